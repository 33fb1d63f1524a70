//! pipeline-sim

mod ball;
mod camera;
mod cell;
mod centre_model;
mod ellipse;
mod error;
mod hand;
mod least_squares;
mod mount;
mod reach_model;
mod samples;
mod workspace;

pub use ball::{Ball, Holder};
pub use camera::{Camera, Distortion};
pub use cell::{Cell, SightRule, WorkingLimits};
pub use centre_model::CentreModel;
pub use ellipse::Ellipse;
pub use error::{CameraError, ProjectionError};
pub use hand::{Capsule, Hand};
pub use least_squares::{FitError, Quality};
pub use mount::Mount;
pub use reach_model::{ReachForm, ReachModel};
pub use samples::{CentreSample, MoveLists, ReachSample, exploring_start, sample_moves, with_noise};
pub use workspace::{Coverage, Workspace};
