//! Lens distortion and its inverse.

use nalgebra::{Matrix2, Point2};

/// Lens distortion after Brown and Conrady, in coordinates on the plane at unit depth.
///
/// A point (x, y) at squared distance s from the axis moves to x (1 + `k1` s + `k2` s² + `k3` s³) +
/// 2 `p1` x y + `p2` (s + 2 x²), and likewise in y with `p1`, `p2` exchanged: the convention of
/// OpenCV's five coefficients. All zero is the ideal pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Distortion {
    /// Radial, of second order. Below zero: barrel.
    pub k1: f64,
    /// Radial, of fourth order.
    pub k2: f64,
    /// Radial, of sixth order.
    pub k3: f64,
    /// Tangential, along y.
    pub p1: f64,
    /// Tangential, along x.
    pub p2: f64,
}

impl Distortion {
    /// Returns `true` for the ideal pinhole.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the place at which the lens shows the point that a pinhole shows at `p`.
    pub(crate) fn distort(&self, p: Point2<f64>) -> Point2<f64> {
        let (x, y) = (p.x, p.y);
        let s = x * x + y * y;
        let radial = 1.0 + s * (self.k1 + s * (self.k2 + s * self.k3));
        Point2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (s + 2.0 * x * x),
            y * radial + 2.0 * self.p2 * x * y + self.p1 * (s + 2.0 * y * y),
        )
    }

    /// Inverts [`Distortion::distort`], to about 1e-13 of the result.
    ///
    /// Newton's method; where it does not converge, it is continued outward from the axis in
    /// stages, which finds the answer before the fold of the lens. `None` if there is none, or `p`
    /// is not finite.
    pub(crate) fn undistort(&self, p: Point2<f64>) -> Option<Point2<f64>> {
        if self.is_none() {
            return Some(p);
        }
        self.newton(p, p, false).or_else(|| {
            const STAGES: i32 = 32;
            (1..=STAGES).try_fold(Point2::origin(), |from, stage| {
                self.newton(p * (f64::from(stage) / f64::from(STAGES)), from, true)
            })
        })
    }

    /// Inverts [`Distortion::distort`] from the answer for a place nearby.
    pub(crate) fn undistort_near(
        &self,
        p: Point2<f64>,
        (other, undone): (Point2<f64>, Point2<f64>),
    ) -> Option<Point2<f64>> {
        self.newton(p, undone + (p - other), false)
            .or_else(|| self.undistort(p))
    }

    /// Runs Newton's method from `start`. A step that does not reduce the error is halved if
    /// `patient`, else the search ends.
    fn newton(&self, p: Point2<f64>, start: Point2<f64>, patient: bool) -> Option<Point2<f64>> {
        let (mut q, mut error) = (start, self.distort(start) - p);
        let enough = 1e-14 * (1.0 + p.coords.norm());
        for _ in 0..60 {
            if error.norm() <= enough {
                break;
            }
            let slope = self.jacobian(q);
            if slope.determinant() <= 0.0 {
                return None;
            }
            let step = slope.try_inverse()? * error;
            let halvings = if patient { 30 } else { 1 };
            let nearer = (0..halvings).find_map(|k| {
                let at = q - step * 0.5_f64.powi(k);
                let left = self.distort(at) - p;
                (left.norm() < error.norm()).then_some((at, left))
            });
            match nearer {
                Some(nearer) => (q, error) = nearer,
                // The limit of double precision.
                None if error.norm() <= 10.0 * enough => break,
                None => return None,
            }
        }
        let sound = error.norm() <= 10.0 * enough && self.jacobian(q).determinant() > 0.0;
        sound.then_some(q)
    }

    /// Returns `true` if the lens does not fold the image over between the axis and `p`. Only such
    /// directions are shown.
    pub(crate) fn shows(&self, p: Point2<f64>) -> bool {
        let s = p.coords.norm_squared();
        // Growth of the radial part with the distance from the axis. Its least value is at an end
        // or at a turning point.
        let growth = |s: f64| 1.0 + s * (3.0 * self.k1 + s * (5.0 * self.k2 + s * 7.0 * self.k3));
        let last = growth(s);
        if last.is_nan() || last <= 0.0 {
            return false;
        }
        let (a, b, c) = (21.0 * self.k3, 10.0 * self.k2, 3.0 * self.k1);
        let root = (b * b - 4.0 * a * c).sqrt();
        let turns = [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a), -c / b];
        let turns = turns.into_iter().filter(|turn| (0.0..s).contains(turn));
        let slowest = turns.map(growth).fold(last, f64::min);
        // Greatest change of the growth by the tangential part.
        let tangential = 6.0 * self.p1.hypot(self.p2) * s.sqrt();
        if slowest.abs() >= tangential {
            return slowest > 0.0;
        }
        const STEPS: i32 = 128;
        (1..=STEPS).all(|k| {
            self.jacobian(p * (f64::from(k) / f64::from(STEPS)))
                .determinant()
                > 0.0
        })
    }

    /// Returns the derivatives of [`Distortion::distort`].
    pub(crate) fn jacobian(&self, q: Point2<f64>) -> Matrix2<f64> {
        let (x, y) = (q.x, q.y);
        let s = x * x + y * y;
        let radial = 1.0 + s * (self.k1 + s * (self.k2 + s * self.k3));
        // Twice the derivative of the radial factor by s.
        let growth = 2.0 * (self.k1 + s * (2.0 * self.k2 + s * 3.0 * self.k3));
        let across = x * y * growth + 2.0 * (self.p1 * x + self.p2 * y);
        Matrix2::new(
            radial + x * x * growth + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            across,
            across,
            radial + y * y * growth + 2.0 * self.p2 * x + 6.0 * self.p1 * y,
        )
    }
}
