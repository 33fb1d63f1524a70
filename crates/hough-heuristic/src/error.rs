//! Why a configuration was refused.

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
        "the radius range {min}..={max} px is not usable: both ends must lie in 1..=100000, in order"
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
    /// The rows of a frame in memory overlap.
    #[error("the stride of {stride} bytes is below the frame's width of {width} px")]
    Stride {
        /// Bytes from one row to the next.
        stride: usize,
        /// Pixels in a row.
        width: u32,
    },
    /// A frame in memory is cut short.
    #[error("the buffer of {given} bytes is too short: the frame needs {needed}")]
    Buffer {
        /// Its length, bytes.
        given: usize,
        /// The bytes up to the last pixel.
        needed: usize,
    },
    /// A region of interest is empty or sticks out of its frame.
    #[error(
        "the region of {width}x{height} px at ({left}, {top}) is empty or sticks out of the {frame_width}x{frame_height} px frame"
    )]
    Region {
        /// Leftmost column.
        left: u32,
        /// Top row.
        top: u32,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Columns of the frame.
        frame_width: u32,
        /// Rows of the frame.
        frame_height: u32,
    },
    /// The accumulator of a Hough transform would take more memory than it may.
    #[error(
        "a {frame_width}x{frame_height} px frame needs an accumulator of {needed} bytes, but max_memory is {limit}: narrow \
         the radius range, or make the cells larger"
    )]
    Accumulator {
        /// Columns of the frame.
        frame_width: u32,
        /// Rows of the frame.
        frame_height: u32,
        /// The memory it would take, bytes.
        needed: u64,
        /// The most it may take, bytes.
        limit: u64,
    },
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

/// Checks a radius range.
pub(crate) fn require_radii(min: f64, max: f64) -> Result<(), ConfigError> {
    if min >= 1.0 && max >= min && max <= 1e5 {
        Ok(())
    } else {
        Err(ConfigError::RadiusRange { min, max })
    }
}
