//! The entry of a row's best action.

/// The best action of a row: the lowest index among those of the highest value. It follows from the
/// values, so two are always equal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Best {
    pub(super) value: f64,
    pub(super) action: u32,
    /// Number of offered actions that have the highest value, or `OUTDATED`.
    pub(super) equals: u32,
}

/// Marks a row whose best action has to be searched again.
pub(super) const OUTDATED: u32 = u32::MAX;

impl PartialEq for Best {
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}

impl Best {
    #[inline(always)]
    pub(super) fn new(value: f64, action: u32, equals: u32) -> Self {
        Self {
            value,
            action,
            equals,
        }
    }
}
