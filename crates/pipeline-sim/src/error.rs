//! Errors of bad input.

use puma_val2::Joint;

/// A quantity that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// A number out of the range in which it is usable.
    #[error("{quantity} must be {allowed}, but is {value}")]
    Value {
        /// Name of the quantity.
        quantity: String,
        /// Value given.
        value: f64,
        /// Values that are usable.
        allowed: String,
    },
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
    /// Samples that do not tell all coefficients of a model apart: moves all along one line, or a
    /// single elbow angle.
    #[error(
        "{place}: the samples determine only {rank} of {terms} coefficients; vary the moves and \
         the poses more"
    )]
    Undetermined {
        /// Part of the model: an elbow interval, or the whole.
        place: String,
        /// Numerical rank of the design matrix.
        rank: usize,
        /// Number of coefficients.
        terms: usize,
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

/// The reason why a ball is not seen, or why no pose shows it at the goal.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SightError {
    /// An angle, or a measure of arm, mount, ball or rule, that is out of range.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    /// A ball that is behind the camera, reaches behind it, or holds it inside.
    #[error("the ball, of radius {radius:.4} m at depth {depth:.4} m, is not before the camera")]
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
        "the ball is larger than the view: its outline is {:.0} x {:.0} px, the frame {} x {} px",
        outline.0, outline.1, frame.0, frame.1
    )]
    LargerThanView {
        /// Width and height of the outline, pixels.
        outline: (f64, f64),
        /// Width and height of the frame, pixels.
        frame: (u32, u32),
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
    #[error("the pose has {name} at {:.1} degrees, out of the working limits {:.1}..{:.1}",
        angle.to_degrees(), low.to_degrees(), high.to_degrees())]
    OutOfLimits {
        /// First such joint.
        joint: Joint,
        /// Its name.
        name: String,
        /// Its angle, radians.
        angle: f64,
        /// Its lower limit, radians.
        low: f64,
        /// Its upper limit, radians.
        high: f64,
    },
}

impl SightError {
    /// Returns the error of a joint at an angle out of its limits.
    pub(crate) fn out_of((low, high): (f64, f64), joint: Joint, name: &str, angle: f64) -> Self {
        Self::OutOfLimits {
            joint,
            name: name.into(),
            angle,
            low,
            high,
        }
    }
}

/// Refuses a value that is not usable.
fn check(
    usable: bool,
    quantity: impl Into<String>,
    value: f64,
    allowed: impl Into<String>,
) -> Result<(), QuantityError> {
    if usable {
        return Ok(());
    }
    let (quantity, allowed) = (quantity.into(), allowed.into());
    Err(QuantityError::Value {
        quantity,
        value,
        allowed,
    })
}

/// Refuses a number that is not finite.
pub(crate) fn finite(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    check(value.is_finite(), quantity, value, "a finite number")
}

/// Refuses a number that is not finite, or below zero.
pub(crate) fn amount(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    let usable = value.is_finite() && value >= 0.0;
    check(usable, quantity, value, "a finite number, not below zero")
}

/// Refuses a number that is not finite, or not above zero.
pub(crate) fn positive(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    let usable = value.is_finite() && value > 0.0;
    check(usable, quantity, value, "a finite number above zero")
}

/// Refuses a number above `greatest`.
pub(crate) fn at_most(
    quantity: impl Into<String>,
    value: f64,
    greatest: f64,
) -> Result<(), QuantityError> {
    check(
        value <= greatest,
        quantity,
        value,
        format!("at most {greatest}"),
    )
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
