//! pipeline-sim

mod ball;
mod camera;
mod cell;
mod ellipse;
mod error;
mod hand;
mod mount;
mod workspace;

pub use ball::{Ball, Holder};
pub use camera::{Camera, Distortion};
pub use cell::{Cell, SightRule, WorkingLimits};
pub use ellipse::Ellipse;
pub use error::{CameraError, ProjectionError};
pub use hand::{Capsule, Hand};
pub use mount::Mount;
pub use workspace::{Coverage, Workspace};
