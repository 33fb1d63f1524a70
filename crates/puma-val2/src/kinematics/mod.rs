//! The arm's geometry: parameters, joint angles to poses and back, poses as VAL writes them.

mod drive_train;
mod dynamics;
mod forward;
mod frames;
mod inverse;
mod jacobian;
mod params;
mod xyzoat;

pub use drive_train::DriveTrain;
pub use dynamics::{ArmDynamics, LinkDynamics};
pub use frames::Frames;
pub use inverse::{ArmSide, Configuration, Elbow, Solution, Solutions, Unreachable, Wrist};
pub use jacobian::Singularity;
pub use params::{JointRange, PumaParams};
pub use xyzoat::Xyzoat;
