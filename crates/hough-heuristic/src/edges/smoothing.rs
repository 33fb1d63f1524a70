//! The weights that smooth a frame, and the noise that they let through.

use super::rows::{MAX_REACH, WEIGHT_SUM};

/// Half of a sampled Gaussian in whole numbers; with the mirrored half they sum up to exactly
/// [`WEIGHT_SUM`].
pub(super) fn smoothing_weights(sigma: f32) -> Vec<u16> {
    let reach = match sigma {
        0.0 => 0,
        ..=1.25 => 2,
        ..=1.6 => 3,
        _ => MAX_REACH,
    };
    let half: Vec<f32> = (0..=reach)
        .map(|k| (-0.5 * (k as f32 / sigma.max(1e-3)).powi(2)).exp())
        .collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f32>();
    let mut weights: Vec<u16> = half
        .iter()
        .map(|weight| (weight / sum * f32::from(WEIGHT_SUM)).round() as u16)
        .collect();
    if let Some(first) = weights.get_mut(1) {
        // Rounding changes how much is smoothed by some per cent; weight moved from the centre to
        // its neighbours mends that.
        let variance = |weight: &dyn Fn(usize) -> f32| -> f32 {
            (1..=reach).map(|k| 2.0 * (k * k) as f32 * weight(k)).sum()
        };
        let wanted = variance(&|k| half[k] / sum * f32::from(WEIGHT_SUM));
        let rounded = variance(&|k| (half[k] / sum * f32::from(WEIGHT_SUM)).round());
        *first = (f32::from(*first) + 0.5 * (wanted - rounded)).round() as u16;
    }
    let outer: u16 = weights[1..].iter().sum();
    weights[0] = WEIGHT_SUM - 2 * outer;
    weights
}

/// Returns the deviation of Sobel's gradient under white noise of deviation 1, after smoothing.
pub(super) fn noise_gain(weights: &[u16]) -> f32 {
    let reach = weights.len() - 1;
    let line: Vec<f32> = (0..=2 * reach)
        .map(|k| f32::from(weights[k.abs_diff(reach)]) / f32::from(WEIGHT_SUM))
        .collect();
    let power = |kernel: [f32; 3]| -> f32 {
        (0..line.len() + 2)
            .map(|n| {
                let sum: f32 = (0..3)
                    .filter_map(|k| Some(kernel[k] * line.get(n.checked_sub(k)?)?))
                    .sum();
                sum * sum
            })
            .sum()
    };
    (power([1.0, 0.0, -1.0]) * power([1.0, 2.0, 1.0])).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_up_and_noise_is_what_they_let_through() {
        for sigma in [0.0, 0.5, 0.8, 1.0, 1.2, 1.25, 1.4, 1.6, 2.0] {
            let weights = smoothing_weights(sigma);
            assert_eq!(
                weights[0] + 2 * weights[1..].iter().sum::<u16>(),
                WEIGHT_SUM,
                "{sigma}"
            );
            let outer =
                |k: usize| 2.0 * (k * k) as f32 * f32::from(weights[k]) / f32::from(WEIGHT_SUM);
            let deviation = (1..weights.len()).map(outer).sum::<f32>().sqrt();
            // The cut-off takes some of it.
            assert!(
                deviation <= sigma + 0.05 && deviation >= 0.9 * sigma - 0.05,
                "{sigma}: {deviation}"
            );
        }
        // Sobel alone: sqrt(2 * (1 + 4 + 1)).
        assert!((noise_gain(&smoothing_weights(0.0)) - 12f32.sqrt()).abs() < 1e-5);
    }
}
