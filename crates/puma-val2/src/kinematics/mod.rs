//! The arm's geometry: parameters, joint angles to poses and back, poses as VAL writes them.

pub(crate) mod arm;
pub(crate) mod drive_train;
pub(crate) mod dynamics;
pub(crate) mod forward;
pub(crate) mod frames;
pub(crate) mod inverse;
pub(crate) mod jacobian;
pub(crate) mod params;
#[cfg(feature = "urdf")]
pub(crate) mod urdf;
pub(crate) mod xyzoat;

pub use arm::{Arm, Kinematics};
pub use drive_train::DriveTrain;
pub use dynamics::{ArmDynamics, LinkDynamics};
pub use frames::Frames;
pub use inverse::{Configuration, Solution, Unreachable};
pub use jacobian::Singularity;
pub use params::PumaParams;
pub use xyzoat::Xyzoat;
