//! The emulated arm: where it stands, what moves it, what it refuses.

use std::time::Duration;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::emulator::language::instruction::SpeedUnit;
use crate::emulator::language::place::Place;
use crate::emulator::machine::motion::Motion;
use crate::emulator::machine::path::{Leg, Pace};
use crate::emulator::message::{Fault, Message};
use crate::emulator::profile::Profile;
use crate::joints::{Joint, Joints};
use crate::kinematics::drive_train::DriveTrain;
use crate::kinematics::frames::Frames;
use crate::kinematics::inverse::{Configuration, Unreachable};
use crate::kinematics::params::PumaParams;
use crate::manipulator::Gripper;

#[derive(Clone, Debug)]
pub(crate) struct Arm {
    pub(crate) params: PumaParams,
    drives: Option<DriveTrain>,
    joints: Joints,
    motion: Option<Motion>,
    pub(crate) power: bool,
    pub(crate) calibrated: bool,
    pub(crate) frames: Frames,
    pub(crate) gripper: Gripper,
    gripper_next: Option<Gripper>,
    /// Words of posture for the next motion: right arm, elbow above, wrist flipped.
    postures_next: [Option<bool>; 3],
    keeps_posture: bool,
    /// Percent.
    pub(crate) monitor_speed: f64,
    pub(crate) program_speed: Speed,
    next_speed: Option<Speed>,
    /// `FINE`: the arm stands at the end of the next motion, or of every one.
    pub(crate) fine_next: bool,
    pub(crate) fine_always: bool,
}

/// A program speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Speed {
    value: f64,
    unit: SpeedUnit,
}

impl Speed {
    pub(crate) const FULL: Self = Self::percent(100.0);

    pub(crate) const fn percent(value: f64) -> Self {
        Self {
            value,
            unit: SpeedUnit::Percent,
        }
    }

    pub(crate) fn new(value: f64, unit: SpeedUnit) -> Result<Self, Fault> {
        if value > 0.0 && value <= 100_000.0 {
            Ok(Self { value, unit })
        } else {
            Err(Message::InvalidArgument.into())
        }
    }

    /// Returns the fraction of full speed. `line_speed`, metres per second, is full for a speed in
    /// units of length.
    fn fraction(self, line_speed: f64) -> f64 {
        match self.unit {
            SpeedUnit::Percent => self.value / 100.0,
            SpeedUnit::MillimetresPerSecond => self.value / 1000.0 / line_speed,
            SpeedUnit::InchesPerSecond => self.value * 0.0254 / line_speed,
        }
    }

    /// Returns the number that the controller shows.
    pub(crate) fn shown(self) -> f64 {
        self.value
    }
}

impl Arm {
    pub(crate) fn new(params: PumaParams, profile: &Profile) -> Self {
        let drives = profile.encoder_counts.then(DriveTrain::puma560);
        Self {
            params,
            joints: drives.map_or(profile.start, |d| d.quantized(&profile.start)),
            drives,
            motion: None,
            power: profile.start_power == Some(true),
            calibrated: profile.start_calibrated,
            frames: Frames::default(),
            gripper: Gripper::Open,
            gripper_next: None,
            postures_next: [None; 3],
            keeps_posture: profile.keeps_posture,
            monitor_speed: 100.0,
            program_speed: Speed::FULL,
            next_speed: None,
            fine_next: false,
            fine_always: false,
        }
    }

    /// Stands at `joints` (or the nearest whole encoder counts) from now on.
    pub(crate) fn put(&mut self, joints: Joints) {
        self.motion = None;
        self.joints = joints;
        self.joints = self.shown();
    }

    /// Returns the joint angles at the time of the last [`Arm::advance`].
    pub(crate) fn joints(&self) -> Joints {
        self.joints
    }

    /// Returns the joint angles that the encoders give.
    pub(crate) fn shown(&self) -> Joints {
        self.drives
            .map_or(self.joints, |d| d.quantized(&self.joints))
    }

    /// Returns the end of the present motion, or the position of a standing arm.
    pub(crate) fn destination(&self) -> Joints {
        self.motion
            .as_ref()
            .map_or_else(|| self.shown(), Motion::target)
    }

    /// Returns the joint angles that the next motion starts from.
    pub(crate) fn start(&self) -> Joints {
        self.motion.as_ref().map_or(self.joints, Motion::target)
    }

    /// Returns the time from which on a motion can follow the present one without a stop between.
    /// It is the time at which the arm slows down for its stand.
    pub(crate) fn slows_down(&self) -> Option<Duration> {
        let open = self.motion.as_ref().filter(|motion| motion.is_open());
        open.map(Motion::slows_down)
    }

    /// Makes the arm stand at the end of the present motion, whatever follows.
    pub(crate) fn close(&mut self) {
        if let Some(motion) = &mut self.motion {
            motion.closed = true;
        }
    }

    /// Returns the hand in the world frame.
    pub(crate) fn hand(&self, joints: &Joints) -> Isometry3<f64> {
        self.frames.hand(&self.params, joints)
    }

    pub(crate) fn moving(&self) -> bool {
        self.motion.is_some()
    }

    pub(crate) fn motion_end(&self) -> Option<Duration> {
        self.motion.as_ref().map(Motion::end)
    }

    /// Follows the motion to `now`. Returns the outcome of a motion that has ended, the fault at
    /// the end of its path included.
    pub(crate) fn advance(&mut self, now: Duration) -> Option<Result<(), Fault>> {
        let motion = self.motion.as_ref()?;
        self.joints = motion.at(now);
        if now < motion.end() {
            return None;
        }
        self.joints = self.shown();
        let motion = self.motion.take()?;
        match motion.failure {
            Some(fault) if !motion.is_broken_off() => Some(Err(fault)),
            _ => Some(Ok(())),
        }
    }

    /// Brings a motion under way to a stand.
    pub(crate) fn break_off(&mut self, now: Duration, time: Duration) {
        if let Some(motion) = &mut self.motion {
            motion.break_off(now, time);
        }
    }

    /// Forgets the words that apply to the next motion.
    pub(crate) fn forget_words(&mut self) {
        self.gripper_next = None;
        self.postures_next = [None; 3];
        self.next_speed = None;
        self.fine_next = false;
    }

    pub(crate) fn set_gripper_next(&mut self, to: Gripper) {
        self.gripper_next = Some(to);
    }

    /// Asks for a part of the next motion's [`Configuration`].
    pub(crate) fn set_posture_next(&mut self, part: usize, value: bool) {
        self.postures_next[part] = Some(value);
    }

    pub(crate) fn set_speed_next(&mut self, speed: Speed) {
        self.next_speed = Some(speed);
    }

    /// Checks that the arm may be moved at all.
    pub(crate) fn check_ready(&self) -> Result<(), Fault> {
        if !self.power {
            return Err(Message::ArmPowerOff.into());
        }
        if !self.calibrated {
            return Err(Message::NotCalibrated.into());
        }
        Ok(())
    }

    fn check_limits(&self, joints: &Joints) -> Result<(), Fault> {
        let out = |joint: &Joint| {
            let range = self.params.ranges[joint.index()];
            let (from, to) = (self.start()[*joint], joints[*joint]);
            !range.holds(to) && !range.inwards(from, to)
        };
        match Joint::ALL.into_iter().find(out) {
            Some(joint) => Err(Fault::at(Message::OutOfRange, joint)),
            None => Ok(()),
        }
    }

    fn pace(&self, profile: &Profile, speed: Option<Speed>) -> Pace {
        let speed = speed.or(self.next_speed).unwrap_or(self.program_speed);
        let fraction = speed.fraction(profile.line_speed) * self.monitor_speed / 100.0;
        Pace {
            fraction: fraction.clamp(1e-4, 1.0),
            acceleration_time: profile.acceleration_time.as_secs_f64().max(1e-3),
        }
    }

    /// Starts along a leg, after the present motion if there is one. Returns `false`, and changes
    /// nothing, if the arm has to stand first.
    fn begin(&mut self, leg: Leg, failure: Option<Fault>, now: Duration, pace: Pace) -> bool {
        let begun = match &self.motion {
            Some(motion) => motion.followed_by(leg, now),
            None => Some(Motion::new(leg, now, pace, &self.params)),
        };
        let Some(mut motion) = begun else {
            return false;
        };
        motion.closed = self.fine_next || self.fine_always;
        motion.failure = failure;
        if let Some(gripper) = self.gripper_next.take() {
            self.gripper = gripper;
        }
        self.forget_words();
        self.motion = Some(motion);
        true
    }

    /// Starts a joint-interpolated motion. `speed` overrides the program's. Returns `false` if the
    /// arm has to stand first.
    pub(crate) fn start_joints(
        &mut self,
        to: Joints,
        speed: Option<Speed>,
        now: Duration,
        profile: &Profile,
    ) -> Result<bool, Fault> {
        self.check_ready()?;
        self.check_limits(&to)?;
        let pace = self.pace(profile, speed);
        let leg = Leg::straight(self.start(), to, pace, &self.params);
        Ok(self.begin(leg, None, now, pace))
    }

    /// Returns the joint angles that reach a location, in the posture asked for or the present one.
    pub(crate) fn resolve(&self, place: &Place) -> Result<Joints, Fault> {
        let pose = match place {
            Place::PrecisionPoint(joints) => return Ok(*joints),
            Place::Transformation(pose) => pose,
        };
        let start = self.start();
        let now = self.params.configuration(&start).parts();
        let [side_open, wrist_open] = self.between_postures(&start);
        let fits = |c: Configuration, open: [bool; 3]| {
            let kept = |i: usize| open[i] || c.parts()[i] == now[i];
            (0..3).all(|i| self.postures_next[i].map_or(kept(i), |asked| asked == c.parts()[i]))
        };
        let keeps = |c| fits(c, [side_open, side_open, wrist_open]);
        let reached = self.reach(pose, &start, keeps);
        if self.keeps_posture {
            return reached;
        }
        let obeys = |c| fits(c, [true; 3]);
        reached.or_else(|fault| self.reach(pose, &start, obeys).map_err(|_| fault))
    }

    /// Returns `true` for side and wrist if the arm stands so near to the border between two
    /// postures that it is in neither: the upright arm between left and right, the straight wrist
    /// between flip and no flip.
    fn between_postures(&self, joints: &Joints) -> [bool; 2] {
        let ahead = self.params.wrist_ahead(joints);
        [ahead.abs() < 0.03, joints.0[4].abs() < 0.1_f64.to_radians()]
    }

    fn reach(
        &self,
        hand: &Isometry3<f64>,
        near: &Joints,
        allowed: impl Fn(Configuration) -> bool,
    ) -> Result<Joints, Fault> {
        let flange = self.frames.flange(hand);
        self.params
            .inverse_among(&flange, near, allowed)
            .map_err(|why| match why {
                Unreachable::TooClose { .. } => Message::TooClose.into(),
                Unreachable::Limit { joint, .. } => Fault::at(Message::OutOfRange, joint),
                _ => Message::OutOfRange.into(),
            })
    }

    /// Starts a straight-line motion of the hand, in the present posture. Returns `false` if the
    /// arm has to stand first.
    pub(crate) fn start_line(
        &mut self,
        to: &Place,
        now: Duration,
        profile: &Profile,
    ) -> Result<bool, Fault> {
        self.check_ready()?;
        let start = self.start();
        let to = match to {
            Place::Transformation(pose) => *pose,
            Place::PrecisionPoint(joints) => self.hand(joints),
        };
        let from = self.hand(&start);
        let posture = self.params.configuration(&start);
        self.reach(&to, &start, |c| c == posture)?;
        let length = (to.translation.vector - from.translation.vector).norm();
        let turn = from.rotation.angle_to(&to.rotation);
        // A knot every 5 mm or 2 degrees keeps the joint-interpolated chord within some micrometres
        // of the line.
        let spans = (length / 0.005)
            .max(turn / 2.0_f64.to_radians())
            .ceil()
            .clamp(1.0, 2000.0) as usize;
        let mut knots = vec![start];
        let mut failure = None;
        for i in 1..=spans {
            let part = i as f64 / spans as f64;
            let position = from.translation.vector.lerp(&to.translation.vector, part);
            let rotation = from
                .rotation
                .try_slerp(&to.rotation, part, 1e-9)
                .unwrap_or(to.rotation);
            let hand = Isometry3::from_parts(Translation3::from(position), rotation);
            match self.reach(&hand, &knots[i - 1], |c| c == posture) {
                Ok(joints) => knots.push(joints),
                Err(fault) if profile.check_line_ahead || i == 1 => return Err(fault),
                Err(fault) => {
                    failure = Some(fault);
                    break;
                }
            }
        }
        let travelled = (knots.len() - 1) as f64 / spans as f64;
        let mut pace = self.pace(profile, None);
        let seconds = (length / profile.line_speed).max(turn / profile.line_turn) * travelled;
        let seconds = seconds / pace.fraction;
        // A line's speed is a matter of the hand; the joints are held to their own limits at full
        // speed.
        pace.fraction = 1.0;
        let leg = Leg::along(knots, seconds, pace, &self.params);
        Ok(self.begin(leg, failure, now, pace))
    }

    /// Returns `place` moved by `distance` metres back along its own tool axis.
    pub(crate) fn approach(&self, place: &Place, distance: f64) -> Place {
        let pose = match place {
            Place::Transformation(pose) => *pose,
            Place::PrecisionPoint(joints) => self.hand(joints),
        };
        Place::Transformation(pose * Translation3::new(0.0, 0.0, -distance))
    }

    /// Returns the present pose with the tool axis turned to the nearest axis of the world.
    pub(crate) fn aligned(&self) -> Place {
        let hand = self.hand(&self.destination());
        let axis = hand * Vector3::z();
        let nearest = axis.iamax();
        let mut wanted = Vector3::zeros();
        wanted[nearest] = if axis[nearest] < 0.0 { -1.0 } else { 1.0 };
        let turn = UnitQuaternion::rotation_between(&axis, &wanted).unwrap_or_default();
        Place::Transformation(Isometry3::from_parts(
            hand.translation,
            turn * hand.rotation,
        ))
    }

    /// Turns every joint by a degree and a half and back, past an index pulse of each encoder.
    pub(crate) fn start_calibration(&mut self, now: Duration, profile: &Profile) {
        let pace = Pace {
            fraction: 0.05,
            acceleration_time: profile.acceleration_time.as_secs_f64().max(1e-3),
        };
        let by = 1.5_f64.to_radians();
        let away = Joints(std::array::from_fn(|i| {
            let range = self.params.ranges[i];
            if self.joints.0[i] + by <= range.max {
                self.joints.0[i] + by
            } else {
                self.joints.0[i] - by
            }
        }));
        let there = Leg::straight(self.joints, away, pace, &self.params);
        let back = Leg::straight(away, self.joints, pace, &self.params);
        let motion = Motion::new(there, now, pace, &self.params);
        self.motion = motion.followed_by(back, now).or(Some(motion));
    }
}
