//! The cell in which controllers are compared: on the feature shortcut, or through the full chain.

use std::error::Error;

use example_support::stages::Stages;
use example_support::trial::{Trial, TrialCell, run_on_rig};
use grasp_agent::{Agent, AgentConfig, Controller, RunEvent, TaughtGoal};
use hough_heuristic::CircleDetector;
use pipeline_sim::{ErrorLevel, Workspace};
use puma_grasp::{Rig, bright_ball_scene};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use crate::Options;

/// A run and its collisions, which only the full chain counts.
pub(crate) type Run = (Trial, Option<usize>);

/// A cell with drawn errors.
pub(crate) enum World {
    /// Features straight from the geometry, an arm that moves at once.
    Shortcut(Box<TrialCell>),
    /// Rendered frames, circle detection, VAL II on a line. The emulated arm has no play: of the
    /// drawn errors only those of camera and ball apply.
    Chain(Box<Rig>, Box<dyn CircleDetector + Send>),
}

impl World {
    pub(crate) fn draw(
        options: &Options,
        level: ErrorLevel,
        seed: u64,
    ) -> Result<Self, Box<dyn Error>> {
        if !options.full_chain {
            let cell = TrialCell::draw(level, seed)?;
            let cell = if options.grip {
                cell
            } else {
                cell.without_bodies()
            };
            return Ok(Self::Shortcut(Box::new(cell)));
        }
        let rig = Rig::emulated(false, &bright_ball_scene(), seed)?;
        let errors = level.draw(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let wrong = errors.apply(&rig.cell().get())?;
        rig.cell().with(|cell| *cell = wrong);
        Ok(Self::Chain(Box::new(rig), options.detector.build(seed)?))
    }

    pub(crate) fn agent_config(&self, options: &Options) -> AgentConfig {
        let paper = AgentConfig::paper(Workspace::paper().search_poses());
        AgentConfig {
            lift: paper.lift.filter(|_| options.grip),
            ..paper
        }
    }

    /// Shows the goal with the ball between the jaws; `None` if it is out of view there. On the
    /// feature shortcut only.
    pub(crate) fn teach_goal(&self, seed: u64) -> Result<Option<TaughtGoal>, Box<dyn Error>> {
        match self {
            Self::Shortcut(cell) => Ok(cell.teach_goal(seed)?),
            Self::Chain(..) => Ok(None),
        }
    }

    /// Lets `agent` go for the ball that `seed` places; `None` if no ball can be seen. Collisions
    /// are counted through the full chain only.
    pub(crate) fn run<C: Controller>(
        &mut self,
        agent: &mut Agent<C>,
        seed: u64,
        observe: &mut dyn FnMut(&RunEvent<'_>),
    ) -> Result<Option<Run>, Box<dyn Error>> {
        let (rig, detector) = match self {
            Self::Shortcut(cell) => {
                let trial = cell.run(agent, seed, &mut |_, _| (), observe)?;
                return Ok(trial.map(|trial| (trial, None)));
            }
            Self::Chain(rig, detector) => (rig, detector),
        };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (cell, workspace) = (rig.cell().get(), Workspace::paper());
        let Some((ball, _)) = workspace.sample_seen_ball(&cell, &mut rng) else {
            return Ok(None);
        };
        rig.clear_for(workspace.search_poses()[3])?;
        rig.place(&ball)?;
        let trial = run_on_rig(rig, &mut **detector, agent, &Stages::default(), observe)?;
        Ok(Some((trial, Some(rig.contacts().collisions))))
    }
}
