//! What can be wrong with optics, scenes and poses.

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
    /// The distortion folds the image over within the frame: two directions would meet in one pixel.
    #[error(
        "the lens distortion folds the image over {radius_px:.0} px from the principal point, inside the frame"
    )]
    Folds {
        /// Distance from the principal point at which the image turns back, pixels.
        radius_px: f64,
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
    #[error("the camera is inside the ball: its centre is {distance:.4} m away, its radius is {radius:.4} m")]
    Inside {
        /// Distance of the centre, metres.
        distance: f64,
        /// Radius, metres.
        radius: f64,
    },
    /// The sphere lies behind the camera, or reaches behind it, so that its outline is no ellipse.
    #[error("the ball is behind the camera or reaches behind it: depth {depth:.4} m, radius {radius:.4} m")]
    Behind {
        /// Depth of the centre along the optical axis, metres.
        depth: f64,
        /// Radius, metres.
        radius: f64,
    },
}
