//! Surfaces: a repeating fine texture, and its sampling along image rows.

use rand::{Rng, RngExt};

/// A square repeating texture with coarser copies of itself, values 0..=255 with mean 128.
///
/// Each entry holds four neighbouring values in one word, so that one read serves a bilinear interpolation.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    /// Texels per metre of the finest level.
    per_metre: f64,
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    bits: u32,
    words: Vec<u32>,
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
            let at = |u: usize, v: usize| u32::from(values[(v % n) * n + u % n].round() as u8);
            let words = (0..n * n)
                .map(|i| {
                    let (u, v) = (i % n, i / n);
                    at(u, v) | at(u + 1, v) << 8 | at(u, v + 1) << 16 | at(u + 1, v + 1) << 24
                })
                .collect();
            levels.push(Level { bits, words });
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

    /// Samples between (u0, v0) and (u1, v1) metres, one for each entry of `row` from the start on, scaled so that the mean is 1 and
    /// one standard deviation about `strength` / 3.2.
    pub(super) fn walk(
        &self,
        index: usize,
        from: (f64, f64),
        to: (f64, f64),
        strength: f32,
        row: &mut [f32],
    ) {
        let steps = row.len().max(1) as f64;
        let (du, dv) = ((to.0 - from.0) / steps, (to.1 - from.1) / steps);
        let level = &self.levels[index];
        let scale = self.per_metre / (1_u64 << index) as f64 * 65536.0;
        // 16.16 fixed point; the texture repeats, so the wrap of the integers does no harm.
        let (mut u, mut v) = ((from.0 * scale) as i64 as u32, (from.1 * scale) as i64 as u32);
        let (du, dv) = ((du * scale) as i64 as u32, (dv * scale) as i64 as u32);
        let (mask, bits) = ((1_u32 << level.bits) - 1, level.bits);
        let (gain, base) = (strength / (128.0 * 256.0), 1.0 - strength);
        let words = &level.words[..1_usize << (2 * bits)];
        for value in row {
            let word = words[((((v >> 16) & mask) << bits) | ((u >> 16) & mask)) as usize];
            let (fu, fv) = ((u >> 8) & 255, (v >> 8) & 255);
            let across =
                ((word & 0x00ff_00ff) * (256 - fu) + ((word >> 8) & 0x00ff_00ff) * fu) >> 8 & 0x00ff_00ff;
            let sample = (across & 255) * (256 - fv) + (across >> 16) * fv;
            *value = base + gain * sample as f32;
            u = u.wrapping_add(du);
            v = v.wrapping_add(dv);
        }
    }
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
