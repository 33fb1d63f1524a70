//! Errors.

use hough_heuristic::FrameError;
use puma_val2::{ArmError, Joint};

use crate::run::event::RunEvent;

/// Reason why a behaviour could not be made, learned, saved or loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BehaviourError {
    /// A table does not fit the specification.
    #[error(
        "the table of behaviour `{name}` has {}x{} entries (states x actions), expected {}x{}",
        found.0, found.1, expected.0, expected.1
    )]
    Shape {
        /// Name of the behaviour.
        name: String,
        /// States and actions of the specification.
        expected: (usize, usize),
        /// States and actions of the table.
        found: (usize, usize),
    },
    /// A file holds another behaviour than the one asked for.
    #[error(
        "{}: holds another behaviour than `{name}`: its {part} differs; train again, or use the \
         specification it was trained for",
        path.display()
    )]
    Foreign {
        /// The file.
        path: std::path::PathBuf,
        /// First part of the specification that differs.
        part: &'static str,
        /// Name of the behaviour asked for.
        name: String,
    },
    /// Settings cannot work.
    #[error("settings: {0}")]
    Settings(String),
    /// Training failed: settings out of range, or a reward that is not a number.
    #[error("training: {0}")]
    Training(#[from] qtable::Error),
    /// A text is not a behaviour, policy, belief or controller that can be used here.
    #[error("this text cannot be used here: {what}")]
    Text {
        /// The fault and its place.
        what: String,
    },
    /// A file cannot be written or read, or is damaged.
    #[error(transparent)]
    File(#[from] qtable::FileError),
}

impl From<String> for BehaviourError {
    fn from(fault: String) -> Self {
        Self::Settings(fault)
    }
}

/// Reason why a run was broken off. The arm has been told to stop.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AgentError {
    /// The camera delivered no frame, or the frame could not be searched.
    #[error("the camera failed: {0}")]
    Camera(#[from] FrameError),
    /// The arm, or the line to it, failed.
    #[error("the arm failed: {0}")]
    Arm(#[from] ArmError),
    /// The image has not changed although the arm has moved.
    #[error(
        "the camera seems to be frozen: {looks} images in a row, each from another pose, are the \
         same"
    )]
    FrozenCamera {
        /// Number of images.
        looks: usize,
    },
    /// A small move has not displaced the ball in the image.
    #[error(
        "the image has not changed in {looks} looks after a small move: the camera delivers old \
         images, or the arm has not moved; see AgentConfig::lag_check"
    )]
    Unchanged {
        /// Number of looks after the move.
        looks: usize,
    },
    /// A replayed run took another course than the logged one: another controller, other settings,
    /// or other knowledge.
    #[error("the replayed run differs from the log at event {event} (counted from 0)")]
    Replay {
        /// Index of the first event that differs.
        event: usize,
        /// That event in the log; `None` if the log has ended before.
        then: Option<Box<RunEvent<'static>>>,
        /// That event in the replay; `None` if the replay has ended before.
        now: Option<Box<RunEvent<'static>>>,
    },
    /// The arm reports an angle that is not finite.
    #[error("the arm reports an angle of {name} that is not finite")]
    Pose {
        /// First joint without a finite angle.
        joint: Joint,
        /// Its name, see [`AgentConfig::joint_names`](crate::AgentConfig::joint_names).
        name: String,
    },
    /// A search or a recovery named a pose that is not finite.
    #[error("viewpoint {number} is no pose to look from: its {name} is not finite")]
    Viewpoint {
        /// Number of the viewpoint.
        number: usize,
        /// First joint without a finite angle.
        joint: Joint,
        /// Its name.
        name: String,
    },
    /// A text is not a saved run, or its controller cannot be made again.
    #[error("this text is no saved run: {0}")]
    SavedRun(String),
    /// Looks from which a camera cannot be calibrated.
    #[error("calibration: {0}")]
    Calibration(String),
    /// Settings cannot work.
    #[error("agent configuration: {0}")]
    Config(String),
}
