//! Evidence against a circle: the rays on which its outline would be seen if it were there.
//!
//! The proof weighs the rays that fit. Here those that do not are asked: a ray on which both sides
//! of the outline have the level of the thing, or both that of the ground, refutes the circle, and
//! so does one on which the outline is followed off the circle. A thing in front excuses them: at a
//! T-junction the levels change along the outline on both of its sides.

use super::directions::Rays;
use super::ellipse;
use super::polar::{Gray, Polar, Ring};
use super::proof::{NOISE, Proof, window_for};
use super::strongest::{Edges, RAYS};

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
/// Least number of rays in a part of the outline that is followed.
const LEAST_PART: usize = 3;
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
    /// Steps between the ends of the window and the outline.
    reach: usize,
    half: usize,
    /// Radius and deviation of the noise, of the size looked at.
    r: f32,
    noise: f32,
    /// Deviation of the noise of averaged levels.
    level_noise: f32,
    /// Usual changes of the levels along the outline, inside and outside.
    uneven: [f32; 2],
    /// The outline's sign, slope and contrast.
    sign: f32,
    slope: f32,
    contrast: f32,
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
    /// Set if the outline goes on off the circle.
    leaves: bool,
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

/// The part of the certainty that is left to a proven circle: 0..=1.
#[inline(always)]
pub(super) fn left(
    gray: Gray<'_>,
    rays: Rays<'_>,
    polar: &mut Polar,
    ring: &Ring,
    noise: f32,
    proof: &Proof,
    others: impl Iterator<Item = Ring>,
) -> f32 {
    if proof.visible < WHOLE && proof.covered * proof.visible < LEAST_SEEN {
        return 0.0;
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
    let mut around = Around {
        polar,
        edges: &edges,
        reach: window.reach,
        half: window.half,
        r: ring.r,
        noise,
        level_noise: noise / (2.0 * window.half as f32 + 1.0).sqrt(),
        uneven: [0.0; 2],
        sign: 1.0,
        slope: 0.0,
        contrast: 0.0,
    };
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
                contrasts[hits] = (around.beside(ray, 0.0, 1) - around.beside(ray, 0.0, -1)).abs();
                signs += edges.sign[ray];
                hits += 1;
            }
        }
    }
    if hits < LEAST_HITS {
        return 1.0;
    }
    around.sign = 1f32.copysign(signs);
    around.slope = median(&mut slopes[..hits]);
    around.contrast = median(&mut contrasts[..hits]);
    if ellipse::fits_better(
        rays,
        &edges,
        polar,
        (around.sign, around.slope),
        ring,
        tolerance,
        proof.covered,
    ) {
        return 0.0;
    }
    around.uneven = [0.0, around.unevenness(&states, 1.0)];
    let Some(first) = (0..RAYS).find(|&ray| states[ray] == Ray::Near) else {
        return 1.0;
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
    if bare > MOST_BARE * RAYS as f32 && around.slope > STEEP * noise {
        return 0.0;
    }
    let left = (1.0 - PRICE * refuted / visible).max(0.0);
    left * left.sqrt()
}

impl Around<'_> {
    /// The level `BESIDE` pixels outside (`side` 1) or inside (-1) of a place `off` the outline.
    #[inline(always)]
    fn beside(&self, ray: usize, off: f32, side: i32) -> f32 {
        let place = self.reach as f32 + 0.5 + off + BESIDE * side as f32;
        let row = (place + 0.5).max(0.0) as usize;
        let mut sum = 0.0;
        for shift in 0..=2 * self.half {
            sum += self
                .polar
                .gray(row, (ray + RAYS + shift - self.half) % RAYS);
        }
        sum / (2 * self.half + 1) as f32
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
        let mut leaving = [false; RAYS];
        let before = self.end(states, is_hit, (begin, end), 1, &mut leaving);
        let behind = self.end(states, is_hit, (begin, end), -1, &mut leaving);
        let excuses =
            u8::from(before.excused && !before.leaves) + u8::from(behind.excused && !behind.leaves);
        let weight = match excuses {
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
            if leaving[ray] {
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
        let (inner, outer) = (self.beside(ray, 0.0, -1), self.beside(ray, 0.0, 1));
        let both = |level: f32| (inner - level).abs() <= slack && (outer - level).abs() <= slack;
        both(levels.inner) || both(levels.outer)
    }

    /// Looks at the end of the gap that a part of the outline before it (`side` 1) or behind it
    /// (-1) ends at, and marks the rays on which that part goes on off the circle.
    #[inline(always)]
    fn end(
        &self,
        states: &[Ray; RAYS],
        is_hit: &[bool; RAYS],
        (begin, end): (usize, usize),
        side: i32,
        leaving: &mut [bool; RAYS],
    ) -> End {
        // The last ray of the part, and the way into the gap from there.
        let last = if side > 0 { begin + RAYS - 1 } else { end } % RAYS;
        let ray_at = |steps: i32| (last as i32 + side * steps).rem_euclid(RAYS as i32) as usize;
        let mut levels = Levels::default();
        let (mut count, mut part, mut in_part) = (0, 0, true);
        for back in 0..RAYS as i32 {
            let ray = ray_at(-back);
            in_part &= states[ray] == Ray::Near;
            part += usize::from(in_part);
            if is_hit[ray] {
                levels.inner += self.beside(ray, 0.0, -1);
                levels.outer += self.beside(ray, 0.0, 1);
                count += 1;
            }
            if count == END && (!in_part || part >= LEAST_PART) {
                break;
            }
        }
        levels.inner /= count as f32;
        levels.outer /= count as f32;
        let mut found = End {
            levels,
            excused: states[ray_at(1)] == Ray::Beyond || self.is_junction(last, side, end - begin),
            leaves: false,
        };
        if part >= LEAST_PART {
            found.leaves = self.follow(last, side, end - begin, levels, states, leaving);
        }
        found
    }

    /// The level `BESIDE` pixels inside (`beside` -1) or outside (1), so many rays from a ray.
    #[inline(always)]
    fn level(&self, ray: usize, steps: i32, beside: f32) -> f32 {
        let row = (self.reach as f32 + 1.0 + BESIDE * beside) as usize;
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

    /// Follows the outline into the gap; returns `true` if it leaves the circle.
    #[inline(always)]
    fn follow(
        &self,
        last: usize,
        side: i32,
        rays: usize,
        levels: Levels,
        states: &[Ray; RAYS],
        leaving: &mut [bool; RAYS],
    ) -> bool {
        let ray_at = |steps: i32| (last as i32 + side * steps).rem_euclid(RAYS as i32) as usize;
        let slack = (0.25 * (levels.outer - levels.inner).abs()).max(2.0 * self.level_noise);
        let reach = (0.05 * self.r).max(0.9);
        let mut off = self.edges.distance[last];
        let mut bend = 0.5 * (off - self.edges.distance[ray_at(-2)]);
        let mut own = [false; RAYS];
        let mut farthest = 0.0f32;
        for steps in 1..=rays as i32 {
            let ray = ray_at(steps);
            if states[ray] == Ray::Beyond {
                break;
            }
            let Some((place, slope)) = self.nearest_edge(ray, off + bend, reach) else {
                break;
            };
            bend = 0.5 * (bend + place - off);
            off = place;
            farthest = farthest.max(off.abs());
            let (inner, outer) = (self.beside(ray, off, -1), self.beside(ray, off, 1));
            own[ray] = off.abs() > (0.05 * self.r).max(1.0)
                && slope >= 0.5 * self.slope
                && (inner - levels.inner).abs() <= slack
                && (outer - levels.outer).abs() <= slack;
        }
        let leaves = farthest >= (0.1 * self.r).max(2.0) && own.iter().any(|&own| own);
        if leaves {
            for (leaving, own) in leaving.iter_mut().zip(own) {
                *leaving |= own;
            }
        }
        leaves
    }

    /// The edge of the outline's sign on a ray that is nearest to `wanted`, and its slope.
    #[inline(always)]
    fn nearest_edge(&self, ray: usize, wanted: f32, reach: f32) -> Option<(f32, f32)> {
        let middle = self.reach as f32 + wanted;
        let first = ((middle - reach).max(1.0)).ceil() as usize;
        let slope = |step: usize| self.sign * self.polar.outward[step * RAYS + ray];
        let mut best: Option<(f32, f32)> = None;
        for step in first..self.polar.steps - 1 {
            if step as f32 > middle + reach {
                break;
            }
            let here = slope(step);
            let (before, behind) = (slope(step - 1), slope(step + 1));
            if here < 0.4 * self.slope || here > 2.5 * self.slope || here < before || here < behind
            {
                continue;
            }
            let bend = 2.0 * here - before - behind;
            let top = if bend > 0.0 {
                (0.5 * (behind - before) / bend).clamp(-0.5, 0.5)
            } else {
                0.0
            };
            let place = self.polar.distance(step as f32 + top);
            if best.is_none_or(|(other, _)| (place - wanted).abs() < (other - wanted).abs()) {
                best = Some((place, here));
            }
        }
        best
    }
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
