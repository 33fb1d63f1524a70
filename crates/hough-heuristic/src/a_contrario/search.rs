//! Drawing pairs of edge points, and looking at the circle each pair determines: the paper's steps
//! 3a to 3c.

use super::budget::{Budget, Stage};
use super::candidate::{Candidate, Collected};
use super::directions::{CODES, UnitCircle, code};
use super::fit::Moments;
use super::level::{EDGE, Level};
use super::partners::{LEAST_ALONG, PARTNERS};
use super::polar::{LANES, Ring, whole};
use super::prover::Prover;

/// Points of a circle's outline that are looked at.
pub(super) const LOOKS: usize = 32;
/// Largest angle between an edge and the outline, in codes of 2.8 degrees.
pub(super) const DIRECTION_SLACK: u8 = 7;
/// Share of the fitted outline that must lie on edges before a proof.
const LEAST_SHARE: f32 = 0.4;
/// Limits for pairs. A ball of which two fifths are hidden shows little more.
const START: Start = Start {
    share: 0.44,
    reach: [3.0, 2.0],
};

/// Edges along the outline of a ring.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Support {
    /// Points of the outline that lie on an edge along it.
    pub(super) hits: u32,
    /// Points of the outline that lie in the frame.
    pub(super) visible: u32,
}

impl Support {
    pub(super) fn share(&self) -> f32 {
        self.hits as f32 / self.visible.max(1) as f32
    }
}

/// The points of the outline in the order in which they are looked at, each with the lowest code
/// that its edge may have.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    x: [f32; LOOKS],
    y: [f32; LOOKS],
    lowest: [u8; LOOKS],
}

/// Points that are looked at together.
const BLOCK: usize = 8;

impl Outline {
    pub(super) fn new(circle: &UnitCircle) -> Self {
        // Bits reversed: any first part of the order is spread over the whole outline.
        let order: [usize; LOOKS] = std::array::from_fn(|index| {
            (index as u32).reverse_bits() as usize >> (32 - LOOKS.trailing_zeros())
        });
        let points = order.map(|index| circle.point(index, LOOKS));
        Self {
            x: points.map(|(x, _)| x),
            y: points.map(|(_, y)| y),
            lowest: points.map(|(x, y)| code(x, y).wrapping_sub(DIRECTION_SLACK) % CODES),
        }
    }

    /// Counts the edges along the outline; `None` as soon as their share falls clearly below
    /// `least`.
    #[inline(always)]
    pub(super) fn support(
        &self,
        level: &Level,
        ring: &Ring,
        least: f32,
        looks: &mut u64,
    ) -> Option<Support> {
        let (width, height) = (level.width as f32, level.height as f32);
        let inside = ring.x - ring.r >= 0.0
            && ring.y - ring.r >= 0.0
            && ring.x + ring.r <= width - 1.0
            && ring.y + ring.r <= height - 1.0;
        let mut support = Support::default();
        for block in 0..LOOKS / BLOCK {
            let (x, y) = (
                &self.x.as_chunks::<BLOCK>().0[block],
                &self.y.as_chunks::<BLOCK>().0[block],
            );
            let lowest = &self.lowest.as_chunks::<BLOCK>().0[block];
            let mut marks = [0u8; BLOCK];
            if inside {
                let mut pixels = [0i32; BLOCK];
                for i in 0..BLOCK {
                    let (column, row) = (
                        whole(ring.x + ring.r * x[i]).0,
                        whole(ring.y + ring.r * y[i]).0,
                    );
                    pixels[i] = row * level.width as i32 + column;
                }
                for i in 0..BLOCK {
                    marks[i] = level.marks().get(pixels[i] as usize).copied().unwrap_or(0);
                }
                support.visible += BLOCK as u32;
            } else {
                for i in 0..BLOCK {
                    if let Some((mark, _)) =
                        level.mark(ring.x + ring.r * x[i], ring.y + ring.r * y[i])
                    {
                        marks[i] = mark;
                        support.visible += 1;
                    }
                }
            }
            let mut hits = 0u8;
            for i in 0..BLOCK {
                hits += u8::from(runs_along(marks[i], lowest[i]));
            }
            support.hits += u32::from(hits);
            // Eight at once are quicker than one after the other.
            *looks += BLOCK as u64 / 2;
            if (support.hits + 1) as f32 <= support.visible as f32 * least {
                return None;
            }
        }
        (support.visible >= LOOKS as u32 / 3
            && support.hits as f32 >= support.visible as f32 * least)
            .then_some(support)
    }

    /// The pixels of the outline's points at distance `r` from the centre; the largest number for
    /// those outside of the frame.
    #[inline(always)]
    fn pixels(&self, level: &Level, ring: &Ring, r: f32) -> [u32; LOOKS] {
        let (width, height) = (level.width as u32, level.height as u32);
        let mut pixels = [u32::MAX; LOOKS];
        for (pixel, (x, y)) in pixels.iter_mut().zip(self.x.iter().zip(&self.y)) {
            // Numbers below 0 become very large ones.
            let (column, row) = (
                whole(ring.x + r * x).0 as u32,
                whole(ring.y + r * y).0 as u32,
            );
            let inside = (column < width) & (row < height);
            *pixel =
                row.wrapping_mul(width).wrapping_add(column) | (u32::from(inside).wrapping_sub(1));
        }
        pixels
    }

    /// Fits the ring to the edge points along it, and counts those that lie on it then; None if
    /// they do not determine one.
    #[inline(always)]
    pub(super) fn fit(
        &self,
        level: &Level,
        ring: &Ring,
        reach: f32,
        looks: &mut u64,
    ) -> Option<(Ring, Support)> {
        let mut support = Support::default();
        let (mut dx, mut dy, mut length) = ([0.0f32; LOOKS], [0.0f32; LOOKS], [1.0f32; LOOKS]);
        let (mut residual, mut weight) = ([0.0f32; LOOKS], [0.0f32; LOOKS]);
        let pixels = [0.0, -1.5, 1.5].map(|step| self.pixels(level, ring, ring.r + step));
        for index in 0..LOOKS {
            let lowest = self.lowest[index];
            let mut inside = false;
            for pixels in &pixels {
                *looks += 1;
                let pixel = pixels[index] as usize;
                let Some(&mark) = level.marks().get(pixel) else {
                    continue;
                };
                inside = true;
                if !runs_along(mark, lowest) {
                    continue;
                }
                let point = level.point_at(pixel);
                (dx[index], dy[index]) = (point.0 - ring.x, point.1 - ring.y);
                let distance = (dx[index] * dx[index] + dy[index] * dy[index]).sqrt();
                let off = distance - ring.r;
                if off.abs() <= reach && distance > 0.5 {
                    length[index] = distance;
                    (residual[index], weight[index]) = (off, level.strength_at(pixel));
                    break;
                }
            }
            support.visible += u32::from(inside);
        }
        // Those without weight do not count, whatever their directions.
        let (mut ux, mut uy) = ([0.0f32; LOOKS], [0.0f32; LOOKS]);
        for index in 0..LOOKS {
            (ux[index], uy[index]) = (dx[index] / length[index], dy[index] / length[index]);
        }
        let mut moments = Moments::default();
        for block in 0..LOOKS / LANES {
            let of = |values: &[f32; LOOKS]| values.as_chunks::<LANES>().0[block];
            moments.add(&of(&ux), &of(&uy), &of(&residual), &of(&weight));
        }
        let shift = moments.step()?;
        let moved = shift.x.abs() + shift.y.abs() + shift.r.abs();
        if moved.is_nan() || moved > 3.0 * reach {
            return None;
        }
        let fitted = Ring {
            x: ring.x + shift.x,
            y: ring.y + shift.y,
            r: ring.r + shift.r,
        };
        let slack = 0.7 + 0.02 * fitted.r;
        for index in 0..LOOKS {
            let (x, y) = (dx[index] - shift.x, dy[index] - shift.y);
            let off = (x * x + y * y).sqrt() - fitted.r;
            support.hits += u32::from(weight[index] > 0.0 && off.abs() <= slack);
        }
        Some((fitted, support))
    }

    /// Marks the points along the ring as explained.
    pub(super) fn explain(
        &self,
        circle: &UnitCircle,
        level: &mut Level,
        ring: &Ring,
        looks: &mut u64,
    ) {
        let count = ((6.3 * ring.r) as usize).clamp(16, 512);
        *looks += 3 * count as u64;
        for index in 0..count {
            let ((ux, uy), code) = circle.coded_point(index, count);
            let lowest = code.wrapping_sub(DIRECTION_SLACK) % CODES;
            for step in [0.0, -1.5, 1.5] {
                let at = ring.r + step;
                if let Some((mark, pixel)) = level.mark(ring.x + at * ux, ring.y + at * uy)
                    && runs_along(mark, lowest)
                {
                    level.explain(pixel);
                }
            }
        }
    }
}

/// Returns `true` if a pixel with this mark has an edge whose code lies at most twice the slack
/// above the lowest.
#[inline]
fn runs_along(mark: u8, lowest: u8) -> bool {
    mark & EDGE != 0 && mark.wrapping_sub(lowest) % CODES <= 2 * DIRECTION_SLACK
}

/// Requirements of the first look at a circle.
pub(super) struct Start {
    /// The share of the outline that must lie on edges.
    pub(super) share: f32,
    /// Largest distance from the circle of the points that it is fitted to, pixels: in the first
    /// two rounds, and then.
    pub(super) reach: [f32; 2],
}

/// Everything the search of a level needs.
pub(super) struct Search<'a> {
    pub(super) circle: &'a UnitCircle,
    pub(super) outline: &'a Outline,
    /// Radii that pairs are drawn for at this level, pixels of the level.
    pub(super) radii: (f32, f32),
    /// The largest radius of arcs, and of what pairs are fitted to, pixels of the level.
    pub(super) most_radius: f32,
    /// Pixels of the frame per pixel of the level.
    pub(super) scale: f32,
    pub(super) seed: u64,
    /// The sine of how far two normals may be from mirroring one another.
    pub(super) mirror_slack: f32,
}

impl Search<'_> {
    /// Draws pairs on the rows, then on the columns, until all points have had their turn or the
    /// budget is spent.
    #[inline(always)]
    pub(super) fn run(
        &self,
        level: &mut Level,
        found: &mut Collected,
        prover: &mut Prover<'_>,
        budget: &mut Budget,
    ) {
        for transposed in [false, true] {
            let lines = if transposed {
                level.width
            } else {
                level.height
            };
            let stride = stride(lines);
            let mut line = (self.seed % lines.max(1) as u64) as usize;
            for _ in 0..lines {
                line = (line + stride) % lines;
                let points = level.line(transposed, line);
                let line_end = points.end;
                for at in points {
                    if budget.is_late() || budget.is_over(Stage::Search) {
                        return;
                    }
                    self.draw_from(level, transposed, (at, line_end), found, prover, budget);
                }
            }
        }
    }

    #[inline(always)]
    fn draw_from(
        &self,
        level: &mut Level,
        transposed: bool,
        (at, line_end): (usize, usize),
        found: &mut Collected,
        prover: &mut Prover<'_>,
        budget: &mut Budget,
    ) {
        let lines = if transposed {
            &level.columns
        } else {
            &level.rows
        };
        if lines.nx[at].abs() < LEAST_ALONG || !level.free[lines.id[at] as usize] {
            return;
        }
        budget.looks += 1;
        let mut rings = [Ring::default(); PARTNERS];
        let count = lines.partners(
            (at, line_end),
            self.radii,
            self.mirror_slack,
            &level.free,
            &mut rings,
            &mut budget.looks,
        );
        for ring in &rings[..count] {
            let ring = if transposed {
                Ring {
                    x: ring.y,
                    y: ring.x,
                    r: ring.r,
                }
            } else {
                *ring
            };
            if self.consider(level, ring, &START, found, prover, budget) {
                return;
            }
        }
    }

    /// Checks the circle and keeps it if it qualifies. Returns `true` if it explains its points.
    #[inline(always)]
    pub(super) fn consider(
        &self,
        level: &mut Level,
        ring: Ring,
        start: &Start,
        found: &mut Collected,
        prover: &mut Prover<'_>,
        budget: &mut Budget,
    ) -> bool {
        budget.draws += 1;
        let Some(_) = self
            .outline
            .support(level, &ring, start.share, &mut budget.looks)
        else {
            return false;
        };
        // The same circle is met again and again; a few fits from different pairs are enough.
        if found.is_known(
            &Candidate::new(&ring, self.scale, Support::default()),
            budget,
        ) {
            return false;
        }
        // Fit until it rests.
        let (mut ring, mut support) = (ring, Support::default());
        for round in 0..6 {
            let reach = start.reach[usize::from(round >= 2)];
            let Some((fitted, now)) = self.outline.fit(level, &ring, reach, &mut budget.looks)
            else {
                break;
            };
            let outside = fitted.r < 0.8 * self.radii.0 || fitted.r > 1.25 * self.most_radius;
            if outside || now.hits + 2 < support.hits {
                break;
            }
            let moved =
                (fitted.x - ring.x).abs() + (fitted.y - ring.y).abs() + (fitted.r - ring.r).abs();
            (ring, support) = (fitted, now);
            if moved < 0.15 {
                break;
            }
        }
        if support.share() < LEAST_SHARE.min(start.share) || support.visible < LOOKS as u32 / 3 {
            return false;
        }
        let candidate = Candidate::new(&ring, self.scale, support);
        if found.is_proven(&candidate, budget) {
            return false;
        }
        let Some(place) = found.add(candidate, budget) else {
            return false;
        };
        if support.share() < 0.7 {
            return false;
        }
        // Likely enough to be proven at once; what is proven beyond doubt takes its points along.
        if let Some(place) = place {
            found.candidates[place].tried = true;
        }
        let Some(proven) = found.settle(place, &candidate, prover, budget) else {
            return false;
        };
        self.outline.explain(
            self.circle,
            level,
            &proven.shrunk(self.scale),
            &mut budget.looks,
        );
        true
    }
}

/// A step through `count` points that meets each of them once and leaps far.
fn stride(count: usize) -> usize {
    let mut step = (count as f64 * 0.618) as usize | 1;
    while gcd(step, count) != 1 {
        step += 2;
    }
    step
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
