//! Frames of half the size, by the mean of four pixels.

use crate::edges::{Vectorized, widest};

/// Makes `half` the frame of half the width and height (odd rests cut off), each pixel the rounded
/// mean of four.
pub(super) fn halve(gray: &[u8], width: usize, half: &mut Vec<u8>) -> (usize, usize) {
    let height = gray.len().checked_div(width).unwrap_or(0);
    let (columns, rows) = (width / 2, height / 2);
    half.resize(columns * rows, 0);
    if columns > 0 {
        halve_rows(gray, width, half);
    }
    (columns, rows)
}

#[cfg(not(feature = "parallel"))]
fn halve_rows(gray: &[u8], width: usize, half: &mut [u8]) {
    widest(Halving { gray, width, half });
}

/// Large frames a strip of rows on each thread.
#[cfg(feature = "parallel")]
fn halve_rows(gray: &[u8], width: usize, half: &mut [u8]) {
    use rayon::prelude::*;

    /// Strips of fewer pixels are not worth a thread's waking.
    const LEAST_STRIP: usize = if cfg!(test) { 60 } else { 1_500_000 };
    let count = rayon::current_num_threads()
        .min(gray.len() / LEAST_STRIP)
        .max(1);
    let rows = (gray.len() / width / 2).div_ceil(count).max(1);
    if count == 1 {
        widest(Halving { gray, width, half });
    } else {
        gray.par_chunks(2 * rows * width)
            .zip(half.par_chunks_mut(rows * (width / 2)))
            .for_each(|(gray, half)| widest(Halving { gray, width, half }));
    }
}

struct Halving<'a> {
    gray: &'a [u8],
    width: usize,
    half: &'a mut [u8],
}

impl Vectorized for Halving<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let rows = self.gray.chunks_exact(2 * self.width);
        for (pair, out) in rows.zip(self.half.chunks_exact_mut(self.width / 2)) {
            let (upper, lower) = pair.split_at(self.width);
            let pairs = upper
                .as_chunks::<2>()
                .0
                .iter()
                .zip(lower.as_chunks::<2>().0);
            for (out, (upper, lower)) in out.iter_mut().zip(pairs) {
                // Two pixels as the two bytes of a word.
                let (upper, lower) = (u16::from_le_bytes(*upper), u16::from_le_bytes(*lower));
                let sum = (upper & 0xff) + (upper >> 8) + (lower & 0xff) + (lower >> 8);
                *out = ((sum + 2) / 4) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_way_gives_the_mean(width in 2usize..90, height in 0usize..9, seed: u64) {
            let gray: Vec<u8> = (0..width * height)
                .map(|k| (seed.wrapping_mul(2 * k as u64 + 1) >> 32) as u8)
                .collect();
            let (mut fast, mut plain) = (Vec::new(), vec![0; (width / 2) * (height / 2)]);
            prop_assert_eq!(halve(&gray, width, &mut fast), (width / 2, height / 2));
            Halving { gray: &gray, width, half: &mut plain }.run();
            prop_assert_eq!(&fast, &plain);
            for (index, half) in fast.iter().enumerate() {
                let at = index / (width / 2) * 2 * width + index % (width / 2) * 2;
                let four = [at, at + 1, at + width, at + width + 1];
                let sum: u16 = four.map(|k| u16::from(gray[k])).iter().sum();
                prop_assert_eq!(u16::from(*half), (sum + 2) / 4);
            }
        }
    }
}
