//! The fewest moves that lead to the goal: the yardstick for every controller.

use hough_heuristic::Features;
use puma_val2::{Joint, JointDelta, Joints};

use crate::cell::geometry::Cell;
use crate::cell::moves::MoveLists;
use crate::error::QuantityError;
use crate::error::{ascending, finite};

/// Intervals of the image features in which the goal is reached, both ends included, feature units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GoalBox {
    /// Least and greatest x.
    pub x: (f64, f64),
    /// Least and greatest y.
    pub y: (f64, f64),
    /// Least and greatest r.
    pub r: (f64, f64),
}

impl GoalBox {
    /// The goal of the paper's rewards (equations 5 and 6): x 99..108, y 74..82, r 32..34.
    pub fn paper() -> Self {
        Self {
            x: (99.0, 108.0),
            y: (74.0, 82.0),
            r: (32.0, 34.0),
        }
    }

    /// Whether x is in its interval: the goal of centring.
    pub fn centred(&self, features: &Features) -> bool {
        (self.x.0..=self.x.1).contains(&features.x)
    }

    /// Whether y and r are in their intervals: the goal of approaching.
    pub fn approached(&self, features: &Features) -> bool {
        (self.y.0..=self.y.1).contains(&features.y) && (self.r.0..=self.r.1).contains(&features.r)
    }
}

impl Default for GoalBox {
    fn default() -> Self {
        Self::paper()
    }
}

/// Joint angles reached by listed moves lie on a grid of this many degrees around the start.
const GRID_DEGREES: f64 = 0.1;

/// What stands at a joint pose; looked up once.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Unknown,
    Barred,
    Open,
    Goal,
}

impl Cell {
    /// The fewest moves of `JT2` and `JT3` together, from the lists of `moves`, that lead from
    /// `start` to the goal in y and r, by breadth-first search ([`Cell::fewest_moves`]); 0 if
    /// `start` is there already. `JT1` is first turned so that the ball lies between the jaws:
    /// turning the arm about its waist changes neither y nor r of the task, so this is the optimum
    /// of the approach alone.
    ///
    /// `None` as for [`Cell::fewest_moves`].
    ///
    /// # Errors
    /// As for [`Cell::fewest_moves`].
    pub fn fewest_reaching_moves(
        &self,
        start: &Joints,
        moves: &MoveLists,
        goal: &GoalBox,
        most: u32,
    ) -> Result<Option<u32>, QuantityError> {
        let mut turned = *start;
        if let Some(pose) = self.goal_pose(start[Joint::J5].to_degrees()) {
            turned.0[0] = pose.0[0];
        }
        let pairs = moves
            .jt2
            .iter()
            .flat_map(|d2| moves.jt3.map(|d3| (*d2, d3)));
        let deltas: Vec<JointDelta> = pairs
            .map(|(d2, d3)| JointDelta::from_degrees([0.0, d2, d3, 0.0, 0.0, 0.0]))
            .collect();
        // The ball must be in sight before the waist is turned, too.
        if start.non_finite().is_none() && self.features(start).is_none() {
            return Grid::new(self, start, &deltas).map(|_| None);
        }
        self.breadth_first(&turned, &deltas, |f, _| goal.approached(f), most)
    }

    /// The fewest moves of `JT1` from the list of `moves` that bring the ball into the goal's
    /// interval of x, as [`Cell::fewest_reaching_moves`] does for y and r.
    ///
    /// # Errors
    /// As for [`Cell::fewest_moves`].
    pub fn fewest_centring_moves(
        &self,
        start: &Joints,
        moves: &MoveLists,
        goal: &GoalBox,
        most: u32,
    ) -> Result<Option<u32>, QuantityError> {
        let deltas = moves
            .jt1
            .map(|d1| JointDelta::from_degrees([d1, 0.0, 0.0, 0.0, 0.0, 0.0]));
        self.fewest_moves(start, &deltas, |f, _| goal.centred(f), most)
    }

    /// The fewest of the given moves that lead from `start` to a pose that `reached` calls the
    /// goal, by breadth-first search; 0 if `start` is one. The ball is kept in sight and the arm
    /// within its working limits after every move. Moves are taken to the nearest tenth of a
    /// degree, and may turn one or two joints.
    ///
    /// `None` if the ball is out of sight at `start` or the arm out of its limits, no way leads to
    /// the goal, or it takes more than `most` moves.
    ///
    /// # Errors
    /// [`QuantityError`]: a ball's place, angles of `start`, of a move, or of the working limits
    /// that are not finite; limits the wrong way round or more than three turns apart; moves that
    /// turn more than two joints.
    pub fn fewest_moves(
        &self,
        start: &Joints,
        moves: &[JointDelta],
        reached: impl Fn(&Features, &Joints) -> bool,
        most: u32,
    ) -> Result<Option<u32>, QuantityError> {
        if start.non_finite().is_none() && self.features(start).is_none() {
            // Nothing to look for, but what cannot be searched is still to be named.
            return Grid::new(self, start, moves).map(|_| None);
        }
        self.breadth_first(start, moves, reached, most)
    }

    /// As [`Cell::fewest_moves`], whether or not the ball is in sight at the start.
    fn breadth_first(
        &self,
        start: &Joints,
        moves: &[JointDelta],
        reached: impl Fn(&Features, &Joints) -> bool,
        most: u32,
    ) -> Result<Option<u32>, QuantityError> {
        let grid = Grid::new(self, start, moves)?;
        if !self.within_limits(start) {
            return Ok(None);
        }
        let look = |at: (i64, i64)| {
            let pose = grid.pose(at);
            match self.features(&pose) {
                Some(f) if reached(&f, &pose) => Place::Goal,
                Some(_) => Place::Open,
                None => Place::Barred,
            }
        };
        if look((0, 0)) == Place::Goal {
            return Ok(Some(0));
        }
        let mut places = vec![Place::Unknown; grid.len()];
        if let Some(place) = grid.index((0, 0)) {
            places[place] = Place::Barred;
        }
        let mut front = vec![(0, 0)];
        let mut next = Vec::new();
        for depth in 1..=most {
            for (i, j) in &front {
                for (di, dj) in &grid.moves {
                    let to = (i + di, j + dj);
                    let Some(place) = grid.index(to).map(|k| &mut places[k]) else {
                        continue;
                    };
                    if *place != Place::Unknown {
                        continue;
                    }
                    match look(to) {
                        Place::Goal => return Ok(Some(depth)),
                        Place::Open => next.push(to),
                        _ => {}
                    }
                    // Visited or of no use: either way never again.
                    *place = Place::Barred;
                }
            }
            if next.is_empty() {
                break;
            }
            std::mem::swap(&mut front, &mut next);
            next.clear();
        }
        Ok(None)
    }
}

/// The poses around a start that moves of one or two joints can lead to, within the working limits.
struct Grid {
    start: Joints,
    /// The joints that move; the second may stand still.
    joints: [usize; 2],
    /// Least and greatest number of steps of each.
    spans: [(i64, i64); 2],
    /// The moves, in steps.
    moves: Vec<(i64, i64)>,
}

impl Grid {
    fn new(cell: &Cell, start: &Joints, moves: &[JointDelta]) -> Result<Self, QuantityError> {
        let not_finite = |what: &str, joint: usize, value: f64| QuantityError::NotFinite {
            quantity: format!("the {what} of JT{} (rad)", joint + 1),
            value,
        };
        let ball = cell.ball.centre;
        for (axis, value) in [("x", ball.x), ("y", ball.y), ("z", ball.z)] {
            finite(format!("the {axis} coordinate of the ball (m)"), value)?;
        }
        let mut moving = Vec::new();
        for joint in 0..6 {
            if !start.0[joint].is_finite() {
                return Err(not_finite("start", joint, start.0[joint]));
            }
            if let Some(bad) = moves.iter().map(|m| m.0[joint]).find(|m| !m.is_finite()) {
                return Err(not_finite("move", joint, bad));
            }
            if moves.iter().any(|m| m.0[joint] != 0.0) {
                moving.push(joint);
            }
        }
        if moving.len() > 2 {
            return Err(QuantityError::Joints {
                count: moving.len(),
            });
        }
        let step = GRID_DEGREES.to_radians();
        let mut spans = [(0, 0); 2];
        for (span, joint) in spans.iter_mut().zip(&moving) {
            let (low, high) = (cell.limits.min[*joint], cell.limits.max[*joint]);
            ascending("the working limits of a joint (rad)", (low, high))?;
            if high - low > 3.0 * std::f64::consts::TAU {
                return Err(QuantityError::Range {
                    quantity: "the working limits of a joint (rad), at most three turns,",
                    low,
                    high,
                });
            }
            let here = start.0[*joint];
            // A start outside the limits has no grid; it is refused before one is looked at.
            *span = (
                -(((here - low) / step + 1e-6).floor().max(0.0) as i64),
                ((high - here) / step + 1e-6).floor().max(0.0) as i64,
            );
            if !(low - 1e-9..=high + 1e-9).contains(&here) {
                *span = (0, 0);
            }
        }
        let at = |k: usize| moving.get(k).copied();
        let joints = [at(0).unwrap_or(0), at(1).or(at(0)).unwrap_or(0)];
        let in_steps = |m: &JointDelta, k: usize| {
            at(k).map_or(0, |joint| {
                // No move is longer than the widest span; what is, leads nowhere either way.
                (m.0[joint] / step).round().clamp(-1e6, 1e6) as i64
            })
        };
        let mut moves: Vec<(i64, i64)> = moves
            .iter()
            .map(|m| (in_steps(m, 0), in_steps(m, 1)))
            .collect();
        moves.sort_unstable();
        moves.dedup();
        Ok(Self {
            start: *start,
            joints,
            spans,
            moves,
        })
    }

    fn pose(&self, (i, j): (i64, i64)) -> Joints {
        let mut pose = self.start;
        pose.0[self.joints[0]] += (i as f64 * GRID_DEGREES).to_radians();
        pose.0[self.joints[1]] += (j as f64 * GRID_DEGREES).to_radians();
        pose
    }

    fn len(&self) -> usize {
        let size = |(low, high): (i64, i64)| (high - low + 1) as usize;
        size(self.spans[0]) * size(self.spans[1])
    }

    /// Position in a list of all places; `None` outside the working limits.
    fn index(&self, (i, j): (i64, i64)) -> Option<usize> {
        let [(low_i, high_i), (low_j, high_j)] = self.spans;
        let inside = (low_i..=high_i).contains(&i) && (low_j..=high_j).contains(&j);
        inside.then(|| ((i - low_i) * (high_j - low_j + 1) + (j - low_j)) as usize)
    }
}
