//! The region in which balls lie, and the poses from which the arm searches for them.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use puma_val2::Joints;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::cell::ball::Ball;
use crate::cell::geometry::Cell;
use crate::error::{QuantityError, ascending, finite};

/// The part of the world in which balls lie: a sector of a ring around the waist axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Workspace {
    /// Least and greatest horizontal distance from the waist axis, metres.
    pub rho: (f64, f64),
    /// Least and greatest azimuth from +x toward +y, radians.
    pub azimuth: (f64, f64),
    /// Least and greatest height above the shoulder, metres.
    pub height: (f64, f64),
    /// `JT1` of the search poses, radians.
    pub search_pans: [f64; 6],
    /// `JT2` and `JT3` of the search poses, radians.
    pub search_elbow: (f64, f64),
    /// `JT4`, `JT5` and `JT6` of the search poses, radians.
    pub search_wrist: [f64; 3],
}

impl Workspace {
    /// Returns the workspace of the paper's cell: 500..800 mm from the waist axis, azimuth -70..70
    /// degrees, 200 mm below to 50 mm above the shoulder; search poses (p, -110, 210, 0, 45, 0)
    /// with p from -75 to 50 in steps of 25 degrees.
    pub fn paper() -> Self {
        Self {
            rho: (0.500, 0.800),
            azimuth: (-70_f64.to_radians(), 70_f64.to_radians()),
            height: (-0.200, 0.050),
            search_pans: [-75.0_f64, -50.0, -25.0, 0.0, 25.0, 50.0].map(f64::to_radians),
            search_elbow: (-110_f64.to_radians(), 210_f64.to_radians()),
            search_wrist: [0.0, Cell::REACHING_JT5_DEGREES.to_radians(), 0.0],
        }
    }

    /// Returns the workspace of [`Cell::ur5`]: 350..600 mm from the base axis, azimuth 120..240
    /// degrees, 0..50 mm above the base; search poses (p, -85, 75, -80, -90, 0) with p from -50 to
    /// 50 in steps of 20 degrees.
    pub fn ur5() -> Self {
        Self {
            rho: (0.350, 0.600),
            azimuth: (120_f64.to_radians(), 240_f64.to_radians()),
            height: (0.0, 0.050),
            search_pans: [-50.0_f64, -30.0, -10.0, 10.0, 30.0, 50.0].map(f64::to_radians),
            search_elbow: (-85_f64.to_radians(), 75_f64.to_radians()),
            search_wrist: [-80.0_f64, -90.0, 0.0].map(f64::to_radians),
        }
    }

    /// Returns the workspace of [`Cell::so101`]: 200..340 mm from the base axis, azimuth -60..60
    /// degrees, 0..30 mm above the base; search poses (p, -30, 30, 0, 60, 0) with p from -60 to 60
    /// in steps of 24 degrees.
    pub fn so101() -> Self {
        Self {
            rho: (0.200, 0.340),
            azimuth: (-60_f64.to_radians(), 60_f64.to_radians()),
            height: (0.0, 0.030),
            search_pans: [-60.0_f64, -36.0, -12.0, 12.0, 36.0, 60.0].map(f64::to_radians),
            search_elbow: (-30_f64.to_radians(), 30_f64.to_radians()),
            search_wrist: [0.0, 60_f64.to_radians(), 0.0],
        }
    }

    /// Returns the six starting poses of the target search (section 2.2 of the paper).
    pub fn search_poses(&self) -> [Joints; 6] {
        let (jt2, jt3) = self.search_elbow;
        let [jt4, jt5, jt6] = self.search_wrist;
        self.search_pans
            .map(|pan| Joints([pan, jt2, jt3, jt4, jt5, jt6]))
    }

    /// Checks that balls can lie in this workspace.
    ///
    /// # Errors
    /// [`QuantityError`] names the range that is not finite and ascending (a distance from the
    /// waist must not be below zero either), or the angle of the search poses that is not finite.
    pub fn check(&self) -> Result<(), QuantityError> {
        ascending("the distance from the waist (m)", self.rho)?;
        ascending(
            "the distance from the waist (m), from zero,",
            (0.0, self.rho.0),
        )?;
        ascending("the azimuth (rad)", self.azimuth)?;
        ascending("the height (m)", self.height)?;
        let elbow = [self.search_elbow.0, self.search_elbow.1];
        let angles = self.search_pans.into_iter().chain(elbow);
        let mut angles = angles.chain(self.search_wrist);
        angles.try_for_each(|angle| finite("an angle of the search poses (rad)", angle))
    }

    /// Draws a ball in the workspace, uniform in volume. Its coordinates are NaN in a workspace
    /// that [`Workspace::check`] refuses.
    pub fn sample_ball<R: Rng + ?Sized>(&self, rng: &mut R) -> Ball {
        if self.check().is_err() {
            return Ball::at(f64::NAN, f64::NAN, f64::NAN);
        }
        let rho = rng
            .random_range(self.rho.0.powi(2)..=self.rho.1.powi(2))
            .sqrt();
        let azimuth = rng.random_range(self.azimuth.0..=self.azimuth.1);
        let z = rng.random_range(self.height.0..=self.height.1);
        Ball::at(rho * azimuth.cos(), rho * azimuth.sin(), z)
    }

    /// Draws a ball that at least one of the search poses sees in `cell` (93 % of all balls), and
    /// returns it with the first such pose.
    ///
    /// `None` if 10 000 balls in a row cannot be seen (a camera that does not see the workspace),
    /// and in a workspace that [`Workspace::check`] refuses.
    pub fn sample_seen_ball<R: Rng + ?Sized>(
        &self,
        cell: &Cell,
        rng: &mut R,
    ) -> Option<(Ball, Joints)> {
        let poses = self.search_poses();
        self.check().ok()?;
        (0..10_000).find_map(|_| {
            let ball = self.sample_ball(rng);
            let cell = Cell { ball, ..*cell };
            let pose = poses.iter().find(|pose| cell.circle(pose).is_ok())?;
            Some((ball, *pose))
        })
    }

    /// Returns `true` if a place is inside the workspace.
    pub fn contains(&self, place: &Point3<f64>) -> bool {
        let within = |range: (f64, f64), value: f64| (range.0..=range.1).contains(&value);
        let from = self.azimuth.0;
        let azimuth = from + (place.y.atan2(place.x) - from).rem_euclid(TAU);
        within(self.rho, place.x.hypot(place.y))
            && within(self.azimuth, azimuth)
            && within(self.height, place.z)
    }

    /// Draws a place `distance` metres from `from` in a random direction, inside the workspace;
    /// `None` if 1000 directions lead out of it.
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
}

impl Default for Workspace {
    fn default() -> Self {
        Self::paper()
    }
}
