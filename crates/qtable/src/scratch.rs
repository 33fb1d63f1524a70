//! A buffer that is reused.

/// A buffer kept between calls so that they allocate nothing. It is no part of its owner's state:
/// it is not saved, and two buffers are always equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch(Vec<f64>);

impl Scratch {
    /// Returns the buffer with a length, with its old contents.
    #[inline(always)]
    pub(crate) fn of_length(&mut self, length: usize) -> &mut [f64] {
        if self.0.len() != length {
            self.0.resize(length, 0.0);
        }
        &mut self.0
    }
}

impl PartialEq for Scratch {
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}
