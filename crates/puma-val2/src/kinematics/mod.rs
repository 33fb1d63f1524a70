//! The arm's geometry: parameters, joint angles to poses and back, poses as VAL writes them.

mod drive_train;
mod forward;
mod inverse;
mod params;
mod xyzoat;

pub use drive_train::DriveTrain;
pub use inverse::{ArmSide, Configuration, Elbow, Solution, Solutions, Unreachable, Wrist};
pub use params::{JointRange, PumaParams};
pub use xyzoat::Xyzoat;
