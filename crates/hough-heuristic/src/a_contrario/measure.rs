//! The last step: a proven circle measured at the full size of the frame, with the error to be
//! expected.

use super::directions::{Rays, UnitCircle};
use super::fit::Moments;
use super::polar::{Gray, LANES, Polar, Ring};
use super::proof::Proof;
use super::strongest::RAYS;

/// A circle as measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Measured {
    pub(super) ring: Ring,
    /// Standard errors, pixels.
    pub(super) centre_error: f32,
    pub(super) radius_error: f32,
    /// Amplitude of the second harmonic of the outline, pixels:
    /// `r + cos2 cos(2 a) + sin2 sin(2 a)`.
    pub(super) cos2: f32,
    pub(super) sin2: f32,
}

impl Measured {
    /// A circle that was not measured, known to a fraction of a pixel of the size it was proven at.
    pub(super) fn roughly(ring: Ring, scale: f32) -> Self {
        Self {
            ring,
            centre_error: 0.5 * scale,
            radius_error: 0.5 * scale,
            ..Self::default()
        }
    }

    /// Undoes the displacement `limb` that shading and blur caused, and adds its uncertainty to the
    /// standard errors.
    fn shift_by(&mut self, limb: &Ring) {
        self.ring.x += limb.x;
        self.ring.y += limb.y;
        self.ring.r += limb.r;
        let both = |chance: f32, model: f32| (chance * chance + model * model).sqrt();
        let sideways = (limb.x * limb.x + limb.y * limb.y).sqrt();
        self.centre_error = both(
            SCATTER * self.centre_error,
            MODEL_CENTRE + LIMB_CENTRE * limb.r.abs() + sideways,
        );
        self.radius_error = both(
            SCATTER * self.radius_error,
            MODEL_RADIUS + LIMB_RADIUS * limb.r.abs(),
        );
    }

    /// Returns the measurement in a frame that is `factor` times as wide and high.
    pub(super) fn grown(&self, factor: f32) -> Self {
        Self {
            ring: self.ring.grown(factor),
            centre_error: self.centre_error * factor,
            radius_error: self.radius_error * factor,
            cos2: self.cos2 * factor,
            sin2: self.sin2 * factor,
        }
    }

    /// Shortest by longest diameter.
    pub(super) fn axis_ratio(&self) -> f32 {
        let flattening = (self.cos2 * self.cos2 + self.sin2 * self.sin2).sqrt() / self.ring.r;
        ((1.0 - flattening) / (1.0 + flattening)).clamp(0.0, 1.0)
    }
}

/// Factor on the standard errors, found on rendered frames: neighbouring rays have correlated
/// errors.
const SCATTER: f32 = 2.0;
/// Standard errors that more rays do not reduce. `MODEL_*`: pixels, from the square shape of
/// pixels. `LIMB_*`: per pixel by which shading displaced the outline.
const MODEL_CENTRE: f32 = 0.01;
const MODEL_RADIUS: f32 = 0.03;
const LIMB_CENTRE: f32 = 0.5;
const LIMB_RADIUS: f32 = 1.1;

/// Largest number of directions.
const MOST: usize = 256;
/// Reach of the search for edges on either side of the outline, pixels.
const REACH: usize = 4;

/// Number of fits at the full size.
const ROUNDS: usize = 3;

/// The steepest place along each ray.
struct Steepest {
    distance: [f32; MOST],
    weight: [f32; MOST],
}

/// Measures a proven circle on ever finer frames, the finest last; `None` where it gets lost.
#[inline(always)]
pub(super) fn measure<'a>(
    frames: impl Iterator<Item = Gray<'a>>,
    circle: &UnitCircle,
    polar: &mut Polar,
    proof: &Proof,
    noise: f32,
) -> Option<Measured> {
    let mut measured = Measured {
        ring: proof.ring,
        ..Measured::default()
    };
    let mut frames = frames.peekable();
    let mut first = true;
    while let Some(frame) = frames.next() {
        let last = frames.peek().is_none();
        if !first {
            measured.ring = measured.ring.grown(2.0);
        }
        first = false;
        let rays = circle.rays(if last {
            (measured.ring.r * 3.0) as usize
        } else {
            64
        });
        let count = rays.x.len();
        let arc = measured.ring.r * std::f32::consts::TAU / count as f32;
        // Averaged along the outline over a length that grows with the noise.
        let length = noise.clamp(1.0, (0.3 * measured.ring.r).max(1.0));
        let half = ((0.5 * length / arc) as usize).min(8);
        let rounds = if last { ROUNDS } else { 1 };
        for round in 0..rounds {
            let reach = if round == 0 { REACH } else { 3 };
            polar.sample(
                frame,
                rays,
                &measured.ring,
                reach.min(measured.ring.r as usize),
                half,
            );
            let focus = if round == 0 { 4.0 } else { 2.5 };
            let final_round = last && round + 1 == rounds;
            // What noise makes of the slope; while the outline is being sought, the steep parts of
            // it lead.
            let doubtful = if final_round {
                2.0 * noise / ((2 * half + 1) as f32).sqrt()
            } else {
                f32::INFINITY
            };
            let steepest = Steepest::on(polar, proof, focus, doubtful);
            let step = steepest.fit(rays.x, rays.y, focus)?;
            measured.ring.x += step.x;
            measured.ring.y += step.y;
            measured.ring.r += step.r;
            if !(step.x.abs() + step.y.abs() + step.r.abs() < 6.0 && measured.ring.r > 2.0) {
                return None;
            }
            if final_round {
                steepest.errors(
                    rays.x,
                    rays.y,
                    &step,
                    (2 * half + 1) as f32 * arc,
                    arc,
                    &mut measured,
                );
                let limb =
                    limb_shift(frame, rays, polar, &measured.ring, half, noise).unwrap_or_default();
                measured.shift_by(&limb);
            }
        }
    }
    Some(measured)
}

/// Parts of the outline that are looked at on their own.
const SECTORS: usize = 8;
/// Reach of the profile across the outline, pixels.
const PROFILE: usize = 8;

/// Estimates the distance of a shaded ball's outline outside the steepest place.
///
/// A ball that darkens towards its limb has slopes inside of the outline but none outside, and blur
/// moves the steepest place inward. Where the profile of the slope has the half width `w` on the
/// outside, and two half widths inside of its top it is higher than outside by the part `A` of the
/// top, that is by about `w A`: to 4 % of `w`, for shading between none and all, radii of 12 to 100
/// px and blur of 0.6 to 1.8 px.
#[inline(always)]
fn limb_shift(
    frame: Gray<'_>,
    rays: Rays<'_>,
    polar: &mut Polar,
    ring: &Ring,
    half: usize,
    noise: f32,
) -> Option<Ring> {
    let count = rays.x.len();
    polar.sample(frame, rays, ring, PROFILE.min(ring.r as usize), half);
    let steps = polar.steps;
    let middle = steps / 2;
    let mut profiles = [[0.0f32; 2 * PROFILE + 1]; SECTORS];
    let mut used = [0.0f32; SECTORS];
    for ray in 0..count {
        if polar.visible[ray] == 0.0 {
            continue;
        }
        let slope = |step: usize| polar.outward[step * count + ray];
        let top = slope(middle - 1) + slope(middle) + slope(middle + 1);
        let sector = ray * SECTORS / count;
        let sign = 1f32.copysign(top);
        used[sector] += 1.0;
        for (step, sum) in profiles[sector][..steps].iter_mut().enumerate() {
            *sum += sign * slope(step);
        }
    }
    let mut whole = [0.0f32; 2 * PROFILE + 1];
    for profile in &profiles {
        whole
            .iter_mut()
            .zip(profile)
            .for_each(|(sum, part)| *sum += part);
    }
    let visible: f32 = used.iter().sum();
    let common = shift_of(&whole[..steps], 6.0 * noise * visible.sqrt()).unwrap_or(0.0);
    let mut moments = Moments::default();
    for block in 0..count / LANES {
        let sector = block * LANES * SECTORS / count;
        let own = shift_of(
            &profiles[sector][..steps],
            12.0 * noise * used[sector].sqrt(),
        );
        let shift = own.unwrap_or(common);
        let weight = if used[sector] > 0.0 { 1.0 } else { 0.0 };
        let (ux, uy) = (&rays.x.as_chunks().0[block], &rays.y.as_chunks().0[block]);
        moments.add(ux, uy, &[shift; LANES], &[weight; LANES]);
    }
    moments.step()
}

/// Distance of the outline outside the top of a profile; `None` if the top does not exceed `least`.
#[inline(always)]
fn shift_of(profile: &[f32], least: f32) -> Option<f32> {
    let middle = profile.len() / 2;
    let at = (middle.saturating_sub(1)..=middle + 1)
        .max_by(|&a, &b| profile[a].total_cmp(&profile[b]))?;
    let top = profile[at];
    if at < 1 || at + 2 > profile.len() || top <= least {
        return None;
    }
    let (before, behind) = (profile[at - 1], profile[at + 1]);
    let bend = 2.0 * top - before - behind;
    let place = at as f32
        + if bend > 0.0 {
            (0.5 * (behind - before) / bend).clamp(-0.5, 0.5)
        } else {
            0.0
        };
    let value = |place: f32| {
        let place = place.clamp(0.0, (profile.len() - 1) as f32);
        let low = (place as usize).min(profile.len() - 2);
        profile[low] + (profile[low + 1] - profile[low]) * (place - low as f32)
    };
    // The half width on the outside.
    let next = (at + 1..profile.len()).find(|&step| profile[step] < 0.5 * top)?;
    let (high, low) = (profile[next - 1], profile[next]);
    let width = (next - 1) as f32 + (high - 0.5 * top) / (high - low).max(1e-6) - place;
    let excess = (value(place - 2.0 * width) - value(place + 2.0 * width)) / top;
    Some(width * excess.clamp(0.0, 0.5))
}

/// The weight of a slope: proportional to its square far below `doubtful`, close to the slope
/// itself far above.
#[inline(always)]
fn weight_of(slope: f32, doubtful: f32) -> f32 {
    if doubtful.is_finite() {
        slope * slope / (slope + doubtful)
    } else {
        slope * slope
    }
}

impl Steepest {
    #[inline(always)]
    fn on(polar: &Polar, proof: &Proof, focus: f32, doubtful: f32) -> Self {
        let count = polar.rays;
        // Where the proof has an edge only those of its direction count: another outline may be
        // close by.
        let signs: [_; RAYS] = std::array::from_fn(|ray| {
            let bit = |bits: u64| (bits >> ray & 1) as u8;
            let sign = 2.0 * f32::from(bit(proof.brighter)) - 1.0;
            (sign, f32::from(1 - bit(proof.hits)))
        });
        let mut steepest = Self {
            distance: [0.0; MOST],
            weight: [0.0; MOST],
        };
        for block in 0..count.min(MOST) / LANES {
            let (mut best, mut at) = ([0.0f32; LANES], [0i32; LANES]);
            let signs: [_; LANES] =
                std::array::from_fn(|lane| signs[(block * LANES + lane) * RAYS / count]);
            // The slope where it is best, and a step before and behind; all three the same at the
            // ends of the ray.
            let slopes = |step: usize| {
                let row: &[f32; LANES] =
                    &polar.outward[step * count..][..count].as_chunks().0[block];
                let mut slopes = [0.0; LANES];
                for lane in 0..LANES {
                    let (sign, either) = signs[lane];
                    slopes[lane] = (sign * row[lane]).max(either * row[lane].abs());
                }
                slopes
            };
            let first = slopes(0);
            let [mut before, mut here, mut behind] = [first; 3];
            let [mut last, mut now] = [first; 2];
            for step in 0..polar.steps {
                let next = if step + 1 < polar.steps {
                    slopes(step + 1)
                } else {
                    now
                };
                let ends = step == 0 || step + 1 == polar.steps;
                let (earlier, later) = if ends { (&now, &now) } else { (&last, &next) };
                let along: &[f32; LANES] =
                    &polar.along[step * count..][..count].as_chunks().0[block];
                let off = polar.distance(step as f32) / (focus + 1.5);
                let nearness = (1.0 - off * off).max(0.0);
                for lane in 0..LANES {
                    let strength = now[lane] * nearness - 0.5 * along[lane].abs();
                    let better = strength > best[lane];
                    best[lane] = if better { strength } else { best[lane] };
                    at[lane] = if better { step as i32 } else { at[lane] };
                    before[lane] = if better { earlier[lane] } else { before[lane] };
                    here[lane] = if better { now[lane] } else { here[lane] };
                    behind[lane] = if better { later[lane] } else { behind[lane] };
                }
                (last, now) = (now, next);
            }
            let visible: &[f32; LANES] = &polar.visible.as_chunks().0[block];
            for lane in 0..LANES {
                let bend = 2.0 * here[lane] - before[lane] - behind[lane];
                let top = (0.5 * (behind[lane] - before[lane]) / bend).clamp(-0.5, 0.5);
                let place = at[lane] as f32 + if bend > 0.0 { top } else { 0.0 };
                let weight = weight_of(here[lane].min(60.0), doubtful);
                let seen = visible[lane] > 0.0;
                let ray = block * LANES + lane;
                steepest.distance[ray] = if seen { polar.distance(place) } else { 0.0 };
                steepest.weight[ray] = if seen && best[lane] > 0.0 {
                    weight
                } else {
                    0.0
                };
            }
        }
        steepest
    }

    /// The robust step to the best circle.
    #[inline(always)]
    fn fit(&self, ux: &[f32], uy: &[f32], focus: f32) -> Option<Ring> {
        let mut step = Ring::default();
        for focus in [focus, 0.7 * focus, 0.5 * focus, 0.5 * focus] {
            let mut moments = Moments::default();
            for block in 0..ux.len() / LANES {
                let ux = &ux.as_chunks::<LANES>().0[block];
                let uy = &uy.as_chunks::<LANES>().0[block];
                let distance = &self.distance.as_chunks::<LANES>().0[block];
                let slope = &self.weight.as_chunks::<LANES>().0[block];
                let mut weight = [0.0; LANES];
                for lane in 0..LANES {
                    let off =
                        (distance[lane] - step.r - step.x * ux[lane] - step.y * uy[lane]) / focus;
                    let within = (1.0 - off * off).max(0.0);
                    weight[lane] = slope[lane] * within * within;
                }
                moments.add(ux, uy, distance, &weight);
            }
            step = moments.step()?;
        }
        Some(step)
    }

    /// The scatter about the circle after `step`, and what it means.
    #[inline(always)]
    fn errors(
        &self,
        ux: &[f32],
        uy: &[f32],
        step: &Ring,
        averaged: f32,
        arc: f32,
        measured: &mut Measured,
    ) {
        let (mut sum, mut squares, mut weights) = (0.0, 0.0, 0.0);
        let (mut cos2, mut sin2, mut oval) = (0.0, 0.0, 0.0);
        for ray in 0..ux.len() {
            let off = self.distance[ray] - step.r - step.x * ux[ray] - step.y * uy[ray];
            let within = (1.0 - (off / 1.5) * (off / 1.5)).max(0.0);
            let weight = self.weight[ray] * within * within;
            // The oval is sought farther off: it is what makes the outline leave the circle.
            let loose = self.weight[ray] * f32::from(u8::from(off.abs() < 2.5));
            oval += loose;
            cos2 += loose * off * (ux[ray] * ux[ray] - uy[ray] * uy[ray]);
            sin2 += loose * off * (2.0 * ux[ray] * uy[ray]);
            sum += weight;
            squares += weight * off * off;
            weights += weight * weight;
        }
        if sum <= 0.0 {
            return;
        }
        let scatter = (squares / sum).sqrt();
        // Neighbouring rays share pixels: so many of them are worth one.
        let shared = (averaged.max(1.5) / arc).max(1.0);
        let effective = (sum * sum / weights / shared).max(3.0);
        measured.radius_error = scatter / effective.sqrt();
        measured.centre_error = scatter * (2.0 / effective).sqrt();
        (measured.cos2, measured.sin2) = (2.0 * cos2 / oval, 2.0 * sin2 / oval);
    }
}
