//! The fewest moves that lead to a goal: a lower bound for every controller.

use std::f64::consts::TAU;

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};

use crate::cell::geometry::Cell;
use crate::error::{QuantityError, ascending, at_most, finite};

/// Spacing of the grid of joint angles around the start, degrees.
const GRID_DEGREES: f64 = 0.1;

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
        // `Some(true)` at the goal, `None` where no move may end.
        let look = |at: Place| {
            let pose = grid.pose(at);
            let features = self.features(&pose).ok()?;
            Some(reached(&features, &pose))
        };
        if !self.within_limits(start) {
            return Ok(None);
        }
        match look((0, 0)) {
            Some(true) => return Ok(Some(0)),
            Some(false) => {}
            None => return Ok(None),
        }
        let mut visited = vec![false; grid.len()];
        let mut front = vec![(0, 0)];
        for depth in 1..=most {
            let mut next = Vec::new();
            for (i, j) in front {
                for (di, dj) in &grid.moves {
                    let to = (i + di, j + dj);
                    let Some(visited) = grid.index(to).map(|place| &mut visited[place]) else {
                        continue;
                    };
                    if std::mem::replace(visited, true) {
                        continue;
                    }
                    match look(to) {
                        Some(true) => return Ok(Some(depth)),
                        Some(false) => next.push(to),
                        None => {}
                    }
                }
            }
            if next.is_empty() {
                break;
            }
            front = next;
        }
        Ok(None)
    }
}

/// Steps of the two joints from the start.
type Place = (i64, i64);

/// The poses that moves of one or two joints can lead to, within the working limits.
struct Grid {
    start: Joints,
    /// Joints that move; the second may stand still.
    joints: [usize; 2],
    /// Least and greatest number of steps of each.
    spans: [(i64, i64); 2],
    moves: Vec<Place>,
}

impl Grid {
    fn new(cell: &Cell, start: &Joints, moves: &[JointDelta]) -> Result<Self, QuantityError> {
        cell.check_ball()?;
        let step = GRID_DEGREES.to_radians();
        let (mut moving, mut spans) = (Vec::new(), Vec::new());
        for joint in 0..6 {
            finite(
                format!("the start of JT{} (rad)", joint + 1),
                start.0[joint],
            )?;
            for step in moves {
                finite(format!("the move of JT{} (rad)", joint + 1), step.0[joint])?;
            }
            if moves.iter().any(|m| m.0[joint] != 0.0) {
                moving.push(joint);
                let ((low, high), here) = (cell.limits[joint], start.0[joint]);
                ascending("the working limits of a joint (rad)", (low, high))?;
                at_most(
                    "the range of the working limits (rad)",
                    high - low,
                    3.0 * TAU,
                )?;
                let steps = |way: f64| (way / step + 1e-6).floor().max(0.0) as i64;
                spans.push((-steps(here - low), steps(high - here)));
            }
        }
        at_most(
            "the number of joints that the moves turn",
            moving.len() as f64,
            2.0,
        )?;
        spans.resize(2, (0, 0));
        let spans = [spans[0], spans[1]];
        let at = |k: usize| moving.get(k).copied();
        // A move longer than any range leads nowhere.
        let in_steps = |turn: f64| (turn / step).round().clamp(-1e6, 1e6) as i64;
        let steps = |m: &JointDelta, k| at(k).map_or(0, |joint| in_steps(m.0[joint]));
        let mut moves: Vec<Place> = moves.iter().map(|m| (steps(m, 0), steps(m, 1))).collect();
        moves.sort_unstable();
        moves.dedup();
        let joints = [at(0).unwrap_or(0), at(1).or(at(0)).unwrap_or(0)];
        Ok(Self {
            start: *start,
            joints,
            spans,
            moves,
        })
    }

    fn pose(&self, (i, j): Place) -> Joints {
        let mut pose = self.start;
        pose.0[self.joints[0]] += (i as f64 * GRID_DEGREES).to_radians();
        pose.0[self.joints[1]] += (j as f64 * GRID_DEGREES).to_radians();
        pose
    }

    /// Returns the number of places; the start must be within the limits.
    fn len(&self) -> usize {
        let [rows, columns] = self.spans.map(|(low, high)| (high - low + 1) as usize);
        rows * columns
    }

    /// Returns the position in a list of all places; `None` outside the working limits.
    fn index(&self, (i, j): Place) -> Option<usize> {
        let [(low_i, high_i), (low_j, high_j)] = self.spans;
        let inside = (low_i..=high_i).contains(&i) && (low_j..=high_j).contains(&j);
        inside.then(|| ((i - low_i) * (high_j - low_j + 1) + (j - low_j)) as usize)
    }
}
