//! Estimates a frame's noise.

/// Usual distance between sampled rows.
pub(crate) const ROW_STEP: usize = 12;
/// Distance between sampled columns. It is odd, so that a pattern with a period of two pixels is
/// sampled in both phases.
const COLUMN_STEP: usize = 3;
/// Columns that are worked on together, a multiple of the step.
const BLOCK: usize = 96;
/// Responses reach 8 * 255.
const BINS: usize = 2048;

/// The standard deviation of the noise, gray levels, from every `row_step`-th row: 0 for frames
/// smaller than 3x3.
///
/// The median of the absolute response of the mask `1 -2 1; -2 4 -2; 1 -2 1`, which planes and
/// straight edges along the axes do not move and noise of deviation σ gives the deviation 6 σ
/// (Immerkær, 1996). The median leaves corners and texture out of account as long as they cover
/// less than about a third of the frame; where they cover more, they count as noise.
pub(crate) fn noise_deviation(gray: &[u8], width: usize, row_step: usize) -> f32 {
    let height = gray.len().checked_div(width).unwrap_or(0);
    if width < 3 || height < 3 {
        return 0.0;
    }
    let mut histogram = [0u32; BINS];
    let mut samples = 0;
    for y in (1..height - 1).step_by(row_step) {
        let [a, b, c] = [y - 1, y, y + 1].map(|row| &gray[row * width..][..width]);
        let mut x = 1;
        while x + BLOCK < width {
            let [a, b, c] = [a, b, c].map(|row| &row[x - 1..=x + BLOCK]);
            let mut down = [0i16; BLOCK + 2];
            for (((down, a), b), c) in down.iter_mut().zip(a).zip(b).zip(c) {
                *down = i16::from(*a) - 2 * i16::from(*b) + i16::from(*c);
            }
            // All of them by vectors take less time than every third one by one.
            let mut responses = [0; BLOCK];
            for (k, response) in responses.iter_mut().enumerate() {
                *response = (down[k] - 2 * down[k + 1] + down[k + 2]).unsigned_abs();
            }
            for response in responses.iter().step_by(COLUMN_STEP) {
                histogram[usize::from(*response) % BINS] += 1;
            }
            samples += (BLOCK / COLUMN_STEP) as u32;
            x += BLOCK;
        }
        for x in (x..width - 1).step_by(COLUMN_STEP) {
            let three =
                |row: &[u8]| i32::from(row[x - 1]) - 2 * i32::from(row[x]) + i32::from(row[x + 1]);
            let response = three(a) - 2 * three(b) + three(c);
            histogram[response.unsigned_abs() as usize] += 1;
            samples += 1;
        }
    }
    let mut left = samples / 2;
    let median = histogram.iter().position(|&count| {
        let reached = left < count;
        left = left.saturating_sub(count);
        reached
    });
    // The median of |response| is 0.6745 deviations of it.
    median.unwrap_or(0) as f32 / (6.0 * 0.6745)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The estimate, computed one pixel after another.
    fn plainly(gray: &[u8], width: usize, row_step: usize) -> f32 {
        let height = gray.len() / width;
        let mut responses = Vec::new();
        for y in (1..height - 1).step_by(row_step) {
            for x in (1..width - 1).step_by(COLUMN_STEP) {
                let at = |dx: usize, dy: usize| i32::from(gray[(y + dy - 1) * width + x + dx - 1]);
                let row = |dy: usize| at(0, dy) - 2 * at(1, dy) + at(2, dy);
                responses.push((row(0) - 2 * row(1) + row(2)).abs());
            }
        }
        responses.sort_unstable();
        responses[responses.len() / 2] as f32 / (6.0 * 0.6745)
    }

    proptest! {
        #[test]
        fn blocks_give_what_single_pixels_give(
            width in 3usize..420, height in 3usize..30, row_step in 1usize..14,
            roughness in 1u32..=256, seed: u64,
        ) {
            let gray: Vec<u8> = (0..width * height)
                .map(|k| ((seed.wrapping_mul(2 * k as u64 + 1) >> 40) as u32 % roughness) as u8)
                .collect();
            let (fast, plain) =
                (noise_deviation(&gray, width, row_step), plainly(&gray, width, row_step));
            prop_assert_eq!(fast.to_bits(), plain.to_bits());
        }
    }
}
