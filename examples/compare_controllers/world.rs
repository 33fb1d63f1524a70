//! Where controllers are compared: on the feature shortcut, or through the full chain.

use std::error::Error;

use grasp_agent::{Agent, AgentConfig, Controller, Event, EventKind, Outcome, TaughtGoal};
use hough_heuristic::CircleDetector;
use pipeline_sim::{ErrorLevel, Workspace};
use puma_grasp::{BallDetector, Rig, TrialCell, bright_ball_scene};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// A cell with drawn errors.
pub(crate) enum World {
    /// Features straight from the geometry, an arm that moves at once.
    Shortcut(Box<TrialCell>),
    /// Rendered frames, circle detection, VAL II on a line.
    Chain(Box<Chain>),
}

pub(crate) struct Chain {
    rig: Rig,
    detector: Box<dyn CircleDetector + Send>,
    workspace: Workspace,
    /// Whether the ball is gripped and lifted, or the run over at the goal.
    with_grip: bool,
}

/// What came of one ball.
pub(crate) struct Trial {
    pub(crate) outcome: Outcome,
    pub(crate) reached: bool,
    pub(crate) held: bool,
    /// Counted through the full chain only.
    pub(crate) collisions: Option<usize>,
}

impl World {
    pub(crate) fn shortcut(
        level: ErrorLevel,
        seed: u64,
        with_bodies: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let cell = TrialCell::draw(level, seed)?;
        Ok(Self::Shortcut(Box::new(if with_bodies {
            cell
        } else {
            cell.without_bodies()
        })))
    }

    /// The emulated arm has no play: of the drawn errors, those of camera and ball are there.
    pub(crate) fn chain(
        level: ErrorLevel,
        seed: u64,
        detector: BallDetector,
        with_grip: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let rig = Rig::emulated(false, &bright_ball_scene(), seed)?;
        let errors = level.draw(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let wrong = errors.apply(&rig.cell().get())?;
        rig.cell().with(|cell| *cell = wrong);
        Ok(Self::Chain(Box::new(Chain {
            rig,
            detector: detector.build(seed)?,
            workspace: Workspace::paper(),
            with_grip,
        })))
    }

    pub(crate) fn agent_config(&self) -> AgentConfig {
        match self {
            Self::Shortcut(cell) => cell.agent_config(),
            Self::Chain(chain) => {
                let paper = AgentConfig::paper(chain.workspace.search_poses());
                AgentConfig {
                    lift: paper.lift.filter(|_| chain.with_grip),
                    ..paper
                }
            }
        }
    }

    /// The goal as it shows where the jaws are around the ball; `None` where that is out of view.
    /// On the feature shortcut only.
    pub(crate) fn teach_goal(&self, seed: u64) -> Result<Option<TaughtGoal>, Box<dyn Error>> {
        match self {
            Self::Shortcut(cell) => Ok(cell.teach_goal(seed)?),
            Self::Chain(_) => Ok(None),
        }
    }

    /// Lets `agent` go for the ball that `seed` places; `None` if no ball can be seen.
    pub(crate) fn run<C: Controller>(
        &mut self,
        agent: &mut Agent<C>,
        seed: u64,
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Option<Trial>, Box<dyn Error>> {
        match self {
            Self::Shortcut(cell) => {
                let result = cell.run(agent, seed, &mut |_, _| (), observe)?;
                Ok(result.map(|result| Trial {
                    outcome: result.outcome,
                    reached: result.reached,
                    held: result.held,
                    collisions: None,
                }))
            }
            Self::Chain(chain) => chain.run(agent, seed, observe),
        }
    }
}

impl Chain {
    fn run<C: Controller>(
        &mut self,
        agent: &mut Agent<C>,
        seed: u64,
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Option<Trial>, Box<dyn Error>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let cell = self.rig.cell().get();
        let Some((ball, _)) = self.workspace.sample_seen_ball(&cell, &mut rng) else {
            return Ok(None);
        };
        self.rig.clear_for(self.workspace.search_poses()[3])?;
        self.rig.place(&ball)?;
        let mut reached = false;
        let outcome = self
            .rig
            .run_and_learn(agent, &mut *self.detector, &mut |event| {
                reached |= event.kind == EventKind::AtGoal;
                observe(event);
            })?;
        Ok(Some(Trial {
            outcome,
            reached,
            held: self.rig.holds_ball(),
            collisions: Some(self.rig.contacts().collisions),
        }))
    }
}
