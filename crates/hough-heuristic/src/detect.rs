//! The trait of every circle detector.

use image::GrayImage;

use crate::circle::Circle;
use crate::region::Region;

/// A circle that a detector reports, with its score.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Detection {
    /// The circle, in pixels of the frame.
    pub circle: Circle,
    /// Score, 0..=1, higher is better. Each detector states what it measures.
    pub score: f64,
}

/// Finds circles in monochrome frames.
///
/// A detector owns its buffers, hence `&mut self`. Its result depends on its configuration (seed
/// included) and on the frame, never on the frames before.
pub trait CircleDetector {
    /// Returns the circles of `frame`, best first.
    ///
    /// A frame without circles, the empty frame among them, gives an empty slice.
    ///
    /// # Errors
    /// [`FrameRefused`] if the configuration does not suit a frame of this size.
    fn detect(&mut self, frame: &GrayImage) -> Result<&[Detection], FrameRefused>;
}

/// The reason why a detector did not search a frame.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameRefused {
    /// The region of interest sticks out of the frame.
    #[error(
        "the region of {}x{} px at ({}, {}) sticks out of the {frame_width}x{frame_height} px \
         frame: use frames of the size that the region was made for",
        region.width, region.height, region.left, region.top
    )]
    Region {
        /// The region of the detector's configuration.
        region: Region,
        /// Columns of the frame.
        frame_width: u32,
        /// Rows of the frame.
        frame_height: u32,
    },
    /// The accumulator of a Hough transform would exceed its limit of memory.
    #[error(
        "a {frame_width}x{frame_height} px frame needs an accumulator of {needed} bytes, but \
         max_memory is {limit}: narrow the radius range, or make the cells larger"
    )]
    Accumulator {
        /// Columns of the frame.
        frame_width: u32,
        /// Rows of the frame.
        frame_height: u32,
        /// Memory that the accumulator would take, bytes.
        needed: u64,
        /// Memory that it may take, bytes.
        limit: u64,
    },
}
