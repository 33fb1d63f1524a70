//! The differences between a believed cell and the real one.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};
use puma_val2::{ArmError, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Holder;
use crate::cell::geometry::Cell;
use crate::error::{QuantityError, finite, positive};

/// Differences of a real cell from the nominal one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Errors {
    /// True focal length over the nominal one.
    pub focal_factor: f64,
    /// Turn of the camera about its optical axis, radians.
    pub roll: f64,
    /// Turn of the camera about the image's x axis, radians.
    pub pitch: f64,
    /// Turn of the camera about the image's y axis, radians.
    pub yaw: f64,
    /// Displacement of the camera along its own axes, metres.
    pub camera_shift: [f64; 3],
    /// Displacement of the principal point, feature units.
    pub centre_shift: [f64; 2],
    /// True radius of the ball over the nominal one.
    pub radius_factor: f64,
    /// Play between motor and link in every joint, whole width, radians.
    pub backlash: f64,
    /// Angle of one encoder count, `JT1` first, radians; 0 for a joint that stands anywhere.
    pub encoder_step: [f64; 6],
    /// Standard deviation of the noise on each image feature, units.
    pub feature_noise: f64,
}

impl Errors {
    /// Angle of one count of each of the PUMA 560's encoders, degrees.
    pub const PUMA_ENCODER_DEGREES: [f64; 6] =
        [0.00575, 0.00417, 0.00670, 0.00474, 0.00501, 0.00939];

    /// Returns the errors of a cell that is as believed.
    pub fn none() -> Self {
        Self {
            focal_factor: 1.0,
            roll: 0.0,
            pitch: 0.0,
            yaw: 0.0,
            camera_shift: [0.0; 3],
            centre_shift: [0.0; 2],
            radius_factor: 1.0,
            backlash: 0.0,
            encoder_step: [0.0; 6],
            feature_noise: 0.0,
        }
    }

    /// Returns the true cell for the believed cell `nominal`. Backlash, encoder steps and noise
    /// belong to the arm ([`SimulatedArm::with_errors`](crate::SimulatedArm::with_errors)) and the
    /// observation ([`FeatureCamera`](crate::FeatureCamera)).
    ///
    /// # Errors
    /// [`QuantityError`] names the factor that is not above zero, or the angle or shift that is not
    /// finite.
    pub fn apply(&self, nominal: &Cell) -> Result<Cell, QuantityError> {
        let [x, y, z] = self.camera_shift;
        for (quantity, value) in [
            ("roll of the camera (rad)", self.roll),
            ("pitch of the camera (rad)", self.pitch),
            ("yaw of the camera (rad)", self.yaw),
            ("shift of the camera along its x axis (m)", x),
            ("shift of the camera along its y axis (m)", y),
            ("shift of the camera along its z axis (m)", z),
        ] {
            finite(quantity, value)?;
        }
        let radius = nominal.ball.radius * self.radius_factor;
        positive("radius of the ball (m)", radius)?;
        let unit = f64::from(nominal.camera.size().0) / hough_heuristic::Features::WIDTH;
        let principal = nominal.camera.principal_point()
            + Vector2::new(self.centre_shift[0] * unit, self.centre_shift[1] * unit);
        let mut cell = *nominal;
        cell.camera = nominal
            .camera
            .with_focal_factor(self.focal_factor)?
            .with_principal_point(principal)?;
        // Shifted along the camera's own axes, then turned in place.
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), self.yaw)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), self.pitch)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), self.roll);
        cell.mount *= Isometry3::from_parts(
            Translation3::from(self.camera_shift),
            UnitQuaternion::from_rotation_matrix(&turn),
        );
        cell.ball.radius = radius;
        if nominal
            .holder
            .is_some_and(|holder| holder.carries(&nominal.ball))
        {
            cell.holder = Some(Holder::under(&cell.ball));
        }
        Ok(cell)
    }
}

impl Errors {
    /// Checks that an arm can have this play and these encoders.
    ///
    /// # Errors
    /// [`ArmError::Setting`] names the quantity that is not finite, or below zero.
    pub(crate) fn check_drive(&self) -> Result<(), ArmError> {
        const STEPS: [&str; 6] = [
            "the encoder step of JT1",
            "the encoder step of JT2",
            "the encoder step of JT3",
            "the encoder step of JT4",
            "the encoder step of JT5",
            "the encoder step of JT6",
        ];
        let steps = STEPS.into_iter().zip(self.encoder_step);
        for (what, value) in steps.chain([("the backlash", self.backlash)]) {
            if !(0.0..=std::f64::consts::PI).contains(&value) {
                return Err(ArmError::Setting {
                    what,
                    value: format!("{value} rad"),
                    allowed: "a finite angle of zero or above, at most half a turn",
                });
            }
        }
        Ok(())
    }
}

impl Default for Errors {
    fn default() -> Self {
        Self::none()
    }
}

/// Size of the errors of a cell.
///
/// | level | focal length | roll, pitch, yaw | backlash | noise | ball | camera | principal point |
/// |---|---|---|---|---|---|---|---|
/// | none | | | | | | | |
/// | moderate | 10 % | 3 deg | 0.2 deg | 0.5 units | | | |
/// | heavy | 25 % | 8 deg | 0.6 deg | 1 unit | 10 % | 20 mm each axis | 5 units |
/// | extreme | 40 % | 15 deg | 1 deg | 1.5 units | 20 % | 20 mm each axis | 5 units |
///
/// Each quantity is off by the full amount, with a random sign. All levels but `none` have the
/// encoder steps of a PUMA 560.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ErrorLevel {
    /// No errors.
    None,
    /// A cell set up with care, without calibration.
    Moderate,
    /// A cell set up by eye.
    Heavy,
    /// A cell with the wrong lens, a bent bracket and another ball.
    Extreme,
}

impl ErrorLevel {
    /// All levels, mildest first.
    pub const ALL: [Self; 4] = [Self::None, Self::Moderate, Self::Heavy, Self::Extreme];

    /// Draws the errors of one cell.
    pub fn draw<R: Rng + ?Sized>(self, rng: &mut R) -> Errors {
        let (focal, degrees, backlash, noise, ball, shift, centre) = match self {
            Self::None => return Errors::none(),
            Self::Moderate => (0.10, 3.0, 0.2, 0.5, 0.0, 0.0, 0.0),
            Self::Heavy => (0.25, 8.0, 0.6, 1.0, 0.10, 0.020, 5.0),
            Self::Extreme => (0.40, 15.0, 1.0, 1.5, 0.20, 0.020, 5.0),
        };
        let mut signed = |amount: f64| if rng.random() { amount } else { -amount };
        let angle = f64::to_radians(degrees);
        Errors {
            focal_factor: 1.0 + signed(focal),
            roll: signed(angle),
            pitch: signed(angle),
            yaw: signed(angle),
            camera_shift: [signed(shift), signed(shift), signed(shift)],
            centre_shift: [signed(centre), signed(centre)],
            radius_factor: 1.0 + signed(ball),
            backlash: f64::to_radians(backlash),
            encoder_step: Errors::PUMA_ENCODER_DEGREES.map(f64::to_radians),
            feature_noise: noise,
        }
    }
}

impl fmt::Display for ErrorLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::None => "none",
            Self::Moderate => "moderate",
            Self::Heavy => "heavy",
            Self::Extreme => "extreme",
        })
    }
}

impl FromStr for ErrorLevel {
    type Err = QuantityError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|level| level.to_string() == name)
            .ok_or_else(|| QuantityError::Name {
                name: name.to_owned(),
                known: "none, moderate, heavy, extreme".to_owned(),
            })
    }
}

/// Motors and gears: the reported joint angles, and those of the links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drive {
    backlash: f64,
    encoder_step: [f64; 6],
    reported: Joints,
    links: Joints,
}

impl Drive {
    /// `errors` must have passed [`Errors::check_drive`].
    pub(crate) fn new(joints: Joints, errors: &Errors) -> Self {
        let (backlash, encoder_step) = (errors.backlash, errors.encoder_step);
        let mut drive = Self {
            backlash,
            encoder_step,
            reported: joints,
            links: joints,
        };
        drive.send(joints);
        drive
    }

    /// Returns the angles that the encoders report.
    pub(crate) fn reported(&self) -> Joints {
        self.reported
    }

    /// Returns the angles of the links, within the play of the gears.
    pub(crate) fn links(&self) -> Joints {
        self.links
    }

    /// Turns the motors to the counts nearest to `target`; the links follow once the play is used
    /// up.
    pub(crate) fn send(&mut self, target: Joints) {
        let half = 0.5 * self.backlash;
        for i in 0..6 {
            let step = self.encoder_step[i];
            let motor = if step > 0.0 {
                (target.0[i] / step).round() * step
            } else {
                target.0[i]
            };
            self.reported.0[i] = motor;
            self.links.0[i] = self.links.0[i].clamp(motor - half, motor + half);
        }
    }
}
