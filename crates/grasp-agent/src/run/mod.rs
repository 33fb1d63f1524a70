//! Runs: the agent, its state machine, and the modules that it links.

pub(crate) mod agent;
pub(crate) mod config;
pub(crate) mod event;
pub(crate) mod search;
pub(crate) mod state_machine;
pub(crate) mod supervision;
