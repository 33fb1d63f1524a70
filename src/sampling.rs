//! Samples of moves made by an arm: the paper's own way to its simulator.

use std::ops::ControlFlow;

use grasp_agent::{AgentError, Eye, Sighting};
use hough_heuristic::{Features, FrameError};
use pipeline_sim::{Ball, Cell, MoveSample, Workspace};
use puma_val2::{ArmError, Gripper, Joint, JointDelta, Joints, Manipulator};
use rand::{Rng, RngExt};

use crate::simulator::Simulator;

/// Largest radius that a sampled move is planned to lead to, feature units: the hand stays clear of
/// the ball.
const NEAREST: f64 = 48.0;
/// Smallest radius from which samples are taken on purpose, feature units.
const FARTHEST: f64 = 7.0;
/// Intervals of `JT3` that samples are spread over evenly, degrees.
const ELBOW: [(f64, f64); 3] = [(150.0, 175.0), (175.0, 190.0), (190.0, 214.0)];
/// Least distance of a planned ball from the border of the frame, feature units.
const MARGIN: f64 = 12.0;

impl Simulator {
    /// Samples `count` moves of `JT1`, and as many of `JT2` and `JT3`, on an arm whose camera sees
    /// a ball at rest. The lists, in this order, are those of [`Cell::sample_moves`], in whose
    /// place they are given to [`Simulator::fit`].
    ///
    /// The ball is searched for from the paper's poses. Each sample begins at a random pose from
    /// which the ball should be seen, and keeps what the camera shows before and after the move.
    /// `nominal` plans them: an approximate cell, whose ball is put where the arm sees one, and
    /// which keeps the hand away from it. Poses and moves that lose the ball are tried again
    /// elsewhere. `on_progress` is called with each sample; its [`ControlFlow::Break`] ends the
    /// sampling.
    ///
    /// # Errors
    /// Faults of camera and arm; [`FrameError::Failed`] if no ball is in view, or lost again and
    /// again.
    pub fn sample_on_arm<R: Rng + ?Sized>(
        eye: &mut dyn Eye,
        arm: &mut dyn Manipulator,
        nominal: &Cell,
        count: usize,
        rng: &mut R,
        on_progress: &mut dyn FnMut(&MoveSample) -> ControlFlow<()>,
    ) -> Result<(Vec<MoveSample>, Vec<MoveSample>), AgentError> {
        arm.set_gripper(Gripper::Open)?;
        let mut sampler = Sampler {
            cell: searched(eye, arm, nominal)?,
            eye,
            arm,
        };
        let (mut centering, mut reaching) = (Vec::<MoveSample>::new(), Vec::<MoveSample>::new());
        let (mut misses, mut in_a_row) = (0, 0);
        while centering.len() < count || reaching.len() < count {
            let turn_waist = centering.len() < count && centering.len() <= reaching.len();
            // Each interval of the elbow has a model of its own, and gets as many samples. One in
            // which the ball is lost twice has to wait.
            let mut elbows = ELBOW;
            elbows.sort_by_key(|&(low, high)| {
                let inside = |sample: &&MoveSample| (low..high).contains(&sample.jt3_degrees);
                reaching.iter().filter(inside).count()
            });
            let elbow = elbows[in_a_row / 2 % ELBOW.len()];
            let Some(sample) = sampler.sample(turn_waist, elbow, rng)? else {
                misses += 1;
                in_a_row += 1;
                if misses > 50 + centering.len() + reaching.len() {
                    return Err(unseen(
                        "the ball is lost again and again; check the light on it",
                    ));
                }
                continue;
            };
            in_a_row = 0;
            let flow = on_progress(&sample);
            if turn_waist {
                centering.push(sample);
            } else {
                reaching.push(sample);
            }
            if flow.is_break() {
                break;
            }
        }
        Ok((centering, reaching))
    }
}

fn unseen(reason: &str) -> AgentError {
    AgentError::Camera(FrameError::Failed {
        origin: "sampling on the arm".into(),
        reason: reason.into(),
    })
}

/// Returns the nominal cell with the ball where a search pose shows it.
fn searched(
    eye: &mut dyn Eye,
    arm: &mut dyn Manipulator,
    nominal: &Cell,
) -> Result<Cell, AgentError> {
    for pose in Workspace::paper().search_poses() {
        let joints = arm.move_to(pose)?;
        let seen = eye
            .look()?
            .and_then(|seen| located(nominal, &joints, &seen));
        if let Some(cell) = seen {
            return Ok(cell);
        }
    }
    Err(unseen(
        "no search pose shows a ball; put one where the camera sees it",
    ))
}

/// Returns the cell with its ball where the image shows one.
fn located(cell: &Cell, joints: &Joints, seen: &Sighting) -> Option<Cell> {
    let centre = cell.ball_showing(joints, &seen.features)?;
    let mut cell = Cell {
        ball: Ball {
            centre,
            ..cell.ball
        },
        ..*cell
    };
    cell.place_ball(centre);
    Some(cell)
}

struct Sampler<'a> {
    eye: &'a mut dyn Eye,
    arm: &'a mut dyn Manipulator,
    /// The nominal cell with the ball where it was seen.
    cell: Cell,
}

impl Sampler<'_> {
    /// Makes one move from a random pose; `None` if the ball or the way was lost.
    fn sample<R: Rng + ?Sized>(
        &mut self,
        turn_waist: bool,
        elbow: (f64, f64),
        rng: &mut R,
    ) -> Result<Option<MoveSample>, AgentError> {
        // Each distance gets as many samples, too: the starts of learning are drawn from them.
        let r = rng.random_range(FARTHEST.ln()..NEAREST.ln()).exp();
        let plan = self.plan(turn_waist, elbow, (0.9 * r, r / 0.9), rng);
        let plan = plan.or_else(|| self.plan(turn_waist, elbow, (0.0, NEAREST), rng));
        let Some((pose, delta)) =
            plan.or_else(|| self.plan(turn_waist, (150.0, 214.0), (0.0, NEAREST), rng))
        else {
            return Err(unseen(
                "no pose shows this ball; put it nearer to the middle",
            ));
        };
        let Some((joints, before)) = self.seen_from(pose)? else {
            return Ok(None);
        };
        let Some((reached, after)) = self.seen_from(joints + delta)? else {
            return Ok(None);
        };
        let (from, to) = (joints.degrees(), reached.degrees());
        let [d1, d2, d3] = [0, 1, 2].map(|i| to[i] - from[i]);
        Ok(Some(MoveSample {
            before,
            jt3_degrees: from[2],
            turns: if turn_waist {
                [d1, 0.0, 0.0]
            } else {
                [0.0, d2, d3]
            },
            after,
        }))
    }

    /// Draws a pose and a move between which the ball should stay in view.
    fn plan<R: Rng + ?Sized>(
        &self,
        turn_waist: bool,
        (low, high): (f64, f64),
        range: (f64, f64),
        rng: &mut R,
    ) -> Option<(Joints, JointDelta)> {
        let towards = self.cell.ball.centre.y.atan2(self.cell.ball.centre.x);
        (0..20_000).find_map(|_| {
            let mut pose = Joints::from_degrees([
                rng.random_range(-30.0..30.0),
                rng.random_range(-125.0..-30.0),
                rng.random_range(low..high),
                0.0,
                Cell::REACHING_JT5_DEGREES,
                0.0,
            ]);
            pose.0[Joint::J1.index()] += towards;
            let [d1, d2, d3] = MoveSample::draw_turns(turn_waist, rng);
            let delta = JointDelta::from_degrees([d1, d2, d3, 0.0, 0.0, 0.0]);
            let there = self.shows(&pose, range) && self.shows(&(pose + delta), (0.0, NEAREST));
            there.then_some((pose, delta))
        })
    }

    /// Returns whether the ball should show from there with a radius in this range, for a ball of
    /// the paper's size, and the hand can stand there, clear of everything.
    fn shows(&self, pose: &Joints, (far, near): (f64, f64)) -> bool {
        let seen = |f: Features| {
            (far..=near).contains(&(f.r * 0.020 / self.cell.ball.radius))
                && (MARGIN..Features::WIDTH - MARGIN).contains(&f.x)
                && (MARGIN..Features::HEIGHT - MARGIN).contains(&f.y)
        };
        // The quickest first: most poses are turned down.
        self.cell.within_limits(pose)
            && self.cell.features(pose).is_ok_and(seen)
            && !self.cell.proximity(pose)
    }

    /// Moves to a pose and looks. `None` if the controller stopped the arm or no ball is seen.
    fn seen_from(&mut self, pose: Joints) -> Result<Option<(Joints, Features)>, AgentError> {
        let joints = match self.arm.move_to(pose) {
            Err(ArmError::ProximityStop { .. }) => {
                self.arm.move_to(Workspace::paper().search_poses()[0])?;
                return Ok(None);
            }
            joints => joints?,
        };
        Ok(self.eye.look()?.map(|seen| (joints, seen.features)))
    }
}
