//! PUMA 560 kinematics, a VAL II client for the serial line, and a VAL II controller emulator.
//!
//! Whoever owns a PUMA can drive it with this crate; whoever does not can talk to an emulated one.
//! Three things meet here:
//!
//! * [`PumaParams`] is the arm as numbers. It turns [`Joints`] into a hand pose
//!   ([`PumaParams::forward`]) and back ([`PumaParams::inverse`], all eight postures;
//!   [`PumaParams::inverse_near`], the nearest one in range), gives the Jacobian and names
//!   singularities. [`Xyzoat`] is a pose in VAL's own six numbers, [`Frames`] what `BASE` and
//!   `TOOL` add, [`DriveTrain`] the way from motor to joint, [`ArmDynamics`] the torques.
//! * [`Emulator`] is a controller: bytes in, bytes and [`Event`]s out, at times that the caller
//!   names. What is not known for certain about real controllers is a [`Profile`]. [`PtyServer`]
//!   and [`TcpServer`] serve it; `cargo run --example val2_emulator` does so from the command line.
//! * [`Val2Client`] is the other end: typed calls over a [`Transport`], which is a `SerialLine`
//!   (feature `serial`), a [`TcpLine`], or a [`MemoryLine`] with an emulator inside. It is a
//!   [`Manipulator`] and a [`ProximitySensor`], the two narrow traits by which a controlling
//!   program should know it.
//!
//! Angles are radians and lengths metres everywhere, but for names that say otherwise (`degrees`,
//! `val`): VAL itself speaks degrees and millimetres. Joint angles are VAL's own, what `WHERE`
//! prints.
//!
//! ```
//! use puma_val2::{ClientConfig, Emulator, Gripper, Joints, Manipulator, MemoryLine, Profile, PumaParams, Val2Client};
//!
//! # fn main() -> Result<(), puma_val2::ArmError> {
//! let arm = PumaParams::unimation();
//! let line = MemoryLine::new(Emulator::new(arm, Profile::val2()));
//! let mut client = Val2Client::connect(line, ClientConfig::default())?;
//! client.calibrate()?;
//! client.move_to(Joints::from_degrees([0.0, -45.0, 180.0, 0.0, 45.0, 0.0]))?;
//! client.set_gripper(Gripper::Closed)?;
//! let place = client.where_()?;
//! assert_eq!(place.hand.to_string(), "X 625.92 Y 149.09 Z -42.78 O 90.000 A 90.000 T 0.000");
//! # Ok(())
//! # }
//! ```
//!
//! # Faults on the line
//!
//! Serial lines lose, double and change characters, controllers restart, people press buttons. The
//! rule of [`Val2Client`]: **a relative motion is never repeated blindly.** After any doubt about
//! what the controller has understood the position is read, and only what is missing from there to
//! the goal is commanded. Before that, what is typed is compared with its echo before its line is
//! ended, the values of a point with what the controller shows of them, a program with its listing,
//! and the two halves of `WHERE` with each other; what the resident program shows is believed when
//! it is where the arm was sent, or is shown twice. A call ends with the arm at its goal, or with a
//! typed [`ArmError`], the arm stopped as far as the line allows it, and its last known joint
//! angles kept ([`Val2Client::last_known`] is `None` where they may not be right any more). No wait
//! is without end, nor is what is kept of a line that never falls silent.
//!
//! A controller that echoes nothing gives no such check for a bare line: [`MoveWay::Automatic`] and
//! [`Val2Client::move_hand`] then move by `POINT`, whose display shows what has arrived. With
//! [`MoveWay::Drive`] on such a line a changed digit is found out only after the motion.
//!
//! [`Val2Client::arm_proximity`] lets the controller itself stop the arm by a signal. Every motion
//! is guarded then or refused, and a signal that was on for a moment only is not overlooked: the
//! program that it calls keeps it in a variable.
//!
//! `cargo test --test faults -- --nocapture` damages, loses and doubles characters of each kind of
//! call one by one, cuts and closes the line at each of them, and says how many faults were
//! recovered from and how many were reported. A program that asks for values is never answered with
//! an empty line before it has been tried to cancel it: it might take that for zeros and move.
//!
//! # What a move costs
//!
//! At 9600 baud a character takes a millisecond. Measured on the emulator with a paced line and an
//! arm that takes no time (`cargo test --test budget -- --nocapture`), each move confirmed:
//!
//! | a move of | characters sent | received | moves per second, 30 ms quiet | 5 ms quiet |
//! |---|---|---|---|---|
//! | one joint, `DRIVE` | 27 | 250 | 3.1 | 3.7 |
//! | two joints, two `DRIVE`s | 46 | 271 | 2.6 | 3.3 |
//! | three joints, three `DRIVE`s | 67 | 294 | 2.3 | 3.0 |
//! | three joints, `POINT` and `MOVE` | 74 | 567 | 1.3 | 1.6 |
//! | three joints, `MOVE #PPOINT` | 42 | 265 | 2.9 | 3.5 |
//! | three joints, under a proximity guard | 85 | 606 | 1.2 | 1.5 |
//! | three joints, resident program | 23 | 72 | 9.3 | 12.2 |
//!
//! `WHERE` alone is 230 of the characters received. [`MoveWay::Automatic`] takes `DRIVE` for one
//! joint, `#PPOINT` for several, and `POINT` where the controller does not know `#PPOINT` (joints
//! that are driven one after the other add up their times). [`Val2Client::resident`] puts a small
//! program into the controller that answers each move with the joint angles reached; it can neither
//! be guarded nor checked without an echo.
//!
//! # Limitations
//!
//! * The VAL II manual could not be consulted; see [`Profile`]. Wording, widths and optional
//!   behaviour of a real controller will differ from the emulator's defaults. The client does not
//!   depend on them.
//! * The emulated servos follow exactly; there is no dynamics in the motion, no collision, no
//!   servoed hand.
//! * The supervisory port (DDCMP) and `ALTER` are not there.
//! * A client waits until its call is done. [`Val2Client::panic_stop`] cannot be called meanwhile:
//!   an emergency stop is a button, not a program.

mod client;
mod emulator;
mod error;
mod joints;
mod kinematics;
mod limits;
mod manipulator;
#[cfg(feature = "cli")]
mod program;
mod serve;
mod transport;

pub use client::{ClientConfig, GuardedArm, Location, MoveWay, Resident, Val2Client};
pub use emulator::{
    BootQuestion, Emulator, Event, Fault, Message, Place, Profile, StartPower, TextError,
};
pub use error::ArmError;
pub use joints::{Joint, JointDelta, Joints};
pub use kinematics::{
    ArmDynamics, ArmSide, Configuration, DriveTrain, Elbow, Frames, LinkDynamics, PumaParams,
    Singularity, Solution, Unreachable, Wrist, Xyzoat,
};
pub use limits::JointRange;
pub use manipulator::{Gripper, Manipulator, ProximitySensor};
pub use nalgebra;
pub use serve::{EmulatorServer, ServeConfig};
#[cfg(feature = "serial")]
pub use transport::SerialLine;
pub use transport::{MemoryLine, Recorded, TcpLine, Transport};

#[cfg(feature = "cli")]
pub use program::val2;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
