//! Confidence interval of a share.

/// Returns Wilson's 95 % interval, percent, of a share (0..=1) of `n` trials. It has a width even
/// where all trials succeed, or none; it is NaN without trials.
pub fn wilson(share: f64, n: f64) -> [f64; 2] {
    const Z: f64 = 1.96;
    let middle = share + 0.5 * Z * Z / n;
    let half = Z * (share * (1.0 - share) / n + 0.25 * Z * Z / (n * n)).sqrt();
    let scale = 100.0 / (1.0 + Z * Z / n);
    // Rounding must not lead beyond a possible share.
    [middle - half, middle + half].map(|end| (scale * end).clamp(0.0, 100.0).abs())
}
