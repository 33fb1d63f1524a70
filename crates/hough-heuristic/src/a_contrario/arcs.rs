//! Circles from single arcs, for what no pair begins with because the opposite side is hidden or
//! too faint.

use super::budget::{Budget, Stage};
use super::candidate::Collected;
use super::level::{EDGE, Level};
use super::polar::Ring;
use super::prover::Prover;
use super::search::{Search, Start};

/// Largest number of steps along an arc from its first point, to either side.
const STEPS: usize = 6;
/// Length of a step, pixels.
const STEP: f32 = 2.0;
/// Interval between the points that begin an arc, in the list of points.
const EVERY: usize = 5;
/// Number of steps within which a point does not begin another arc.
const OWN: usize = 2;
/// The fewest points of an arc.
const LEAST_POINTS: usize = 9;
/// Cosine of the largest change of direction in a step.
const LEAST_STRAIGHT: f32 = 0.8;
/// Largest root mean square distance of an arc's points from its circle, pixels.
const SCATTER: f32 = 0.35;
/// Less of the outline is required than for a pair, of which two sides are visible. The circle is
/// fitted to nearer points only: those farther off belong to what hides it.
const START: Start = Start {
    share: 0.34,
    reach: [1.5; 2],
};

impl Search<'_> {
    /// Follows the edges that no circle explains so far, and looks at the circle of each arc.
    #[inline(always)]
    pub(super) fn follow_arcs(
        &self,
        level: &mut Level,
        found: &mut Collected,
        prover: &mut Prover<'_>,
        budget: &mut Budget,
    ) {
        let radii = self.radii.0..=self.most_radius;
        for id in (0..level.free.len()).step_by(EVERY) {
            if !level.free[id] {
                continue;
            }
            if budget.is_late() || budget.is_over(Stage::Search) {
                return;
            }
            let mut arc = Arc::default();
            arc.push(level, id);
            arc.follow(level, id, -STEP, budget);
            if arc.count + STEPS < LEAST_POINTS {
                continue;
            }
            arc.follow(level, id, STEP, budget);
            if let Some(ring) = arc.ring().filter(|ring| radii.contains(&ring.r)) {
                self.consider(level, ring, &START, found, prover, budget);
            }
        }
    }
}

/// The points of an arc.
#[derive(Default)]
struct Arc {
    x: [f32; 2 * STEPS + 1],
    y: [f32; 2 * STEPS + 1],
    count: usize,
}

impl Arc {
    #[inline(always)]
    fn push(&mut self, level: &Level, id: usize) {
        self.x[self.count] = level.rows.x[id];
        self.y[self.count] = level.rows.y[id];
        self.count += 1;
    }

    /// Follows the edge from a point to one side, `side` pixels a step, until it ends or bends
    /// sharply.
    #[inline(always)]
    fn follow(&mut self, level: &mut Level, start: usize, side: f32, budget: &mut Budget) {
        let mut id = start;
        let (mut tx, mut ty) = (-side * level.rows.ny[id], side * level.rows.nx[id]);
        for step in 0..STEPS {
            budget.looks += 1;
            let at = level.mark(level.rows.x[id] + tx, level.rows.y[id] + ty);
            let Some((_, pixel)) = at.filter(|(mark, _)| mark & EDGE != 0) else {
                return;
            };
            let next = level.id_at(pixel);
            let (nx, ny) = (-level.rows.ny[next], level.rows.nx[next]);
            let turned = tx * nx + ty * ny;
            if next == id || turned.abs() < STEP * LEAST_STRAIGHT {
                return;
            }
            let length = STEP.copysign(turned);
            (tx, ty) = (length * nx, length * ny);
            id = next;
            self.push(level, id);
            if step < OWN {
                level.free[id] = false;
            }
        }
    }

    /// The circle fitted to the points by Kåsa's method, which minimizes the sum of the squared
    /// powers of the points; `None` if the points determine no circle or scatter about it.
    #[inline(always)]
    fn ring(&self) -> Option<Ring> {
        if self.count < LEAST_POINTS {
            return None;
        }
        let n = self.count as f32;
        let (x, y) = (&self.x[..self.count], &self.y[..self.count]);
        let (mx, my) = (x.iter().sum::<f32>() / n, y.iter().sum::<f32>() / n);
        let points = || x.iter().zip(y).map(|(x, y)| (x - mx, y - my));
        let [mut xx, mut xy, mut yy, mut xz, mut yz] = [0.0f32; 5];
        for (x, y) in points() {
            let z = x * x + y * y;
            xx += x * x;
            xy += x * y;
            yy += y * y;
            xz += x * z;
            yz += y * z;
        }
        let zz = xx + yy;
        let determinant = xx * yy - xy * xy;
        if determinant < 1e-3 * zz {
            return None;
        }
        let cx = 0.5 * (xz * yy - yz * xy) / determinant;
        let cy = 0.5 * (yz * xx - xz * xy) / determinant;
        let r = (cx * cx + cy * cy + zz / n).sqrt();
        let mut squares = 0.0;
        for (x, y) in points() {
            let off = ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt() - r;
            squares += off * off;
        }
        (squares <= SCATTER * SCATTER * n).then_some(Ring {
            x: mx + cx,
            y: my + cy,
            r,
        })
    }
}
