//! The strongest edge along each ray across an outline, and which of them are no edges of things.

use super::directions::Rays;
use super::polar::{Gray, LANES, Polar, Ring};

/// Directions that are looked in.
pub(super) const RAYS: usize = 64;
/// Gray level from which on a pixel counts as overexposed; compression leaves a margin.
const CLIPPED: f32 = 245.0;
/// By how much wider than for edges the window is for the light around, pixels.
const FALL: usize = 4;
/// Fall of the light from 3 to 6 px beyond an edge, as a share of the edge, from which on it is the
/// glow of a lamp. Lamps have 0.1 to 0.5, balls up to 0.03.
const GLOW: f32 = 0.08;

/// Reach of the search around a circle, and the averaging of slopes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Pixels on either side of the outline.
    pub(super) reach: usize,
    /// Rays on either side that a slope is averaged over.
    pub(super) half: usize,
    /// The least slope of an edge, gray levels per pixel.
    pub(super) least: f32,
    /// Set if slopes are averaged across the outline, as is right for soft edges.
    pub(super) soft: bool,
}

/// The strongest edge along each ray.
#[derive(Clone, Debug)]
pub(super) struct Edges {
    /// Distance outside the outline, pixels.
    pub(super) distance: [f32; RAYS],
    /// Slope without its sign; 0 where there is no edge.
    pub(super) slope: [f32; RAYS],
    /// 1 where the outside is brighter, else -1.
    pub(super) sign: [f32; RAYS],
    /// Tangent of the angle between the edge and the outline.
    pub(super) slant: [f32; RAYS],
    /// The step of the window that the edge was found at, from 1 on; 0 where there is no edge.
    at: [i32; RAYS],
}

impl Edges {
    /// Edges at these distances, for tests.
    #[cfg(test)]
    pub(super) fn at_distances(distance: [f32; RAYS]) -> Self {
        Self {
            distance,
            slope: [10.0; RAYS],
            sign: [1.0; RAYS],
            slant: [0.0; RAYS],
            at: [1; RAYS],
        }
    }

    /// Finds the strongest edge along the outline's normal on each ray.
    #[inline(always)]
    pub(super) fn around(
        ring: &Ring,
        gray: Gray<'_>,
        rays: Rays<'_>,
        polar: &mut Polar,
        window: Window,
    ) -> Self {
        let Window {
            reach,
            half,
            least,
            soft,
        } = window;
        polar.sample(gray, rays, ring, reach, half);
        if soft {
            polar.soften();
        }
        let mut edges = Self {
            distance: [0.0; RAYS],
            slope: [0.0; RAYS],
            sign: [1.0; RAYS],
            slant: [0.0; RAYS],
            at: [0; RAYS],
        };
        for (block, at) in edges.at.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let visible = polar.visible.as_chunks::<LANES>().0[block];
            let (mut best, mut place) = ([least; LANES], [0i32; LANES]);
            let rows = polar
                .outward
                .chunks_exact(RAYS)
                .zip(polar.along.chunks_exact(RAYS));
            for (step, (outward, along)) in rows.enumerate() {
                let outward = outward.as_chunks::<LANES>().0[block];
                let along = along.as_chunks::<LANES>().0[block];
                for lane in 0..LANES {
                    let strength = (outward[lane].abs() - 0.7 * along[lane].abs()) * visible[lane];
                    let better = -i32::from(strength > best[lane]);
                    place[lane] = (better & (step as i32 + 1)) | (!better & place[lane]);
                    best[lane] = strength.max(best[lane]);
                }
            }
            *at = place;
        }
        for ray in 0..RAYS {
            let Some(step) = (edges.at[ray] as usize).checked_sub(1) else {
                edges.distance[ray] = 0.0;
                edges.slope[ray] = 0.0;
                continue;
            };
            let slope = |step: usize| polar.outward[step * RAYS + ray].abs();
            let here = slope(step);
            let mut place = step as f32;
            if step > 0 && step + 1 < polar.steps {
                let (before, behind) = (slope(step - 1), slope(step + 1));
                let bend = 2.0 * here - before - behind;
                if bend > 0.0 {
                    place += (0.5 * (behind - before) / bend).clamp(-0.5, 0.5);
                }
            }
            edges.distance[ray] = polar.distance(place);
            edges.slope[ray] = here;
            edges.sign[ray] = 1f32.copysign(polar.outward[step * RAYS + ray]);
            edges.slant[ray] = polar.along[step * RAYS + ray].abs() / here;
        }
        edges
    }

    /// The width of the mean profile across the edges at half of its height, pixels; that of the
    /// window where it does not fall so far within it.
    #[inline(always)]
    pub(super) fn width(&self, polar: &Polar) -> f32 {
        const FAR: usize = 5;
        let (mut sums, mut counts) = ([0.0f32; 2 * FAR + 1], [0.0f32; 2 * FAR + 1]);
        for ray in 0..RAYS {
            let Some(step) = (self.at[ray] as usize).checked_sub(1) else {
                continue;
            };
            for (index, (sum, count)) in sums.iter_mut().zip(&mut counts).enumerate() {
                let row = (step + index).wrapping_sub(FAR);
                if row < polar.steps {
                    *sum += self.sign[ray] * polar.outward[row * RAYS + ray];
                    *count += 1.0;
                }
            }
        }
        let mean = |index: usize| sums[index] / f32::max(counts[index], 1.0);
        let half = 0.5 * mean(FAR);
        if half <= 0.0 {
            return 0.0;
        }
        let side = |outward: bool| {
            let at = |steps: usize| if outward { FAR + steps } else { FAR - steps };
            let (mut before, mut place) = (mean(FAR), FAR as f32);
            for steps in 1..=FAR {
                if counts[at(steps)] < 0.25 * counts[FAR] {
                    break;
                }
                let here = mean(at(steps));
                if here < half {
                    place = (steps - 1) as f32 + (before - half) / (before - here);
                    break;
                }
                before = here;
            }
            place
        };
        side(true) + side(false)
    }

    /// The gray level `pixels` away from the edge of a ray, on the dark side of it if positive;
    /// `beyond` is how much wider the window sampled is than the one in which the edges were
    /// sought.
    #[inline(always)]
    fn gray(&self, polar: &Polar, ray: usize, pixels: i32, beyond: usize) -> f32 {
        let step = self.at[ray] - 1 + beyond as i32;
        // The edge lies between this row and the next.
        let outward = polar.outward[step.max(0) as usize * RAYS + ray];
        let row = if outward < 0.0 {
            step + pixels
        } else {
            step + 1 - pixels
        };
        polar.gray(row.max(0) as usize, ray)
    }

    /// Returns `true` if an edge lies on the outline and its inner side is overexposed.
    #[inline(always)]
    fn is_clipped(&self, polar: &Polar, ray: usize, beyond: usize) -> bool {
        self.slope[ray] > 0.0
            && self.sign[ray] < 0.0
            && self.distance[ray].abs() <= 1.5
            && self.gray(polar, ray, -2, beyond) >= CLIPPED
    }

    /// Returns `true` if an eighth of the outline or more runs along an overexposed area.
    pub(super) fn are_clipped(&self, polar: &Polar) -> bool {
        (0..RAYS)
            .filter(|&ray| self.is_clipped(polar, ray, 0))
            .count()
            >= RAYS / 8
    }

    /// Drops the edges of overexposed parts if the light falls off around them: of a lamp and its
    /// glow, whose outline is the border of the overexposure and not of a thing.
    pub(super) fn leave_out_glow(
        &mut self,
        ring: &Ring,
        gray: Gray<'_>,
        rays: Rays<'_>,
        polar: &mut Polar,
        window: Window,
    ) {
        polar.sample(gray, rays, ring, window.reach + FALL, window.half);
        let (mut drop, mut fall) = (0.0, 0.0);
        for ray in (0..RAYS).filter(|&ray| self.is_clipped(polar, ray, FALL)) {
            let [bright, dark, far] = [-2, 3, 6].map(|pixels| self.gray(polar, ray, pixels, FALL));
            drop += bright - dark;
            fall += dark - far;
        }
        if fall > GLOW * drop {
            for ray in 0..RAYS {
                if self.is_clipped(polar, ray, FALL) {
                    self.slope[ray] = 0.0;
                }
            }
        }
    }
}
