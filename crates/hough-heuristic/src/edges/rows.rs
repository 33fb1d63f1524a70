//! The fused passes of Canny's operator over one row after another.
//!
//! Everything is integer arithmetic on short rows that stay in the nearest cache, written as plain loops over slices of one
//! length, which the compiler turns into vector code. The same source is compiled for the baseline of the target and, in
//! `dispatch`, for wider vectors; the results are the same by construction, and a test compares both with a plain version.

use super::{EdgeGradient, EdgePixel};

/// Grey levels are carried in sixteenths from the smoothing on.
pub(super) const UNITS: f32 = 16.0;
/// The smoothing weights of one direction sum up to this.
pub(super) const WEIGHT_SUM: u16 = 64;
/// The largest reach of the smoothing, pixels to either side.
pub(super) const MAX_REACH: usize = 4;
/// Pixels that are looked at together when maxima are sought.
const BLOCK: usize = 32;
/// `tan(22.5 degrees)` in units of 2^-15: where the sectors of the gradient direction meet.
const TAN_22: i32 = 13573;

/// What the passes need to know.
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
    /// One row smoothed along the columns, in quarters of a grey level, `reach` pixels wider at either end.
    across: Vec<u16>,
    /// Three smoothed rows, in units, a pixel wider at either end.
    smooth: [Vec<i16>; 3],
    gradient: [GradientRow; 3],
}

#[derive(Clone, Debug, Default)]
struct GradientRow {
    x: Vec<i16>,
    y: Vec<i16>,
    /// Squared length.
    square: Vec<i32>,
}

/// A pixel that is a maximum across its edge, and above the low threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) pixel: EdgePixel,
    pub(super) gradient: EdgeGradient,
}

/// The marks that [`maxima`] leaves in the edge image.
pub(super) const WEAK: u8 = 1;
/// See [`WEAK`].
pub(super) const STRONG: u8 = 2;

/// Marks the candidates of a frame of at least 3x3 pixels in `marks`, of the frame's size, and lists them row by row.
#[inline(always)]
pub(super) fn candidates(
    passes: &Passes,
    grey: &[u8],
    width: usize,
    rows: &mut Rows,
    marks: &mut [u8],
    found: &mut Vec<Candidate>,
) {
    let height = grey.len() / width;
    rows.resize(width, passes.weights.len() - 1);
    let last = height - 1;
    for y in 0..=height {
        // Row y is smoothed, then row y - 1 differentiated, then the maxima of row y - 2 found.
        if y <= last {
            rows.smooth_row(passes, grey, width, y);
        }
        if y >= 1 {
            let middle = y - 1;
            let (above, below) = (middle.saturating_sub(1), y.min(last));
            let [a, b, c] = [above, middle, below].map(|row| &rows.smooth[row % 3]);
            differentiate(a, b, c, &mut rows.gradient[middle % 3]);
        }
        if y >= 3 {
            let row = y - 2;
            let [a, b, c] = [row - 1, row, row + 1].map(|row| &rows.gradient[row % 3]);
            maxima(passes, [a, b, c], row, &mut marks[row * width..][..width], found);
        }
    }
    marks[..width].fill(0);
    marks[last * width..].fill(0);
}

impl Rows {
    fn resize(&mut self, width: usize, reach: usize) {
        self.across.resize(width + 2 * reach, 0);
        for row in &mut self.smooth {
            row.resize(width + 2, 0);
        }
        for row in &mut self.gradient {
            row.x.resize(width, 0);
            row.y.resize(width, 0);
            row.square.resize(width, 0);
        }
    }

    #[inline(always)]
    fn smooth_row(&mut self, passes: &Passes, grey: &[u8], width: usize, y: usize) {
        let out = &mut self.smooth[y % 3];
        // The reach as a constant lets the loops unroll.
        match passes.weights[..] {
            [_] => smooth::<0>(passes, grey, width, y, &mut self.across, out),
            [_, _] => smooth::<1>(passes, grey, width, y, &mut self.across, out),
            [_, _, _] => smooth::<2>(passes, grey, width, y, &mut self.across, out),
            [_, _, _, _] => smooth::<3>(passes, grey, width, y, &mut self.across, out),
            _ => smooth::<MAX_REACH>(passes, grey, width, y, &mut self.across, out),
        }
    }
}

/// Smooths row `y`, down the columns and then along the row; pixels beyond the border repeat the border's.
#[inline(always)]
fn smooth<const REACH: usize>(
    passes: &Passes,
    grey: &[u8],
    width: usize,
    y: usize,
    across: &mut [u16],
    out: &mut [i16],
) {
    let weights = &passes.weights[..=REACH];
    let last = grey.len() / width - 1;
    let row = |y: usize| &grey[y * width..][..width];
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
    let taps: [&[u16]; MAX_REACH * 2 + 1] = std::array::from_fn(|k| &across[k.min(2 * REACH)..][..width]);
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
    let width = out.square.len();
    let [a0, a1, a2] = [&a[..width], &a[1..][..width], &a[2..][..width]];
    let [b0, b2] = [&b[..width], &b[2..][..width]];
    let [c0, c1, c2] = [&c[..width], &c[1..][..width], &c[2..][..width]];
    let (gx, gy, square) = (&mut out.x[..width], &mut out.y[..width], &mut out.square[..width]);
    for x in 0..width {
        let dx = (a2[x] - a0[x]) + 2 * (b2[x] - b0[x]) + (c2[x] - c0[x]);
        let dy = (c0[x] - a0[x]) + 2 * (c1[x] - a1[x]) + (c2[x] - a2[x]);
        gx[x] = dx;
        gy[x] = dy;
        square[x] = i32::from(dx) * i32::from(dx) + i32::from(dy) * i32::from(dy);
    }
}

/// Marks the pixels of a row whose gradient is above the low threshold and a maximum across the edge.
#[inline(always)]
fn maxima(passes: &Passes, rows: [&GradientRow; 3], y: usize, marks: &mut [u8], found: &mut Vec<Candidate>) {
    let width = marks.len();
    marks[0] = 0;
    marks[width - 1] = 0;
    let mut x = 1;
    while x + BLOCK < width {
        let above = block(&rows[1].square, x)
            .iter()
            .fold(0, |most, &square| square.max(most));
        let out = &mut marks[x..x + BLOCK];
        if above <= passes.low {
            out.fill(0);
        } else {
            mark_block(passes, rows, x, out);
            for eight in 0..BLOCK / 8 {
                let word = &out[8 * eight..8 * eight + 8];
                let mut bits = word
                    .iter()
                    .rev()
                    .fold(0u64, |bits, &mark| bits << 8 | u64::from(mark));
                while bits != 0 {
                    let offset = bits.trailing_zeros() as usize / 8;
                    bits &= !(0xff << (8 * offset));
                    found.push(candidate(rows, x + 8 * eight + offset, y));
                }
            }
        }
        x += BLOCK;
    }
    for x in x..width - 1 {
        let square = rows[1].square[x];
        let (before, behind) = neighbours(rows, x);
        marks[x] = mark(passes, square, before, behind);
        if marks[x] != 0 {
            found.push(candidate(rows, x, y));
        }
    }
}

#[inline(always)]
fn block<T>(row: &[T], x: usize) -> &[T] {
    &row[x..x + BLOCK]
}

#[inline(always)]
fn mark(passes: &Passes, square: i32, before: i32, behind: i32) -> u8 {
    let maximum = (square > passes.low) & (square > before) & (square >= behind);
    u8::from(maximum) * (WEAK + u8::from(square > passes.high))
}

/// Fills a block of marks without branches.
#[inline(always)]
fn mark_block(passes: &Passes, rows: [&GradientRow; 3], x: usize, out: &mut [u8]) {
    let [a, b, c] = rows;
    let (gx, gy) = (block(&b.x, x), block(&b.y, x));
    let (a0, a1, a2) = (
        block(&a.square, x - 1),
        block(&a.square, x),
        block(&a.square, x + 1),
    );
    let (b0, b1, b2) = (
        block(&b.square, x - 1),
        block(&b.square, x),
        block(&b.square, x + 1),
    );
    let (c0, c1, c2) = (
        block(&c.square, x - 1),
        block(&c.square, x),
        block(&c.square, x + 1),
    );
    for i in 0..BLOCK {
        let (before, behind) = across_edge(
            gx[i],
            gy[i],
            [
                [a0[i], a1[i], a2[i]],
                [b0[i], b1[i], b2[i]],
                [c0[i], c1[i], c2[i]],
            ],
        );
        out[i] = mark(passes, b1[i], before, behind);
    }
}

/// The squares of the two neighbours across the edge, that is along the gradient's sector of 45 degrees.
#[inline(always)]
fn across_edge(gx: i16, gy: i16, square: [[i32; 3]; 3]) -> (i32, i32) {
    let [[a0, a1, a2], [b0, _, b2], [c0, c1, c2]] = square;
    let (ax, ay) = (i32::from(gx).abs(), i32::from(gy).abs());
    let level = is_shallow(ay, ax);
    let upright = is_shallow(ax, ay);
    let falling = (gx ^ gy) >= 0;
    let (d1, d2) = if falling { (a0, c2) } else { (a2, c0) };
    let (v1, v2) = if upright { (a1, c1) } else { (d1, d2) };
    if level { (b0, b2) } else { (v1, v2) }
}

/// Whether a direction with these absolute components lies within 22.5 degrees of the axis of `along`.
#[inline(always)]
pub(super) fn is_shallow(across: i32, along: i32) -> bool {
    (across << 15) < along * TAN_22
}

#[inline(always)]
fn neighbours([a, b, c]: [&GradientRow; 3], x: usize) -> (i32, i32) {
    let three = |row: &GradientRow| [row.square[x - 1], row.square[x], row.square[x + 1]];
    across_edge(b.x[x], b.y[x], [three(a), three(b), three(c)])
}

#[inline(always)]
fn candidate(rows: [&GradientRow; 3], x: usize, y: usize) -> Candidate {
    let (before, behind) = neighbours(rows, x);
    Candidate {
        pixel: EdgePixel {
            x: x as u32,
            y: y as u32,
        },
        gradient: EdgeGradient::new(rows[1].x[x], rows[1].y[x], [before, rows[1].square[x], behind]),
    }
}
