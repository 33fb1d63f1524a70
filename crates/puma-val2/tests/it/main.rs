//! Tests of the crate through its public interface.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::needless_pass_by_value,
    reason = "functions that serve tests may fail and print"
)]

/// Fails, and shows the value, unless it has this pattern.
macro_rules! assert_matches {
    ($value:expr, $pattern:pat $(if $guard:expr)?) => {
        assert_matches!($value, $pattern $(if $guard)?, "")
    };
    ($value:expr, $pattern:pat $(if $guard:expr)?, $($context:tt)+) => {
        match &$value {
            $pattern $(if $guard)? => {}
            other => panic!("{} {other:?}", format!($($context)+)),
        }
    };
}

mod backup;
mod budget;
mod client;
mod client_robustness;
mod console;
mod drivers;
mod emulator_robustness;
mod faults;
mod forms;
mod fuzz_targets;
mod interpreter;
mod oracles;
#[cfg(all(unix, feature = "cli"))]
mod owner;
#[cfg(all(unix, feature = "cli"))]
mod owner_faults;
mod profiles;
#[cfg(feature = "cli")]
mod program;
#[cfg(all(unix, feature = "serial"))]
mod pty;
#[cfg(unix)]
mod pyserial;
mod regression;
mod session;
mod tcp;
