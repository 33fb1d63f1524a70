//! PUMA 560 kinematics, a VAL II client for the serial line, and a VAL II controller emulator.

mod error;
mod joints;
mod kinematics;
mod manipulator;
mod params;

pub use error::ArmError;
pub use joints::{Joint, JointDelta, Joints};
pub use manipulator::{Gripper, Manipulator, ProximitySensor};
pub use nalgebra;
pub use params::{JointRange, PumaParams};
