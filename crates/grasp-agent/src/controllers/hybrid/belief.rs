//! The belief about camera, ball and arm: eighteen parameters with their covariance.

use serde::{Deserialize, Serialize};

use crate::checked::above_zero;
use crate::controllers::hybrid::parameters::{Information, LEARNED, Numbers, at, corrected};
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
    /// Zero of `JT3`, radians \[0.03\]. Those of `JT1` and `JT2` turn arm and ball alike and change
    /// nothing. 0 switches a parameter of the arm off, here and below.
    pub zero: f64,
    /// Gears of `JT2` and `JT3`, true turn over the reported one less 1 \[0.02\].
    pub gear: f64,
    /// Sag of the level upper arm, radians \[0.03\].
    pub sag: f64,
    /// Turn of `JT2` per turn of `JT3` \[0.04\].
    pub coupling: f64,
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
            zero: 0.03,
            gear: 0.02,
            sag: 0.03,
            coupling: 0.04,
        }
    }

    /// Checks that each standard deviation is above zero; those of the arm may be zero.
    pub(crate) fn check(&self) -> Result<(), String> {
        for (i, deviation) in self.deviations().iter().enumerate() {
            if i < at::ARM || *deviation != 0.0 {
                above_zero("a standard deviation of the prior", *deviation)?;
            }
        }
        Ok(())
    }

    fn deviations(&self) -> Numbers {
        let Self {
            focal: f,
            centre: c,
            turn: t,
            shift: s,
            radius: r,
            play: p,
            zero,
            gear: g,
            sag,
            coupling,
        } = *self;
        Numbers::from_column_slice(&[
            f, c, c, t, t, t, s, s, s, r, p, p, p, zero, g, g, sag, coupling,
        ])
    }
}

/// Normal distribution of the errors of the nominal model.
///
/// The eighteen parameters: logarithm of the focal length over the nominal one; shift of the
/// principal point (feature units); rotation of the camera about its x, y and z axes (radians) and
/// translation along them (metres); logarithm of the ball's radius over the nominal one; backlash
/// of `JT1`, `JT2` and `JT3` (whole width, radians); zero of `JT3` (radians), gears of `JT2` and
/// `JT3`, sag of the upper arm (radians), and turn of `JT2` per turn of `JT3`.
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

/// Returns the precision of a standard deviation; 0 keeps a parameter as it is.
fn precision(deviation: f64) -> f64 {
    1.0 / (deviation * deviation).max(1e-18)
}

impl Belief {
    /// Creates the belief of an uncalibrated cell with the arm as it is given.
    pub fn new(prior: &Prior) -> Self {
        let mut precisions = prior.deviations().map(precision);
        precisions
            .rows_mut(at::ARM, LEARNED - at::ARM)
            .fill(precision(0.0));
        Self::of(
            Numbers::zeros(),
            Information::from_diagonal(&precisions),
            FIRST_NOISE,
        )
    }

    /// Returns the belief of an uncalibrated cell, with an uncertain arm if this one has that.
    pub(crate) fn fresh(&self, prior: &Prior) -> Self {
        let fresh = Self::new(prior);
        if self.knows_arm() {
            fresh.with_arm(prior)
        } else {
            fresh
        }
    }

    fn knows_arm(&self) -> bool {
        (at::ARM..LEARNED).any(|i| self.information[(i, i)] < precision(0.0))
    }

    /// Returns the belief with an arm as uncertain as in `prior`.
    pub(crate) fn with_arm(&self, prior: &Prior) -> Self {
        let (mut belief, deviations) = (self.clone(), prior.deviations());
        for i in at::ARM..LEARNED {
            belief.information.row_mut(i).fill(0.0);
            belief.information.column_mut(i).fill(0.0);
            belief.information[(i, i)] = precision(deviations[i]);
        }
        belief
    }

    pub(crate) fn of(mean: Numbers, information: Information, noise: f64) -> Self {
        Self {
            mean,
            information,
            noise,
        }
    }

    /// Returns the means of the eighteen parameters.
    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    /// Returns the standard deviations of the eighteen parameters.
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
        let end = if self.knows_arm() { LEARNED } else { at::ARM };
        self.widened(&(prior.deviations() * share), 0..end)
    }

    /// Returns the belief after a slip of the camera in its mount, or a turn of its lens.
    pub(crate) fn slipped(self, prior: &Prior) -> Self {
        self.widened(&prior.deviations(), 0..at::RADIUS)
    }

    /// Adds these standard deviations to some parameters and keeps the means.
    fn widened(self, deviations: &Numbers, rows: std::ops::Range<usize>) -> Self {
        let mut change = Numbers::zeros();
        for i in rows {
            change[i] = deviations[i].powi(2);
        }
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
    const FILE_KIND: &str = "grasp-agent belief/3";

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
