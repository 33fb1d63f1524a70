//! Surfaces: a repeating fine texture, and its sampling along image rows.

use std::ops::Range;

use rand::{Rng, RngExt};

/// A square repeating texture with coarser copies of itself, values 0..=255 with mean 128.
///
/// One byte a value, because memory traffic costs as much time as arithmetic.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    /// Texels per metre of the finest level.
    per_metre: f64,
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    /// Logarithm of the side in texels.
    bits: u32,
    /// Strips of 64 columns. Each row also holds the first columns of the next strip, and the first
    /// row is repeated below the last, so that the neighbours of a texel lie at fixed offsets and a
    /// walk in any direction touches few pages of memory.
    values: Vec<u8>,
}

/// Columns of a strip, and the length of its row in memory, texels.
const STRIP: u32 = 64;
const PITCH: u32 = STRIP + 8;
/// Flags of a place that is half a texel further along u, along v.
const HALF_U: u32 = 1 << 31;
const HALF_V: u32 = 1 << 30;

impl Level {
    fn new(values: &[f32], bits: u32) -> Self {
        let n = 1_usize << bits;
        let (strip, pitch) = (STRIP as usize, PITCH as usize);
        let strips = n.div_ceil(strip);
        let mut bytes = Vec::with_capacity(strips * (n + 1) * pitch);
        for left in (0..n).step_by(strip) {
            for v in 0..=n {
                let row = &values[v % n * n..][..n];
                bytes.extend((left..left + pitch).map(|u| (row[u % n] + 0.5) as u8));
            }
        }
        Self {
            bits,
            values: bytes,
        }
    }

    /// Returns the index of the texel at (u, v), which are in 2^32ths of the side, and in the bits
    /// [`HALF_U`] and [`HALF_V`] the half of it that they lie in.
    #[inline(always)]
    fn place(u: u32, v: u32, bits: u32) -> u32 {
        let (column, row) = (u >> (32 - bits), v >> (32 - bits));
        let size = ((1 << bits) + 1) * PITCH;
        let halves = ((u << bits) & HALF_U) | ((v << bits >> 1) & HALF_V);
        (row * PITCH + (column & (STRIP - 1)) + (column / STRIP) * size) | halves
    }

    /// Returns the texel at a place, and the next along u, along v, and along both: a byte each,
    /// the lowest first.
    #[inline(always)]
    fn four(values: &[u8], place: u32) -> u32 {
        const AROUND: usize = PITCH as usize + 2;
        let Some(last) = values.len().checked_sub(AROUND) else {
            return 0;
        };
        let at = ((place & !(HALF_U | HALF_V)) as usize).min(last);
        let v = &values[at..at + AROUND];
        u32::from_le_bytes([v[0], v[1], v[AROUND - 2], v[AROUND - 1]])
    }
}

/// Returns four times the value at a place between the texels of [`Level::four`].
#[inline(always)]
fn sum(four: u32, place: u32) -> u32 {
    let (left, right) = (four & 0x00ff_00ff, four >> 8 & 0x00ff_00ff);
    let rows = left + if place & HALF_U == 0 { left } else { right };
    let (upper, lower) = (rows & 0xffff, rows >> 16);
    upper + if place & HALF_V == 0 { upper } else { lower }
}

const FINEST_BITS: u32 = 10;
const COARSEST_BITS: u32 = 5;

impl Texture {
    /// Creates a wooden surface: grain along u, pores, specks and a few scratches. `size` metres
    /// repeat.
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
            let mut u = rng.random_range(0.0..n as f32);
            let mut v = rng.random_range(0.0..n as f32);
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
        let squares = values.iter().map(|v| (v - mean).powi(2));
        let deviation = (squares.sum::<f32>() / values.len() as f32).sqrt();
        for value in &mut values {
            *value = (128.0 + 40.0 * (*value - mean) / deviation).clamp(0.0, 255.0);
        }
        Self::from_values(values, n as f64 / size)
    }

    fn from_values(mut values: Vec<f32>, per_metre: f64) -> Self {
        let mut levels = Vec::new();
        for bits in (COARSEST_BITS..=FINEST_BITS).rev() {
            let n = 1_usize << bits;
            levels.push(Level::new(&values, bits));
            let half = n / 2;
            let mean = |i: usize| {
                let k = 2 * (i / half) * n + 2 * (i % half);
                0.25 * (values[k] + values[k + 1] + values[k + n] + values[k + n + 1])
            };
            values = (0..half * half).map(mean).collect();
        }
        Self { per_metre, levels }
    }

    /// Returns the level whose texels are about as large as the pixels' footprint of `metres`.
    pub(super) fn level(&self, metres: f64) -> usize {
        let texels = (metres * self.per_metre).max(1e-6);
        // Half a level sharper than one texel per pixel: bilinear sampling blurs enough. NaN is 0.
        let level = (texels.log2() + 0.2).round();
        level.clamp(0.0, self.levels.len() as f64 - 1.0) as usize
    }

    /// Samples along an image row from column `x0` on, one for each entry of `row`, scaled so that
    /// the mean is 1 and one standard deviation about `strength` / 3.2. `place` returns the place
    /// of a column on the surface (metres); it is called at multiples of [`STRIDE`] and
    /// interpolated linearly between.
    ///
    /// A sample is the nearest of the level's values, at most a quarter of a texel away along
    /// either axis. Every odd column is the mean of its neighbours.
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
        let bits = *bits;
        // A side is 2^32, so that wrapping repeats the texture.
        let scale = self.per_metre / f64::from(1 << FINEST_BITS) * TURN;
        // Rounds to the nearest half texel.
        let quarter = 1_u32 << (30 - bits);
        let (gain, base) = (strength / 512.0, 1.0 - strength);
        // Places, then values, then means, so that each loop vectorizes and loads overlap.
        let mut places = [0_u32; STRETCH / 2 + STRIDE / 2];
        let mut fours = [0_u32; STRETCH / 2 + STRIDE / 2];
        let mut found = [0.0_f32; STRETCH / 2 + STRIDE / 2];
        let end = x0 + row.len();
        let mut rest = row;
        for left in (x0 / STRETCH * STRETCH..end).step_by(STRETCH) {
            let (from, to) = (x0.max(left) - left, end.min(left + STRETCH) - left);
            let node = |k: usize| {
                let (u, v) = place_of(left + k * STRIDE);
                (u * scale, v * scale)
            };
            let (first, last) = (from / STRIDE, to / STRIDE);
            let mut here = node(first);
            let strides = places.as_chunks_mut::<{ STRIDE / 2 }>().0;
            for (stride, k) in strides[first..=last].iter_mut().zip(first + 1..) {
                let next = node(k);
                let way = |here: f64, next: f64| fixed((next - here) / (STRIDE / 2) as f64);
                let (u, du) = (fixed(here.0).wrapping_add(quarter), way(here.0, next.0));
                let (v, dv) = (fixed(here.1).wrapping_add(quarter), way(here.1, next.1));
                for (place, k) in stride.iter_mut().zip(0_u32..) {
                    let at = |start: u32, step: u32| start.wrapping_add(step.wrapping_mul(k));
                    *place = Level::place(at(u, du), at(v, dv), bits);
                }
                here = next;
            }
            let needed = from / 2..to / 2 + 1;
            let places = &places[needed.clone()];
            for (four, place) in fours[needed.clone()].iter_mut().zip(places) {
                *four = Level::four(values, *place);
            }
            let between = fours[needed.clone()].iter().zip(places);
            for (found, (four, place)) in found[needed.clone()].iter_mut().zip(between) {
                *found = base + gain * sum(*four, *place) as f32;
            }
            let (part, further) = std::mem::take(&mut rest).split_at_mut(to - from);
            rest = further;
            let mean = |k: usize| 0.5 * (found[k] + found[k + 1]);
            let (head, part) = part.split_at_mut(from % 2);
            if let [head] = head {
                *head = mean(needed.start);
            }
            let (pairs, tail) = part.as_chunks_mut::<2>();
            for (pair, two) in pairs.iter_mut().zip(found[from.div_ceil(2)..].windows(2)) {
                *pair = [two[0], 0.5 * (two[0] + two[1])];
            }
            if let [tail] = tail {
                *tail = found[to / 2];
            }
        }
    }
}

/// 2^32.
const TURN: f64 = 4_294_967_296.0;

/// Returns the nearest whole number, modulo 2^32.
#[inline(always)]
fn fixed(value: f64) -> u32 {
    // Adding 2^52 leaves the whole number in the low bits.
    const LARGE: f64 = 6_755_399_441_055_744.0;
    (value + LARGE).to_bits() as u32
}

/// Columns between two at which the place on a surface is worked out exactly.
const STRIDE: usize = 16;
/// Columns that are worked on at a time.
const STRETCH: usize = 8 * STRIDE;

/// Adds smooth periodic noise with the given number of cells along each side.
fn add_noise<R: Rng + ?Sized>(
    values: &mut [f32],
    n: usize,
    cells_u: usize,
    cells_v: usize,
    strength: f32,
    rng: &mut R,
) {
    let cells = 0..cells_u * cells_v;
    let lattice: Vec<f32> = cells.map(|_| rng.random_range(-1.0..1.0)).collect();
    // The cell before a place, the next one, and how far the place is between them.
    let between = |place: usize, cells: usize| {
        let at = place as f32 * cells as f32 / n as f32;
        let (cell, t) = (at as usize, at.fract());
        (cell % cells, (cell + 1) % cells, t * t * (3.0 - 2.0 * t))
    };
    let columns: Vec<_> = (0..n).map(|u| between(u, cells_u)).collect();
    for (v, row) in values.chunks_exact_mut(n).enumerate() {
        let (top, bottom, fy) = between(v, cells_v);
        let line = |cell: usize| &lattice[cell * cells_u..][..cells_u];
        let (top, bottom) = (line(top), line(bottom));
        for (value, (left, right, fx)) in row.iter_mut().zip(&columns) {
            let across = |row: &[f32]| row[*left] + (row[*right] - row[*left]) * fx;
            let (upper, lower) = (across(top), across(bottom));
            *value += strength * (upper + (lower - upper) * fy);
        }
    }
}

/// A coarse map of factors over a square part of the table: stains, light, shadows of things.
#[derive(Clone, Debug)]
pub(super) struct CoarseMap {
    pub(super) side: usize,
    pub(super) corner: (f64, f64),
    pub(super) size: f64,
    pub(super) values: Vec<f32>,
}

impl CoarseMap {
    /// Creates slow stains of the given strength around 1.
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

    /// Returns the position on the table of the entry in column `i` and row `j`, metres.
    pub(super) fn place(&self, i: usize, j: usize) -> (f64, f64) {
        let (step, (x, y)) = (self.size / (self.side - 1) as f64, self.corner);
        (x + i as f64 * step, y + j as f64 * step)
    }

    /// Returns columns and rows of the entries within `reach` of (x, y) along each axis.
    pub(super) fn range(&self, x: f64, y: f64, reach: f64) -> [Range<usize>; 2] {
        let scale = (self.side - 1) as f64 / self.size;
        [(x, self.corner.0), (y, self.corner.1)].map(|(middle, corner)| {
            let low = ((middle - reach - corner) * scale).ceil().max(0.0) as usize;
            let high = ((middle + reach - corner) * scale).floor().max(-1.0) + 1.0;
            low..(high as usize).min(self.side)
        })
    }

    /// Writes bilinear values; outside the map those of its border.
    #[inline(always)]
    pub(super) fn at(&self, x: &[f32], y: &[f32], values: &mut [f32]) {
        let scale = ((self.side - 1) as f64 / self.size) as f32;
        let (left, top) = (self.corner.0 as f32, self.corner.1 as f32);
        let limit = (self.side - 1) as f32 - 1e-3;
        for ((value, x), y) in values.iter_mut().zip(x).zip(y) {
            // In this order NaN is on the border as well.
            let x = ((x - left) * scale).max(0.0).min(limit);
            let y = ((y - top) * scale).max(0.0).min(limit);
            let (i, j) = (x as u32, y as u32);
            let (fx, fy) = (x - i as f32, y - j as f32);
            let k = j as usize * self.side + i as usize;
            let two = |k: usize| self.values.get(k..k + 2).map_or([0.0; 2], |v| [v[0], v[1]]);
            let ([a, b], [c, d]) = (two(k), two(k + self.side));
            let (upper, lower) = (a + (b - a) * fx, c + (d - c) * fx);
            *value = upper + (lower - upper) * fy;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    #[test]
    fn walk_meets_each_texel_and_the_means_between() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let n = 1_usize << FINEST_BITS;
        let texels: Vec<f32> = (0..n * n)
            .map(|_| rng.random_range(0_u8..=255).into())
            .collect();
        // A texel is a metre, a half texel one step; the walk crosses the border along both axes.
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
            let place = |x: usize| {
                (
                    start.0 - 0.2 + step.0 * x as f64,
                    start.1 + 0.2 + step.1 * x as f64,
                )
            };
            texture.walk(0, place, 1.0, 0, &mut row);
            // A walk that begins elsewhere gives equal values.
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
                    * (texel(i, j)
                        + texel(i + right, j)
                        + texel(i, j + down)
                        + texel(i + right, j + down));
                let error = 128.0 * row[k as usize] - mean;
                assert!(error.abs() <= 0.51, "{u} {v}: {error}");
            }
        }
    }
}
