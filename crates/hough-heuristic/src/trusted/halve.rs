//! Frames of half the size, by the mean of four pixels.

/// Makes `half` the frame of half the width and height (odd rests cut off), each pixel the rounded mean of four.
pub(super) fn halve(grey: &[u8], width: usize, half: &mut Vec<u8>) -> (usize, usize) {
    let height = grey.len().checked_div(width).unwrap_or(0);
    let (columns, rows) = (width / 2, height / 2);
    half.resize(columns * rows, 0);
    if columns > 0 {
        for (pair, out) in grey.chunks_exact(2 * width).zip(half.chunks_exact_mut(columns)) {
            let (upper, lower) = pair.split_at(width);
            for (x, out) in out.iter_mut().enumerate() {
                let sum = u16::from(upper[2 * x])
                    + u16::from(upper[2 * x + 1])
                    + u16::from(lower[2 * x])
                    + u16::from(lower[2 * x + 1]);
                *out = ((sum + 2) / 4) as u8;
            }
        }
    }
    (columns, rows)
}
