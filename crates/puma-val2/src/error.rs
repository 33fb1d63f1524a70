//! What can go wrong between a controller program and an arm.

use std::io;
use std::time::Duration;

use crate::joints::{Joint, Joints};

/// Why an arm did not do what it was asked to.
///
/// `port` names the line as the caller gave it: a device path, a socket address, or a word for an
/// arm in memory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// The device or socket could not be opened: no such port, no permission, held by another
    /// program.
    #[error("{port}: cannot be opened: {source}")]
    Open {
        /// The line.
        port: String,
        /// What the system said.
        source: io::Error,
    },
    /// The line failed in use: unplugged, closed by the other side.
    #[error("{port}: the line failed while {doing}: {source}")]
    Line {
        /// The line.
        port: String,
        /// What was under way.
        doing: String,
        /// What the system said.
        source: io::Error,
    },
    /// Nothing, or not enough, came back in time.
    #[error(
        "{port}: no complete answer to `{sent}` within {waited:?}: expected {expected}, heard {heard:?}"
    )]
    Silence {
        /// The line.
        port: String,
        /// What had been sent.
        sent: String,
        /// What would have been a complete answer.
        expected: String,
        /// What had come until then, shortened.
        heard: String,
        /// How long was waited.
        waited: Duration,
    },
    /// Something came back that cannot be understood.
    #[error("{port}: the answer to `{sent}` makes no sense: expected {expected}, heard {heard:?}")]
    Garbled {
        /// The line.
        port: String,
        /// What had been sent.
        sent: String,
        /// What would have made sense.
        expected: String,
        /// What came instead, shortened.
        heard: String,
    },
    /// The controller understood and refused, with its own message.
    #[error("{port}: `{sent}` was refused by the controller: *{message}*")]
    Refused {
        /// The line.
        port: String,
        /// What had been sent.
        sent: String,
        /// The controller's words, without the asterisks.
        message: String,
    },
    /// The arm stands, but not where it was sent.
    #[error(
        "{port}: {joint} was sent to {wanted_degrees:.3} degrees but reports {reported_degrees:.3}"
    )]
    NotReached {
        /// The line.
        port: String,
        /// The joint that is furthest off.
        joint: Joint,
        /// Where it should be.
        wanted_degrees: f64,
        /// Where it says it is.
        reported_degrees: f64,
    },
    /// A move would take a joint out of its limits; nothing was sent.
    #[error(
        "{joint} cannot go to {wanted_degrees:.3} degrees: its range is {min_degrees:.1} to {max_degrees:.1}"
    )]
    JointLimit {
        /// The joint.
        joint: Joint,
        /// Where it was to go.
        wanted_degrees: f64,
        /// Lower limit.
        min_degrees: f64,
        /// Upper limit.
        max_degrees: f64,
    },
    /// An angle is NaN or infinite; nothing was sent.
    #[error("the angle asked of {joint} is not a finite number")]
    NotFinite {
        /// The joint.
        joint: Joint,
    },
    /// The controller has been started again in mid-session: it asks its start-up questions. It
    /// must be connected to and calibrated anew.
    #[error(
        "{port}: the controller has been restarted: it says {heard:?}; connect and calibrate again"
    )]
    Restarted {
        /// The line.
        port: String,
        /// What it said.
        heard: String,
    },
    /// A motion was commanded and it can no longer be found out where the arm is. The words that
    /// stop it have been sent if the line took them.
    #[error("{port}: the outcome of a motion is not known: {cause}")]
    Unconfirmed {
        /// The line.
        port: String,
        /// The joint angles that the arm last reported.
        last_known: Option<Joints>,
        /// What kept the arm from reporting.
        cause: Box<ArmError>,
    },
    /// The proximity signal stopped the arm on its way.
    #[error("{port}: stopped by signal {signal} at {joints}")]
    ProximityStop {
        /// The line.
        port: String,
        /// The input that came on.
        signal: u16,
        /// Where the arm stands.
        joints: Joints,
    },
    /// A setting that cannot be: a speed of zero, an empty name. Nothing was sent.
    #[error("{what} cannot be {value}: {allowed}")]
    Setting {
        /// What was to be set.
        what: &'static str,
        /// The value.
        value: String,
        /// What would do.
        allowed: &'static str,
    },
}
