//! Checks of single settings.

use hough_heuristic::Features;

/// Checks that the quantity called `name` is a size.
pub(crate) fn above_zero(name: &str, value: f64) -> Result<(), String> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(format!("{name} is {value}; it must be finite and above 0"))
}

/// Checks that a ball can have these features.
pub(crate) fn check_goal(goal: &Features) -> Result<(), String> {
    let Features { x, y, r } = *goal;
    if !(x.is_finite() && y.is_finite()) {
        return Err(format!("the goal is at {x}, {y}, which is not finite"));
    }
    above_zero("the radius of the goal", r)
}
