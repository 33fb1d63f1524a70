//! Frames of half the size, by the mean of four pixels.

use crate::edges::{Vectorized, widest};

/// Makes `half` the frame of half the width and height (odd rests cut off), each pixel the rounded mean of four.
pub(super) fn halve(grey: &[u8], width: usize, half: &mut Vec<u8>) -> (usize, usize) {
    let height = grey.len().checked_div(width).unwrap_or(0);
    let (columns, rows) = (width / 2, height / 2);
    half.resize(columns * rows, 0);
    if columns > 0 {
        widest(Halving { grey, width, half });
    }
    (columns, rows)
}

struct Halving<'a> {
    grey: &'a [u8],
    width: usize,
    half: &'a mut [u8],
}

impl Vectorized for Halving<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let rows = self.grey.chunks_exact(2 * self.width);
        for (pair, out) in rows.zip(self.half.chunks_exact_mut(self.width / 2)) {
            let (upper, lower) = pair.split_at(self.width);
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            for (out, (upper, lower)) in out.iter_mut().zip(pairs) {
                // Two pixels as the two bytes of a word.
                let (upper, lower) = (u16::from_le_bytes(*upper), u16::from_le_bytes(*lower));
                let sum = (upper & 0xff) + (upper >> 8) + (lower & 0xff) + (lower >> 8);
                *out = ((sum + 2) / 4) as u8;
            }
        }
    }
}
