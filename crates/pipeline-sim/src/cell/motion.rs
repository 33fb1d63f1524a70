//! Balls and arms that do not stay where they are.

use nalgebra::{Point3, Rotation3, Vector3};
use puma_val2::{Joint, Joints};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::cell::geometry::Cell;
use crate::cell::workspace::Workspace;
use crate::error::QuantityError;
use crate::error::finite;

/// A path of the ball's centre over time.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum BallPath {
    /// Straight on at constant speed, for ever.
    Drift {
        /// Place at time 0.
        from: Point3<f64>,
        /// Metres per second.
        velocity: Vector3<f64>,
    },
    /// Round a horizontal circle.
    Circle {
        /// Middle of the circle.
        middle: Point3<f64>,
        /// Radius, metres.
        radius: f64,
        /// Seconds per round; below zero turns clockwise seen from above.
        period: f64,
    },
    /// At rest from each time on until the next: (seconds, place), ascending in time. Before the
    /// first time, at the first place.
    Jumps(Vec<(f64, Point3<f64>)>),
}

impl BallPath {
    /// Where the ball is after `seconds`; `None` for jumps to nowhere (an empty list), a circle
    /// without a period, and a place that is not finite.
    pub fn at(&self, seconds: f64) -> Option<Point3<f64>> {
        let place = match self {
            Self::Drift { from, velocity } => Some(from + velocity * seconds),
            Self::Circle {
                middle,
                radius,
                period,
            } => {
                let turn = std::f64::consts::TAU * seconds / period;
                turn.is_finite()
                    .then(|| middle + Vector3::new(turn.cos(), turn.sin(), 0.0) * *radius)
            }
            Self::Jumps(places) => {
                let reached = places
                    .iter()
                    .take_while(|(time, _)| *time <= seconds)
                    .last();
                reached.or(places.first()).map(|(_, place)| *place)
            }
        };
        place.filter(|place| place.iter().all(|v| v.is_finite()))
    }
}

/// How fast arm and ball move while a frame is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motion {
    /// Speeds of the joints, `JT1` first, radians per second.
    pub joints: [f64; 6],
    /// Velocity of the ball, metres per second, and of its holder if it stands on it. A ball in the
    /// jaws goes with the hand instead.
    pub ball: Vector3<f64>,
}

impl Motion {
    /// Nothing moves.
    pub fn still() -> Self {
        Self {
            joints: [0.0; 6],
            ball: Vector3::zeros(),
        }
    }

    /// The even motion that leads from one moment to another, `seconds` later.
    pub fn between(before: (&Cell, &Joints), after: (&Cell, &Joints), seconds: f64) -> Self {
        Self {
            joints: std::array::from_fn(|i| (after.1.0[i] - before.1.0[i]) / seconds),
            ball: (after.0.ball.centre - before.0.ball.centre) / seconds,
        }
    }

    /// Cell and joints `seconds` after (or, below zero, before) they are `cell` and `joints`.
    pub fn moved(&self, cell: &Cell, joints: &Joints, seconds: f64) -> (Cell, Joints) {
        let then = Joints(std::array::from_fn(|i| {
            joints.0[i] + self.joints[i] * seconds
        }));
        let mut moved = *cell;
        if let Some(place) = cell.held {
            moved.ball.centre = cell.params.wrist(&then) * place;
            return (moved, then);
        }
        let by = self.ball * seconds;
        moved.ball.centre += by;
        if let Some(holder) = moved.holder.as_mut().filter(|h| h.carries(&cell.ball)) {
            holder.foot += by.xy();
            holder.top += by.z;
        }
        (moved, then)
    }

    /// Whether all speeds are finite.
    ///
    /// # Errors
    /// [`QuantityError::NotFinite`] names the first that is not.
    pub fn check(&self) -> Result<(), QuantityError> {
        for (joint, speed) in Joint::ALL.iter().zip(self.joints) {
            finite(format!("the speed of {joint} (rad/s)"), speed)?;
        }
        for (axis, speed) in ["x", "y", "z"].iter().zip(self.ball.iter()) {
            finite(format!("the speed of the ball along {axis} (m/s)"), *speed)?;
        }
        Ok(())
    }
}

impl Default for Motion {
    fn default() -> Self {
        Self::still()
    }
}

impl Workspace {
    /// Whether a place is inside the workspace.
    pub fn contains(&self, place: &Point3<f64>) -> bool {
        let within = |range: (f64, f64), value: f64| (range.0..=range.1).contains(&value);
        within(self.rho, place.x.hypot(place.y))
            && within(self.azimuth, place.y.atan2(place.x))
            && within(self.height, place.z)
    }

    /// A place `distance` metres from `from` in a random direction, inside the workspace; `None` if
    /// 1000 directions lead out of it.
    pub fn sample_jump<R: Rng + ?Sized>(
        &self,
        from: &Point3<f64>,
        distance: f64,
        rng: &mut R,
    ) -> Option<Point3<f64>> {
        (0..1000).find_map(|_| {
            let mut draw = || -> f64 { StandardNormal.sample(rng) };
            let direction = Vector3::new(draw(), draw(), draw()).try_normalize(1e-9)?;
            let to = from + direction * distance;
            self.contains(&to).then_some(to)
        })
    }

    /// A drift of `speed` metres per second from `from`, in a random horizontal direction.
    pub fn sample_drift<R: Rng + ?Sized>(
        &self,
        from: &Point3<f64>,
        speed: f64,
        rng: &mut R,
    ) -> BallPath {
        let heading = rng.random_range(0.0..std::f64::consts::TAU);
        let velocity =
            Rotation3::from_axis_angle(&Vector3::z_axis(), heading) * Vector3::x() * speed;
        BallPath::Drift {
            from: *from,
            velocity,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_leads_to_no_place_that_is_no_number() {
        let drift = |speed| BallPath::Drift {
            from: Point3::origin(),
            velocity: Vector3::new(speed, 0.0, 0.0),
        };
        assert!(drift(1.0).at(2.0).is_some());
        assert_eq!(drift(f64::NAN).at(2.0), None);
        assert_eq!(drift(1.0).at(f64::INFINITY), None);
        let circle = BallPath::Circle {
            middle: Point3::origin(),
            radius: f64::NAN,
            period: 1.0,
        };
        assert_eq!(circle.at(0.0), None);
        let jump = BallPath::Jumps(vec![(0.0, Point3::new(f64::NAN, 0.0, 0.0))]);
        assert_eq!(jump.at(1.0), None);
    }
}
