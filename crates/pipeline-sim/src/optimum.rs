//! The fewest moves that lead to the goal: the yardstick for every controller.

use hough_heuristic::Features;
use puma_val2::{Joint, Joints};

use crate::{Cell, MoveLists};

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
    /// The fewest moves of `JT2` and `JT3` together, from the lists of `moves`, that lead from `start` to the goal in y and r, by
    /// breadth-first search; 0 if `start` is there already. The ball is kept in sight and the arm within its working limits after
    /// every move. The ball must be in sight from `start`; `JT1` is then turned so that the ball lies between the jaws: turning the arm about its waist changes
    /// neither y nor r of the task, so this is the optimum of the approach alone.
    ///
    /// `None` if the start is out of sight or limits, no way leads to the goal, or it takes more than `most` moves. Moves are taken to the nearest
    /// tenth of a degree.
    pub fn fewest_reaching_moves(
        &self,
        start: &Joints,
        moves: &MoveLists,
        goal: &GoalBox,
        most: u32,
    ) -> Option<u32> {
        self.features(start)?;
        let mut start = *start;
        if let Some(pose) = self.goal_pose(start[Joint::J5].to_degrees()) {
            start.0[0] = pose.0[0];
        }
        let steps = |list: &[f64; 9]| list.map(|d| (d / GRID_DEGREES).round() as i64);
        let (jt2, jt3) = (steps(&moves.jt2), steps(&moves.jt3));
        let pairs: Vec<(i64, i64)> = jt2
            .iter()
            .flat_map(|a| jt3.iter().map(move |b| (*a, *b)))
            .collect();
        let at = |i: i64, j: i64| {
            let mut pose = start;
            pose.0[1] += (i as f64 * GRID_DEGREES).to_radians();
            pose.0[2] += (j as f64 * GRID_DEGREES).to_radians();
            pose
        };
        self.breadth_first(&start, [1, 2], &pairs, at, |f| goal.approached(f), most)
    }

    /// The fewest moves of `JT1` from the list of `moves` that bring the ball into the goal's interval of x, as
    /// [`Cell::fewest_reaching_moves`] does for y and r.
    pub fn fewest_centring_moves(
        &self,
        start: &Joints,
        moves: &MoveLists,
        goal: &GoalBox,
        most: u32,
    ) -> Option<u32> {
        let pairs: Vec<(i64, i64)> = moves
            .jt1
            .iter()
            .map(|d| ((d / GRID_DEGREES).round() as i64, 0))
            .collect();
        let at = |i: i64, _: i64| {
            let mut pose = *start;
            pose.0[0] += (i as f64 * GRID_DEGREES).to_radians();
            pose
        };
        self.breadth_first(start, [0, 5], &pairs, at, |f| goal.centred(f), most)
    }

    fn breadth_first(
        &self,
        start: &Joints,
        joints: [usize; 2],
        moves: &[(i64, i64)],
        at: impl Fn(i64, i64) -> Joints,
        reached: impl Fn(&Features) -> bool,
        most: u32,
    ) -> Option<u32> {
        // The grid spans the working limits of the two joints; one column is enough for a joint that does not move.
        let grid = GRID_DEGREES.to_radians();
        let span = |k: usize, moved: bool| {
            let joint = joints[k];
            let below = ((start.0[joint] - self.limits.min[joint]) / grid).floor();
            let above = ((self.limits.max[joint] - start.0[joint]) / grid).floor();
            if moved {
                (-(below as i64), above as i64)
            } else {
                (0, 0)
            }
        };
        let (low_i, high_i) = span(0, true);
        let (low_j, high_j) = span(1, moves.iter().any(|m| m.1 != 0));
        if !start.0.iter().all(|a| a.is_finite()) || low_i > 0 || high_i < 0 || low_j > 0 || high_j < 0 {
            return None;
        }
        let columns = (high_j - low_j + 1) as usize;
        let index = |i: i64, j: i64| (i - low_i) as usize * columns + (j - low_j) as usize;
        let mut places = vec![Place::Unknown; (high_i - low_i + 1) as usize * columns];
        let look = |i: i64, j: i64| match self.features(&at(i, j)) {
            Some(f) if reached(&f) => Place::Goal,
            Some(_) => Place::Open,
            None => Place::Barred,
        };
        if look(0, 0) == Place::Goal {
            return Some(0);
        }
        places[index(0, 0)] = Place::Barred;
        let mut front = vec![(0, 0)];
        let mut next = Vec::new();
        for depth in 1..=most {
            for &(i, j) in &front {
                for &(di, dj) in moves {
                    let (i, j) = (i + di, j + dj);
                    if i < low_i || i > high_i || j < low_j || j > high_j {
                        continue;
                    }
                    let place = &mut places[index(i, j)];
                    if *place != Place::Unknown {
                        continue;
                    }
                    match look(i, j) {
                        Place::Goal => return Some(depth),
                        Place::Open => next.push((i, j)),
                        _ => {}
                    }
                    // Visited or of no use: either way never again.
                    *place = Place::Barred;
                }
            }
            if next.is_empty() {
                return None;
            }
            std::mem::swap(&mut front, &mut next);
            next.clear();
        }
        None
    }
}
