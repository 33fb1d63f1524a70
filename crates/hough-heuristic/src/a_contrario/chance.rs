//! The bound on the probability that chance alone puts so many edges on an outline.

/// The Kullback-Leibler divergence of the share found from the share expected, in decimal digits
/// per sample; 0 unless more is found. By Hoeffding's bound, `n` samples show that share by chance
/// with a probability of at most `10^(-n divergence)`.
pub(super) fn divergence(share: f32, p: f32) -> f32 {
    if share <= p {
        return 0.0;
    }
    let term = |q: f32, p: f32| if q > 0.0 { q * log10(q / p) } else { 0.0 };
    term(share, p) + term(1.0 - share, 1.0 - p)
}

/// The decimal logarithm of a normal number above 0, by the four operations alone: the same bits on
/// every machine.
pub(super) fn log10(x: f32) -> f32 {
    let bits = f64::from(x).to_bits();
    let exponent = (bits >> 52) as i64 - 1023;
    // The mantissa, 1..2.
    let m = f64::from_bits((bits & ((1 << 52) - 1)) | (1023 << 52));
    // ln m = 2 artanh z, with z up to 1/3.
    let z = (m - 1.0) / (m + 1.0);
    let mut power = z;
    let mut sum = 0.0;
    for k in 0..14 {
        sum += power / f64::from(2 * k + 1);
        power *= z * z;
    }
    let natural = 2.0 * sum + exponent as f64 * std::f64::consts::LN_2;
    (natural * std::f64::consts::LOG10_E) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_are_those_of_the_library() {
        for x in [1e-30f32, 0.001, 0.3, 0.999, 1.0, 1.5, 1.999, 2.0, 10.0, 1e7] {
            assert!(
                (log10(x) - x.log10()).abs() <= 1e-6 * x.log10().abs().max(1.0),
                "{x}"
            );
        }
    }

    #[test]
    fn only_more_than_expected_is_evidence() {
        assert!(divergence(0.1, 0.2) <= 0.0 && divergence(0.2, 0.2) <= 0.0);
        assert!((divergence(1.0, 0.1) - 1.0).abs() < 1e-6);
        assert!(divergence(0.6, 0.1) > divergence(0.5, 0.1));
    }
}
