//! Kinematics of the PUMA 560, a client for its VAL II controller, and an emulator of that
//! controller.
//!
//! * [`PumaParams`] holds the geometry of the arm. It turns [`Joints`] into a hand pose
//!   ([`PumaParams::forward`]) and back: [`PumaParams::inverse`] returns all eight postures,
//!   [`PumaParams::inverse_near`] the nearest one in range. [`Xyzoat`] is a pose in VAL's own six
//!   numbers. [`Frames`] holds `BASE` and `TOOL`, [`DriveTrain`] gears, [`ArmDynamics`]
//!   masses and torques. An [`Arm`] is any other arm as data, a UR5 for example.
//! * [`Emulator`] is a controller without threads and without a clock: bytes in, bytes and
//!   [`Event`]s out, at times that the caller names. [`Profile`] holds everything that is not known
//!   for certain about real controllers. [`EmulatorServer`] serves it on a pseudo-terminal or a
//!   socket; so does the program `val2 emulate` (feature `cli`).
//! * [`Val2Client`] is a controller's client over a [`Transport`]: a `SerialLine` (feature
//!   `serial`), a [`TcpLine`], or a [`MemoryLine`] with an emulator inside. It implements
//!   [`Manipulator`] and [`ProximitySensor`], the two narrow traits for programs that control an
//!   arm.
//!
//! Angles are radians and lengths metres. Names that end in `degrees` or `val` are the exception:
//! they hold VAL's degrees and millimetres. Joint angles are VAL's own, those that `WHERE` prints.
//!
//! ```
//! use puma_val2::{
//!     ArmError, ClientConfig, Emulator, Gripper, Joints, Manipulator, MemoryLine, Profile,
//!     PumaParams, Val2Client,
//! };
//!
//! fn main() -> Result<(), ArmError> {
//!     let arm = PumaParams::unimation();
//!     let line = MemoryLine::new(Emulator::new(arm, Profile::val2()));
//!     let mut client = Val2Client::connect(line, ClientConfig::default())?;
//!     client.calibrate()?;
//!     client.move_to(Joints::from_degrees([0.0, -45.0, 180.0, 0.0, 45.0, 0.0]))?;
//!     client.set_gripper(Gripper::Closed)?;
//!     let hand = client.where_()?.hand;
//!     assert_eq!(hand.to_string(), "X 625.92 Y 149.09 Z -42.78 O 90.000 A 90.000 T 0.000");
//!     Ok(())
//! }
//! ```
//!
//! # Faults on the line
//!
//! Serial lines lose, double and change characters, controllers restart, people press buttons. The
//! rule of [`Val2Client`]: **a relative motion is never repeated blindly.** After any doubt about
//! an exchange, the client reads the position and commands only the rest of the way.
//!
//! Checks come before the motion. A typed line is compared with its echo before it is ended, the
//! values of a point with the controller's display of them, a program with its listing, and the two
//! halves of `WHERE` with each other. Angles from the resident program ([`Resident`]) are accepted
//! if they are those of the goal or are shown twice.
//!
//! A call ends with the arm at its goal or with a typed [`ArmError`]. After an error the arm is
//! stopped as far as the line allows it, and [`Val2Client::last_known`] is `None` where the last
//! angles may be wrong. Every wait and every buffer is bounded.
//!
//! If the end of a line is not echoed, the client deletes the line or makes it invalid before it
//! sends anything else: an empty line could carry out the damaged one. Commands end with a blank,
//! so that a doubled last character is harmless. A point that is opened again must show its earlier
//! values, which proves that its name arrived undamaged. A program that asks for values is
//! cancelled, since it might take an empty line for zeros.
//!
//! Without an echo a single line cannot be checked. [`MoveWay::Automatic`] and
//! [`Val2Client::move_hand`] then move by `POINT`, whose display is compared, and a stored program
//! (`PGMOVE`), which shows a sum of the point's values and moves only after an answer. Motions by
//! `DRIVE` or `#PPOINT` are refused.
//!
//! [`Val2Client::arm_proximity`] lets the controller itself stop the arm on a signal. While this
//! guard is armed, every motion is guarded or refused. A short pulse counts too: the program that
//! the signal calls records it in a variable.
//!
//! `cargo test -p puma-val2 --test it faults -- --nocapture` damages, loses and doubles each
//! character of each kind of call, cuts and closes the line there, and counts the faults recovered
//! from and reported.
//!
//! [`Val2Client::connect`] neither stops the arm or a program nor sets the speed, unless asked to.
//! [`Val2Client::stop_on`] stops an arm that moves for another program, over any line and without a
//! prompt. [`Val2Client::store_program`] and [`Val2Client::restore`] replace a program only after
//! the new one has been listed and compared.
//!
//! # Cost of a move
//!
//! At 9600 baud a character takes a millisecond. Measured on the emulator with a paced line and an
//! arm that takes no time (`cargo test -p puma-val2 --test it budget -- --nocapture`), each move
//! confirmed; *quiet* is [`ClientConfig::quiet`]:
//!
//! | a move of | characters sent | received | moves per second, 30 ms quiet | 5 ms quiet |
//! |---|---|---|---|---|
//! | one joint, `DRIVE` | 28 | 251 | 3.1 | 3.6 |
//! | two joints, two `DRIVE`s | 48 | 273 | 2.6 | 3.3 |
//! | three joints, three `DRIVE`s | 70 | 297 | 2.3 | 3.0 |
//! | three joints, `POINT` and `MOVE` | 76 | 569 | 1.3 | 1.6 |
//! | three joints, `MOVE #PPOINT` | 42 | 265 | 2.9 | 3.5 |
//! | three joints, under a proximity guard | 88 | 609 | 1.2 | 1.5 |
//! | three joints, resident program | 23 | 72 | 9.3 | 12.2 |
//!
//! `WHERE` alone is 230 of the characters received. [`MoveWay::Automatic`] takes `DRIVE` for one
//! joint, `#PPOINT` for several, and `POINT` where the controller does not know `#PPOINT`. `DRIVE`
//! moves several joints one after the other. [`Val2Client::resident`] puts a small program into the
//! controller that answers each move with the joint angles reached. It needs an echo, and no
//! proximity guard can watch it.
//!
//! # Limitations
//!
//! * The VAL II manual could not be consulted; see [`Profile`]. Wording, widths and optional
//!   behaviour of a real controller will differ from the emulator's defaults. The client does not
//!   depend on them.
//! * The emulated servos follow exactly: no dynamics in the motion, no collision, no servoed hand.
//! * Successive motions of an emulated program blend unless `BREAK`, `FINE`, `DISABLE CP` or an
//!   instruction that waits for the arm stands between them. The program runs on to the next motion
//!   28 ms before the arm slows down, so that among short motions it is ahead of the arm by the
//!   stopping distance. How far a real controller rounds a corner is not known: here a joint uses
//!   80 % of its acceleration for the turn, over at most half of each motion.
//! * `DISABLE CP` and `FINE` end every motion at a stand; `COARSE`, `NULL`, `NONULL` and `INTOFF`
//!   change nothing, since the tolerances of a real controller's servos are not known.
//! * Motions given by `DO` never blend, and a speed set while the arm moves holds from the next
//!   motion on.
//! * A process-control program (`PCEXECUTE`) runs beside the robot's. It has no arm, and its `CALL`
//!   takes no arguments; a real controller may allow more.
//! * The supervisory port (DDCMP) and `ALTER` are missing.
//! * A client waits until its call is done, and [`Manipulator::stop`] cannot be called meanwhile.
//!   [`Val2Client::stop_on`] stops the arm over any line, from a fresh process too. Neither
//!   replaces the emergency stop, which is a button.

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
pub use emulator::{Emulator, Event, Fault, Message, Place, Profile, TextError};
pub use error::ArmError;
pub use joints::{Joint, JointDelta, Joints};
pub use kinematics::{
    Arm, ArmDynamics, Configuration, DriveTrain, Frames, Kinematics, LinkDynamics, PumaParams,
    Singularity, Solution, Unreachable, Xyzoat,
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
