//! What speaks against a circle, as numbers that its certainty is changed by.

/// The evidence against a circle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Against {
    /// The part of the certainty that refuted rays leave.
    pub(super) left: f32,
    /// Certainty subtracted for outlines that go on off the circle.
    pub(super) price: f32,
}

impl Against {
    /// Returns `true` if nothing speaks against the circle.
    pub(super) fn is_none(&self) -> bool {
        self.left >= 1.0 && self.price <= 0.0
    }
}

impl Default for Against {
    fn default() -> Self {
        Self {
            left: 1.0,
            price: 0.0,
        }
    }
}
