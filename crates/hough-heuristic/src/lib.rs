//! Finds circles in an edge image by sampling three pixels and checking the image itself, with no accumulator.

mod circle;
mod detect;
mod frame;

pub use circle::{Circle, Features};
pub use detect::{CircleDetector, Detection};
pub use frame::{FrameError, FrameSource};
pub use image;
