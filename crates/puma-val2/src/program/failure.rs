//! Failures of the program and their exit codes.

use std::error::Error;
use std::io;

use crate::error::ArmError;

/// Text for the standard error and the exit code.
#[derive(Debug)]
pub(super) struct Failure {
    pub(super) text: String,
    pub(super) code: u8,
}

impl Failure {
    pub(super) fn usage(text: impl Into<String>) -> Self {
        let (text, code) = (text.into(), 2);
        Self { text, code }
    }

    pub(super) fn unconfirmed(text: impl Into<String>) -> Self {
        let (text, code) = (text.into(), 5);
        Self { text, code }
    }
}

impl From<Box<dyn Error>> for Failure {
    fn from(error: Box<dyn Error>) -> Self {
        let (text, code) = (error.to_string(), 1);
        Self { text, code }
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        // Whoever reads the output has enough of it.
        if error.kind() == io::ErrorKind::BrokenPipe {
            let (text, code) = (String::new(), 141);
            return Self { text, code };
        }
        let (text, code) = (error.to_string(), 1);
        Self { text, code }
    }
}

impl From<ArmError> for Failure {
    fn from(error: ArmError) -> Self {
        let code = match &error {
            ArmError::Setting { .. } | ArmError::JointLimit { .. } | ArmError::NotFinite { .. } => {
                2
            }
            ArmError::Refused { .. } | ArmError::Step { .. } | ArmError::Asked { .. } => 3,
            ArmError::Open { .. }
            | ArmError::Line { .. }
            | ArmError::Silence { .. }
            | ArmError::Garbled { .. }
            | ArmError::Restarted { .. } => 4,
            ArmError::Conflict { .. } => 5,
            ArmError::Busy { .. } | ArmError::Unconfirmed { .. } => 6,
            ArmError::NotReached { .. }
            | ArmError::Other(_)
            | ArmError::ProximityStop { .. }
            | ArmError::Text { .. } => 1,
        };
        let text = error.to_string();
        Self { text, code }
    }
}
