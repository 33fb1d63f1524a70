//! The moves of the paper's behaviours.

/// The moves that a behaviour chooses from (sections 3.1.1 and 3.1.2 of the paper), degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MoveLists {
    /// Moves of `JT1`.
    pub jt1: [f64; 9],
    /// Moves of `JT2`.
    pub jt2: [f64; 9],
    /// Moves of `JT3`.
    pub jt3: [f64; 9],
}

impl MoveLists {
    /// The lists used throughout. The paper gives their first members (-5, -1 for `JT1`; -20, -6
    /// for `JT2`; -16, -5 for `JT3`) and their length; the rest continues them symmetrically.
    pub fn paper() -> Self {
        Self {
            jt1: [-5.0, -1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0, 5.0],
            jt2: [-20.0, -6.0, -2.0, -0.6, 0.0, 0.6, 2.0, 6.0, 20.0],
            jt3: [-16.0, -5.0, -1.6, -0.5, 0.0, 0.5, 1.6, 5.0, 16.0],
        }
    }
}

impl Default for MoveLists {
    fn default() -> Self {
        Self::paper()
    }
}
