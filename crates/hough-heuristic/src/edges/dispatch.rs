//! Chooses the widest vectors that the machine has.
//!
//! The one module of the crate with `unsafe` code: a function compiled for AVX2 may only be called
//! where the processor has AVX2, which the call below checks and the compiler cannot.
#![allow(unsafe_code)]

/// Work that is compiled for several widths of vectors.
///
/// ```
/// use hough_heuristic::Vectorized;
///
/// struct Halve<'a>(&'a mut [f32]);
///
/// impl Vectorized for Halve<'_> {
///     type Output = ();
///
///     #[inline(always)]
///     fn run(self) {
///         self.0.iter_mut().for_each(|value| *value *= 0.5);
///     }
/// }
///
/// let mut values = [3.0; 100];
/// Halve(&mut values).widest();
/// assert_eq!(values, [1.5; 100]);
/// ```
pub trait Vectorized: Sized {
    /// The result.
    type Output;

    /// Does the work. Mark it and the functions that it calls `#[inline(always)]`.
    fn run(self) -> Self::Output;

    /// Does the work by the fastest code for this machine: with AVX2 if the processor has it. The
    /// result does not depend on the machine, since there are no fused multiplications.
    fn widest(self) -> Self::Output {
        widest(self)
    }
}

/// Does the work by the fastest code for this machine.
pub(crate) fn widest<W: Vectorized>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the function needs nothing but AVX2, which has just been detected.
        return unsafe { with_avx2(work) };
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<W: Vectorized>(work: W) -> W::Output {
    work.run()
}
