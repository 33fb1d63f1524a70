//! Evidence against a circle: its outline goes on off the circle, as that of a finger, a letter or
//! a lobe does.
//!
//! From the end of each part of the outline the edge is followed ray by ray. It is one outline as
//! long as it bends little and its sides keep their levels. What hides a ball has levels of its
//! own, and the terminator of a shaded ball has a smaller step.

use super::polar::Polar;
use super::strongest::{Edges, RAYS};

/// Rays of a part of the outline that its levels and its direction are taken from.
const END: usize = 4;
/// The most rays that an edge is followed over.
const FARTHEST: usize = 20;
/// The farthest from the circle that an edge is followed, radii.
const REACH: f32 = 0.7;
/// Distance from the circle that an edge must reach: radii, and pixels.
const OFF: f32 = 0.1;
const LEAST_OFF: f32 = 2.0;
/// Distance outside of the circle that a straight line must reach, radii, and the most of it that
/// it has at half of its rays. The line along which a finger goes on leaves the circle ever faster,
/// the outline of another ball ever more slowly.
const STRAIGHT_OFF: f32 = 0.2;
const STRAIGHT: f32 = 0.47;
/// The most rays between two such ends.
const WIDEST: usize = 45;
/// Distance from the edge at which levels are taken, pixels.
const BESIDE: f32 = 2.5;
/// Distance of an edge from the place expected: radii, pixels, and in units of the displacement
/// from ray to ray.
const SLACK: f32 = 0.05;
const LEAST_SLACK: f32 = 0.9;
const BEND: f32 = 0.3;
/// The least slope of the edge, in slopes of the part that it goes on from.
const LEAST_SLOPE: f32 = 0.25;
/// The least step across the edge, in contrasts of the outline.
const LEAST_STEP: f32 = 0.55;
/// The most that the level of a side changes, in contrasts of the outline.
const MOST_CHANGE: f32 = 0.33;
/// Part of the difference by which the levels looked for follow those met.
const ADAPT: f32 = 0.3;

/// An outline, and the picture around it.
pub(super) struct Leaving<'a> {
    /// Sampled at least as far as [`reach`] from the outline.
    pub(super) polar: &'a Polar,
    pub(super) edges: &'a Edges,
    pub(super) r: f32,
    /// 1 where the outside is brighter, else -1.
    pub(super) sign: f32,
    /// Usual difference of the levels on the two sides.
    pub(super) contrast: f32,
    /// Change of a level that noise may cause.
    pub(super) uncertain: f32,
}

/// Distance from an outline of this radius that must be sampled, pixels.
pub(super) fn reach(r: f32) -> usize {
    (REACH * r + BESIDE) as usize + 1
}

/// An edge on a ray: its distance from the circle, and the levels inside and outside of it.
#[derive(Clone, Copy)]
struct Place {
    off: f32,
    inner: f32,
    outer: f32,
}

/// The ends of parts at which an outline goes on off the circle.
#[derive(Clone, Copy, Default)]
pub(super) struct Ends {
    pub(super) count: usize,
    /// A bit for each ray between two of them, if the outline goes on along a straight line outside
    /// of the circle at both, as a finger's does.
    pub(super) between: u64,
}

/// Distances of an edge outside of the circle: the largest, and that at half of the rays to it.
struct Course {
    most: f32,
    half: f32,
}

impl Leaving<'_> {
    /// Follows the outline from the ends of its parts; `own` marks the rays on which it is seen.
    #[inline(always)]
    pub(super) fn ends(&self, own: &[bool; RAYS]) -> Ends {
        let mut ends = Ends::default();
        let mut is_straight = [[false; RAYS]; 2];
        for (side, way) in [1, RAYS - 1].into_iter().enumerate() {
            for last in 0..RAYS {
                let part = |back: usize| own[(last + back * (RAYS - way)) % RAYS];
                if own[(last + way) % RAYS] || !(0..END).all(part) {
                    continue;
                }
                let course = self.follow(last, way);
                let most = course.most;
                ends.count += usize::from(most.abs() >= (OFF * self.r).max(LEAST_OFF));
                let straight = most >= STRAIGHT_OFF * self.r && course.half <= STRAIGHT * most;
                is_straight[side][last] = straight;
            }
        }
        for last in (0..RAYS).filter(|&last| is_straight[0][last]) {
            let at = |steps: usize| (last + steps) % RAYS;
            let next = (1..WIDEST).find(|&steps| is_straight[1][at(steps)]);
            for steps in 1..next.unwrap_or(0) {
                ends.between |= 1 << at(steps);
            }
        }
        ends
    }

    /// The level so far outside of the circle.
    #[inline(always)]
    fn level(&self, ray: usize, off: f32) -> f32 {
        let row = 0.5 * self.polar.steps as f32 + off + 0.5;
        self.polar.gray(row.max(0.0) as usize, ray)
    }

    /// Follows the outline from its last ray.
    #[inline(always)]
    fn follow(&self, last: usize, way: usize) -> Course {
        let before: [usize; END] = std::array::from_fn(|back| (last + back * (RAYS - way)) % RAYS);
        let mean = |value: &dyn Fn(usize) -> f32| {
            before.iter().map(|&ray| value(ray)).sum::<f32>() / END as f32
        };
        let distance = &self.edges.distance;
        let slope = mean(&|ray| self.edges.slope[ray]);
        let mut inner = mean(&|ray| self.level(ray, distance[ray] - BESIDE));
        let mut outer = mean(&|ray| self.level(ray, distance[ray] + BESIDE));
        let mut offs = [before[2], before[1], before[0]].map(|ray| distance[ray]);
        let mut course = [0.0f32; FARTHEST + 1];
        let mut count = 0;
        for (steps, at) in course.iter_mut().enumerate().skip(1) {
            let ray = (last + way * steps) % RAYS;
            let bend = 0.5 * (offs[2] - offs[0]);
            let slack = (SLACK * self.r).max(LEAST_SLACK) + BEND * bend.abs();
            let Some(place) = self.edge(ray, (offs[2] + bend, slack), slope, (inner, outer)) else {
                break;
            };
            offs = [offs[1], offs[2], place.off];
            inner += ADAPT * (place.inner - inner);
            outer += ADAPT * (place.outer - outer);
            *at = place.off;
            count = steps;
        }
        let most = (0..=count).max_by(|&a, &b| course[a].abs().total_cmp(&course[b].abs()));
        let most = most.unwrap_or(0);
        Course {
            most: course[most],
            half: course[most / 2],
        }
    }

    /// The edge of the outline on a ray that is nearest to the place expected.
    #[inline(always)]
    fn edge(
        &self,
        ray: usize,
        (wanted, slack): (f32, f32),
        slope: f32,
        (inner, outer): (f32, f32),
    ) -> Option<Place> {
        let middle = 0.5 * (self.polar.steps - 1) as f32 + wanted;
        let first = (middle - slack - 0.5).max(1.0).ceil() as usize;
        let end = ((middle + slack + 1.5).max(0.0) as usize).min(self.polar.steps - 1);
        let at = |step: usize| self.sign * self.polar.outward[step * RAYS + ray];
        let change = (MOST_CHANGE * self.contrast).max(self.uncertain);
        let places = (first..end).filter_map(|step| {
            let (before, here, behind) = (at(step - 1), at(step), at(step + 1));
            if here < LEAST_SLOPE * slope || here < before || here < behind {
                return None;
            }
            let bend = 2.0 * here - before - behind;
            let top = if bend > 0.0 {
                (0.5 * (behind - before) / bend).clamp(-0.5, 0.5)
            } else {
                0.0
            };
            let off = self.polar.distance(step as f32 + top);
            let place = Place {
                off,
                inner: self.level(ray, off - BESIDE),
                outer: self.level(ray, off + BESIDE),
            };
            let is_own = (off - wanted).abs() <= slack
                && off.abs() <= REACH * self.r
                && self.sign * (place.outer - place.inner) >= LEAST_STEP * self.contrast
                && (place.inner - inner).abs() <= change
                && (place.outer - outer).abs() <= change;
            is_own.then_some(place)
        });
        let from = |place: &Place| (place.off - wanted).abs();
        places.min_by(|a, b| from(a).total_cmp(&from(b)))
    }
}
