//! Approaching alone, in the arm's plane: with the exact geometry in the place of a regression, and
//! measured against the breadth-first optimum.
//!
//! With the ball in the plane that the arm moves in, `JT2` and `JT3` decide everything and (y, r,
//! theta 3) is the whole state. Centering has nothing to do here.

use std::ops::ControlFlow;

use grasp_agent::{
    Behaviour, BehaviourError, BehaviourSpec, CameraModel, JointLimits, LearningSettings, Lesson,
    Percept,
};
use hough_heuristic::Features;
use pipeline_sim::{Cell, SightRule, Workspace};
use puma_val2::{JointDelta, Joints};
use qtable::{Action, Record};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, RngExt, SeedableRng};

use crate::learning::paper_cell;
use crate::program::{progress_bar, stopped};

/// A simulator of approaching with the exact geometry, and the starts to learn from.
#[derive(Clone, Debug)]
pub struct ExactPlane {
    model: CameraModel,
    sight: SightRule,
    starts: Vec<Percept>,
}

/// The result of one policy from a set of starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneScore {
    /// Starts from which the goal was reached.
    pub reached: usize,
    /// Starts in all.
    pub starts: usize,
    /// Steps of the successful runs, on average.
    pub steps: f64,
    /// Ratio of these steps to the breadth-first optimum from the same starts.
    pub over_optimum: f64,
}

/// A start as a search pose shows the ball, turned into the arm's plane.
#[derive(Clone, Debug)]
pub struct PlaneStart {
    cell: Cell,
    joints: Joints,
    /// The fewest steps of the paper's 81 actions to the goal.
    pub optimum: usize,
}

/// Most steps of a run.
const MOST_STEPS: usize = 60;

/// From the camera sideways to the arm's plane, in radii of the ball: 4.5 of 20 mm.
const CAMERA_BESIDE: f64 = 0.225;

impl ExactPlane {
    /// Draws at most `starts` exploring starts.
    pub fn new(starts: usize, rng: &mut dyn Rng) -> Self {
        let cell = paper_cell();
        let drawn = (0..starts).filter_map(|_| {
            let (cell, joints) = cell.exploring_start(rng)?;
            let mut features = cell.features(&joints).ok()?;
            // Into the arm's plane: the camera sits this many ball radii beside it.
            features.x = 0.5 * Features::WIDTH + CAMERA_BESIDE * features.r;
            Some(Percept::new(features, &joints))
        });
        Self {
            model: CameraModel::paper(),
            sight: SightRule::default(),
            starts: drawn.collect(),
        }
    }

    /// Draws the start of an episode.
    pub fn start(&self, rng: &mut dyn Rng) -> Percept {
        self.starts[rng.random_range(0..self.starts.len())]
    }

    /// Returns what is perceived after the move, `None` when the ball is lost.
    pub fn after(&self, percept: &Percept, delta: &JointDelta) -> Option<Percept> {
        simulator(&self.model, &BehaviourSpec::approaching())(percept, delta)
            .filter(|after| self.sight.sees_features(&after.features))
    }

    /// Learns `spec` here with the paper's settings. With `trials` the table that does best from
    /// them is kept ([`BehaviourSpec::learn`]).
    ///
    /// # Errors
    /// Those of [`BehaviourSpec::learn`].
    pub fn learn(
        &self,
        spec: BehaviourSpec,
        trials: &[Percept],
        actions: u64,
        rng: &mut dyn Rng,
        on_progress: &mut dyn FnMut(&Record) -> ControlFlow<()>,
    ) -> Result<Lesson, BehaviourError> {
        let mut plane = simulator(&self.model, &spec);
        let simulate = |percept: &Percept, delta: &JointDelta| {
            let after = plane(percept, delta)?;
            self.sight.sees_features(&after.features).then_some(after)
        };
        let start = |rng: &mut dyn Rng| self.start(rng);
        let config = LearningSettings::paper(actions)?;
        spec.learn(simulate, start, trials, &config, rng, on_progress)
    }
}

/// Returns the exact simulator of a PUMA with its hand as the search poses have it.
fn simulator(
    model: &CameraModel,
    spec: &BehaviourSpec,
) -> impl FnMut(&Percept, &JointDelta) -> Option<Percept> + use<> {
    let [pose, ..] = Workspace::paper().search_poses();
    model.approaching(spec, JointLimits::paper(), &pose)
}

/// Returns `count` balls as the search finds them, turned into the arm's plane, with the optimum
/// from each.
pub fn search_starts(count: usize, seed: u64) -> Vec<PlaneStart> {
    let spec = BehaviourSpec::approaching();
    let moves: Vec<JointDelta> = (0..spec.actions())
        .map(|action| spec.delta(Action(action)))
        .collect();
    let reached =
        |features: &Features, joints: &Joints| spec.at_goal(&Percept::new(*features, joints));
    let starts = found_by_search(seed).filter_map(|(cell, joints)| {
        let fewest = cell.fewest_moves(&joints, &moves, reached, MOST_STEPS as u32);
        let optimum = fewest.ok()?? as usize;
        Some(PlaneStart {
            cell,
            joints,
            optimum,
        })
    });
    let bar = progress_bar(count as u64, "starts", false);
    let starts = bar.wrap_iter(starts.take(count));
    let starts = starts.take_while(|_| !stopped()).collect();
    bar.finish_and_clear();
    starts
}

/// Returns what is perceived of `count` balls where the search finds them, turned into the arm's
/// plane: trials to choose a table by.
pub fn search_percepts(count: usize, seed: u64) -> Vec<Percept> {
    let seen = found_by_search(seed).filter_map(|(cell, joints)| {
        let features = cell.features(&joints).ok()?;
        Some(Percept::new(features, &joints))
    });
    seen.take(count).collect()
}

/// Returns balls and search poses that see them, with the ball in the arm's plane.
fn found_by_search(seed: u64) -> impl Iterator<Item = (Cell, Joints)> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let workspace = Workspace::paper();
    let elbow = workspace.search_poses()[0];
    std::iter::repeat_with(move || {
        let cell = Cell::paper(workspace.sample_ball(&mut rng));
        let goal = cell.goal_pose(Cell::REACHING_JT5_DEGREES).ok()?;
        let mut joints = elbow;
        joints.0[0] = goal.0[0];
        cell.features(&joints).ok().map(|_| (cell, joints))
    })
    .flatten()
}

/// Measures a policy from `starts`: greedy, with the loop breaker at `kappa`.
pub fn score(behaviour: &Behaviour, kappa: f64, starts: &[PlaneStart]) -> PlaneScore {
    let (mut reached, mut steps, mut optimum) = (0, 0, 0);
    for start in starts {
        if let Some(needed) = steps_to_goal(behaviour, kappa, start) {
            reached += 1;
            steps += needed;
            optimum += start.optimum;
        }
    }
    PlaneScore {
        reached,
        starts: starts.len(),
        steps: steps as f64 / reached as f64,
        over_optimum: steps as f64 / optimum as f64,
    }
}

fn steps_to_goal(behaviour: &Behaviour, penalty: f64, start: &PlaneStart) -> Option<usize> {
    let cell = &start.cell;
    let joints = std::cell::Cell::new(start.joints);
    let perceive = || {
        let features = cell.features(&joints.get()).ok()?;
        Some(Percept::new(features, &joints.get()))
    };
    let within = |_: &Percept, delta: &JointDelta| cell.within_limits(&(joints.get() + *delta));
    let steps = behaviour.steps_to_goal(&perceive()?, penalty, MOST_STEPS, within, |_, delta| {
        joints.set(joints.get() + *delta);
        perceive()
    });
    steps.ok()
}
