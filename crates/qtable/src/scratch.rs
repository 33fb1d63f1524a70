//! Room to work in.

/// A buffer kept between calls so that they allocate nothing. What is in it is no part of its
/// owner's state: it is not saved, and two of them are always equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch(Vec<f64>);

impl Scratch {
    /// The buffer with a length, holding whatever it held.
    pub(crate) fn of_length(&mut self, length: usize) -> &mut [f64] {
        self.0.resize(length, 0.0);
        &mut self.0
    }
}

impl PartialEq for Scratch {
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}
