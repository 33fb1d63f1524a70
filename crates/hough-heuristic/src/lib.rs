//! Finds circles in an edge image by sampling three pixels and checking the image itself, with no accumulator.
//!
//! A frame passes two stages, each behind a trait of one method. An [`EdgeDetector`] turns the [`GrayImage`] into an
//! [`EdgeMap`]: the edge image, and the list of its lighted pixels that the literature calls the structure `D`. A
//! [`CircleDetector`] turns the frame into [`Detection`]s, best first, each a [`Circle`] with a score between 0 and 1.
//!
//! [`Heuristic`] is the detector of the paper this project follows: a random search that needs no memory but the edges
//! themselves. [`Canny`] is its edge operator.
//!
//! ```
//! use hough_heuristic::image::{GrayImage, Luma};
//! use hough_heuristic::{CircleDetector, Heuristic, HeuristicConfig};
//!
//! // A dark ball of radius 28 before a bright wall.
//! let frame = GrayImage::from_fn(192, 144, |x, y| {
//!     let (dx, dy) = (f64::from(x) - 100.0, f64::from(y) - 70.0);
//!     Luma([if dx.hypot(dy) < 28.0 { 40 } else { 200 }])
//! });
//!
//! let mut detector = Heuristic::with_canny(HeuristicConfig::default())?;
//! let ball = detector.detect(&frame)[0];
//! assert!((ball.circle.x - 100.0).abs() < 0.5 && (ball.circle.radius - 28.0).abs() < 0.5);
//! assert!(ball.score > 0.9);
//! # Ok::<(), hough_heuristic::ConfigError>(())
//! ```
//!
//! Coordinates are pixels with `(0, 0)` at the *centre* of the top-left pixel, x to the right and y down. A detector owns
//! its buffers, so use one detector for many frames; what it finds in a frame does not depend on the frames before.
//!
//! Frames come from a [`FrameSource`]: `ImageFiles` reads files and folders (feature `files`, on by default).
//!
//! [`GrayImage`]: image::GrayImage

mod belonging;
mod circle;
mod curve;
mod detect;
mod edges;
mod error;
mod evidence;
#[cfg(feature = "files")]
mod files;
mod fit;
mod frame;
mod heuristic;
mod randomized_hough;
mod region;
#[cfg(feature = "files")]
mod stages;
mod standard_hough;
mod structure;

pub use circle::{Circle, Features};
pub use curve::{Curve, CurveSearch, CurveSearchConfig, Ellipse, FoundCurve, Line};
pub use detect::{CircleDetector, Detection};
pub use edges::{Canny, CannyConfig, EdgeDetector, EdgeGradient, EdgeMap, EdgePixel, ImageprocCanny};
pub use error::ConfigError;
pub use evidence::Acceptance;
#[cfg(feature = "files")]
pub use files::ImageFiles;
pub use frame::{FrameError, FrameSource, GrayView, RawFrames, Y4mFrames};
pub use heuristic::{Heuristic, HeuristicConfig, Sampling, StageTimes, detect_circles};
pub use image;
pub use randomized_hough::{RandomizedHough, RandomizedHoughConfig};
pub use region::Region;
#[cfg(feature = "files")]
pub use stages::{StageError, write_stages};
pub use standard_hough::{StandardHough, StandardHoughConfig};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
