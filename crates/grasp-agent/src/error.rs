//! What can go wrong.

use hough_heuristic::FrameError;
use puma_val2::{ArmError, Joint};

/// Why a behaviour could not be made, saved or loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BehaviourError {
    /// A table that does not fit the specification.
    #[error(
        "the table of behaviour `{name}` has {}x{} entries (states x actions) where {}x{} are needed",
        found.0, found.1, expected.0, expected.1
    )]
    Shape {
        /// The behaviour.
        name: String,
        /// States and actions of the specification.
        expected: (usize, usize),
        /// States and actions of the table.
        found: (usize, usize),
    },
    /// A file that holds another behaviour than the one asked for.
    #[error("{}: holds another behaviour than the `{name}` asked for: its {part} differs; train again, or use the specification it was trained for", path.display())]
    Foreign {
        /// The file.
        path: std::path::PathBuf,
        /// The first part of the specification that differs.
        part: &'static str,
        /// The behaviour that was asked for.
        name: String,
    },
    /// A setting that nothing can be learned by.
    #[error("{quantity} of learning at work is {value}; it must be {allowed}")]
    Learning {
        /// Which one.
        quantity: &'static str,
        /// What was given.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// Text that is no behaviour, or none of the one asked for.
    #[error("this text is no behaviour that can be used here: {what}")]
    Text {
        /// What is wrong, and where.
        what: String,
    },
    /// A file that cannot be written or read, or is damaged.
    #[cfg(feature = "serde")]
    #[error(transparent)]
    File(#[from] qtable::FileError),
}

/// Why a run was broken off. The arm stands.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AgentError {
    /// The camera delivered no frame.
    #[error("the camera failed: {0}")]
    Camera(#[from] FrameError),
    /// The arm, or the line to it, failed.
    #[error("the arm failed: {0}")]
    Arm(#[from] ArmError),
    /// The camera delivers the same frame again and again while it is moved.
    #[error(
        "the camera seems to be frozen: {looks} frames in a row, each from another pose, are the same or show the ball at exactly the same place"
    )]
    FrozenCamera {
        /// How many frames.
        looks: usize,
    },
    /// A replayed run took another course than the logged one: another controller, another
    /// configuration, or other knowledge.
    #[error("the replayed run differs from the log at event {event} (counted from 0)")]
    Replay {
        /// The first event that differs.
        event: usize,
    },
    /// The arm does not say where it stands.
    #[error("the arm reports an angle of {joint} that is not finite")]
    Pose {
        /// The first joint that has no finite angle.
        joint: Joint,
    },
    /// A search or a recovery named a viewpoint that is no pose.
    #[error("viewpoint {number} is no pose to look from: its {joint} is not finite")]
    Viewpoint {
        /// Its number.
        number: usize,
        /// The first joint that has no finite angle.
        joint: Joint,
    },
    /// Text that is no saved run.
    #[error("this text is no saved run: {0}")]
    SavedRun(String),
    /// A configuration that cannot work.
    #[error("agent configuration: {0}")]
    Config(String),
}
