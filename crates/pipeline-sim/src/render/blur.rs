//! Blur of lens and sensor.

use hough_heuristic::Vectorized;

use crate::render::canvas::Canvas;

/// Returns side and middle weight of the three-tap kernel of variance sigma², or the widest kernel
/// of three taps.
pub(super) fn three_taps(sigma: f64) -> (f32, f32) {
    let side = (0.5 * sigma * sigma).clamp(0.0, 0.333) as f32;
    (side, 1.0 - 2.0 * side)
}

/// Pixels that are blurred at a time, so that their sums stay in registers.
const BLOCK: usize = 32;

/// Blurs rows of `width` pixels with the sensor's three taps along each axis
/// ([`Sensor::blur`](crate::render::scene::Sensor::blur)). The fields of an interlaced frame are
/// blurred before they are woven.
pub(super) fn soften(values: &mut [f32], width: usize, sigma: f64, spare: &mut Vec<f32>) {
    let (side, middle) = three_taps(sigma);
    if side > 0.0 {
        convolve(values, width, &[0.5 * middle, side], spare);
    }
}

/// Blurs the whole canvas by a Gaussian of standard deviation `sigma` pixels.
pub(super) fn defocus(canvas: &mut Canvas, sigma: f64, spare: &mut Vec<f32>) {
    let reach = (2.5 * sigma).ceil().min(40.0) as usize;
    if sigma.is_nan() || sigma <= 0.0 || reach == 0 {
        return;
    }
    let weight = |i: usize| (-0.5 * (i as f64 / sigma).powi(2)).exp() as f32;
    let mut kernel: Vec<f32> = (0..=reach).map(weight).collect();
    let sum = kernel[0] + 2.0 * kernel[1..].iter().sum::<f32>();
    kernel.iter_mut().for_each(|k| *k /= sum);
    kernel[0] *= 0.5;
    convolve(&mut canvas.light, canvas.width, &kernel, spare);
}

/// Convolves rows of `width` pixels along both axes with a symmetric kernel, given from the middle
/// outward with half the middle weight. The border is continued.
fn convolve(values: &mut [f32], width: usize, kernel: &[f32], spare: &mut Vec<f32>) {
    if values.is_empty() {
        return;
    }
    let (w, h, reach) = (width, values.len() / width, kernel.len() - 1);
    let needed = w * h + w + 2 * reach;
    if spare.len() < needed {
        spare.resize(needed, 0.0);
    }
    let (mixed, padded) = spare[..needed].split_at_mut(w * h);
    for y in 0..h {
        let row = |y: usize| &values[y * w..][..w];
        let pairs = kernel.iter().enumerate();
        let pairs = pairs.map(|(i, k)| (*k, row(y.saturating_sub(i)), row((y + i).min(h - 1))));
        Weighing(pairs, &mut mixed[y * w..][..w]).widest();
    }
    for (row, out) in mixed.chunks_exact(w).zip(values.chunks_exact_mut(w)) {
        padded[..reach].fill(row[0]);
        padded[reach..reach + w].copy_from_slice(row);
        padded[reach + w..].fill(row[w - 1]);
        let pairs = kernel.iter().enumerate();
        let pairs = pairs.map(|(i, k)| (*k, &padded[reach - i..][..w], &padded[reach + i..][..w]));
        Weighing(pairs, out).widest();
    }
}

/// Computes the sum of pairs of rows, each with its weight.
struct Weighing<'a, P>(P, &'a mut [f32]);

impl<'a, P: Iterator<Item = (f32, &'a [f32], &'a [f32])> + Clone> Vectorized for Weighing<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(pairs, out) = self;
        let mut at = 0;
        let mut blocks = out.chunks_exact_mut(BLOCK);
        for block in &mut blocks {
            let mut sums = [0.0_f32; BLOCK];
            for (k, a, b) in pairs.clone() {
                let (a, b) = (
                    a[at..].first_chunk::<BLOCK>(),
                    b[at..].first_chunk::<BLOCK>(),
                );
                let (Some(a), Some(b)) = (a, b) else { continue };
                for i in 0..BLOCK {
                    sums[i] += k * (a[i] + b[i]);
                }
            }
            block.copy_from_slice(&sums);
            at += BLOCK;
        }
        for (i, value) in blocks.into_remainder().iter_mut().enumerate() {
            let terms = pairs.clone().map(|(k, a, b)| k * (a[at + i] + b[at + i]));
            *value = terms.sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defocus_is_a_gaussian_cut_off_at_two_and_a_half_deviations() {
        // Neither side is a multiple of a block; the border is continued.
        let (w, h) = (53_usize, 41_usize);
        let mut state = 1_u32;
        let light: Vec<f32> = (0..w * h)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / 16_777_216.0
            })
            .collect();
        for sigma in [0.6, 1.0, 2.3, 3.5] {
            let mut canvas = Canvas::new(w, h);
            canvas.light.copy_from_slice(&light);
            defocus(&mut canvas, sigma, &mut Vec::new());
            let reach = (2.5 * sigma).ceil() as i64;
            let weight = |d: i64| (-0.5 * (d as f64 / sigma).powi(2)).exp();
            let sum: f64 = (-reach..=reach).map(weight).sum();
            for (x, y) in [(0_i64, 0_i64), (26, 20), (52, 40), (50, 3), (15, 40)] {
                let at = |x: i64, y: i64| {
                    let (x, y) = (x.clamp(0, w as i64 - 1), y.clamp(0, h as i64 - 1));
                    f64::from(light[y as usize * w + x as usize])
                };
                let exact: f64 = (-reach..=reach)
                    .flat_map(|j| (-reach..=reach).map(move |i| (i, j)))
                    .map(|(i, j)| weight(i) * weight(j) * at(x + i, y + j))
                    .sum::<f64>()
                    / (sum * sum);
                let blurred = f64::from(canvas.light[y as usize * w + x as usize]);
                assert!(
                    (blurred - exact).abs() < 1e-5,
                    "{sigma} {x} {y}: {blurred} {exact}"
                );
            }
        }
    }
}
