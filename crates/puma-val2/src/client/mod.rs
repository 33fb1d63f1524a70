//! The client: typed calls to a VAL II controller over any line.

pub(crate) mod backup;
pub(crate) mod config;
pub(crate) mod connect;
pub(crate) mod dialogue;
mod guarded;
pub(crate) mod hand;
pub(crate) mod motion;
mod number;
pub(crate) mod point;
pub(crate) mod programs;
pub(crate) mod proximity;
pub(crate) mod reader;
pub(crate) mod resident;
mod val2_client;
pub(crate) mod whereabouts;
pub(crate) mod wire;

pub use config::{ClientConfig, MoveWay};
pub use guarded::GuardedArm;
pub use resident::Resident;
pub use val2_client::Val2Client;
pub use whereabouts::Location;
