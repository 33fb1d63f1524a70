//! Lens distortion, and how it is undone.

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
    /// Whether this is the ideal pinhole.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Where the lens shows what a pinhole would show at `p`.
    pub fn distort(&self, p: Point2<f64>) -> Point2<f64> {
        let (x, y) = (p.x, p.y);
        let s = x * x + y * y;
        let radial = 1.0 + s * (self.k1 + s * (self.k2 + s * self.k3));
        Point2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (s + 2.0 * x * x),
            y * radial + 2.0 * self.p2 * x * y + self.p1 * (s + 2.0 * y * y),
        )
    }

    /// The inverse of [`Distortion::distort`]: what a pinhole would show where the lens shows `p`,
    /// to about 1e-13 of its size.
    ///
    /// By Newton's method; where that hesitates, followed outward from the axis, so that of several
    /// answers it is the one before the lens folds. `None` if there is none, or `p` is not finite.
    pub fn undistort(&self, p: Point2<f64>) -> Option<Point2<f64>> {
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

    /// As [`Distortion::undistort`], with the answer for a place nearby as a start.
    pub(crate) fn undistort_near(
        &self,
        p: Point2<f64>,
        (other, undone): (Point2<f64>, Point2<f64>),
    ) -> Option<Point2<f64>> {
        self.newton(p, undone + (p - other), false)
            .or_else(|| self.undistort(p))
    }

    /// Newton's method from `start`. It must come nearer with every step; where it does not, the
    /// step is halved if `patient`, else that is the end of it.
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
                // As near as numbers go.
                None if error.norm() <= 10.0 * enough => break,
                None => return None,
            }
        }
        let sound = error.norm() <= 10.0 * enough && self.jacobian(q).determinant() > 0.0;
        sound.then_some(q)
    }

    /// Whether the lens has not folded the image over on the way from the axis to `p`: only such
    /// directions are shown.
    pub(crate) fn shows(&self, p: Point2<f64>) -> bool {
        let s = p.coords.norm_squared();
        // How fast the radial part grows with the distance from the axis: never slower than at
        // either end or where this itself turns.
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
        // The tangential part changes that by no more than this.
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

    /// Derivatives of [`Distortion::distort`].
    pub(crate) fn jacobian(&self, q: Point2<f64>) -> Matrix2<f64> {
        let (x, y) = (q.x, q.y);
        let s = x * x + y * y;
        let radial = 1.0 + s * (self.k1 + s * (self.k2 + s * self.k3));
        // Of the radial factor by s, twice.
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
