//! The calibration of a camera on the hand.

use std::fmt;

use nalgebra::{DMatrix, Point3};
use puma_val2::{Joint, JointDelta, Joints, Kinematics, Manipulator};
use qtable::rand::SeedableRng;
use qtable::rand::rngs::Xoshiro256PlusPlus;
use serde::Serialize;

use crate::calibration::cell::{Estimated, at, joints_with_zeros};
use crate::calibration::fit::{Fit, Look};
use crate::calibration::poses::Known;
use crate::checked::above_zero;
use crate::error::AgentError;
use crate::limits::JointLimits;
use crate::percept::Sighting;
use crate::sight::camera_model::CameraModel;
use crate::sight::eye::Eye;

/// Hand-eye and lens calibration from looks at a ball that rests anywhere in view: no board, no
/// marker, no known place or size.
///
/// [`HandEye::calibrate`] looks from poses of its own choosing, [`HandEye::fit`] takes looks that
/// were made otherwise. The zero of the first joint cannot be told from the place of the ball, nor
/// that of the last joint from the turn of the camera.
#[derive(Clone, Debug)]
pub struct HandEye {
    /// Arm, camera and ball as they are meant to be: the focal length within a third, the axes
    /// within 15 degrees, places within centimetres.
    pub nominal: CameraModel,
    /// Range that each joint is kept in (default: that of the arm).
    pub limits: JointLimits,
    /// Number of looks, at least 8 (default 15).
    pub looks: usize,
    /// Estimate the zeros of joints (default `true`). Without, the encoders are believed.
    pub zeros: bool,
    /// Least distance of the ball's centre from the line between hand and tool point, and from the
    /// camera, metres (default .07): half the opening of the jaws, a finger and the ball.
    pub clearance: f64,
    /// Turn by which each joint comes to its place from below, radians (default .07). It takes the
    /// same side of all play; 0 moves straight.
    pub approach: f64,
    /// Seed of the poses (default 1).
    pub seed: u64,
}

/// Result of a calibration.
#[derive(Clone, Debug, Serialize)]
pub struct Calibration {
    /// Arm, camera and ball as found.
    pub model: CameraModel,
    /// First radial term of the lens distortion (`k1` of OpenCV).
    pub distortion: f64,
    /// Angle of each joint less the angle that it reports, radians; 0 where it is not estimated.
    pub zeros: JointDelta,
    /// Place of the ball, in the base frame, metres.
    pub ball: Point3<f64>,
    /// Standard deviation of the ball's place in the image, and of its radius, feature units. A
    /// detector has a fraction of a unit; much more means that arm or lens differ in form.
    pub noise: [f64; 2],
    /// Number of looks that did not fit the others and were left out.
    pub left_out: usize,
    /// Each quantity with its standard error.
    pub estimates: Vec<Estimate>,
}

/// One quantity of a [`Calibration`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Name, with the unit.
    pub name: String,
    /// Value; of the camera's axes, the turn about each of them from their nominal direction.
    pub value: f64,
    /// Standard error. The truth lies within two of them in 95 of 100 calibrations.
    pub error: f64,
}

/// Greatest noise with which looks fit, feature units: three times that of a poor detector.
const FITS: f64 = 2.5;

impl HandEye {
    /// Creates the settings for a cell that is meant to be like `nominal`.
    pub fn new(nominal: CameraModel) -> Self {
        Self {
            nominal,
            limits: JointLimits(nominal.arm.limits()),
            looks: 15,
            zeros: true,
            clearance: 0.07,
            approach: 0.07,
            seed: 1,
        }
    }

    /// Looks at a ball that is in view now, from poses of its own choosing, and calibrates.
    ///
    /// `free` tells whether the hand may go to a pose and stay clear of table and surroundings.
    /// The arm ends at the last pose.
    ///
    /// # Errors
    /// [`AgentError::Calibration`] if the ball is not in view at the beginning, is lost too often,
    /// or the looks do not determine a quantity; [`AgentError::Arm`], [`AgentError::Camera`];
    /// [`AgentError::Config`] for settings that cannot work.
    pub fn calibrate(
        &self,
        eye: &mut dyn Eye,
        arm: &mut dyn Manipulator,
        free: &mut dyn FnMut(&Joints) -> bool,
    ) -> Result<Calibration, AgentError> {
        self.check()?;
        let zeros = self.joints();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let (mut looks, mut poses): (Vec<Look>, Vec<Joints>) = (Vec::new(), Vec::new());
        let begun = arm.joints()?;
        let mut care = 2.0;
        let mut known = None;
        let mut goes_to = begun;
        for _ in 0..3 * self.looks {
            if self.approach > 0.0 && self.limits.admit(&self.before(&goes_to)) {
                arm.move_to(self.before(&goes_to))?;
            }
            let joints = arm.move_to(goes_to)?;
            if let Some(joint) = joints.non_finite() {
                let name = self.nominal.arm.names()[joint.index()].into();
                return Err(AgentError::Pose { joint, name });
            }
            if let Some(ball) = eye.look()?.filter(Sighting::is_finite) {
                looks.push((joints, ball.features));
                poses.push(joints);
                let start = match known.take() {
                    Some((cell, _)) => cell,
                    None => self.nominal_with_ball(&looks)?,
                };
                known = self.known(&looks, start, &zeros);
            } else if looks.is_empty() {
                return Err(unseen(
                    "the ball is not in view; move the arm until it is, and begin there",
                ));
            } else {
                care = (1.3_f64 * care).min(6.0);
            }
            if looks.len() == self.looks {
                return self.fit(&looks);
            }
            let Some((cell, covariance)) = &known else {
                return Err(unseen(
                    "the looks do not fit any camera near the nominal one",
                ));
            };
            // In tight places the ball may be seen less surely.
            let next = [1.0, 0.5, 0.2, 0.0].into_iter().find_map(|less| {
                let known = Known {
                    cell,
                    covariance,
                    zeros: &zeros,
                    poses: &poses,
                    care: less * care,
                };
                known.next(self, free, &mut rng)
            });
            goes_to = next.ok_or_else(|| {
                unseen("no free pose within the limits shows the ball; place it elsewhere")
            })?;
        }
        Err(unseen(
            "the ball was lost in two of three looks; check that it rests and is well lit",
        ))
    }

    /// Calibrates by looks that were made already: poses as the arm reported them, and the ball as
    /// it was seen from each.
    ///
    /// # Errors
    /// [`AgentError::Calibration`] if the looks do not determine a quantity, or do not fit;
    /// [`AgentError::Config`] for settings that cannot work.
    pub fn fit(
        &self,
        looks: &[(Joints, hough_heuristic::Features)],
    ) -> Result<Calibration, AgentError> {
        self.check()?;
        let zeros = self.joints();
        let start = self.nominal_with_ball(looks)?;
        let no_fit = || unseen("the looks do not fit any camera near the nominal one");
        let (mut cell, _) = self.known(looks, start, &zeros).ok_or_else(no_fit)?;
        let mut fit = Fit {
            looks,
            zeros: &zeros,
            noise: [0.5; 2],
            nominal: None,
        };
        let first = fit.good(&cell);
        fit.looks = &first;
        cell = fit.solve(cell).ok_or_else(no_fit)?.0;
        let kept = fit.good(&cell);
        fit.looks = &kept;
        let mut covariance = DMatrix::zeros(0, 0);
        // The noise of the looks and the cell are found in turn.
        for _ in 0..5 {
            let (next, information) = fit.solve(cell).ok_or_else(no_fit)?;
            covariance = self.covariance(&information, &zeros)?;
            cell = next;
            fit.noise = fit.noise_at(&cell, &covariance);
        }
        let noise = fit.noise;
        if noise[0] > FITS {
            return Err(unseen(&format!(
                "the looks fit no camera near the nominal one: they are {:.1} units from the best; \
                 check that the ball rests and that arm and nominal camera are the right ones",
                noise[0]
            )));
        }
        // Student's factor: the noise is estimated by the same looks.
        let spare = (3 * kept.len()).saturating_sub(covariance.nrows()).max(1);
        covariance *= 1.0 + 2.4 / spare as f64;
        let left_out = looks.len() - kept.len();
        Ok(self.result(&cell, &covariance, &zeros, noise, left_out))
    }

    fn check(&self) -> Result<(), AgentError> {
        let checked = || {
            self.nominal.check()?;
            self.limits
                .check(|joint| self.nominal.arm.names()[joint.index()].into())?;
            above_zero("the clearance", self.clearance)?;
            if !(0.0..1.0).contains(&self.approach) {
                return Err(format!("the approach is {}; give 0 to 1", self.approach));
            }
            if self.looks < 8 {
                return Err(format!("{} looks are too few; give 8 or more", self.looks));
            }
            Ok(())
        };
        checked().map_err(AgentError::Config)
    }

    fn joints(&self) -> Vec<Joint> {
        match self.zeros {
            true => joints_with_zeros(&self.nominal.arm),
            false => Vec::new(),
        }
    }

    /// Returns the pose from which the arm comes to `pose`.
    pub(crate) fn before(&self, pose: &Joints) -> Joints {
        self.limits
            .nearest(&(*pose + JointDelta([-self.approach; 6])))
    }

    fn nominal_with_ball(&self, looks: &[Look]) -> Result<Estimated, AgentError> {
        let located = |(joints, seen): &Look| self.nominal.locate(joints, seen);
        let ball = looks.iter().find_map(located);
        Ok(Estimated {
            model: self.nominal,
            distortion: 0.0,
            zeros: JointDelta::default(),
            ball: ball.ok_or_else(|| unseen("no look shows a ball that the camera can see"))?,
        })
    }

    /// Returns the cell by looks and expectation together, without looks that do not fit, and its
    /// covariance.
    fn known(
        &self,
        looks: &[Look],
        start: Estimated,
        zeros: &[Joint],
    ) -> Option<(Estimated, DMatrix<f64>)> {
        let mut fit = Fit {
            looks,
            zeros,
            noise: [0.5; 2],
            nominal: Some(self.nominal_with_ball(looks).ok()?),
        };
        let (mut cell, mut information) = fit.solve(start)?;
        let kept = fit.good(&cell);
        if kept.len() < looks.len() {
            fit.looks = &kept;
            (cell, information) = fit.solve(cell)?;
        }
        Some((cell, information.try_inverse()?))
    }

    /// Inverts the information of the looks alone.
    fn covariance(
        &self,
        information: &DMatrix<f64>,
        zeros: &[Joint],
    ) -> Result<DMatrix<f64>, AgentError> {
        let unit = information.map_diagonal(|v| v.max(1e-30).sqrt().recip());
        let scale = DMatrix::from_diagonal(&unit);
        let even = (&scale * information * &scale).symmetric_eigen();
        let (weakest, least) = even.eigenvalues.argmin();
        if least.is_nan() || least < 1e-10 {
            let direction = even.eigenvectors.column(weakest).abs();
            let name = self.name(direction.argmax().0, zeros);
            return Err(unseen(&format!(
                "the looks do not determine {name}; look from more different poses, or do without \
                 the zeros of joints"
            )));
        }
        let inverse = DMatrix::from_diagonal(&even.eigenvalues.map(f64::recip));
        let even = &even.eigenvectors * inverse * even.eigenvectors.transpose();
        Ok(&scale * even * &scale)
    }

    /// Returns the name of a quantity.
    fn name(&self, i: usize, zeros: &[Joint]) -> String {
        let axis = |from: usize| ["x", "y", "z"][i - from];
        match i {
            _ if i < at::SHIFT => format!("turn about the camera's {} (degrees)", axis(at::TURN)),
            _ if i < at::FOCAL => format!("camera {} in the hand (mm)", axis(at::SHIFT)),
            at::FOCAL => "focal length (units)".into(),
            _ if i < at::DISTORTION => format!("principal point {} (units)", axis(at::CENTRE)),
            at::DISTORTION => "distortion k1".into(),
            at::RADIUS => "radius of the ball (mm)".into(),
            _ if i < at::ZEROS => format!("ball {} (mm)", axis(at::BALL)),
            _ => {
                let joint = zeros[i - at::ZEROS].index();
                format!("zero of {} (degrees)", self.nominal.arm.names()[joint])
            }
        }
    }

    fn result(
        &self,
        cell: &Estimated,
        covariance: &DMatrix<f64>,
        zeros: &[Joint],
        noise: [f64; 2],
        left_out: usize,
    ) -> Calibration {
        let model = cell.model;
        let turn = (self.nominal.mount.rotation.inverse() * model.mount.rotation).scaled_axis();
        let estimates = (0..covariance.nrows()).map(|i| {
            let (value, unit) = match i {
                _ if i < at::SHIFT => (turn[i].to_degrees(), 1_f64.to_degrees()),
                _ if i < at::FOCAL => {
                    let place = model.mount.translation.vector[i - at::SHIFT];
                    (1000.0 * place, 1000.0)
                }
                at::FOCAL => (model.focal, model.focal),
                _ if i < at::DISTORTION => (model.centre[i - at::CENTRE], 1.0),
                at::DISTORTION => (cell.distortion, 1.0),
                at::RADIUS => (1000.0 * model.ball_radius, 1000.0 * model.ball_radius),
                _ if i < at::ZEROS => (1000.0 * cell.ball[i - at::BALL], 1000.0),
                _ => {
                    let zero = cell.zeros[zeros[i - at::ZEROS]];
                    (zero.to_degrees(), 1_f64.to_degrees())
                }
            };
            Estimate {
                name: self.name(i, zeros),
                value,
                error: unit * covariance[(i, i)].max(0.0).sqrt(),
            }
        });
        Calibration {
            model,
            distortion: cell.distortion,
            zeros: cell.zeros,
            ball: cell.ball,
            noise,
            left_out,
            estimates: estimates.collect(),
        }
    }
}

fn unseen(what: &str) -> AgentError {
    AgentError::Calibration(what.to_owned())
}

impl fmt::Display for Calibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Estimate { name, value, error } in &self.estimates {
            writeln!(f, "{name:<34} {value:>10.3} +- {error:.3}")?;
        }
        let [place, radius] = self.noise;
        write!(f, "noise {place:.2} units, of the radius {radius:.2}; ")?;
        write!(f, "{} looks left out", self.left_out)
    }
}
