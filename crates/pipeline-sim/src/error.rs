//! Errors of bad input.

use puma_val2::Joint;

/// A quantity of a cell, a scene or a camera that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// A range with an end that is not finite, or with its ends the wrong way round.
    #[error("the range of {quantity} must be finite and ascending, but is {low}..{high}")]
    Range {
        /// Name of the quantity.
        quantity: &'static str,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// A quantity that is NaN or infinite.
    #[error("{quantity} must be a finite number, but is {value}")]
    NotFinite {
        /// Name of the quantity.
        quantity: String,
        /// Value given.
        value: f64,
    },
    /// A quantity below zero.
    #[error("{quantity} must not be below zero, but is {value}")]
    Negative {
        /// Name of the quantity.
        quantity: String,
        /// Value given.
        value: f64,
    },
    /// A quantity that must be above zero and is not.
    #[error("{quantity} must be a finite number above zero, but is {value}")]
    NotPositive {
        /// Name of the quantity.
        quantity: String,
        /// Value given.
        value: f64,
    },
    /// A quantity above the greatest value supported.
    #[error("{quantity} must be at most {greatest}, but is {value}")]
    TooLarge {
        /// Name of the quantity.
        quantity: String,
        /// Value given.
        value: f64,
        /// Greatest value supported.
        greatest: f64,
    },
    /// Moves that turn more joints than a search over moves can follow.
    #[error("the moves turn {count} joints; a search can follow one or two")]
    Joints {
        /// Number of joints that any of the moves turns.
        count: usize,
    },
    /// A lens distortion that folds the image over inside the frame: two directions would meet in
    /// one pixel.
    #[error(
        "the lens distortion folds the image over {radius_px:.0} px from the principal point, \
         inside the frame"
    )]
    Folds {
        /// Distance from the principal point at which the image turns back, pixels.
        radius_px: f64,
    },
    /// A pixel outside the frame and beyond the fold of the distortion, where the lens shows
    /// nothing.
    #[error("no ray leads to the pixel ({x:.1}, {y:.1}): the lens shows nothing there")]
    NoRay {
        /// Column asked for, pixels.
        x: f64,
        /// Row asked for, pixels.
        y: f64,
    },
    /// A name that is not in a list.
    #[error("unknown name {name:?}; known are {known}")]
    Name {
        /// Name given.
        name: String,
        /// Names in the list, separated by commas.
        known: String,
    },
}

/// The reason why a ball is not seen.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SightError {
    /// A joint angle that is NaN or infinite.
    #[error("the angle of {joint} is not a finite number")]
    JointNotFinite {
        /// The joint.
        joint: Joint,
    },
    /// A measure of arm, hand, ball or rule that is NaN (or infinite, where it must be finite).
    #[error("{quantity} must be a finite number, but is {value}")]
    NotFinite {
        /// Name of the quantity.
        quantity: &'static str,
        /// Value found.
        value: f64,
    },
    /// A ball with a radius that is not above zero, or not finite.
    #[error("the radius of the ball must be a finite number above zero, but is {radius} m")]
    BallRadius {
        /// Radius given, metres.
        radius: f64,
    },
    /// A ball with a centre that is not finite.
    #[error("the centre of the ball is not finite")]
    CentreNotFinite,
    /// A camera whose centre of projection lies inside the ball.
    #[error(
        "the camera is inside the ball: its centre is {distance:.4} m away, its radius is \
         {radius:.4} m"
    )]
    Inside {
        /// Distance of the ball's centre, metres.
        distance: f64,
        /// Radius of the ball, metres.
        radius: f64,
    },
    /// A ball behind the camera, or reaching behind it, so that its outline is no ellipse.
    #[error(
        "the ball is behind the camera or reaches behind it: depth {depth:.4} m, radius \
         {radius:.4} m"
    )]
    Behind {
        /// Depth of the ball's centre along the optical axis, metres.
        depth: f64,
        /// Radius of the ball, metres.
        radius: f64,
    },
    /// A ball that lies, wholly or in part, beyond the direction at which the lens folds the image
    /// over.
    #[error(
        "the ball is beyond what the lens shows: its centre is {:.1} degrees off the optical \
         axis, and the distortion folds the image over nearer to it",
        angle.to_degrees()
    )]
    BeyondLens {
        /// Angle between the optical axis and the direction of the ball's centre, radians.
        angle: f64,
    },
    /// An outline that does not fit into the frame, wherever it lies.
    #[error(
        "the ball is larger than the view: its outline is {width_px:.0} x {height_px:.0} px in a \
         frame of {frame_width} x {frame_height} px"
    )]
    LargerThanView {
        /// Width of the outline, pixels.
        width_px: f64,
        /// Height of the outline, pixels.
        height_px: f64,
        /// Width of the frame, pixels.
        frame_width: u32,
        /// Height of the frame, pixels.
        frame_height: u32,
    },
    /// A radius in the image out of the range in which a ball counts as seen.
    #[error(
        "the ball's radius of {r:.2} units is out of the range {least}..{greatest} in which it \
         counts as seen"
    )]
    Radius {
        /// Radius, feature units.
        r: f64,
        /// Smallest radius.
        least: f64,
        /// Greatest radius.
        greatest: f64,
    },
    /// A centre outside the frame.
    #[error("the centre of the ball is outside the frame, at ({x:.1}, {y:.1}) px")]
    CentreOutside {
        /// Column of the centre, pixels.
        x: f64,
        /// Row of the centre, pixels.
        y: f64,
    },
    /// An outline with too large a part outside the frame.
    #[error(
        "only {:.0} % of the ball's outline is inside the frame, at least {:.0} % must be",
        100.0 * share, 100.0 * least
    )]
    CutOff {
        /// Fraction of the outline inside the frame, 0..=1.
        share: f64,
        /// Least fraction at which a ball counts as seen.
        least: f64,
    },
}

/// The reason why no pose shows the ball at the goal.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReachError {
    /// An angle, a coordinate of the ball, or a measure of arm or mount that is NaN or infinite.
    #[error("{quantity} must be a finite number, but is {value}")]
    NotFinite {
        /// Name of the quantity.
        quantity: &'static str,
        /// Value found.
        value: f64,
    },
    /// A ball with a radius that is not above zero, or not finite.
    #[error("the radius of the ball must be a finite number above zero, but is {radius} m")]
    BallRadius {
        /// Radius given, metres.
        radius: f64,
    },
    /// A camera that shows a ball of this size nowhere at the goal.
    #[error("the camera shows the ball nowhere at the goal")]
    NoView,
    /// A ball nearer to the waist's axis than the plane in which the arm moves.
    #[error(
        "the ball is {distance:.3} m from the waist's axis; the arm moves in a plane {offset:.3} \
         m beside it"
    )]
    BesideWaist {
        /// Distance from the axis, metres.
        distance: f64,
        /// Distance of the arm's plane from the axis, metres.
        offset: f64,
    },
    /// A ball too near to the shoulder, or too far from it.
    #[error(
        "the ball is {distance:.3} m from the shoulder, in the arm's plane; the arm reaches \
         {least:.3}..{greatest:.3} m"
    )]
    OutOfReach {
        /// Distance from the shoulder, metres.
        distance: f64,
        /// Least distance that the arm reaches with the hand at its angle.
        least: f64,
        /// Greatest distance.
        greatest: f64,
    },
    /// A pose out of the working limits.
    #[error("the pose has {joint} at {:.1} degrees, out of the working limits {:.1}..{:.1}",
        angle.to_degrees(), low.to_degrees(), high.to_degrees())]
    OutOfLimits {
        /// First such joint.
        joint: Joint,
        /// Its angle, radians.
        angle: f64,
        /// Its lower limit, radians.
        low: f64,
        /// Its upper limit, radians.
        high: f64,
    },
}

/// The reason why a regression has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer samples than coefficients.
    #[error("{place}: {got} samples are too few for {needed} coefficients")]
    TooFewSamples {
        /// Part of the model: an elbow interval, or the whole.
        place: String,
        /// Samples given.
        got: usize,
        /// Least number.
        needed: usize,
    },
    /// Samples that do not tell all coefficients apart: moves all along one line, or a single elbow
    /// angle.
    #[error(
        "{place}: the samples determine only {rank} of {terms} coefficients; vary the moves and \
         the poses more"
    )]
    RankDeficient {
        /// Part of the model.
        place: String,
        /// Numerical rank of the design matrix.
        rank: usize,
        /// Number of coefficients.
        terms: usize,
    },
    /// A sample that holds a NaN, an infinity, or a radius that is not above zero.
    #[error("sample {index}: {quantity} is not a usable number ({value})")]
    NotFinite {
        /// Position of the sample, from 0.
        index: usize,
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// Edges of the elbow intervals that are not finite and strictly ascending.
    #[error("the elbow edges must be finite and strictly ascending: {edges:?}")]
    Edges {
        /// Edges given, degrees.
        edges: Vec<f64>,
    },
    /// A ridge or a power that a refit cannot use.
    #[error("{what}")]
    Prior {
        /// Description of the fault.
        what: String,
    },
}

impl FitError {
    /// Converts the error of a sample that a model cannot be judged on.
    pub(crate) fn into_quantity(self) -> QuantityError {
        let (quantity, value) = match self {
            Self::NotFinite {
                index,
                quantity,
                value,
            } => (format!("sample {index}: {quantity}"), value),
            other => (other.to_string(), f64::NAN),
        };
        if value.is_finite() && value <= 0.0 {
            QuantityError::NotPositive { quantity, value }
        } else {
            QuantityError::NotFinite { quantity, value }
        }
    }
}

/// Refuses a ridge out of 0..=1e100.
pub(crate) fn check_ridge(ridge: f64) -> Result<(), FitError> {
    if (0.0..=1e100).contains(&ridge) {
        return Ok(());
    }
    let what = format!("the ridge of a refit must be within 0..=1e100, but is {ridge}");
    Err(FitError::Prior { what })
}

/// Refuses a number that is not finite.
pub(crate) fn finite(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    if value.is_finite() {
        return Ok(());
    }
    let quantity = quantity.into();
    Err(QuantityError::NotFinite { quantity, value })
}

/// Refuses a number that is not finite, or below zero.
pub(crate) fn amount(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    let quantity = quantity.into();
    if value < 0.0 && value.is_finite() {
        return Err(QuantityError::Negative { quantity, value });
    }
    finite(quantity, value)
}

/// Refuses a number that is not finite, or not above zero.
pub(crate) fn positive(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    let quantity = quantity.into();
    Err(QuantityError::NotPositive { quantity, value })
}

/// Refuses a number above `greatest`.
pub(crate) fn at_most(
    quantity: impl Into<String>,
    value: f64,
    greatest: f64,
) -> Result<(), QuantityError> {
    if value <= greatest {
        return Ok(());
    }
    Err(QuantityError::TooLarge {
        quantity: quantity.into(),
        value,
        greatest,
    })
}

/// Refuses a range that is not finite and ascending.
pub(crate) fn ascending(
    quantity: &'static str,
    (low, high): (f64, f64),
) -> Result<(), QuantityError> {
    if low.is_finite() && high.is_finite() && low <= high {
        return Ok(());
    }
    Err(QuantityError::Range {
        quantity,
        low,
        high,
    })
}
