//! The error of configurations.

use crate::region::Region;

/// A configuration that no detector can be built from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A single parameter lies outside its range.
    #[error("{parameter} is {value}, but must be {expected}")]
    OutOfRange {
        /// The field of the configuration.
        parameter: &'static str,
        /// The value that was given.
        value: f64,
        /// The values that are accepted.
        expected: &'static str,
    },
    /// The radius range is empty, negative, or reaches beyond any frame.
    #[error(
        "the radius range {min}..={max} px is not usable: both ends must lie in 1..=100000, in \
         order"
    )]
    RadiusRange {
        /// The smallest radius, pixels.
        min: f64,
        /// The largest radius, pixels.
        max: f64,
    },
    /// The two thresholds of an edge detector are not in order.
    #[error(
        "the edge thresholds low {low} and high {high} are not usable: 0 < low <= high is needed"
    )]
    Thresholds {
        /// The lower threshold.
        low: f64,
        /// The upper threshold.
        high: f64,
    },
    /// A region of interest is empty, or lies beyond any frame.
    #[error(
        "the region of {}x{} px at ({}, {}) is not usable: it must have pixels, below row and \
         column 4294967295",
        .0.width, .0.height, .0.left, .0.top
    )]
    Region(Region),
}

/// Checks one number; NaN fails every test.
pub(crate) fn require(
    parameter: &'static str,
    value: f64,
    expected: &'static str,
    accepted: bool,
) -> Result<(), ConfigError> {
    if accepted {
        Ok(())
    } else {
        Err(ConfigError::OutOfRange {
            parameter,
            value,
            expected,
        })
    }
}

/// Checks a number of things of which at least one is needed.
pub(crate) fn require_some(parameter: &'static str, count: usize) -> Result<(), ConfigError> {
    require(parameter, count as f64, "at least 1", count > 0)
}

/// Checks a share.
pub(crate) fn require_share(parameter: &'static str, share: f64) -> Result<(), ConfigError> {
    let usable = share > 0.0 && share < 1.0;
    require(parameter, share, "between 0 and 1, both excluded", usable)
}

/// Checks a tolerance: up to 8 px, the counts of near edge pixels fit in a byte.
pub(crate) fn require_tolerance(tolerance: f64) -> Result<(), ConfigError> {
    let usable = (0.0..=8.0).contains(&tolerance);
    require("tolerance", tolerance, "0..=8 px", usable)
}

/// Checks a radius range.
pub(crate) fn require_radii(min: f64, max: f64) -> Result<(), ConfigError> {
    if min >= 1.0 && max >= min && max <= 1e5 {
        Ok(())
    } else {
        Err(ConfigError::RadiusRange { min, max })
    }
}
