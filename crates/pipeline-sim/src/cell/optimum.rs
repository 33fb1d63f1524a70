//! The fewest moves that lead to a goal: a lower bound for every controller.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};

use crate::cell::geometry::Cell;
use crate::error::QuantityError;
use crate::error::{ascending, finite};

/// Spacing of the grid of joint angles around the start, degrees.
const GRID_DEGREES: f64 = 0.1;

/// The state of a joint pose; evaluated once.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Unknown,
    Barred,
    Open,
    Goal,
}

impl Cell {
    /// Returns the fewest of the given moves that lead from `start` to a pose for which `reached`
    /// returns `true`, by breadth-first search; 0 if `start` is one. The ball stays in sight and
    /// the arm within its working limits after every move. Moves are rounded to a tenth of a degree
    /// and may turn one or two joints.
    ///
    /// `None` if the ball is out of sight at `start` or the arm out of its limits, if there is no
    /// way to the goal, or if it takes more than `most` moves.
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
        let grid = Grid::new(self, start, moves)?;
        if !self.within_limits(start) {
            return Ok(None);
        }
        let look = |at: (i64, i64)| {
            let pose = grid.pose(at);
            match self.features(&pose) {
                Ok(f) if reached(&f, &pose) => Place::Goal,
                Ok(_) => Place::Open,
                Err(_) => Place::Barred,
            }
        };
        match look((0, 0)) {
            Place::Goal => return Ok(Some(0)),
            Place::Barred => return Ok(None),
            _ => {}
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
                    // Visited, or of no use.
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

/// The poses that moves of one or two joints can lead to, within the working limits.
struct Grid {
    start: Joints,
    /// Joints that move; the second may stand still.
    joints: [usize; 2],
    /// Least and greatest number of steps of each.
    spans: [(i64, i64); 2],
    /// Moves, in steps.
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
            let (low, high) = cell.limits[*joint];
            ascending("the working limits of a joint (rad)", (low, high))?;
            if high - low > 3.0 * std::f64::consts::TAU {
                return Err(QuantityError::Range {
                    quantity: "the working limits of a joint (rad), at most three turns,",
                    low,
                    high,
                });
            }
            let here = start.0[*joint];
            // A start outside the limits is refused before the grid is used.
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
                // A move longer than the widest span leads nowhere.
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

    /// Returns the position in a list of all places; `None` outside the working limits.
    fn index(&self, (i, j): (i64, i64)) -> Option<usize> {
        let [(low_i, high_i), (low_j, high_j)] = self.spans;
        let inside = (low_i..=high_i).contains(&i) && (low_j..=high_j).contains(&j);
        inside.then(|| ((i - low_i) * (high_j - low_j + 1) + (j - low_j)) as usize)
    }
}
