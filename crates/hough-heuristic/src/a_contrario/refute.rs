//! Evidence against a circle: the rays on which its outline would be seen if it were there.
//!
//! The proof weighs the rays that fit. Here those that do not are asked: a ray on which both sides
//! of the outline have the level of the thing, or both that of the ground, refutes the circle. A
//! thing in front excuses them: at a T-junction the levels change along the outline on both of its
//! sides. An outline that goes on off the circle has a price of its own.

use super::against::Against;
use super::directions::Rays;
use super::ellipse;
use super::leaving::{self, Ends, Leaving};
use super::polar::{Gray, Polar, Ring};
use super::proof::{NOISE, Proof, window_for};
use super::strongest::{Edges, RAYS};

/// No certainty is left.
const OUT: Against = Against {
    left: 0.0,
    price: 0.0,
};
/// Certainty subtracted for each end of a part of the outline that goes on off the circle.
const LEAVING: f32 = 4.0;
/// Inverse of the share of refuted rays at which no certainty is left.
const PRICE: f32 = 3.0;
/// Share of rays without any edge above which a circle is dropped.
const MOST_BARE: f32 = 0.3;
/// Least slope of the outline for such rays to count, in deviations of the noise.
const STEEP: f32 = 5.0;
/// Least share of the outline that must be seen if the frame cuts the circle.
const LEAST_SEEN: f32 = 0.45;
/// Share of the outline in the frame below which the frame cuts the circle.
const WHOLE: f32 = 0.9;
/// Distance from the outline at which levels are taken, pixels.
const BESIDE: f32 = 2.5;
/// Number of rays on the outline below which no evidence against the circle is sought.
const LEAST_HITS: usize = 8;
/// Rays at the end of a part that its levels are taken from.
const END: usize = 4;
/// The least step at a junction, in contrasts of the outline.
const FAINT: f32 = 0.025;
/// The least step at a junction, in units of the ground's unevenness.
const ROUGH: f32 = 2.5;
/// Number of rays behind its border on which a thing in front is examined.
const FAR: i32 = 9;
/// Distance from another circle within which an edge belongs to it, pixels.
const OTHER: f32 = 1.5;
/// Weight of a gap with a thing in front at one of its two ends.
const HALF_EXCUSED: f32 = 0.75;

/// The picture around an outline, ray by ray.
struct Around<'a> {
    polar: &'a Polar,
    edges: &'a Edges,
    half: usize,
    /// Radius and deviation of the noise, of the size looked at.
    r: f32,
    noise: f32,
    /// Deviation of the noise of averaged levels.
    level_noise: f32,
    /// Usual changes of the levels along the outline, inside and outside.
    uneven: [f32; 2],
    /// The outline's contrast.
    contrast: f32,
    /// Rays between ends at which it goes on, as in [`Ends`].
    between: u64,
}

/// The levels on either side of the outline at the end of one of its parts.
#[derive(Clone, Copy, Default)]
struct Levels {
    inner: f32,
    outer: f32,
}

/// One end of a gap.
#[derive(Clone, Copy, Default)]
struct End {
    levels: Levels,
    /// Set if something in front begins here, or the frame ends.
    excused: bool,
}

/// The state of a ray.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ray {
    /// Outside of the frame.
    Beyond,
    /// The strongest edge lies on the outline or close to it.
    Near,
    Missing,
}

/// What speaks against a proven circle.
#[inline(always)]
pub(super) fn against(
    gray: Gray<'_>,
    rays: Rays<'_>,
    polar: &mut Polar,
    ring: &Ring,
    noise: f32,
    proof: &Proof,
    others: impl Iterator<Item = Ring>,
) -> Against {
    if proof.visible < WHOLE && proof.covered * proof.visible < LEAST_SEEN {
        return OUT;
    }
    let window = window_for(ring, noise);
    let edges = Edges::around(ring, gray, rays, polar, window);
    let tolerance = if noise > NOISE { 1.0 } else { 0.5 };
    for other in others.filter(|other| crosses(ring, other)) {
        leave_to(rays, &edges, polar, ring, &other, tolerance);
    }
    let mut slopes = [0.0; RAYS];
    let mut contrasts = [0.0; RAYS];
    let (mut hits, mut signs) = (0, 0.0f32);
    let mut states = [Ray::Missing; RAYS];
    let mut is_hit = [false; RAYS];
    let mut visible = 0.0;
    for ray in 0..RAYS {
        if polar.visible[ray] == 0.0 {
            states[ray] = Ray::Beyond;
            continue;
        }
        visible += 1.0;
        if edges.slope[ray] > 0.0 && edges.distance[ray].abs() <= tolerance + 0.5 {
            states[ray] = Ray::Near;
            if edges.distance[ray].abs() <= tolerance {
                is_hit[ray] = true;
                slopes[hits] = edges.slope[ray];
                let [outer, inner] = [1, -1].map(|side| beside(polar, window.half, ray, side));
                contrasts[hits] = (outer - inner).abs();
                signs += edges.sign[ray];
                hits += 1;
            }
        }
    }
    if hits < LEAST_HITS {
        return Against::default();
    }
    let sign = 1f32.copysign(signs);
    let slope = median(&mut slopes[..hits]);
    let contrast = median(&mut contrasts[..hits]);
    if ellipse::fits_better(
        rays,
        &edges,
        polar,
        (sign, slope),
        ring,
        tolerance,
        proof.covered,
    ) {
        return OUT;
    }
    polar.sample(gray, rays, ring, leaving::reach(ring.r), window.half);
    let level_noise = noise / (2.0 * window.half as f32 + 1.0).sqrt();
    let own = std::array::from_fn(|ray| states[ray] == Ray::Near && edges.sign[ray] * sign > 0.0);
    let leaving = Leaving {
        polar,
        edges: &edges,
        r: ring.r,
        sign,
        contrast,
        uncertain: 2.0 * level_noise,
    };
    // In noise an edge is followed to others by chance.
    let ends = if noise > NOISE {
        Ends::default()
    } else {
        leaving.ends(&own)
    };
    let mut around = Around {
        polar,
        edges: &edges,
        half: window.half,
        r: ring.r,
        noise,
        level_noise,
        uneven: [0.0; 2],
        contrast,
        between: ends.between,
    };
    around.uneven = [0.0, around.unevenness(&states, 1.0)];
    let Some(first) = (0..RAYS).find(|&ray| states[ray] == Ray::Near) else {
        return Against::default();
    };
    let (mut refuted, mut bare) = (0.0, 0.0);
    let mut at = first;
    while at < first + RAYS {
        if states[at % RAYS] == Ray::Near {
            at += 1;
            continue;
        }
        let begin = at;
        while states[at % RAYS] != Ray::Near {
            at += 1;
        }
        let gap = around.gap(&states, &is_hit, begin, at);
        refuted += gap.0;
        bare += gap.1;
    }
    if bare > MOST_BARE * RAYS as f32 && slope > STEEP * noise {
        return OUT;
    }
    let left = (1.0 - PRICE * refuted / visible).max(0.0);
    let price = LEAVING * ends.count as f32;
    Against {
        left: left * left.sqrt(),
        price,
    }
}

impl Around<'_> {
    /// The level `BESIDE` pixels outside (`side` 1) or inside (-1) of the outline.
    #[inline(always)]
    fn beside(&self, ray: usize, side: i32) -> f32 {
        beside(self.polar, self.half, ray, side)
    }

    /// The weight of the rays from `begin` to `end` that refute the circle, and of those without
    /// any edge.
    #[inline(always)]
    fn gap(
        &self,
        states: &[Ray; RAYS],
        is_hit: &[bool; RAYS],
        begin: usize,
        end: usize,
    ) -> (f32, f32) {
        let before = self.end(states, is_hit, (begin, end), 1);
        let behind = self.end(states, is_hit, (begin, end), -1);
        let weight = match u8::from(before.excused) + u8::from(behind.excused) {
            0 => 1.0,
            1 => HALF_EXCUSED,
            _ => 0.0,
        };
        let (mut refuted, mut bare) = (0.0, 0.0);
        let step = |end: &End| (end.levels.outer - end.levels.inner).abs();
        let least = step(&before).min(step(&behind));
        for at in begin..end {
            let ray = at % RAYS;
            if states[ray] == Ray::Beyond {
                continue;
            }
            if self.between >> ray & 1 == 1 {
                refuted += 1.0;
            } else if self.is_plain(ray, before.levels, least)
                || self.is_plain(ray, behind.levels, least)
            {
                refuted += weight;
            }
            if self.edges.slope[ray] <= 0.0 {
                bare += weight;
            }
        }
        (refuted, bare)
    }

    /// Returns `true` if both sides of the outline have the level of the thing, or both that of the
    /// ground.
    #[inline(always)]
    fn is_plain(&self, ray: usize, levels: Levels, least: f32) -> bool {
        let step = (levels.outer - levels.inner).abs();
        let edge_near =
            self.edges.slope[ray] > 0.0 && self.edges.distance[ray].abs() <= 0.15 * self.r + 1.0;
        if edge_near || step < (4.0 * self.level_noise).max(0.6 * self.contrast) {
            return false;
        }
        let slack = (0.25 * least).max(2.0 * self.level_noise);
        let (inner, outer) = (self.beside(ray, -1), self.beside(ray, 1));
        let both = |level: f32| (inner - level).abs() <= slack && (outer - level).abs() <= slack;
        both(levels.inner) || both(levels.outer)
    }

    /// Looks at the end of the gap that a part of the outline before it (`side` 1) or behind it
    /// (-1) ends at.
    #[inline(always)]
    fn end(
        &self,
        states: &[Ray; RAYS],
        is_hit: &[bool; RAYS],
        (begin, end): (usize, usize),
        side: i32,
    ) -> End {
        // The last ray of the part, and the way into the gap from there.
        let last = if side > 0 { begin + RAYS - 1 } else { end } % RAYS;
        let ray_at = |steps: i32| (last as i32 + side * steps).rem_euclid(RAYS as i32) as usize;
        let mut levels = Levels::default();
        let hits = (0..RAYS as i32)
            .map(|back| ray_at(-back))
            .filter(|&ray| is_hit[ray]);
        let mut count = 0.0;
        for ray in hits.take(END) {
            levels.inner += self.beside(ray, -1);
            levels.outer += self.beside(ray, 1);
            count += 1.0;
        }
        levels.inner /= count;
        levels.outer /= count;
        End {
            levels,
            excused: states[ray_at(1)] == Ray::Beyond || self.is_junction(last, side, end - begin),
        }
    }

    /// The level `BESIDE` pixels inside (`beside` -1) or outside (1), so many rays from a ray.
    #[inline(always)]
    fn level(&self, ray: usize, steps: i32, beside: f32) -> f32 {
        let row = (0.5 * (self.polar.steps + 1) as f32 + BESIDE * beside) as usize;
        let ray = (ray as i32 + steps).rem_euclid(RAYS as i32) as usize;
        self.polar.gray(row, ray)
    }

    /// Mean change of the level beside the outline over four rays, where the outline is seen.
    #[inline(always)]
    fn unevenness(&self, states: &[Ray; RAYS], beside: f32) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0f32);
        for ray in 0..RAYS {
            if (0..7).any(|step| states[(ray + step) % RAYS] != Ray::Near) {
                continue;
            }
            let level = |steps: i32| self.level(ray, steps, beside);
            let (before, behind) = (
                level(0) + level(1) + level(2),
                level(4) + level(5) + level(6),
            );
            sum += (behind - before).abs() / 3.0;
            count += 1.0;
        }
        sum / count.max(1.0)
    }

    /// Returns `true` if the levels change along the outline at the end of a part, inside and
    /// outside of it, as they do where a thing in front begins; it would hide `gap` rays.
    #[inline(always)]
    fn is_junction(&self, last: usize, side: i32, gap: usize) -> bool {
        [-1.0, 1.0]
            .into_iter()
            .zip(self.uneven)
            .all(|(beside, uneven)| {
                let least = (3.5 * 0.82 * self.noise)
                    .max(FAINT * self.contrast)
                    .max(1.5)
                    .max(ROUGH * uneven);
                let level = |steps: i32| self.level(last, side * steps, beside);
                let mean = |from: i32, to: i32| {
                    let sum: f32 = (from..to).map(level).sum();
                    sum / (to - from) as f32
                };
                (-2..=3).any(|at| {
                    let (before, behind) = (mean(at - 3, at), mean(at + 1, at + 4));
                    let step = behind - before;
                    // Uneven ground changes gradually.
                    let trend = (level(at - 3) - level(at - 1)).abs()
                        + (level(at + 1) - level(at + 3)).abs();
                    let sharp = step.abs() - (trend - 4.0 * self.noise).max(0.0);
                    // What is in front is as wide as the gap.
                    let end = (at + FAR).min(gap as i32 - 1).max(at + 4);
                    let far = mean(at + 1, end) - before;
                    sharp > least && far * step > 0.0 && far.abs() > least
                })
            })
    }
}

/// The level `BESIDE` pixels outside (`side` 1) or inside (-1) of an outline, averaged over `half`
/// rays on either side.
#[inline(always)]
fn beside(polar: &Polar, half: usize, ray: usize, side: i32) -> f32 {
    let row = (0.5 * (polar.steps + 1) as f32 + BESIDE * side as f32) as usize;
    let levels = (0..=2 * half).map(|shift| polar.gray(row, (ray + RAYS + shift - half) % RAYS));
    levels.sum::<f32>() / (2 * half + 1) as f32
}

/// Returns `true` if the outlines cross.
pub(super) fn crosses(a: &Ring, b: &Ring) -> bool {
    let (dx, dy) = (a.x - b.x, a.y - b.y);
    let apart = (dx * dx + dy * dy).sqrt();
    apart > (a.r - b.r).abs() && apart < a.r + b.r
}

/// Leaves to a surer circle that crosses this one the rays whose edge is its own or that it hides.
#[inline(always)]
fn leave_to(
    rays: Rays<'_>,
    edges: &Edges,
    polar: &mut Polar,
    ring: &Ring,
    other: &Ring,
    tolerance: f32,
) {
    for ray in 0..RAYS {
        let off = edges.distance[ray];
        if edges.slope[ray] > 0.0 && off.abs() <= tolerance {
            continue;
        }
        let outside = |r: f32| {
            let (x, y) = (
                ring.x + r * rays.x[ray] - other.x,
                ring.y + r * rays.y[ray] - other.y,
            );
            (x * x + y * y).sqrt() - other.r
        };
        if outside(ring.r) < 0.0 || outside(ring.r + off).abs() <= OTHER {
            polar.visible[ray] = 0.0;
        }
    }
}

fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}
