//! The differences between a believed cell and the real one.

use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

use hough_heuristic::Features;
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};
use puma_val2::Joints;
use rand::{Rng, RngExt};

use crate::cell::ball::Holder;
use crate::cell::distortion::Distortion;
use crate::cell::geometry::Cell;
use crate::error::{QuantityError, amount, at_most, finite, positive};

/// Differences of a real cell from the nominal one.
///
/// [`Errors::apply`] puts those of camera, ball and links into a cell; arm and cameras on a
/// [`SharedCell`](crate::SharedCell) make the others ([`SharedCell::set_errors`]).
///
/// [`SharedCell::set_errors`]: crate::SharedCell::set_errors
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
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
    /// Distortion of the lens.
    pub distortion: Distortion,
    /// True radius of the ball over the nominal one.
    pub radius_factor: f64,
    /// Lengthening of upper arm and forearm, metres.
    pub link_shift: [f64; 2],
    /// Offset of each link from the angle that its encoder reads, `JT1` first, radians.
    pub joint_zero: [f64; 6],
    /// Turn of each link over that of its encoder. Turns count from where the arm was adjusted: the
    /// middle of the working range of `JT1` to `JT3` (of the paper's cell 0, -85 and 167.5
    /// degrees), 0 of the others.
    pub gear: [f64; 6],
    /// Fraction of the turn of `JT3` that `JT2` makes as well, and of that of `JT2` that `JT3`
    /// makes.
    pub drag: [f64; 2],
    /// Droop of the upper arm when it is level, radians. It falls with the cosine of the elevation.
    pub sag: f64,
    /// Play between motor and link in every joint, whole width, radians.
    pub backlash: f64,
    /// Angle of one encoder count, `JT1` first, radians; 0 for a joint that stands anywhere.
    pub encoder_step: [f64; 6],
    /// Turn below which a joint sticks, radians: the link does not move, and the encoder shows that
    /// it did not.
    pub stiction: f64,
    /// Turn below which a link does not move, radians, although its encoder shows the turn.
    pub dead_zone: f64,
    /// Standard deviation of the noise on each image feature, units.
    pub feature_noise: f64,
    /// A camera that shows left and right exchanged.
    pub mirrored: bool,
    /// Number of frames by which the camera's image is late, at most 1000.
    pub lag: usize,
    /// Fraction of frames that do not show the ball, 0..=1.
    pub missed: f64,
    /// Fraction of frames that show it somewhere else, 0..=1.
    pub outliers: f64,
    /// Turn about the image's x axis, radians, and displacement along it, metres, by which the
    /// camera slips in its mount ([`Errors::slip_camera`]).
    pub slip: [f64; 2],
}

impl Errors {
    /// Angle of one count of each of the PUMA 560's encoders, degrees.
    pub const PUMA_ENCODER_DEGREES: [f64; 6] =
        [0.00575, 0.00417, 0.00670, 0.00474, 0.00501, 0.00939];

    /// Names of odd errors, each with its usual amount, for [`Errors::with_odd`].
    pub const ODD: [(&str, f64); 17] = [
        ("zeros", 3.0),
        ("gears", 3.0),
        ("sag", 4.0),
        ("drag", 10.0),
        ("back-drag", 10.0),
        ("links", 20.0),
        ("stiction", 0.5),
        ("dead-zone", 0.5),
        ("play", 3.0),
        ("lag", 1.0),
        ("slip", 8.0),
        ("mirrored", 1.0),
        ("roll", 45.0),
        ("lens", -0.4),
        ("noise", 3.0),
        ("missed", 20.0),
        ("outliers", 5.0),
    ];

    /// Returns the errors of a cell that equals the nominal one.
    pub fn none() -> Self {
        Self {
            focal_factor: 1.0,
            roll: 0.0,
            pitch: 0.0,
            yaw: 0.0,
            camera_shift: [0.0; 3],
            centre_shift: [0.0; 2],
            distortion: Distortion::default(),
            radius_factor: 1.0,
            link_shift: [0.0; 2],
            joint_zero: [0.0; 6],
            gear: [1.0; 6],
            drag: [0.0; 2],
            sag: 0.0,
            backlash: 0.0,
            encoder_step: [0.0; 6],
            stiction: 0.0,
            dead_zone: 0.0,
            feature_noise: 0.0,
            mirrored: false,
            lag: 0,
            missed: 0.0,
            outliers: 0.0,
            slip: [0.0; 2],
        }
    }

    /// Adds an odd error, one that no level has. `name` is `NAME`, which takes the usual amount of
    /// [`Errors::ODD`], or `NAME=AMOUNT`.
    ///
    /// | name | amount |
    /// |---|---|
    /// | `zeros`, `gears` | degrees, per cent that `JT2` and `JT3` are off |
    /// | `sag` | degrees that the level upper arm hangs down |
    /// | `drag`, `back-drag` | per cent of its turn by which `JT3` drags `JT2`, `JT2` drags `JT3` |
    /// | `links` | millimetres that upper arm and forearm are too long |
    /// | `stiction`, `dead-zone`, `play` | degrees |
    /// | `lag` | frames by which the image is late |
    /// | `slip` | degrees; the slip also shifts the camera by 10 mm |
    /// | `mirrored` | 1, or 0 for an upright image |
    /// | `roll` | degrees |
    /// | `lens` | first radial term of the distortion |
    /// | `noise` | feature units |
    /// | `missed`, `outliers` | per cent of the frames |
    ///
    /// # Errors
    /// [`QuantityError::Name`] lists the names; [`QuantityError::Value`] for an amount that is not
    /// a finite number.
    pub fn with_odd(mut self, name: &str) -> Result<Self, QuantityError> {
        let (kind, given) = name
            .split_once('=')
            .map_or((name, None), |(k, v)| (k, Some(v)));
        let Some((_, usual)) = Self::ODD.iter().find(|(known, _)| *known == kind) else {
            return Err(QuantityError::Name {
                name: kind.to_owned(),
                known: Self::ODD.map(|(known, _)| known).join(", "),
            });
        };
        let amount = given.map_or(*usual, |text| text.trim().parse().unwrap_or(f64::NAN));
        finite(format!("the amount of {kind}"), amount)?;
        let (angle, share) = (amount.to_radians(), amount / 100.0);
        match kind {
            "zeros" => self.joint_zero = [0.0, angle, angle, 0.0, 0.0, 0.0],
            "gears" => self.gear = [1.0, 1.0 + share, 1.0 + share, 1.0, 1.0, 1.0],
            "sag" => self.sag = angle,
            "drag" => self.drag[0] = share,
            "back-drag" => self.drag[1] = share,
            "links" => self.link_shift = [amount / 1000.0; 2],
            "stiction" => self.stiction = angle,
            "dead-zone" => self.dead_zone = angle,
            "play" => self.backlash = angle,
            "lag" => self.lag = amount.max(0.0) as usize,
            "slip" => self.slip = [angle, 0.010],
            "mirrored" => self.mirrored = amount > 0.0,
            "roll" => self.roll += angle,
            "lens" => self.distortion.k1 = amount,
            "noise" => self.feature_noise = amount,
            "missed" => self.missed = share,
            _ => self.outliers = share,
        }
        self.check()?;
        Ok(self)
    }

    /// Checks that a cell can be wrong in these ways.
    ///
    /// # Errors
    /// [`QuantityError`] names the quantity that is out of range.
    pub(crate) fn check(&self) -> Result<(), QuantityError> {
        let [x, y, z] = self.camera_shift;
        for (quantity, value) in [
            ("roll of the camera (rad)", self.roll),
            ("pitch of the camera (rad)", self.pitch),
            ("yaw of the camera (rad)", self.yaw),
            ("shift of the camera along its x axis (m)", x),
            ("shift of the camera along its y axis (m)", y),
            ("shift of the camera along its z axis (m)", z),
            ("lengthening of the upper arm (m)", self.link_shift[0]),
            ("lengthening of the forearm (m)", self.link_shift[1]),
            ("drag of JT2 by JT3", self.drag[0]),
            ("drag of JT3 by JT2", self.drag[1]),
            ("sag of the upper arm (rad)", self.sag),
            ("turn of the camera's slip (rad)", self.slip[0]),
            ("length of the camera's slip (m)", self.slip[1]),
        ] {
            finite(quantity, value)?;
        }
        let turn = |quantity: String, value: f64| {
            amount(quantity.as_str(), value)?;
            at_most(quantity, value, PI)
        };
        turn("backlash (rad)".to_owned(), self.backlash)?;
        turn("stiction (rad)".to_owned(), self.stiction)?;
        turn("dead zone (rad)".to_owned(), self.dead_zone)?;
        for i in 0..6 {
            let of_joint = |what: &str| format!("{what} of JT{}", i + 1);
            turn(of_joint("encoder step (rad)"), self.encoder_step[i])?;
            finite(of_joint("zero (rad)"), self.joint_zero[i])?;
            positive(of_joint("gear"), self.gear[i])?;
        }
        let (noise, amiss) = (self.feature_noise, self.missed + self.outliers);
        amount("noise of the features (units)", noise)?;
        at_most("lag (looks)", self.lag as f64, 1000.0)?;
        amount("fraction of missed looks", self.missed)?;
        amount("fraction of outliers", self.outliers)?;
        at_most("fraction of missed looks and outliers", amiss, 1.0)
    }

    /// Returns the true cell for the believed cell `nominal`.
    ///
    /// # Errors
    /// [`QuantityError`] names the quantity that is out of range.
    pub fn apply(&self, nominal: &Cell) -> Result<Cell, QuantityError> {
        self.check()?;
        let radius = nominal.ball.radius * self.radius_factor;
        positive("radius of the ball (m)", radius)?;
        let unit = f64::from(nominal.camera.size().0) / Features::WIDTH;
        let [across, down] = self.centre_shift;
        let principal = nominal.camera.principal_point() + Vector2::new(across, down) * unit;
        let mut cell = *nominal;
        cell.camera = nominal
            .camera
            .with_focal_factor(self.focal_factor)?
            .with_principal_point(principal)?;
        if !self.distortion.is_none() {
            cell.camera = cell.camera.with_distortion(self.distortion)?;
        }
        cell.arm = cell.arm.lengthened(self.link_shift);
        // Shifted along the camera's own axes, then turned in place.
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), self.yaw)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), self.pitch)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), self.roll);
        cell.mount *= Isometry3::from_parts(
            Translation3::from(self.camera_shift),
            UnitQuaternion::from_rotation_matrix(&turn),
        );
        cell.ball.radius = radius;
        let carried = |holder: Holder| holder.carries(&nominal.ball);
        if nominal.holder.is_some_and(carried) {
            cell.holder = Some(Holder::under(&cell.ball));
        }
        Ok(cell)
    }

    /// Lets the camera of a cell slip in its mount.
    pub fn slip_camera(&self, cell: &mut Cell) {
        let [turn, shift] = self.slip;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), turn);
        cell.mount *= Isometry3::from_parts(Translation3::new(shift, 0.0, 0.0), turn);
    }

    /// Returns the angles of the links of the arm in `cell` whose encoders, less the play, read
    /// `read`.
    pub(crate) fn links(&self, cell: &Cell, read: &Joints) -> Joints {
        let (zero, gear, drag) = (&self.joint_zero, &self.gear, &self.drag);
        let off = zero.iter().chain(drag).copied().chain([self.sag]);
        if off.chain(gear.map(|gear| gear - 1.0)).all(|off| off == 0.0) {
            return *read;
        }
        let adjusted = |i: usize| match cell.limits[i] {
            (low, high) if i < 3 => 0.5 * (low + high),
            _ => 0.0,
        };
        let turned = |i: usize| read.0[i] - adjusted(i);
        let geared = |i: usize| adjusted(i) + gear[i] * turned(i) + zero[i];
        let mut links = Joints(std::array::from_fn(geared));
        links.0[1] += drag[0] * turned(2);
        links.0[2] += drag[1] * turned(1);
        links.0[1] += self.sag * cell.arm.droop(&links);
        links
    }

    /// Draws what goes wrong in a look at the ball.
    pub(crate) fn glitch<R: Rng + ?Sized>(&self, rng: &mut R) -> Glitch {
        if self.missed + self.outliers <= 0.0 {
            return Glitch::None;
        }
        let lot: f64 = rng.random();
        if lot < self.missed {
            Glitch::Missed
        } else if lot < self.missed + self.outliers {
            Glitch::Outlier(Features {
                x: rng.random_range(10.0..Features::WIDTH - 10.0),
                y: rng.random_range(10.0..Features::HEIGHT - 10.0),
                r: rng.random_range(8.0..45.0),
            })
        } else {
            Glitch::None
        }
    }
}

/// A fault of a single look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Glitch {
    None,
    /// The ball does not show.
    Missed,
    /// The ball shows here instead.
    Outlier(Features),
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
/// encoder steps of a PUMA 560. Other errors are added by [`Errors::with_odd`].
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
            ..Errors::none()
        }
    }
}

/// Names of the levels, in the order of [`ErrorLevel::ALL`].
const LEVELS: [&str; 4] = ["none", "moderate", "heavy", "extreme"];

impl fmt::Display for ErrorLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(LEVELS[*self as usize])
    }
}

impl FromStr for ErrorLevel {
    type Err = QuantityError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = LEVELS.iter().position(|level| *level == name);
        found
            .map(|k| Self::ALL[k])
            .ok_or_else(|| QuantityError::Name {
                name: name.to_owned(),
                known: LEVELS.join(", "),
            })
    }
}
