//! Surfaces: a repeating fine texture, and its sampling along image rows.

use rand::{Rng, RngExt};

/// A square repeating texture with coarser copies of itself, values 0..=255 with mean 128.
///
/// One byte a texel: what counts is how much memory a frame has to touch.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    /// Texels per metre of the finest level.
    per_metre: f64,
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    /// Logarithm of the side.
    bits: u32,
    /// Row after row; each row, and the whole, goes on with a copy of its beginning, so that neighbours need no wrap.
    texels: Vec<u8>,
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
            let at = |u: usize, v: usize| values[(v % n) * n + u % n].round() as u8;
            let texels = (0..=n)
                .flat_map(|v| (0..=n).map(move |u| (u, v)))
                .map(|(u, v)| at(u, v))
                .collect();
            levels.push(Level { bits, texels });
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
    /// Every second entry is the mean of its neighbours: with the level chosen for the pixels' size nothing visible is lost.
    pub(super) fn walk(
        &self,
        index: usize,
        from: (f64, f64),
        step: (f64, f64),
        strength: f32,
        row: &mut [f32],
    ) {
        let level = &self.levels[index];
        let scale = self.per_metre / (1_u64 << index) as f64 * 65536.0;
        // 16.16 fixed point; the texture repeats, so the wrap of the integers does no harm.
        let fixed = |metres: f64| (metres * scale) as i64 as u32;
        let (mut u, mut v) = (fixed(from.0), fixed(from.1));
        let (du, dv) = (fixed(2.0 * step.0), fixed(2.0 * step.1));
        let (mask, bits) = ((1_u32 << level.bits) - 1, level.bits);
        let (gain, base) = (strength / (128.0 * 256.0), 1.0 - strength);
        let (texels, line) = (level.texels.as_slice(), (1_usize << bits) + 1);
        let pair = |at: usize| {
            texels
                .get(at..at + 2)
                .map_or(0, |p| u32::from(p[0]) | u32::from(p[1]) << 8)
        };
        let mut sample = || {
            let at = ((v >> 16) & mask) as usize * line + ((u >> 16) & mask) as usize;
            let word = pair(at) | pair(at + line) << 16;
            let (fu, fv) = ((u >> 8) & 255, (v >> 8) & 255);
            let across =
                (((word & 0x00ff_00ff) * (256 - fu) + ((word >> 8) & 0x00ff_00ff) * fu) >> 8) & 0x00ff_00ff;
            let value = (across & 255) * (256 - fv) + (across >> 16) * fv;
            u = u.wrapping_add(du);
            v = v.wrapping_add(dv);
            base + gain * value as i32 as f32
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
