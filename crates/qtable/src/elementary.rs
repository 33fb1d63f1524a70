//! Exponential and logarithm from IEEE additions, multiplications and divisions alone.
//!
//! The functions of the standard library are the platform's: their last bits differ between
//! platforms. These give the same bits everywhere, and the compiler can vectorise a row of them.

use std::f64::consts::{LN_2, LOG2_E, SQRT_2};

/// Adding this to a number below 2^51 in size rounds it to an integer, which then sits in the low
/// mantissa bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, the first with trailing zero bits, so that its product with an exponent is
/// exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Returns `e^x` to 2 units in the last place. Results below 2^-1021 are 0, results above the
/// largest number infinite.
pub(crate) fn exp(x: f64) -> f64 {
    match x {
        x if x < LEAST => 0.0,
        x if x > 710.0 => f64::INFINITY,
        // The power of two alone would overflow.
        x if x > MOST => exp_within(x - 1.0) * std::f64::consts::E,
        x => exp_within(x),
    }
}

/// The exponents that [`exp_within`] takes; others are taken for the nearer end.
const LEAST: f64 = -708.0;
const MOST: f64 = 709.0;

/// Returns `e^x` to 2 units in the last place for `x` in -708..=709, without a branch.
#[inline(always)]
pub(crate) const fn exp_within(x: f64) -> f64 {
    // x = r + n ln 2 with |r| <= ln(2)/2.
    let x = if x > LEAST { x } else { LEAST };
    let x = if x < MOST { x } else { MOST };
    let shifted = x * LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN_2_HIGH) - n * LN_2_LOW;
    let scale = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    // Taylor series of (e^r - 1 - r) / r^2; the first term left out is below 5e-18.
    const C: [f64; 12] = [
        0.5,
        1.0 / 6.0,
        1.0 / 24.0,
        1.0 / 120.0,
        1.0 / 720.0,
        1.0 / 5_040.0,
        1.0 / 40_320.0,
        1.0 / 362_880.0,
        1.0 / 3_628_800.0,
        1.0 / 39_916_800.0,
        1.0 / 479_001_600.0,
        1.0 / 6_227_020_800.0,
    ];
    const fn pair(k: usize, r: f64) -> f64 {
        C[k] + C[k + 1] * r
    }
    let r2 = r * r;
    let r4 = r2 * r2;
    let series = (pair(0, r) + pair(2, r) * r2)
        + r4 * ((pair(4, r) + pair(6, r) * r2) + r4 * (pair(8, r) + pair(10, r) * r2));
    (1.0 + (r + r2 * series)) * scale
}

/// Parts of an octave, the unit of [`exp2_parts`].
pub(crate) const PARTS: usize = 1 << PART_BITS;
const PART_BITS: u32 = 7;

/// Natural logarithm of a part of an octave.
const STEP: f64 = LN_2 / PARTS as f64;

/// Returns the rest of `x`, at most 1/2, beyond the nearest whole number k, and `2^(k / PARTS)`,
/// without a branch: below `2^-1022` that, any number above `2^1023`.
#[inline(always)]
fn part_of_octave(x: f64) -> (f64, f64) {
    const LEAST: f64 = -1022.0 * PARTS as f64;
    let x = if x > LEAST { x } else { LEAST };
    let shifted = x + ROUND;
    let k = shifted.to_bits();
    let power = POWERS[k as usize % PARTS].wrapping_add(k << (52 - PART_BITS));
    (x - (shifted - ROUND), f64::from_bits(power))
}

/// Returns `2^(x / PARTS)` to a part in 10^8, as much as an `f32` holds: 0 below `2^-1022`.
#[inline(always)]
pub(crate) fn exp2_parts(x: f64) -> f32 {
    let (r, power) = part_of_octave(x);
    // The first term left out is below 4e-9.
    ((1.0 + r * STEP + (r * r) * (STEP * STEP / 2.0)) * power) as f32
}

/// Returns `2^(x / PARTS)` to 3 units in the last place: sooner than [`exp_within`], but not in
/// vectors.
#[inline(always)]
pub(crate) fn exp2_quick(x: f64) -> f64 {
    const C2: f64 = STEP * STEP / 2.0;
    const C3: f64 = C2 * STEP / 3.0;
    const C4: f64 = C3 * STEP / 4.0;
    const C5: f64 = C4 * STEP / 5.0;
    let (r, power) = part_of_octave(x);
    // The first term left out is below 6e-19.
    let r2 = r * r;
    power + power * (r * STEP + r2 * ((C2 + r * C3) + r2 * (C4 + r * C5)))
}

/// The bits of `2^(k / PARTS)` less those of k, which in [`exp2_parts`] come with the exponent.
static POWERS: [u64; PARTS] = {
    let mut powers = [0; PARTS];
    let mut k = 0;
    while k < PARTS {
        let power = exp_within(k as f64 * (LN_2 / PARTS as f64));
        powers[k] = power.to_bits() - ((k as u64) << (52 - PART_BITS));
        k += 1;
    }
    powers
};

/// Returns the natural logarithm of a positive, finite, normal `x`, to 2 units in the last place.
pub(crate) fn ln(x: f64) -> f64 {
    let bits = x.to_bits();
    let mut exponent = ((bits >> 52) & 0x7ff) as i64 - 1023;
    let mut m = f64::from_bits((bits & 0x000f_ffff_ffff_ffff) | 0x3ff0_0000_0000_0000);
    if m > SQRT_2 {
        m *= 0.5;
        exponent += 1;
    }
    // ln m = 2 artanh((m-1)/(m+1)), |s| <= 0.172: the twelfth term is below 1e-18.
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let mut series = 0.0;
    for k in (1..12).rev() {
        series = (series + 1.0 / f64::from(2 * k + 1)) * s2;
    }
    let log_m = 2.0 * (s + s * series);
    if exponent == 0 {
        log_m
    } else {
        exponent as f64 * LN_2 + log_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_agrees_with_the_standard_library() {
        for i in -70_800..=70_950 {
            let x = f64::from(i) * 0.01 + 0.001_234;
            let (ours, theirs) = (exp(x), x.exp());
            if x > -708.0 {
                assert!(
                    (ours / theirs - 1.0).abs() < 5e-16,
                    "exp({x}) = {ours}, not {theirs}"
                );
            }
        }
        for i in -70_000..=30_000 {
            let x = f64::from(i) * 0.001_234_5;
            let (ours, theirs) = (f64::from(exp2_parts(x * LOG2_E * PARTS as f64)), x.exp());
            assert!(
                (ours - theirs).abs() <= theirs * 7e-8 + 1e-38,
                "exp({x}) = {ours}, not {theirs}"
            );
        }
        for i in -70_000..=0 {
            let x = f64::from(i) * 0.01;
            let (ours, theirs) = (exp2_quick(x * LOG2_E * PARTS as f64), x.exp());
            // The exponent itself is rounded.
            let bound = 5e-16 - x * 3e-16;
            assert!(
                (ours / theirs - 1.0).abs() < bound,
                "exp({x}) = {ours}, not {theirs}"
            );
        }
        assert_eq!(exp2_quick(0.0).to_bits(), 1.0f64.to_bits());
        assert!(exp2_quick(f64::NEG_INFINITY) < 1e-307);
        assert_eq!(exp(0.0).to_bits(), 1.0f64.to_bits());
        assert_eq!(exp(f64::NEG_INFINITY).to_bits(), 0.0f64.to_bits());
        assert_eq!(exp(-1e300).to_bits(), 0.0f64.to_bits());
        assert_eq!(exp(800.0).to_bits(), f64::INFINITY.to_bits());
        assert!((exp(709.7) / 709.7f64.exp() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn ln_agrees_with_the_standard_library() {
        let mut x = 1e-300;
        while x < 1e300 {
            let (ours, theirs) = (ln(x), x.ln());
            assert!(
                (ours - theirs).abs() <= 5e-16 * theirs.abs(),
                "ln({x}) = {ours}, not {theirs}"
            );
            x *= 1.37;
        }
        for i in 1..2000 {
            let x = f64::from(i) * 0.001;
            assert!(
                (ln(x) - x.ln()).abs() <= 6e-16 * x.ln().abs().max(1e-3),
                "ln({x})"
            );
        }
        assert_eq!(ln(1.0).to_bits(), 0.0f64.to_bits());
    }
}
