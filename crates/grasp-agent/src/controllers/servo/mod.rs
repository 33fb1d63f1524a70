//! The rivals that the paper names: visual servoing in its classical and its usual forms, a fuzzy
//! controller, and a one-step look-ahead.

pub(crate) mod controller;
pub(crate) mod fuzzy;
pub(crate) mod gain_schedule;
pub(crate) mod look_ahead;
pub(crate) mod settings;
