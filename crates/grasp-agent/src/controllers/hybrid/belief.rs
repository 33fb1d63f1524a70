//! The belief about camera, ball and gears: thirteen parameters with their covariance.

use hough_heuristic::Features;
use nalgebra::{Matrix3, Point3};
use puma_val2::Joints;
use serde::{Deserialize, Serialize};

use crate::checked::above_zero;
use crate::controllers::hybrid::parameters::{
    Information, LEARNED, Numbers, corrected, sensitivity, vector,
};
use crate::error::BehaviourError;
use crate::sight::camera_model::CameraModel;

/// Expected errors of an uncalibrated cell, as standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prior {
    /// Logarithm of the focal length (by eye: 0.3).
    pub focal: f64,
    /// Principal point, feature units (by eye: 5).
    pub centre: f64,
    /// Roll, pitch and yaw of the camera, radians (by eye: 0.17).
    pub turn: f64,
    /// Camera position along each of its axes, metres (by eye: 0.015).
    pub shift: f64,
    /// Logarithm of the ball's radius (by eye: 0.15).
    pub radius: f64,
    /// Backlash of each of the first three joints, whole width, radians (by eye: 0.015).
    pub play: f64,
}

impl Prior {
    /// Returns the errors of a cell that was set up by eye: the values that the fields state.
    pub fn by_eye() -> Self {
        Self {
            focal: 0.3,
            centre: 5.0,
            turn: 0.17,
            shift: 0.015,
            radius: 0.15,
            play: 0.015,
        }
    }

    /// Validates that each standard deviation is above zero.
    pub(crate) fn check(&self) -> Result<(), String> {
        let deviations = self.deviations();
        deviations
            .iter()
            .try_for_each(|s| above_zero("a standard deviation of the prior", *s))
    }

    fn deviations(&self) -> Numbers {
        let Self {
            focal,
            centre,
            turn,
            shift,
            radius,
            play,
        } = *self;
        Numbers::from_column_slice(&[
            focal, centre, centre, turn, turn, turn, shift, shift, shift, radius, play, play, play,
        ])
    }
}

/// Normal distribution of the errors of the nominal model.
///
/// The thirteen parameters: logarithm of the focal length over the nominal one; shift of the
/// principal point (feature units); rotation of the camera about its x, y and z axes (radians) and
/// translation along them (metres); logarithm of the ball's radius over the nominal one; backlash
/// of `JT1`, `JT2` and `JT3` (whole width, radians).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    mean: Numbers,
    /// Inverse of the covariance.
    information: Information,
    /// Standard deviation of the image noise, feature units.
    noise: f64,
}

/// Image noise assumed at first, feature units.
const FIRST_NOISE: f64 = 1.0;

impl Belief {
    /// Creates the belief of an uncalibrated cell.
    pub fn new(prior: &Prior) -> Self {
        let precisions = prior.deviations().map(|s| 1.0 / (s * s).max(1e-18));
        Self::of(
            Numbers::zeros(),
            Information::from_diagonal(&precisions),
            FIRST_NOISE,
        )
    }

    pub(crate) fn of(mean: Numbers, information: Information, noise: f64) -> Self {
        Self {
            mean,
            information,
            noise,
        }
    }

    /// Returns the means of the thirteen parameters.
    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    /// Returns the standard deviations of the thirteen parameters.
    pub fn deviations(&self) -> Vec<f64> {
        let covariance = self.information.try_inverse();
        (0..LEARNED)
            .map(|i| covariance.map_or(f64::INFINITY, |c| c[(i, i)].max(0.0).sqrt()))
            .collect()
    }

    /// Returns the standard deviation of the image noise, feature units.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// Adds `share` of the prior's uncertainty and keeps the means: camera, ball or gears may have
    /// changed meanwhile.
    pub(crate) fn loosened(self, prior: &Prior, share: f64) -> Self {
        if share.abs() < f64::MIN_POSITIVE {
            // Avoids the rounding of two inversions.
            return self;
        }
        let change = (prior.deviations() * share).map(|s| s * s);
        let information = self.information.try_inverse();
        let information =
            information.and_then(|c| (c + Information::from_diagonal(&change)).try_inverse());
        let Some(information) = information.filter(|i| i.iter().all(|v| v.is_finite())) else {
            return self.clone();
        };
        Self::of(
            self.mean,
            0.5 * (information + information.transpose()),
            self.noise,
        )
    }

    /// Updates the belief by one sighting, from `joints`, of a ball at a place known to `unsure`
    /// metres along each axis. Returns it unchanged if the sighting is impossible.
    pub(crate) fn having_seen(
        self,
        nominal: &CameraModel,
        joints: &Joints,
        (ball, unsure): (&Point3<f64>, f64),
        features: &Features,
    ) -> Self {
        const ITERATIONS: usize = 10;
        let (before, prior) = (self.mean, self.information);
        let view =
            |numbers: &Numbers, ball: &Point3<f64>| corrected(nominal, numbers).view(joints, ball);
        let (mut numbers, mut information) = (before, prior);
        for _ in 0..ITERATIONS {
            let Some((expected, by_all)) = sensitivity(&numbers, ball, view) else {
                return self;
            };
            let by_numbers = by_all.fixed_columns::<LEARNED>(0);
            let by_place = by_all.fixed_columns::<3>(LEARNED);
            let spread = Matrix3::identity() * self.noise.powi(2)
                + by_place * by_place.transpose() * unsure.powi(2);
            let Some(weight) = spread.try_inverse() else {
                return self;
            };
            let off = vector(features) - vector(&expected);
            information = prior + by_numbers.transpose() * weight * by_numbers;
            let gradient = by_numbers.transpose() * weight * off - prior * (numbers - before);
            let Some(step) = information.cholesky().map(|c| c.solve(&gradient)) else {
                return self;
            };
            numbers += step;
        }
        let finite = numbers
            .iter()
            .chain(information.iter())
            .all(|v| v.is_finite());
        if finite {
            Self::of(numbers, information, self.noise)
        } else {
            self
        }
    }

    pub(crate) fn with_noise(self, noise: f64) -> Self {
        Self { noise, ..self }
    }

    /// Returns `nominal` with the estimated corrections.
    pub fn corrected(&self, nominal: &CameraModel) -> CameraModel {
        corrected(nominal, &self.mean)
    }

    pub(crate) fn numbers(&self) -> Numbers {
        self.mean
    }

    pub(crate) fn information(&self) -> &Information {
        &self.information
    }

    /// Checks that the numbers are finite and the noise is above zero.
    pub(crate) fn check(&self) -> Result<(), String> {
        let mut numbers = self.mean.iter().chain(&self.information);
        if !numbers.all(|v| v.is_finite()) {
            return Err("a number of the belief is not finite".into());
        }
        above_zero("the noise of the belief", self.noise)
    }
}

impl Belief {
    const FILE_KIND: &str = "grasp-agent belief/2";

    /// Writes the belief to `path`, atomically.
    ///
    /// # Errors
    /// [`BehaviourError::File`] if the file cannot be written.
    pub fn save(&self, path: &std::path::Path) -> Result<(), BehaviourError> {
        Ok(qtable::save(path, Self::FILE_KIND, self)?)
    }

    /// Reads a belief that [`Belief::save`] has written.
    ///
    /// # Errors
    /// [`BehaviourError::File`] for a file that cannot be read, is damaged, has another format, or
    /// holds a wrong number of values or one that is not finite.
    pub fn load(path: &std::path::Path) -> Result<Self, BehaviourError> {
        Ok(qtable::load(path, Self::FILE_KIND)?)
    }
}
