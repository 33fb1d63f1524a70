//! The fused passes of Canny's operator over one row after another.
//!
//! Everything is integer arithmetic on short rows that stay in the nearest cache, written as plain
//! loops over slices of one length, which the compiler turns into vector code. The same source is
//! compiled for the baseline of the target and, by [`widest`](super::widest), for wider vectors.
//! The results are the same by construction, and a test compares both with a plain version.

use std::time::Instant;

use super::{EdgeGradient, EdgePixel, Vectorized};
use crate::clock;

/// Gray levels are carried in sixteenths from the smoothing on.
pub(super) const UNITS: f32 = 16.0;
/// The smoothing weights of one direction sum up to this.
pub(super) const WEIGHT_SUM: u16 = 64;
/// The largest reach of the smoothing, pixels to either side.
pub(super) const MAX_REACH: usize = 4;
/// Pixels that are looked at together when maxima are sought.
const BLOCK: usize = 32;
/// `tan(22.5 degrees)` in units of 2^-15: where the sectors of the gradient direction meet.
const TAN_22: i32 = 13573;

/// Parameters of the passes.
#[derive(Clone, Debug)]
pub(super) struct Passes {
    /// Half of the symmetric smoothing kernel: the centre's weight, then outward.
    pub(super) weights: Vec<u16>,
    /// Squared thresholds of the gradient, in units.
    pub(super) low: i32,
    pub(super) high: i32,
}

/// The rows in work, reused from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    /// One row smoothed along the columns, in quarters of a gray level, `reach` pixels wider at
    /// either end.
    across: Vec<u16>,
    /// Three smoothed rows, in units, a pixel wider at either end.
    smooth: [Vec<i16>; 3],
    gradient: [GradientRow; 3],
}

#[derive(Clone, Debug, Default)]
struct GradientRow {
    x: Vec<i16>,
    y: Vec<i16>,
    /// Squared length, if it has been computed.
    square: Vec<i32>,
    /// Set if it has.
    squared: bool,
}

/// A pixel that is a maximum across its edge, and above the low threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) pixel: EdgePixel,
    pub(crate) gradient: EdgeGradient,
}

/// The marks that [`maxima`] leaves in the edge image.
pub(super) const WEAK: u8 = 1;
/// See [`WEAK`].
pub(super) const STRONG: u8 = 2;

/// Lists the candidates of a frame of at least 3x3 pixels row by row, and marks them.
pub(super) struct Finding<'a> {
    pub(super) passes: &'a Passes,
    pub(super) gray: &'a [u8],
    pub(super) width: usize,
    pub(super) rows: &'a mut Rows,
    /// The edge image to mark them in, or empty.
    pub(super) marks: &'a mut [u8],
    pub(super) found: &'a mut Vec<Candidate>,
    /// The time after which none are listed.
    pub(super) deadline: Option<Instant>,
}

impl Vectorized for Finding<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self {
            passes,
            gray,
            width,
            rows,
            marks,
            found,
            deadline,
        } = self;
        let last = gray.len() / width - 1;
        rows.resize(width, passes.weights.len() - 1);
        for y in 0..=last + 1 {
            if y % BLOCK == 0 && clock::is_past(deadline) {
                found.clear();
                return;
            }
            // Row y is smoothed, then row y - 1 differentiated, then the maxima of row y - 2 found.
            if y <= last {
                rows.smooth_row(passes, gray, width, y);
            }
            if y >= 1 {
                let middle = y - 1;
                let (above, below) = (middle.saturating_sub(1), y.min(last));
                let [a, b, c] = [above, middle, below].map(|row| &rows.smooth[row % 3]);
                differentiate(a, b, c, &mut rows.gradient[middle % 3]);
            }
            if y >= 3 {
                let row = y - 2;
                let marks = marks.get_mut(row * width..(row + 1) * width);
                let marks = marks.unwrap_or_default();
                maxima(passes, &mut rows.gradient, (row, width), marks, found);
            }
        }
        if !marks.is_empty() {
            marks[..width].fill(0);
            marks[last * width..].fill(0);
        }
    }
}

impl Rows {
    /// Reserves rows of `width` pixels. What an earlier frame left beyond them is never
    /// looked at in a way that shows.
    fn resize(&mut self, width: usize, reach: usize) {
        // The maxima of a block are sought a pixel farther to the right, and need a pixel beyond.
        let blocks = (width - 2).div_ceil(BLOCK) + 1;
        self.across.resize(width + 2 * reach, 0);
        for row in &mut self.smooth {
            row.resize(width + 2, 0);
        }
        for row in &mut self.gradient {
            row.x.resize(blocks * BLOCK, 0);
            row.y.resize(blocks * BLOCK, 0);
            row.square.resize(blocks * BLOCK, 0);
        }
    }

    #[inline(always)]
    fn smooth_row(&mut self, passes: &Passes, gray: &[u8], width: usize, y: usize) {
        let out = &mut self.smooth[y % 3];
        // The reach as a constant lets the loops unroll.
        match passes.weights[..] {
            [_] => smooth::<0>(passes, gray, width, y, &mut self.across, out),
            [_, _] => smooth::<1>(passes, gray, width, y, &mut self.across, out),
            [_, _, _] => smooth::<2>(passes, gray, width, y, &mut self.across, out),
            [_, _, _, _] => smooth::<3>(passes, gray, width, y, &mut self.across, out),
            _ => smooth::<MAX_REACH>(passes, gray, width, y, &mut self.across, out),
        }
    }
}

/// Smooths row `y`, down the columns and then along the row; pixels beyond the border repeat the
/// border's.
#[inline(always)]
fn smooth<const REACH: usize>(
    passes: &Passes,
    gray: &[u8],
    width: usize,
    y: usize,
    across: &mut [u16],
    out: &mut [i16],
) {
    let weights = &passes.weights[..=REACH];
    let last = gray.len() / width - 1;
    let row = |y: usize| &gray[y * width..][..width];
    let centre = row(y);
    let above: [&[u8]; REACH] = std::array::from_fn(|k| row(y.saturating_sub(k + 1)));
    let below: [&[u8]; REACH] = std::array::from_fn(|k| row((y + k + 1).min(last)));
    {
        let down = &mut across[REACH..][..width];
        for x in 0..width {
            let mut sum = u16::from(centre[x]) * weights[0];
            for k in 0..REACH {
                sum += (u16::from(above[k][x]) + u16::from(below[k][x])) * weights[k + 1];
            }
            // 14 bits to 10: a sum of weights of 64 then just fits again.
            down[x] = (sum + 8) >> 4;
        }
    }
    let (first, end) = (across[REACH], across[REACH + width - 1]);
    across[..REACH].fill(first);
    across[REACH + width..].fill(end);
    let taps: [&[u16]; MAX_REACH * 2 + 1] =
        std::array::from_fn(|k| &across[k.min(2 * REACH)..][..width]);
    let inner = &mut out[1..=width];
    for x in 0..width {
        let mut sum = taps[REACH][x] * weights[0];
        for k in 0..REACH {
            sum += (taps[REACH - 1 - k][x] + taps[REACH + 1 + k][x]) * weights[k + 1];
        }
        inner[x] = ((sum + 8) >> 4) as i16;
    }
    out[0] = out[1];
    out[width + 1] = out[width];
}

/// Sobel's two derivatives of the middle one of three rows.
#[inline(always)]
fn differentiate(a: &[i16], b: &[i16], c: &[i16], out: &mut GradientRow) {
    let width = a.len() - 2;
    let [a0, a1, a2] = [&a[..width], &a[1..][..width], &a[2..][..width]];
    let [b0, b2] = [&b[..width], &b[2..][..width]];
    let [c0, c1, c2] = [&c[..width], &c[1..][..width], &c[2..][..width]];
    let (gx, gy) = (&mut out.x[..width], &mut out.y[..width]);
    for x in 0..width {
        gx[x] = (a2[x] - a0[x]) + 2 * (b2[x] - b0[x]) + (c2[x] - c0[x]);
        gy[x] = (c0[x] - a0[x]) + 2 * (c1[x] - a1[x]) + (c2[x] - a2[x]);
    }
    out.squared = false;
}

impl GradientRow {
    /// Returns `true` if the squared length may exceed `low` in the block at `x`.
    #[inline(always)]
    fn may_exceed(&self, low: i32, x: usize) -> bool {
        if self.squared {
            return block(&self.square, x)
                .iter()
                .fold(0, |most, &square| square.max(most))
                > low;
        }
        let (gx, gy) = (block(&self.x, x), block(&self.y, x));
        let mut most = 0i16;
        for i in 0..BLOCK {
            let (ax, ay) = (gx[i].abs(), gy[i].abs());
            // Never below the length, and at most an eighth above it.
            most = most.max(ax.max(ay) + ((ax.min(ay) + 1) >> 1));
        }
        i32::from(most) * i32::from(most) > low
    }

    /// Returns the squared lengths in the block at `x`, a pixel to its left, and one to its right.
    #[inline(always)]
    fn squares_around(&self, x: usize) -> [&[i32; BLOCK]; 3] {
        [x - 1, x, x + 1].map(|x| block(&self.square, x))
    }

    /// Finds the squared lengths, unless they are known.
    #[inline(always)]
    fn square(&mut self) {
        if self.squared {
            return;
        }
        self.squared = true;
        for ((square, &x), &y) in self.square.iter_mut().zip(&self.x).zip(&self.y) {
            let (x, y) = (i32::from(x), i32::from(y));
            *square = x * x + y * y;
        }
    }
}

/// Marks the pixels of a row whose gradient is above the low threshold and a maximum across the
/// edge.
#[inline(always)]
fn maxima(
    passes: &Passes,
    rows: &mut [GradientRow; 3],
    (y, width): (usize, usize),
    marks: &mut [u8],
    found: &mut Vec<Candidate>,
) {
    if !marks.is_empty() {
        marks.fill(0);
    }
    for x in (1..width - 1).step_by(BLOCK) {
        if !rows[y % 3].may_exceed(passes.low, x) {
            continue;
        }
        for row in &mut *rows {
            row.square();
        }
        let [a, b, c] = [y - 1, y, y + 1].map(|row| &rows[row % 3]);
        let end = (x + BLOCK).min(width - 1);
        let out = marks.get_mut(x..end).unwrap_or_default();
        block_maxima(passes, [a, b, c], (x, y), end - x, out, found);
    }
}

/// [`maxima`] for a block of pixels: first all marks without a branch, then the list of the few
/// that are set.
#[inline(always)]
fn block_maxima(
    passes: &Passes,
    [a, b, c]: [&GradientRow; 3],
    (x, y): (usize, usize),
    count: usize,
    out: &mut [u8],
    found: &mut Vec<Candidate>,
) {
    let (gx, gy) = (block(&b.x, x), block(&b.y, x));
    let [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = [a, b, c].map(|row| row.squares_around(x));
    let (mut before, mut behind, mut wide) = ([0; BLOCK], [0; BLOCK], [0; BLOCK]);
    for i in 0..BLOCK {
        let (ax, ay) = (i32::from(gx[i]).abs(), i32::from(gy[i]).abs());
        let level = mask(is_shallow(ay, ax));
        let upright = mask(is_shallow(ax, ay));
        let falling = mask((gx[i] ^ gy[i]) >= 0);
        let choose = |mask: i32, yes: i32, no: i32| no ^ (mask & (yes ^ no));
        before[i] = choose(
            level,
            b0[i],
            choose(upright, a1[i], choose(falling, a0[i], a2[i])),
        );
        behind[i] = choose(
            level,
            b2[i],
            choose(upright, c1[i], choose(falling, c2[i], c0[i])),
        );
    }
    for i in 0..BLOCK {
        let maximum = (b1[i] > passes.low) & (b1[i] > before[i]) & (b1[i] >= behind[i]);
        wide[i] = mask(maximum) & (i32::from(WEAK) - mask(b1[i] > passes.high));
    }
    let mut marks = [0; BLOCK];
    for i in 0..BLOCK {
        marks[i] = wide[i] as u8;
    }
    // The last block of a row reaches over its end.
    if count < BLOCK {
        marks[count..].fill(0);
    }
    if !out.is_empty() {
        out.copy_from_slice(&marks[..count]);
    }
    for (eight, word) in marks.as_chunks::<8>().0.iter().enumerate() {
        let mut bits = u64::from_le_bytes(*word);
        while bits != 0 {
            let offset = bits.trailing_zeros() as usize / 8;
            bits &= !(0xff << (8 * offset));
            // Always below BLOCK; the remainder spares the checks.
            let i = (8 * eight + offset) % BLOCK;
            let (x, y) = ((x + i) as u32, y as u32);
            found.push(Candidate {
                pixel: EdgePixel { x, y },
                gradient: EdgeGradient::new(gx[i], gy[i], [before[i], b1[i], behind[i]]),
            });
        }
    }
}

/// The block of a row that begins at `x`, as an array: its fixed length is what makes the loops
/// below vector code.
#[inline(always)]
fn block<T>(row: &[T], x: usize) -> &[T; BLOCK] {
    &row[x..x + BLOCK].as_chunks().0[0]
}

/// All bits set, or none.
#[inline(always)]
fn mask(condition: bool) -> i32 {
    -i32::from(condition)
}

/// Returns `true` for a direction, by its absolute components, within 22.5 degrees of the axis of
/// `along`.
#[inline(always)]
pub(super) fn is_shallow(across: i32, along: i32) -> bool {
    (across << 15) < along * TAN_22
}
