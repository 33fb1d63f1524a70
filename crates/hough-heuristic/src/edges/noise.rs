//! How noisy a frame is.

/// Every how many rows a row is usually looked at.
pub(crate) const ROW_STEP: usize = 12;
/// Every how many columns a pixel is looked at; odd, so that no two-pixel pattern is met in one phase only.
const COLUMN_STEP: usize = 3;

/// The standard deviation of the noise, grey levels, from every `row_step`-th row: 0 for frames smaller than 3x3.
///
/// The median of the absolute response of the mask `1 -2 1; -2 4 -2; 1 -2 1`, which planes and straight edges along the axes do not
/// move and noise of deviation σ gives the deviation 6 σ (Immerkær, 1996). The median leaves corners and texture out of account as long as
/// they cover less than about a third of the frame; where they cover more, they count as noise.
pub(crate) fn noise_deviation(grey: &[u8], width: usize, row_step: usize) -> f32 {
    let height = grey.len().checked_div(width).unwrap_or(0);
    if width < 3 || height < 3 {
        return 0.0;
    }
    // Responses reach 8 * 255.
    let mut histogram = [0u32; 2048];
    let mut samples = 0;
    for y in (1..height - 1).step_by(row_step) {
        let [a, b, c] = [y - 1, y, y + 1].map(|row| &grey[row * width..][..width]);
        for x in (1..width - 1).step_by(COLUMN_STEP) {
            let three = |row: &[u8]| i32::from(row[x - 1]) - 2 * i32::from(row[x]) + i32::from(row[x + 1]);
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
