//! The stages of a detection, and pictures of them.

#[cfg(feature = "files")]
mod pictures;

#[cfg(feature = "program")]
pub(crate) use pictures::{with_circles, with_ellipses};

use std::time::Duration;

use crate::acceptance::explained_band;
use crate::circle::Circle;
use crate::curve::Curve;
use crate::edges::{EdgeMap, EdgePixel};

/// The stages of a detector's last frame: for pictures and timing.
///
/// A frame that is [refused](crate::FrameRefused) leaves those of the frame before.
#[derive(Clone, Copy, Debug)]
pub struct Stages<'a> {
    /// The edges that the detector worked on.
    pub edges: &'a EdgeMap,
    /// The circles that were looked at closely, in order, if the detector keeps candidates.
    pub candidates: &'a [Circle],
    /// Distance within which an edge pixel matches a circle's pixel, pixels.
    pub tolerance: f64,
    /// Memory that the circle search holds, bytes, edges not included; 0 from
    /// [`AContrario`](crate::AContrario), as all times are.
    pub memory: usize,
    /// Wall-clock time of finding the edges. All times are zero where there is no clock
    /// (`wasm32-unknown-unknown`).
    pub edge_time: Duration,
    /// Wall-clock time of arranging the edge pixels as the structure `D`, and of marking the pixels
    /// near them.
    pub structure_time: Duration,
    /// Wall-clock time of drawing or voting, checking and fitting.
    pub search_time: Duration,
}

impl Stages<'_> {
    /// Returns `true` if the circle, once accepted, explains the edge pixel: such pixels are taken
    /// out of `D`.
    pub fn explains(&self, circle: &Circle, pixel: EdgePixel) -> bool {
        circle.distance(pixel.x.into(), pixel.y.into())
            <= explained_band(self.tolerance, circle.radius)
    }
}
