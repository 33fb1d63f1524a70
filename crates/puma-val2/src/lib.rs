//! PUMA 560 kinematics, a VAL II client for the serial line, and a VAL II controller emulator.

mod client;
mod emulator;
mod error;
mod joints;
mod kinematics;
mod manipulator;
mod serve;
mod transport;

pub use client::{ClientConfig, Ending, Location, MoveWay, ReplyReader, Resident, Val2Client};
pub use emulator::{
    BootQuestion, Emulator, Event, Fault, Message, Place, Profile, StartPower, TextError, WhereLayout,
    char_time,
};
pub use error::ArmError;
pub use joints::{Joint, JointDelta, Joints};
pub use kinematics::{
    ArmDynamics, ArmSide, Configuration, DriveTrain, Elbow, Frames, JointRange, LinkDynamics, PumaParams,
    Singularity, Solution, Solutions, Unreachable, Wrist, Xyzoat,
};
pub use manipulator::{Gripper, Manipulator, ProximitySensor};
pub use nalgebra;
#[cfg(unix)]
pub use serve::PtyServer;
pub use serve::{ServeConfig, TcpServer};
#[cfg(feature = "serial")]
pub use transport::SerialLine;
pub use transport::{MemoryLine, Recorded, TcpLine, Transport};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
