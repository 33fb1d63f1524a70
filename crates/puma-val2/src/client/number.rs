//! Numbers in commands and messages.

use crate::error::ArmError;

pub(super) fn check_percent(percent: f64) -> Result<(), ArmError> {
    if percent > 0.0 && percent <= 327.67 {
        return Ok(());
    }
    Err(ArmError::Setting {
        what: "a speed",
        value: format!("{percent} %"),
        allowed: "above 0 to 327.67 %",
    })
}

/// Formats a number with up to three decimals and no more characters than needed: every character
/// is a millisecond on the line.
pub(super) fn plain(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}
