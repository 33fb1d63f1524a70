//! How sure a share is.

/// Wilson's 95 % interval of a share, 0..=1, of `n` trials, percent. It says something where all
/// succeed, or none; it is not a number without trials.
pub fn wilson(share: f64, n: f64) -> [f64; 2] {
    const Z: f64 = 1.96;
    let middle = share + 0.5 * Z * Z / n;
    let half = Z * (share * (1.0 - share) / n + 0.25 * Z * Z / (n * n)).sqrt();
    let scale = 100.0 / (1.0 + Z * Z / n);
    // None of the trials, or all of them: rounding must not lead out of what a share can be.
    [middle - half, middle + half].map(|end| (scale * end).clamp(0.0, 100.0).abs())
}
