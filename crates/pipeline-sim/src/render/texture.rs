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
    /// At every half texel: interpolated beforehand, so that to sample is to take the nearest. In tiles of 8 by 8, each a line of the
    /// processor's cache, and these in blocks of 8 by 8, each a page of memory: a walk in any direction meets few of either.
    values: Vec<u8>,
}

/// Bits of a coordinate behind the point.
const FRACTION: u32 = 16;
/// Least logarithm of a level's side in half texels: that of a block.
const BLOCK_BITS: u32 = 6;

/// Where a level of 2^`bits` half texels has the one at (u, v), modulo its side.
#[inline(always)]
fn place(u: u32, v: u32, bits: u32) -> u32 {
    let blocks = (1 << (bits - BLOCK_BITS)) - 1;
    let spread = |c: u32| c & 7 | (c >> 3 & 7) << 6;
    let block = |c: u32| c >> BLOCK_BITS & blocks;
    spread(u) | spread(v) << 3 | block(u) << 12 | block(v) << (BLOCK_BITS + bits)
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
        for bits in (BLOCK_BITS - 1..=FINEST_BITS).rev() {
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

    /// Samples along an image row from column `x0` on, one for each entry of `row`, scaled so that the mean is 1 and one standard deviation
    /// about `strength` / 3.2. `place` tells where on the surface a column lies (metres); it is asked at multiples of [`STRIDE`], with
    /// straight lines between, so that what lies between is the same in all rows.
    ///
    /// A sample is the nearest of the level's values, at most a quarter of a texel away along either axis. Every odd column is the mean of
    /// its neighbours: with the level chosen for the pixels' size nothing visible is lost.
    #[inline(always)]
    pub(super) fn walk(
        &self,
        index: usize,
        place_of: impl Fn(usize) -> (f64, f64),
        strength: f32,
        x0: usize,
        row: &mut [f32],
    ) {
        let Level { bits, values } = &self.levels[index];
        let scale = 2.0 * self.per_metre / (1_u64 << index) as f64 * f64::from(1 << FRACTION);
        // Whole numbers have their place at the low end of a number that is this large; and half a step more, to round. The texture repeats,
        // so the wrap does no harm.
        const LARGE: f64 = 6_755_399_441_055_744.0 + (1 << (FRACTION - 1)) as f64;
        let fixed = |metres: f64| (metres * scale + LARGE).to_bits() as u32;
        let (gain, base) = (strength / 128.0, 1.0 - strength);
        let value = |byte: u8| base + gain * f32::from(byte);
        // Places of a stretch first, then its values, then their means: each can be done to several at once, or, the values, be waited for
        // several at once.
        let mut places = [0_u32; STRETCH / 2 + 1];
        let mut found = [0_u8; STRETCH / 2 + 1];
        let end = x0 + row.len();
        let mut rest = row;
        for left in (x0 / STRETCH * STRETCH..end).step_by(STRETCH) {
            let (from, to) = (x0.max(left) - left, end.min(left + STRETCH) - left);
            let node = |k: usize| {
                let (u, v) = place_of(left + k * STRIDE);
                (fixed(u), fixed(v))
            };
            let (first, last) = (from / STRIDE, to.div_ceil(STRIDE));
            let mut here = node(first);
            let strides = places.as_chunks_mut::<{ STRIDE / 2 }>().0;
            for (k, stride) in strides[first..last].iter_mut().enumerate() {
                let next = node(first + k + 1);
                let at = |here: u32, next: u32, k: u32| {
                    let way = next.wrapping_sub(here) as i32;
                    here.wrapping_add((way / (STRIDE / 2) as i32).wrapping_mul(k as i32) as u32)
                };
                for (place_at, k) in stride.iter_mut().zip(0_u32..) {
                    let (u, v) = (at(here.0, next.0, k), at(here.1, next.1, k));
                    *place_at = place(u >> FRACTION, v >> FRACTION, *bits);
                }
                here = next;
            }
            places[last * STRIDE / 2] = place(here.0 >> FRACTION, here.1 >> FRACTION, *bits);
            let needed = from / 2..to / 2 + 1;
            for (found, at) in found[needed.clone()].iter_mut().zip(&places[needed.clone()]) {
                *found = values.get(*at as usize).copied().unwrap_or(128);
            }
            let (part, further) = std::mem::take(&mut rest).split_at_mut(to - from);
            rest = further;
            let mean = |k: usize| 0.5 * (value(found[k]) + value(found[k + 1]));
            let (head, part) = part.split_at_mut(from % 2);
            if let [head] = head {
                *head = mean(needed.start);
            }
            let (pairs, tail) = part.as_chunks_mut::<2>();
            for (pair, two) in pairs.iter_mut().zip(found[from.div_ceil(2)..].windows(2)) {
                let (here, next) = (value(two[0]), value(two[1]));
                *pair = [here, 0.5 * (here + next)];
            }
            if let [tail] = tail {
                *tail = value(found[to / 2]);
            }
        }
    }
}

/// Columns between two at which the place on a surface is worked out exactly.
const STRIDE: usize = 16;
/// Columns that are worked on at a time.
const STRETCH: usize = 8 * STRIDE;

/// A repeating square of `n` by `n` values, interpolated at its texels and half way between them, in the order of [`place`].
fn at_half_texels(values: &[f32], n: usize) -> Vec<u8> {
    let bits = (2 * n).ilog2();
    let mut finer = vec![0; 4 * n * n];
    for v in 0..n {
        let (here, below) = (&values[v * n..][..n], &values[(v + 1) % n * n..][..n]);
        let mut line = |row: usize, at: &dyn Fn(usize) -> f32| {
            for u in 0..n {
                let (left, right) = (at(u), at((u + 1) % n));
                // The sums are positive: adding a half and cutting off rounds.
                for (column, value) in [(2 * u, left), (2 * u + 1, 0.5 * (left + right))] {
                    finer[place(column as u32, row as u32, bits) as usize] = (value + 0.5) as u8;
                }
            }
        };
        line(2 * v, &|u| here[u]);
        line(2 * v + 1, &|u| 0.5 * (here[u] + below[u]));
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
            let place = |x: usize| {
                (
                    start.0 - 0.2 + step.0 * x as f64,
                    start.1 + 0.2 + step.1 * x as f64,
                )
            };
            texture.walk(0, place, 1.0, 0, &mut row);
            // A walk that begins elsewhere meets the same.
            for x0 in [1, 7, 16, 130, 3990] {
                let mut later = vec![0.0_f32; 4001 - x0];
                texture.walk(0, place, 1.0, x0, &mut later);
                assert_eq!(later, row[x0..], "{x0}");
            }
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
