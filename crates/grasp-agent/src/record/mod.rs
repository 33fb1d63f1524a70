//! Records of runs and of learned behaviours: logs, replays, JSON.

#[cfg(feature = "serde")]
pub(crate) mod behaviour_json;
pub(crate) mod log;
#[cfg(feature = "serde")]
pub(crate) mod policy_json;
#[cfg(feature = "serde")]
pub(crate) mod saved_controller;
#[cfg(feature = "serde")]
pub(crate) mod saved_run;
