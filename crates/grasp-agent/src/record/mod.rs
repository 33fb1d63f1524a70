//! Records of runs and of learned behaviours: logs, replays, JSON.

pub(crate) mod behaviour_json;
pub(crate) mod log;
pub(crate) mod policy_json;
pub(crate) mod saved_controller;
pub(crate) mod saved_run;
