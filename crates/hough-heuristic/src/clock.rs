//! The wall clock, which not every target has.

use std::time::{Duration, Instant};

/// Reads the clock; `None` on `wasm32-unknown-unknown`, where there is none and reading it panics.
pub(crate) fn now() -> Option<Instant> {
    const NO_CLOCK: bool = cfg!(all(target_family = "wasm", target_os = "unknown"));
    (!NO_CLOCK).then(Instant::now)
}

/// Returns the time between two readings, zero without a clock.
pub(crate) fn between(start: Option<Instant>, end: Option<Instant>) -> Duration {
    match (start, end) {
        (Some(start), Some(end)) => end.saturating_duration_since(start),
        _ => Duration::ZERO,
    }
}

/// Returns `true` if there is a deadline and it has passed.
pub(crate) fn is_past(deadline: Option<Instant>) -> bool {
    deadline.is_some_and(|deadline| now() >= Some(deadline))
}
