//! What can be wrong with optics, scenes and poses.

use puma_val2::Joint;

/// Why a camera cannot be built as asked.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A length or size that must be above zero is not, or is not a finite number.
    #[error("{quantity} must be a finite number above zero, but is {value}")]
    NotPositive {
        /// Which quantity.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// A quantity is NaN or infinite.
    #[error("{quantity} must be a finite number, but is {value}")]
    NotFinite {
        /// Which quantity.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// A frame that is larger than [`crate::Camera::LARGEST_SIDE`] on a side.
    #[error("a frame of {width} x {height} px is too large: at most {largest} px on a side", largest = crate::Camera::LARGEST_SIDE)]
    TooLarge {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
    },
    /// The distortion folds the image over within the frame: two directions would meet in one
    /// pixel.
    #[error(
        "the lens distortion folds the image over {radius_px:.0} px from the principal point, inside the frame"
    )]
    Folds {
        /// Distance from the principal point at which the image turns back, pixels.
        radius_px: f64,
    },
    /// The lens shows nothing at this pixel: it lies outside the frame, beyond where the distortion
    /// folds the image over.
    #[error("no ray leads to the pixel ({x:.1}, {y:.1}): the lens shows nothing there")]
    NoRay {
        /// Column asked for, pixels.
        x: f64,
        /// Row asked for, pixels.
        y: f64,
    },
}

/// Why a sphere has no outline in the image.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProjectionError {
    /// The radius is not above zero, or not a finite number.
    #[error("the radius of the ball must be a finite number above zero, but is {radius} m")]
    Radius {
        /// Radius given, metres.
        radius: f64,
    },
    /// A coordinate of the centre is NaN or infinite.
    #[error("the centre of the ball is not finite")]
    CentreNotFinite,
    /// The camera's centre of projection lies inside the sphere.
    #[error(
        "the camera is inside the ball: its centre is {distance:.4} m away, its radius is {radius:.4} m"
    )]
    Inside {
        /// Distance of the centre, metres.
        distance: f64,
        /// Radius, metres.
        radius: f64,
    },
    /// The sphere lies behind the camera, or reaches behind it, so that its outline is no ellipse.
    #[error(
        "the ball is behind the camera or reaches behind it: depth {depth:.4} m, radius {radius:.4} m"
    )]
    Behind {
        /// Depth of the centre along the optical axis, metres.
        depth: f64,
        /// Radius, metres.
        radius: f64,
    },
    /// The sphere lies so far off the optical axis, wholly or in part, that the lens would have
    /// folded the image over before: it is not shown.
    #[error(
        "the ball is beyond what the lens shows: its centre is {:.1} degrees off the optical axis, and the distortion folds the image over nearer to it",
        angle.to_degrees()
    )]
    BeyondLens {
        /// Angle between the optical axis and the direction of the centre, radians.
        angle: f64,
    },
}

/// Why a ball does not count as seen.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SightError {
    /// A joint angle is NaN or infinite.
    #[error("the angle of {joint} is not a finite number")]
    JointNotFinite {
        /// The joint.
        joint: Joint,
    },
    /// A measure of arm or hand, or of the rule itself, is NaN (or, where none can be, infinite).
    #[error("{quantity} must be a finite number, but is {value}")]
    NotFinite {
        /// Which quantity.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// The ball has no outline in the image.
    #[error(transparent)]
    Projection(#[from] ProjectionError),
    /// The outline does not fit into the frame, wherever it lies.
    #[error(
        "the ball is larger than the view: its outline is {width_px:.0} x {height_px:.0} px in a frame of {frame_width} x {frame_height} px"
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
    /// The radius is out of the range in which a ball counts as seen.
    #[error(
        "the ball's radius of {r:.2} units is out of the range {least}..{greatest} in which it counts as seen"
    )]
    Radius {
        /// Radius, feature units.
        r: f64,
        /// Smallest radius.
        least: f64,
        /// Greatest radius.
        greatest: f64,
    },
    /// The centre lies outside the frame.
    #[error("the centre of the ball is outside the frame, at ({x:.1}, {y:.1}) px")]
    CentreOutside {
        /// Column of the centre, pixels.
        x: f64,
        /// Row of the centre, pixels.
        y: f64,
    },
    /// Too much of the outline lies outside the frame.
    #[error("only {:.0} % of the ball's outline is inside the frame, at least {:.0} % must be", 100.0 * share, 100.0 * least)]
    CutOff {
        /// Share of the outline inside the frame, 0..=1.
        share: f64,
        /// Least share at which a ball counts as seen.
        least: f64,
    },
}

/// Why there is no pose from which the ball can be gripped.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReachError {
    /// An angle, a coordinate of the ball, or a measure of arm or mount is NaN or infinite.
    #[error("{quantity} must be a finite number, but is {value}")]
    NotFinite {
        /// Which quantity.
        quantity: &'static str,
        /// What was given.
        value: f64,
    },
    /// The ball's radius is not above zero, or not a finite number.
    #[error("the radius of the ball must be a finite number above zero, but is {radius} m")]
    BallRadius {
        /// Radius given, metres.
        radius: f64,
    },
    /// No place before this camera shows a ball of this size as the goal has it.
    #[error("the camera shows the ball nowhere as the goal has it")]
    NoView,
    /// The ball is nearer to the waist's axis than the plane in which the arm moves.
    #[error(
        "the ball is {distance:.3} m from the waist's axis; the arm moves in a plane {offset:.3} m beside it"
    )]
    BesideWaist {
        /// Distance from the axis, metres.
        distance: f64,
        /// Distance of the arm's plane from the axis, metres.
        offset: f64,
    },
    /// The ball is too near to the shoulder, or too far from it.
    #[error(
        "the ball is {distance:.3} m from the shoulder, in the arm's plane; it reaches {least:.3}..{greatest:.3} m"
    )]
    OutOfReach {
        /// Distance from the shoulder, metres.
        distance: f64,
        /// Least distance that the arm reaches with the hand as it is.
        least: f64,
        /// Greatest distance.
        greatest: f64,
    },
    /// The pose is beyond what the task keeps to.
    #[error("the pose has {joint} at {:.1} degrees, out of the working limits {:.1}..{:.1}",
        angle.to_degrees(), low.to_degrees(), high.to_degrees())]
    OutOfLimits {
        /// The first such joint.
        joint: Joint,
        /// Its angle, radians.
        angle: f64,
        /// Its lower limit, radians.
        low: f64,
        /// Its upper limit, radians.
        high: f64,
    },
}

/// A quantity of the cell that cannot be worked with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// A range whose ends are not finite, or the wrong way round.
    #[error("the range of {quantity} must be finite and ascending, but is {low}..{high}")]
    Range {
        /// What it is the range of.
        quantity: &'static str,
        /// Its lower end.
        low: f64,
        /// Its upper end.
        high: f64,
    },
    /// A quantity is NaN or infinite.
    #[error("{quantity} must be a finite number, but is {value}")]
    NotFinite {
        /// Which quantity.
        quantity: String,
        /// What was given.
        value: f64,
    },
    /// A quantity is below zero.
    #[error("{quantity} must not be below zero, but is {value}")]
    Negative {
        /// Which quantity.
        quantity: String,
        /// What was given.
        value: f64,
    },
    /// A quantity that must be above zero is not.
    #[error("{quantity} must be above zero, but is {value}")]
    NotPositive {
        /// Which quantity.
        quantity: String,
        /// What was given.
        value: f64,
    },
    /// A quantity is greater than can be worked with.
    #[error("{quantity} must be at most {greatest}, but is {value}")]
    TooLarge {
        /// Which quantity.
        quantity: String,
        /// What was given.
        value: f64,
        /// The greatest that can be worked with.
        greatest: f64,
    },
    /// A search over moves can follow one or two joints, not more.
    #[error("the moves turn {count} joints; a search can follow one or two")]
    Joints {
        /// Number of joints that any of the moves turns.
        count: usize,
    },
}

/// Refuses what is no finite number.
pub(crate) fn finite(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    if value.is_finite() {
        Ok(())
    } else {
        let quantity = quantity.into();
        Err(QuantityError::NotFinite { quantity, value })
    }
}

/// Refuses what is no finite number of zero or above.
pub(crate) fn amount(quantity: impl Into<String>, value: f64) -> Result<(), QuantityError> {
    let quantity = quantity.into();
    if value < 0.0 && value.is_finite() {
        return Err(QuantityError::Negative { quantity, value });
    }
    finite(quantity, value)
}

/// Refuses what is above `greatest`.
pub(crate) fn at_most(quantity: &str, value: f64, greatest: f64) -> Result<(), QuantityError> {
    if value <= greatest {
        return Ok(());
    }
    Err(QuantityError::TooLarge {
        quantity: quantity.to_owned(),
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
        Ok(())
    } else {
        Err(QuantityError::Range {
            quantity,
            low,
            high,
        })
    }
}
