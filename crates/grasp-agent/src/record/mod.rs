//! Records of runs and of what was learned: logs, replays, files.

#[cfg(feature = "serde")]
pub(crate) mod export;
#[cfg(feature = "serde")]
pub(crate) mod export_policy;
pub(crate) mod log;
#[cfg(feature = "serde")]
pub(crate) mod numbers;
#[cfg(feature = "serde")]
pub(crate) mod saved_controller;
#[cfg(feature = "serde")]
pub(crate) mod saved_run;
