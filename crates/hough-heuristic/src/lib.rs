//! Circle detectors for gray images: an a contrario detector for photographs, and Hough transforms
//! without and with an accumulator.
//!
//! A [`CircleDetector`] turns a frame, a [`GrayImage`](image::GrayImage), into [`Detection`]s, best
//! first: each is a [`Circle`] with a score between 0 and 1. The three transforms take any
//! [`EdgeDetector`], which turns the frame into an [`EdgeMap`]: the edge image, the list of its
//! edge pixels that the paper calls the structure `D`, and, if known, their gradients.
//!
//! ```
//! use hough_heuristic::image::{GrayImage, Luma};
//! use hough_heuristic::{AContrario, AContrarioConfig, CircleDetector};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     // A dark ball of radius 28 before a bright wall.
//!     let frame = GrayImage::from_fn(192, 144, |x, y| {
//!         let (dx, dy) = (f64::from(x) - 100.0, f64::from(y) - 70.0);
//!         Luma([if dx.hypot(dy) < 28.0 { 40 } else { 200 }])
//!     });
//!
//!     let mut detector = AContrario::new(AContrarioConfig::default())?;
//!     let ball = detector.detect(&frame)?[0];
//!     assert!((ball.circle.x - 100.0).abs() < 0.5 && (ball.circle.radius - 28.0).abs() < 0.5);
//!     assert!(ball.score > 0.9);
//!     Ok(())
//! }
//! ```
//!
//! # Detectors
//!
//! * [`AContrario`]: for photographs. It finds any number of circles, and ellipses if asked for,
//!   each with its number of false alarms and standard errors, in bounded work. It goes beyond the
//!   paper. [`detect_circles`] calls it for a single frame.
//! * [`Heuristic`]: the detector of the paper that this project follows (section 2.1), a random
//!   search whose only memory is the edges.
//! * [`RandomizedHough`] and [`StandardHough`]: the two transforms that the paper compares it with.
//!   All three accept circles by one rule ([`Acceptance`]), so that only the search differs.
//! * [`CurveSearch`]: the paper's algorithm for any [`Curve`] given by n pixels, such as [`Line`]
//!   and [`Ellipse`].
//!
//! # Edges
//!
//! [`Canny`] is the crate's own operator: fused integer passes, sub-pixel positions, thresholds
//! that rise with the frame's noise. `ImageprocCanny` (feature `imageproc`) wraps the operator of
//! the crate `imageproc`. [`EdgeMap::from_image`] accepts the edge image of any other operator.
//!
//! # Frames
//!
//! A [`FrameSource`] delivers frames: `ImageFiles` (feature `files`, on by default) from files and
//! folders, [`FrameStream`] from any reader, so also from a camera through a pipe, `VideoDevice`
//! (feature `v4l2`) from a camera of Linux by name. A frame in memory whose rows are padded becomes
//! a [`GrayImage`](image::GrayImage) by [`FlatSamples`](image::FlatSamples).
//!
//! # Conventions
//!
//! Coordinates are pixels with `(0, 0)` at the *centre* of the top-left pixel, x to the right and y
//! down; [`Features`] are units that do not depend on the resolution. A detector owns its buffers:
//! use one for many frames. It allocates only for a frame that is larger, or has more edges, or
//! takes more draws or votes than all before. Its result depends on its configuration (seed
//! included) and the frame alone, and is the same on every machine with IEEE square roots; only
//! [`StandardHough`] and [`Ellipse`] use sines and arc tangents, whose last bits differ between
//! platforms.
//!
//! # Limitations
//!
//! [`AContrario`] finds everything round, wheels and letters too. It finds no circle of a radius of
//! 4 px or less, none of whose outline a quarter or less is visible (half, where the frame cuts
//! it), and few in a dozen dashes with gaps as long. The other detectors go by the belonging β, the
//! share of the circle's pixels that are edges, whatever the direction of those edges. Where edges
//! cover more than a tenth of the picture, as in grass or gravel, chance lifts β above any useful
//! threshold θ ([`Acceptance::theta`]). A sphere far off the optical axis projects to an ellipse:
//! [`AContrarioConfig::min_axis_ratio`] finds it, a larger `tolerance` accepts it up to a point.
//!
//! *The paper* is C. Distante, A. Anglani and F. Taurisano, "Target Reaching by Using Visual
//! Information and Q-learning Controllers", Autonomous Robots 9 (2000), 41-50.

mod a_contrario;
mod acceptance;
mod circle;
mod clock;
mod curve;
mod detect;
mod edges;
mod error;
mod frame;
#[cfg(feature = "files")]
mod output;
#[cfg(feature = "program")]
mod program;
mod region;
mod sampling;
mod stages;
mod transforms;

pub use a_contrario::{
    AContrario, AContrarioConfig, Effort, MeasuredEllipse, Measurement, Rings, detect_circles,
};
pub use acceptance::Acceptance;
pub use circle::{Circle, Features};
pub use curve::{Curve, Ellipse, Line};
pub use detect::{CircleDetector, Detection, FrameRefused};
#[cfg(feature = "imageproc")]
pub use edges::ImageprocCanny;
pub use edges::{Canny, CannyConfig, EdgeDetector, EdgeMap, EdgePixel, Vectorized};
pub use error::ConfigError;
#[cfg(feature = "v4l2")]
pub use frame::VideoDevice;
#[cfg(feature = "files")]
pub use frame::{Channel, ImageFiles};
pub use frame::{FrameError, FrameSource, FrameStream, Y4mWriter};
pub use image;
#[cfg(feature = "program")]
pub use program::run_detect_circles;
pub use region::Region;
pub use stages::Stages;
pub use transforms::{
    CurveSearch, CurveSearchConfig, Heuristic, HeuristicConfig, RandomizedHough,
    RandomizedHoughConfig, StandardHough, StandardHoughConfig,
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
