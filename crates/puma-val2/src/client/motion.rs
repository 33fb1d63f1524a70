//! Motions of the joints, confirmed by `WHERE`.

use std::time::Duration;

use crate::client::config::MoveWay;
use crate::client::dialogue::State;
use crate::client::number::{check_percent, plain};
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::wire::{Failed, is_doubt};
use crate::error::ArmError;
use crate::joints::{Joint, JointDelta, Joints};
use crate::transport::Transport;

/// Angle below which a joint counts as still: less than VAL's smallest step, half a thousandth of a
/// degree.
pub(super) const STILL: f64 = 0.0005 * std::f64::consts::PI / 180.0;

/// Distance from the goal, an encoder count and a display digit, up to which an arm surely stands
/// there. An arm a little further off may be about to arrive and is looked at again.
pub(super) const AS_SENT: f64 = 0.012 * std::f64::consts::PI / 180.0;

/// Command that leads from the arm's position to a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Means {
    /// `DRIVE`, joint after joint, at this speed in percent.
    Drive(f64),
    Ppoint,
    Point,
    /// `POINT`, then a stored program that watches a signal while it moves. The speed is in
    /// percent; `None` keeps the monitor's own.
    Guarded(Option<f64>),
    Ready,
}

impl Means {
    /// Returns the speed in percent of the monitor's.
    fn percent(self) -> f64 {
        match self {
            Self::Drive(speed) | Self::Guarded(Some(speed)) => speed,
            _ => 100.0,
        }
    }
}

/// Doubt about what the controller has understood of a motion.
#[derive(Debug)]
pub(super) struct Doubt {
    pub(super) error: ArmError,
    /// The time of the motion ran out and it was stopped.
    pub(super) overdue: bool,
}

impl<T: Transport> Val2Client<T> {
    /// Turns one joint by `radians` at `speed` percent of the monitor's speed, and returns the
    /// joint angles afterwards.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`], [`ArmError::NotFinite`] or [`ArmError::Setting`] before anything
    /// is sent; otherwise as for [`Manipulator::move_by`](crate::Manipulator::move_by).
    pub fn drive(&mut self, joint: Joint, radians: f64, speed: f64) -> Result<Joints, ArmError> {
        check_percent(speed)?;
        let means = match self.guard {
            Some(_) => Means::Guarded(Some(speed)),
            None => Means::Drive(speed),
        };
        self.relative(JointDelta::of(joint, radians), means)
    }

    /// Moves the arm to its upright pose by `READY`, and returns the joint angles afterwards.
    ///
    /// # Errors
    /// Those of [`Manipulator::move_to`](crate::Manipulator::move_to).
    pub fn ready(&mut self) -> Result<Joints, ArmError> {
        let ready = Joints::READY;
        let means = match self.guard {
            Some(_) => Means::Guarded(None),
            None => Means::Ready,
        };
        self.absolute(ready, means)
    }

    pub(super) fn move_joints_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let moving = delta.0.iter().filter(|d| d.abs() >= STILL).count();
        let means = match self.wire.config.way {
            _ if self.guard.is_some() => self.coordinated(),
            MoveWay::Drive => Means::Drive(100.0),
            MoveWay::Automatic if moving == 1 && self.wire.checks_echo() => Means::Drive(100.0),
            _ => self.coordinated(),
        };
        self.relative(delta, means)
    }

    pub(super) fn move_joints_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let means = match self.wire.config.way {
            MoveWay::Drive if self.guard.is_none() => Means::Drive(100.0),
            _ => self.coordinated(),
        };
        self.absolute(target, means)
    }

    /// Returns the name of the precision point of the moves.
    pub(super) fn goal(&self) -> String {
        format!("#{}", self.wire.config.point_name)
    }

    fn coordinated(&self) -> Means {
        match self.wire.config.way {
            _ if self.guard.is_some() => Means::Guarded(None),
            MoveWay::Ppoint => Means::Ppoint,
            MoveWay::Automatic if self.wire.checks_echo() && !self.lacks_ppoint => Means::Ppoint,
            _ => Means::Point,
        }
    }

    fn relative(&mut self, delta: JointDelta, means: Means) -> Result<Joints, ArmError> {
        if let Some(joint) = Joints(delta.0).non_finite() {
            let name = joint.to_string();
            return Err(ArmError::NotFinite { joint, name });
        }
        let start = match self.last_known() {
            Some(joints) => joints,
            None => self.where_()?.joints,
        };
        let target = start + delta;
        let ranges = &self.wire.config.params.ranges;
        let mut checked = target;
        for (i, range) in ranges.iter().enumerate() {
            if range.inwards(start.0[i], target.0[i]) {
                checked.0[i] = target.0[i].clamp(range.min, range.max);
            }
        }
        self.wire.config.params.check(&checked)?;
        if delta.0.iter().all(|d| d.abs() < STILL) {
            return self.where_().map(|location| location.joints);
        }
        self.travel(start, target, means)
    }

    fn absolute(&mut self, target: Joints, means: Means) -> Result<Joints, ArmError> {
        self.wire.config.params.check(&target)?;
        // Only `DRIVE` has to know where it starts.
        let start = match (means, self.last_known()) {
            (Means::Drive(_), None) => self.where_()?.joints,
            (_, known) => known.unwrap_or(target),
        };
        self.travel(start, target, means)
    }

    /// Moves the arm from `start` to `target`. After doubt, only the rest of the way is commanded.
    fn travel(
        &mut self,
        start: Joints,
        target: Joints,
        mut means: Means,
    ) -> Result<Joints, ArmError> {
        self.check_means(means)?;
        let limit = self.motion_limit(self.last_known(), target, means.percent());
        let mut from = start;
        let mut tries = 0;
        loop {
            let outcome = self.set_off(from, target, means, limit);
            if let Err(failed) = &outcome
                && means == Means::Ppoint
                && !failed.maybe_done
                && self.wire.config.way == MoveWay::Automatic
                && names_no_place(&failed.error)
            {
                // The refusal may be the line's fault.
                self.lacks_ppoint = self.refuses_ppoint()?;
                if self.lacks_ppoint {
                    means = Means::Point;
                    continue;
                }
                if tries < self.wire.config.retries {
                    tries += 1;
                    continue;
                }
            }
            let doubt = self.doubt(outcome, limit)?;
            let stands = self.stand(target, limit);
            let stands = stands.map_err(|error| self.lost(error))?;
            let stands = self.check_guard(stands, doubt.is_some())?;
            if furthest(&stands, &target).1 <= self.wire.config.tolerance {
                return Ok(stands);
            }
            match doubt {
                Some(doubt) if tries < self.wire.config.retries && !doubt.overdue => {
                    tries += 1;
                    from = stands;
                }
                Some(doubt) => return Err(doubt.error),
                None => return Err(self.not_reached(target, stands)),
            }
        }
    }

    /// Returns `true` for an error that may be the line's fault. Where nothing is echoed, a refusal
    /// of the words may be, too.
    pub(super) fn is_doubtful(&self, error: &ArmError) -> bool {
        is_doubt(error) || !self.wire.checks_echo() && names_no_place(error)
    }

    /// Refuses a motion by a single line, `DRIVE` or `#PPOINT`, whose echo is not checked.
    fn check_means(&self, means: Means) -> Result<(), ArmError> {
        let one_line = matches!(means, Means::Drive(_) | Means::Ppoint);
        if !one_line || self.wire.checks_echo() {
            return Ok(());
        }
        Err(ArmError::Setting {
            what: "a motion by DRIVE or #PPOINT",
            value: "used on a line without a checked echo".into(),
            allowed: "move by POINT (`MoveWay::Point`), whose display is compared",
        })
    }

    /// Returns `true` if the controller refuses `#PPOINT` in a line that moves nothing, twice.
    fn refuses_ppoint(&mut self) -> Result<bool, ArmError> {
        let line = "DO SET #PGTRY=#PPOINT(0,0,0,0,0,0)";
        for _ in 0..2 {
            match self.command(line) {
                Ok(_) => return Ok(false),
                Err(ArmError::Refused { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(true)
    }

    /// Returns the doubt that the command of a motion has left, if any. Afterwards the monitor
    /// shows its prompt again, or the arm has been told to stop.
    pub(super) fn doubt(
        &mut self,
        outcome: Result<(), Failed>,
        limit: Duration,
    ) -> Result<Option<Doubt>, ArmError> {
        let error = match outcome {
            Ok(()) => return Ok(None),
            Err(failed) if self.is_doubtful(&failed.error) => failed.error,
            Err(failed) => return Err(self.given_up(failed)),
        };
        let overdue = matches!(error, ArmError::Silence { waited, .. } if waited >= limit);
        if overdue {
            let _ = self.panic_stop();
        } else {
            self.wire.settle().map_err(|error| self.lost(error))?;
        }
        Ok(Some(Doubt { error, overdue }))
    }

    /// Returns the longest time of a motion from `from`, if that is known, at `percent` of the
    /// monitor's speed.
    pub(super) fn motion_limit(&self, from: Option<Joints>, to: Joints, percent: f64) -> Duration {
        let config = &self.wire.config;
        let ranges = config.params.ranges.iter();
        let seconds = ranges.enumerate().map(|(i, range)| {
            let whole = range.max - range.min;
            from.map_or(whole, |from| (to.0[i] - from.0[i]).abs()) / range.speed
        });
        // Without a known speed the slowest is assumed. Ramps take less than a second each.
        let share = self.speed.unwrap_or(1.0).min(100.0) / 100.0 * percent.min(100.0) / 100.0;
        let longest = 2.0 * (seconds.fold(0.0, f64::max) / share + 2.0);
        let needed = Duration::try_from_secs_f64(longest).unwrap_or(Duration::MAX);
        config.motion_timeout.max(needed)
    }

    /// Returns the longest time of any motion.
    pub(super) fn longest_motion(&self) -> Duration {
        self.motion_limit(None, Joints::READY, 100.0)
    }

    /// Commands the motion. `Ok` says that the controller took all its parts.
    fn set_off(
        &mut self,
        from: Joints,
        target: Joints,
        means: Means,
        limit: Duration,
    ) -> Result<(), Failed> {
        match means {
            Means::Drive(speed) => {
                let mut under_way = false;
                for joint in Joint::ALL {
                    let by = target[joint] - from[joint];
                    if by.abs() >= STILL {
                        let by = plain(by.to_degrees());
                        let line = format!("DO DRIVE {},{by},{}", joint.number(), plain(speed));
                        // Whatever becomes of this one, those before it have moved the arm.
                        self.command_once(&line, limit).map_err(|mut failed| {
                            failed.maybe_done |= under_way;
                            failed
                        })?;
                        under_way = true;
                    }
                }
                Ok(())
            }
            Means::Ppoint => {
                let line = format!("DO MOVE #PPOINT({})", target.degrees().map(plain).join(","));
                self.command_once(&line, limit).map(drop)
            }
            Means::Point => self.move_to_point("MOVE", &self.goal(), target.degrees(), None, limit),
            Means::Guarded(speed) => {
                self.move_to_point("MOVE", &self.goal(), target.degrees(), speed, limit)
            }
            Means::Ready => self.command_once("DO READY", limit).map(drop),
        }
    }

    /// Reads the position until the arm is at `target` or stands elsewhere.
    fn stand(&mut self, target: Joints, limit: Duration) -> Result<Joints, ArmError> {
        let until = self.wire.after(limit);
        let mut before = self.where_()?.joints;
        let mut equal = 0;
        loop {
            if furthest(&before, &target).1 <= self.wire.config.tolerance.min(AS_SENT) {
                return Ok(before);
            }
            if self.wire.left(until).is_zero() {
                self.panic_stop()?;
                return self.where_().map(|location| location.joints);
            }
            self.pause(Duration::from_millis(50))?;
            let now = self.where_()?.joints;
            equal = if furthest(&now, &before).1 < 10.0 * STILL {
                equal + 1
            } else {
                0
            };
            if equal >= 2 {
                return Ok(now);
            }
            before = now;
        }
    }

    pub(super) fn not_reached(&self, target: Joints, stands: Joints) -> ArmError {
        let joint = furthest(&stands, &target).0;
        ArmError::NotReached {
            port: self.wire.port(),
            joint,
            name: joint.to_string(),
            wanted_degrees: target[joint].to_degrees(),
            reported_degrees: stands[joint].to_degrees(),
        }
    }

    /// Ends a move after a refusal, a restart or a broken line. The arm's position is still read if
    /// that is possible.
    fn given_up(&mut self, failed: Failed) -> ArmError {
        let refused = matches!(failed.error, ArmError::Refused { .. });
        if refused && self.wire.state == State::Asking(Ending::Running) {
            // Whatever moves the arm is the program of somebody else.
            self.last_known = None;
            return failed.error;
        }
        // A part of the motion may have been made before a refusal.
        let lost = if refused {
            self.stand_anywhere().is_err()
        } else {
            failed.maybe_done
        };
        if lost {
            self.lost(failed.error)
        } else {
            failed.error
        }
    }

    /// Waits until the arm stands anywhere.
    pub(super) fn stand_anywhere(&mut self) -> Result<Joints, ArmError> {
        let nowhere = Joints([f64::MAX; 6]);
        self.stand(nowhere, self.wire.config.motion_timeout)
    }

    /// Tells an arm to stop whose position cannot be read after a motion was commanded.
    pub(super) fn lost(&mut self, cause: ArmError) -> ArmError {
        if matches!(cause, ArmError::Restarted { .. }) {
            // A controller that starts has no arm power.
            self.last_known = None;
            return cause;
        }
        let _ = self.panic_stop();
        let last_known = self.last_known.take();
        ArmError::Unconfirmed {
            port: self.wire.port(),
            last_known,
            cause: Box::new(cause),
        }
    }
}

/// Words of refusals that are about the arm and not about the line typed.
const OF_THE_ARM: [&str; 6] = [
    "RANGE",
    "CLOSE",
    "POWER",
    "CALIBRATED",
    "ENVELOPE",
    "EXECUTING",
];

/// Returns `true` if a refusal is about the words: the place is not understood.
fn names_no_place(error: &ArmError) -> bool {
    let ArmError::Refused { message, .. } = error else {
        return false;
    };
    let message = message.to_ascii_uppercase();
    !OF_THE_ARM.iter().any(|word| message.contains(word))
}

/// Returns the joint that is furthest off, and its distance in radians.
pub(super) fn furthest(a: &Joints, b: &Joints) -> (Joint, f64) {
    Joint::ALL
        .into_iter()
        .map(|joint| (joint, (a[joint] - b[joint]).abs()))
        .fold((Joint::J1, 0.0), |worst, this| {
            if this.1 > worst.1 { this } else { worst }
        })
}
