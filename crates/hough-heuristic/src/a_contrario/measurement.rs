//! The results of the detector beside its detections.

use crate::circle::Circle;
use crate::curve::Ellipse;

/// A circle found by [`AContrario`](crate::AContrario), with its standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Measurement {
    /// The circle, in pixels of the frame.
    pub circle: Circle,
    /// The score of its [`Detection`](crate::Detection), 0..=1.
    pub score: f64,
    /// Decimal logarithm of the number of false alarms (NFA).
    pub log_false_alarms: f64,
    /// Standard error of the centre along x and along y, pixels.
    pub centre_error: f64,
    /// Standard error of the radius, pixels.
    pub radius_error: f64,
    /// Shortest by longest diameter of the outline, 0..=1.
    pub axis_ratio: f64,
    /// Share of the outline that lies in the frame, 0..=1.
    pub visible: f64,
    /// Share of that on which the strongest edge nearby is the outline, 0..=1.
    pub covered: f64,
    /// The outline as an ellipse; `None` unless
    /// [`min_axis_ratio`](crate::AContrarioConfig::min_axis_ratio) is below 1. `circle` then has
    /// its area and centre.
    pub ellipse: Option<MeasuredEllipse>,
}

/// An ellipse with its standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeasuredEllipse {
    /// The ellipse, in pixels of the frame.
    pub ellipse: Ellipse,
    /// Standard error of the centre along x and along y, pixels.
    pub centre_error: f64,
    /// Standard error of the longer half-axis, pixels.
    pub major_error: f64,
    /// Standard error of the shorter half-axis, pixels.
    pub minor_error: f64,
    /// Standard error of the angle, radians; 0.9 where the axes are too alike to tell it.
    pub angle_error: f64,
}

impl Measurement {
    /// Returns the measurement in a frame whose corner lies farther left and up by (x, y).
    pub(super) fn moved(mut self, x: f64, y: f64) -> Self {
        self.circle.x += x;
        self.circle.y += y;
        if let Some(measured) = &mut self.ellipse {
            measured.ellipse.x += x;
            measured.ellipse.y += y;
        }
        self
    }
}

/// The work that the last frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Number of pairs drawn.
    pub draws: u64,
    /// Number of places looked at. The time is about proportional to it, apart from finding the
    /// edges.
    pub looks: u64,
    /// Number of circles proven beyond doubt. Each of them adds to the budget.
    pub proven: u64,
    /// `true` if the budget ended the search, so that there may be more circles.
    pub ended_by_budget: bool,
    /// `true` if more circles were proven than `max_circles`.
    pub ended_by_count: bool,
}
