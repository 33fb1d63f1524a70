//! Surfaces: a repeating fine texture, and its sampling along image rows.

use rand::{Rng, RngExt};

/// A square repeating texture with coarser copies of itself, values 0..=255 with mean 128.
///
/// One byte a value: how much memory a frame touches counts as much as what is worked out.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    /// Texels per metre of the finest level.
    per_metre: f64,
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    /// Logarithm of the side in half texels.
    bits: u32,
    /// Row after row, at every half texel: interpolated beforehand, so that to sample is to take the nearest.
    values: Vec<u8>,
}

const FINEST_BITS: u32 = 10;

impl Texture {
    /// A wooden surface: grain along u, pores, specks and a few scratches. `size` metres repeat.
    pub(super) fn wood<R: Rng + ?Sized>(size: f64, rng: &mut R) -> Self {
        let n = 1_usize << FINEST_BITS;
        let mut values = vec![0.0_f32; n * n];
        // Octaves of periodic noise, stretched along the grain.
        for (cells_u, cells_v, strength) in [
            (4, 24, 1.0),
            (6, 64, 0.8),
            (12, 160, 0.6),
            (40, 340, 0.5),
            (16, 16, 0.5),
            (128, 256, 0.35),
            (340, 340, 0.35),
        ] {
            add_noise(&mut values, n, cells_u, cells_v, strength, rng);
        }
        for _ in 0..900 {
            let (u, v) = (rng.random_range(0..n), rng.random_range(0..n));
            let (length, depth) = (rng.random_range(3..28), rng.random_range(0.3_f32..1.6));
            for k in 0..length {
                values[v * n + (u + k) % n] -= depth;
            }
        }
        for _ in 0..14 {
            let (mut u, mut v) = (rng.random_range(0.0..n as f32), rng.random_range(0.0..n as f32));
            let angle = rng.random_range(0.0_f32..std::f32::consts::TAU);
            let (du, dv) = (angle.cos(), angle.sin());
            let tone = rng.random_range(-1.5_f32..2.5);
            for _ in 0..rng.random_range(60..420) {
                u = (u + du).rem_euclid(n as f32);
                v = (v + dv).rem_euclid(n as f32);
                values[(v as usize % n) * n + u as usize % n] += tone;
            }
        }
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / values.len() as f32).sqrt();
        for value in &mut values {
            *value = (128.0 + 40.0 * (*value - mean) / deviation).clamp(0.0, 255.0);
        }
        Self::from_values(values, n as f64 / size)
    }

    fn from_values(mut values: Vec<f32>, per_metre: f64) -> Self {
        let mut levels = Vec::new();
        for bits in (3..=FINEST_BITS).rev() {
            let n = 1_usize << bits;
            levels.push(Level {
                bits: bits + 1,
                values: at_half_texels(&values, n),
            });
            let half = n / 2;
            values = (0..half * half)
                .map(|i| {
                    let (u, v) = (2 * (i % half), 2 * (i / half));
                    0.25 * (values[v * n + u]
                        + values[v * n + u + 1]
                        + values[(v + 1) * n + u]
                        + values[(v + 1) * n + u + 1])
                })
                .collect();
        }
        Self { per_metre, levels }
    }

    /// The level whose texels are about as large as the pixels' footprint of `metres`.
    pub(super) fn level(&self, metres: f64) -> usize {
        let texels = (metres * self.per_metre).max(1e-6);
        // Half a level sharper than one texel per pixel: bilinear sampling blurs enough.
        let level = (texels.log2() + 0.2).round();
        if level.is_nan() {
            0
        } else {
            level.clamp(0.0, self.levels.len() as f64 - 1.0) as usize
        }
    }

    /// Samples from `from` on in steps of `step` (metres per entry), one for each entry of `row`, scaled so that the mean is 1 and one
    /// standard deviation about `strength` / 3.2.
    ///
    /// A sample is the nearest of the level's values, at most a quarter of a texel away along either axis. Every second entry is the mean of
    /// its neighbours: with the level chosen for the pixels' size nothing visible is lost.
    pub(super) fn walk(
        &self,
        index: usize,
        from: (f64, f64),
        step: (f64, f64),
        strength: f32,
        row: &mut [f32],
    ) {
        let level = &self.levels[index];
        let scale = 2.0 * self.per_metre / (1_u64 << index) as f64 * 65536.0;
        // 16.16 fixed point; the texture repeats, so the wrap of the integers does no harm.
        let fixed = |metres: f64| (metres * scale) as i64 as u32;
        let half = 1 << 15;
        let (mut u, mut v) = (fixed(from.0).wrapping_add(half), fixed(from.1).wrapping_add(half));
        let (du, dv) = (fixed(2.0 * step.0), fixed(2.0 * step.1));
        let bits = level.bits;
        let (columns, rows) = ((1_u32 << bits) - 1, ((1_u32 << bits) - 1) << bits);
        let (gain, base) = (strength / 128.0, 1.0 - strength);
        let values = level.values.as_slice();
        let mut sample = || {
            let at = (v >> (16 - bits) & rows) | (u >> 16 & columns);
            let value = values.get(at as usize).copied().unwrap_or(128);
            u = u.wrapping_add(du);
            v = v.wrapping_add(dv);
            base + gain * f32::from(value)
        };
        let mut here = sample();
        let mut pairs = row.chunks_exact_mut(2);
        for pair in &mut pairs {
            let next = sample();
            pair[0] = here;
            pair[1] = 0.5 * (here + next);
            here = next;
        }
        if let [last] = pairs.into_remainder() {
            *last = here;
        }
    }
}

/// A repeating square of `n` by `n` values, interpolated at its texels and half way between them.
fn at_half_texels(values: &[f32], n: usize) -> Vec<u8> {
    let mut finer = Vec::with_capacity(4 * n * n);
    for v in 0..n {
        let (here, below) = (&values[v * n..][..n], &values[(v + 1) % n * n..][..n]);
        let mut line = |at: &dyn Fn(usize) -> f32| {
            finer.extend((0..n).flat_map(|u| {
                let (left, right) = (at(u), at((u + 1) % n));
                // The sums are positive: adding a half and cutting off rounds.
                [(left + 0.5) as u8, (0.5 * (left + right) + 0.5) as u8]
            }));
        };
        line(&|u| here[u]);
        line(&|u| 0.5 * (here[u] + below[u]));
    }
    finer
}

/// Adds smooth periodic noise with the given number of cells along each side.
fn add_noise<R: Rng + ?Sized>(
    values: &mut [f32],
    n: usize,
    cells_u: usize,
    cells_v: usize,
    strength: f32,
    rng: &mut R,
) {
    let lattice: Vec<f32> = (0..cells_u * cells_v)
        .map(|_| rng.random_range(-1.0_f32..1.0))
        .collect();
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    for v in 0..n {
        let y = v as f32 * cells_v as f32 / n as f32;
        let (j, fy) = (y as usize, smooth(y.fract()));
        let (top, bottom) = (j % cells_v * cells_u, (j + 1) % cells_v * cells_u);
        for u in 0..n {
            let x = u as f32 * cells_u as f32 / n as f32;
            let (i, fx) = (x as usize, smooth(x.fract()));
            let (left, right) = (i % cells_u, (i + 1) % cells_u);
            let upper = lattice[top + left] + (lattice[top + right] - lattice[top + left]) * fx;
            let lower = lattice[bottom + left] + (lattice[bottom + right] - lattice[bottom + left]) * fx;
            values[v * n + u] += strength * (upper + (lower - upper) * fy);
        }
    }
}

/// A coarse map of factors over a square part of the table, for what changes slowly: stains, light, shadows of things.
#[derive(Clone, Debug)]
pub(super) struct CoarseMap {
    pub(super) side: usize,
    pub(super) corner: (f64, f64),
    pub(super) size: f64,
    pub(super) values: Vec<f32>,
}

impl CoarseMap {
    /// Slow stains of the given strength around 1.
    pub(super) fn stains<R: Rng + ?Sized>(
        side: usize,
        corner: (f64, f64),
        size: f64,
        strength: f32,
        rng: &mut R,
    ) -> Self {
        let mut values = vec![1.0; side * side];
        for (cells, share) in [(7, 0.5), (17, 0.3), (41, 0.2)] {
            add_noise(&mut values, side, cells, cells, strength * share, rng);
        }
        Self {
            side,
            corner,
            size,
            values,
        }
    }

    /// Place of entry (i, j), metres.
    pub(super) fn place(&self, i: usize, j: usize) -> (f64, f64) {
        let step = self.size / (self.side - 1) as f64;
        (self.corner.0 + i as f64 * step, self.corner.1 + j as f64 * step)
    }

    /// Columns and rows of the entries within `reach` of (x, y) along each axis.
    pub(super) fn range(
        &self,
        x: f64,
        y: f64,
        reach: f64,
    ) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let scale = (self.side - 1) as f64 / self.size;
        let range = |middle: f64, corner: f64| {
            let low = ((middle - reach - corner) * scale).ceil().max(0.0) as usize;
            let high = ((middle + reach - corner) * scale).floor().max(-1.0) + 1.0;
            low..(high as usize).min(self.side)
        };
        (range(x, self.corner.0), range(y, self.corner.1))
    }

    /// Bilinear value; outside the map that of its border.
    pub(super) fn at(&self, u: f64, v: f64) -> f32 {
        let scale = (self.side - 1) as f64 / self.size;
        let limit = (self.side - 1) as f64 - 1e-6;
        let (x, y) = (
            ((u - self.corner.0) * scale).clamp(0.0, limit),
            ((v - self.corner.1) * scale).clamp(0.0, limit),
        );
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let k = j * self.side + i;
        let (a, b, c, d) = (
            self.values[k],
            self.values[k + 1],
            self.values[k + self.side],
            self.values[k + self.side + 1],
        );
        let (upper, lower) = (a + (b - a) * fx, c + (d - c) * fx);
        upper + (lower - upper) * fy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    #[test]
    fn a_walk_meets_each_texel_and_the_means_between_them() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let n = 1_usize << FINEST_BITS;
        let texels: Vec<f32> = (0..n * n).map(|_| rng.random_range(0_u8..=255).into()).collect();
        // A texel is a metre, and a half texel one step; the walk goes round the texture's border along both axes.
        let texture = Texture::from_values(texels.clone(), 1.0);
        let texel = |u: i64, v: i64| {
            let wrap = |k: i64| k.rem_euclid(n as i64) as usize;
            texels[wrap(v) * n + wrap(u)]
        };
        let mut row = vec![0.0_f32; 4001];
        for (start, step) in [
            ((-5.0, 7.0), (0.25, 0.0)),
            ((3.0, -9.0), (0.0, 0.25)),
            ((-5.0, -9.0), (0.25, 0.25)),
        ] {
            // Not quite there: what is met is the nearest.
            texture.walk(0, (start.0 - 0.2, start.1 + 0.2), step, 1.0, &mut row);
            for k in (0..4001_i64).step_by(2) {
                let (u, v) = (start.0 + step.0 * k as f64, start.1 + step.1 * k as f64);
                let (i, j) = (u.floor(), v.floor());
                let (right, down) = (i64::from(u > i), i64::from(v > j));
                let (i, j) = (i as i64, j as i64);
                let mean = 0.25
                    * (texel(i, j) + texel(i + right, j) + texel(i, j + down) + texel(i + right, j + down));
                let error = 128.0 * row[k as usize] - mean;
                assert!(error.abs() <= 0.51, "{u} {v}: {error}");
            }
        }
    }
}
