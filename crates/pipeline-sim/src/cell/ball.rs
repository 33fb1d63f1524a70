//! The ball and its holder.

use nalgebra::{Point2, Point3};

/// A sphere at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ball {
    /// Centre, metres, in VAL's world frame (origin at the shoulder, z up).
    pub centre: Point3<f64>,
    /// Radius, metres.
    pub radius: f64,
}

impl Ball {
    /// Radius of the ball of the paper's cell, metres: 20 mm.
    pub const RADIUS: f64 = 0.020;

    /// Returns a ball of [`Ball::RADIUS`] with its centre at (x, y, z) metres.
    pub fn at(x: f64, y: f64, z: f64) -> Self {
        Self {
            centre: Point3::new(x, y, z),
            radius: Self::RADIUS,
        }
    }
}

/// An upright rod on the table that carries the ball, so that the fingers fit below the ball's
/// centre.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Holder {
    /// Position of its axis on the table, metres.
    pub foot: Point2<f64>,
    /// Height of its upper end, metres.
    pub top: f64,
    /// Radius of the rod, metres.
    pub radius: f64,
}

impl Holder {
    /// Returns the holder that carries `ball`: a rod of 8 mm radius that ends where the ball rests.
    pub(crate) fn under(ball: &Ball) -> Self {
        let holder = Self {
            foot: ball.centre.xy(),
            top: ball.centre.z,
            radius: 0.008_f64.min(0.8 * ball.radius),
        };
        Self {
            top: ball.centre.z - holder.rise(ball),
            ..holder
        }
    }

    /// Returns the height of the centre of `ball` above the rod's open end while it rests there.
    pub(super) fn rise(&self, ball: &Ball) -> f64 {
        let squared = ball.radius * ball.radius - self.radius * self.radius;
        squared.max(0.0).sqrt()
    }

    /// Returns `true` if `ball` rests on this holder, to a millimetre.
    pub fn carries(&self, ball: &Ball) -> bool {
        (ball.centre.xy() - self.foot).norm() < 0.001
            && (ball.centre.z - self.rise(ball) - self.top).abs() < 0.001
    }
}
