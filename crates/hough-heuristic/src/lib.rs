//! Finds circles in an edge image by sampling three pixels and checking the image itself, with no
//! accumulator.
//!
//! A frame passes two stages, each behind a trait with one principal method. An [`EdgeDetector`]
//! turns the [`GrayImage`](image::GrayImage) into an [`EdgeMap`]: the edge image, the list of its
//! lighted pixels that the literature calls the structure `D`, and where it is known the gradient
//! of each. A [`CircleDetector`] turns the frame into [`Detection`]s, best first, each a [`Circle`]
//! with a score between 0 and 1 that means the same at every radius.
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
//! let ball = detector.detect(&frame)?[0];
//! assert!((ball.circle.x - 100.0).abs() < 0.5 && (ball.circle.radius - 28.0).abs() < 0.5);
//! assert!(ball.score > 0.9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Detectors
//!
//! * [`AContrario`]: for real photographs. An unknown number of circles, each proven against chance
//!   and measured with its standard error, in a bounded number of draws; goes beyond the paper.
//!   [`detect_circles`] is a call of it.
//! * [`Heuristic`]: a random search that needs no memory but the edges themselves. The detector of
//!   the paper this project follows (section 2.1).
//! * [`RandomizedHough`] and [`StandardHough`]: the two transforms the paper compares it with. They
//!   accept circles by the same rules ([`Acceptance`]), so that what differs is the search.
//! * [`CurveSearch`]: the paper's algorithm as it stands there, for any [`Curve`] given by n
//!   pixels, such as [`Line`] and [`Ellipse`].
//!
//! # Edges
//!
//! [`Canny`] is the crate's own operator, fast enough to be unnoticed at 50 frames a second, with
//! sub-pixel positions and thresholds that rise with the frame's noise; [`ImageprocCanny`] is that
//! of the crate `imageproc`. [`EdgeMap::from_image`] takes the edges of any other.
//!
//! # Frames
//!
//! A [`FrameSource`] delivers them: `ImageFiles` from files and folders (feature `files`, on by
//! default), [`FrameStream`] from any reader, so also from a camera through a pipe.
//!
//! # Conventions
//!
//! Coordinates are pixels with `(0, 0)` at the *centre* of the top-left pixel, x to the right and y
//! down; [`Features`] are units that do not depend on the resolution. A detector owns its buffers,
//! so use one detector for many frames: it allocates only for a frame that is larger, or has more
//! edges, or takes more draws or votes than all before it. What it finds depends on its
//! configuration (seed included) and the frame, never on the frames before, and is the same on
//! every machine whose square roots are IEEE's; only [`StandardHough`] and [`Ellipse`] go through
//! sines and arc tangents, whose last bits differ between platforms.
//!
//! # Limitations
//!
//! [`AContrario`] finds what is round: lamps, wheels and letters too. The others go by β:
//!
//! β asks whether pixels of the circle are edges, not whether those edges run along it. Where edges
//! cover more than a tenth of the picture, as in grass or gravel, chance alone lifts β above any
//! useful θ, and what is found there means little. A sphere far off the optical axis projects to an
//! ellipse; a larger `tolerance` forgives a little of that.

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
#[cfg(feature = "cli")]
pub mod program;
mod region;
mod sampling;
mod stages;
mod transforms;

pub use a_contrario::{AContrario, AContrarioConfig, Effort, Measurement, detect_circles};
pub use acceptance::Acceptance;
pub use circle::{Circle, Features};
pub use curve::{Curve, Ellipse, Line};
pub use detect::{CircleDetector, Detection, FrameRefused};
#[cfg(feature = "imageproc")]
pub use edges::ImageprocCanny;
pub use edges::{Canny, CannyConfig, EdgeDetector, EdgeGradient, EdgeMap, EdgePixel};
pub use edges::{Vectorized, widest};
pub use error::ConfigError;
#[cfg(feature = "files")]
pub use frame::ImageFiles;
pub use frame::{FrameError, FrameSource, FrameStream, Y4mWriter};
pub use image;
pub use region::Region;
pub use sampling::Sampling;
pub use stages::Stages;
pub use transforms::{
    CurveSearch, CurveSearchConfig, FoundCurve, Heuristic, HeuristicConfig, RandomizedHough,
    RandomizedHoughConfig, StandardHough, StandardHoughConfig,
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
