//! Balls that do not stay where they are.

use nalgebra::{Point3, Rotation3, Vector3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::Workspace;

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
    /// At rest from each time on until the next: (seconds, place), ascending in time. Before the first time, at the first place.
    Jumps(Vec<(f64, Point3<f64>)>),
}

impl BallPath {
    /// Where the ball is after `seconds`; `None` for jumps to nowhere (an empty list) and a circle without a period.
    pub fn at(&self, seconds: f64) -> Option<Point3<f64>> {
        match self {
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
                let reached = places.iter().take_while(|(time, _)| *time <= seconds).last();
                reached.or(places.first()).map(|(_, place)| *place)
            }
        }
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

    /// A place `distance` metres from `from` in a random direction, inside the workspace; `None` if 1000 directions lead out of it.
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
    pub fn sample_drift<R: Rng + ?Sized>(&self, from: &Point3<f64>, speed: f64, rng: &mut R) -> BallPath {
        let heading = rng.random_range(0.0..std::f64::consts::TAU);
        let velocity = Rotation3::from_axis_angle(&Vector3::z_axis(), heading) * Vector3::x() * speed;
        BallPath::Drift {
            from: *from,
            velocity,
        }
    }
}
