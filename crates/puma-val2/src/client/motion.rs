//! Motions: commanded, and confirmed by `WHERE`.

use std::time::Duration;

use super::wire::{Failed, is_doubt};
use super::{Ending, MoveWay, Val2Client, check_percent, degrees, plain};
use crate::{ArmError, Joint, JointDelta, Joints, Location, Transport, Xyzoat};

/// Less than VAL's smallest step of a joint, half a thousandth of a degree.
const STILL: f64 = 0.0005 * std::f64::consts::PI / 180.0;

/// An arm that shows its goal to within an encoder count and a display digit stands there. One that is a little further off may be about to
/// arrive and is looked at again.
const AS_SENT: f64 = 0.012 * std::f64::consts::PI / 180.0;

/// What is commanded to get from where the arm stands to a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Means {
    /// `DRIVE`, joint after joint, at this speed in percent.
    Drive(f64),
    Ppoint,
    Point,
    /// `POINT`, then the stored program that watches a signal while it moves.
    Guarded,
    Ready,
}

impl<T: Transport> Val2Client<T> {
    /// Turns one joint by `radians` at `speed` percent of the monitor's speed and returns the joint angles afterwards.
    ///
    /// # Errors
    /// [`ArmError::JointLimit`], [`ArmError::NotFinite`] or [`ArmError::Setting`] before anything is sent; otherwise as for
    /// [`Manipulator::move_by`](crate::Manipulator::move_by).
    pub fn drive(&mut self, joint: Joint, radians: f64, speed: f64) -> Result<Joints, ArmError> {
        check_percent(speed)?;
        let delta = JointDelta::of(joint, radians);
        self.relative(delta, Means::Drive(speed))
    }

    /// `READY`: the arm goes to its upright pose, and is confirmed there.
    ///
    /// # Errors
    /// As for [`Manipulator::move_to`](crate::Manipulator::move_to).
    pub fn ready(&mut self) -> Result<Joints, ArmError> {
        let ready = Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
        self.absolute(ready, Means::Ready)
    }

    pub(super) fn move_joints_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        let moving = delta.0.iter().filter(|d| d.abs() >= STILL).count();
        let means = match self.config.way {
            _ if self.guard.is_some() => self.coordinated(),
            MoveWay::Drive => Means::Drive(100.0),
            MoveWay::Automatic if moving == 1 && self.echoes() => Means::Drive(100.0),
            _ => self.coordinated(),
        };
        self.relative(delta, means)
    }

    pub(super) fn move_joints_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let means = match self.config.way {
            MoveWay::Drive if self.guard.is_none() => Means::Drive(100.0),
            _ => self.coordinated(),
        };
        self.absolute(target, means)
    }

    fn coordinated(&self) -> Means {
        match self.config.way {
            _ if self.guard.is_some_and(|guard| guard.by_program) => Means::Guarded,
            MoveWay::Ppoint => Means::Ppoint,
            MoveWay::Automatic if self.echoes() && !self.lacks_ppoint => Means::Ppoint,
            _ => Means::Point,
        }
    }

    fn relative(&mut self, delta: JointDelta, means: Means) -> Result<Joints, ArmError> {
        if let Some(joint) = Joints(delta.0).non_finite() {
            return Err(ArmError::NotFinite { joint });
        }
        let start = match self.last_known {
            Some(joints) => joints,
            None => self.where_()?.joints,
        };
        let target = start + delta;
        self.config.params.check(&target)?;
        if delta.0.iter().all(|d| d.abs() < STILL) {
            return self.where_().map(|location| location.joints);
        }
        self.travel(start, target, means)
    }

    fn absolute(&mut self, target: Joints, means: Means) -> Result<Joints, ArmError> {
        self.config.params.check(&target)?;
        // Only `DRIVE` has to know where it starts.
        let start = match (means, self.last_known) {
            (Means::Drive(_), None) => self.where_()?.joints,
            (_, known) => known.unwrap_or(target),
        };
        self.travel(start, target, means)
    }

    /// Gets the arm from `start` to `target`. After doubt, what is missing is commanded from where the arm is read to stand.
    fn travel(&mut self, start: Joints, target: Joints, mut means: Means) -> Result<Joints, ArmError> {
        let mut from = start;
        let mut tries = 0;
        loop {
            let outcome = self.set_off(from, target, means);
            if let Err(failed) = &outcome
                && means == Means::Ppoint
                && !failed.maybe_done
                && self.config.way == MoveWay::Automatic
                && names_no_place(&failed.error)
            {
                self.lacks_ppoint = true;
                means = Means::Point;
                continue;
            }
            let doubt = match outcome {
                Ok(()) => None,
                Err(failed) if is_doubt(&failed.error) => Some(failed),
                Err(failed) => return Err(self.given_up(failed)),
            };
            let is_overdue = |failed: &Failed| matches!(failed.error, ArmError::Silence { waited, .. } if waited >= self.config.motion_timeout);
            let overdue = doubt.as_ref().is_some_and(is_overdue);
            if doubt.is_some() {
                if overdue {
                    let _ = self.panic_stop();
                } else if let Err(error) = self.wire.settle(&self.config) {
                    return Err(self.lost(error));
                }
            }
            let stands = match self.stand(target) {
                Ok(joints) => joints,
                Err(error) => return Err(self.lost(error)),
            };
            let (joint, off) = furthest(&stands, &target);
            if off <= self.config.tolerance {
                return Ok(stands);
            }
            self.stopped_by_guard(stands)?;
            match doubt {
                Some(_) if tries < self.config.retries && !overdue => {
                    tries += 1;
                    from = stands;
                }
                Some(failed) => return Err(failed.error),
                None => {
                    return Err(ArmError::NotReached {
                        port: self.wire.port(),
                        joint,
                        wanted_degrees: degrees(&target, joint),
                        reported_degrees: degrees(&stands, joint),
                    });
                }
            }
        }
    }

    /// Commands the motion. `Ok`: the controller took it, in all its parts.
    fn set_off(&mut self, from: Joints, target: Joints, means: Means) -> Result<(), Failed> {
        let patience = self.config.motion_timeout;
        match means {
            Means::Drive(speed) => {
                for joint in Joint::ALL {
                    let by = target[joint] - from[joint];
                    if by.abs() >= STILL {
                        let by = plain(by.to_degrees());
                        let line = format!("DO DRIVE {},{by},{}", joint.number(), plain(speed));
                        self.command_once(&line, patience)?;
                    }
                }
                Ok(())
            }
            Means::Ppoint => {
                let line = format!("DO MOVE #PPOINT({})", target.degrees().map(plain).join(","));
                self.command_once(&line, patience).map(drop)
            }
            Means::Point => {
                self.define_point(&target)?;
                let line = format!("DO MOVE #{}", self.config.point_name);
                self.command_once(&line, patience).map(drop)
            }
            Means::Guarded => {
                self.define_point(&target)?;
                self.run_guarded()
            }
            Means::Ready => self.command_once("DO READY", patience).map(drop),
        }
    }

    /// `POINT #name`, the values, an empty line; what the controller shows of it must be what was meant.
    fn define_point(&mut self, target: &Joints) -> Result<(), Failed> {
        let patience = self.config.reply_timeout * 4;
        let line = format!("POINT #{}", self.config.point_name);
        let values = target.degrees().map(|v| format!("{v:.3}")).join(",");
        let mut tries = 0;
        loop {
            match self.define_point_once(&line, &values, target, patience) {
                Err(failed) if is_doubt(&failed.error) && tries < self.config.retries => {
                    tries += 1;
                    self.wire.settle(&self.config).map_err(not_done)?;
                }
                outcome => return outcome,
            }
        }
    }

    fn define_point_once(
        &mut self,
        line: &str,
        values: &str,
        target: &Joints,
        patience: Duration,
    ) -> Result<(), Failed> {
        for typed in [line, values] {
            let reply = self
                .wire
                .exchange(typed, patience, &self.config)
                .map_err(|failed| not_done(failed.error))?;
            self.without_message(typed, &reply)?;
            if reply.ending != Ending::Question {
                let error = self.wire.garbled(typed, "a question for changes", &reply.text);
                return Err(not_done(error));
            }
            if typed == values {
                let shown = reply
                    .text
                    .split(['\r', '\n'])
                    .filter_map(shown_values)
                    .next_back();
                let fits = shown.is_some_and(|shown| {
                    shown
                        .iter()
                        .zip(target.degrees())
                        .all(|((s, rounding), t)| (s - t).abs() < 0.000_6 + rounding)
                });
                if !fits {
                    let error = self.wire.garbled(typed, "the same values displayed", &reply.text);
                    return Err(not_done(error));
                }
            }
        }
        self.command_once("", patience)
            .map(drop)
            .map_err(|failed| not_done(failed.error))
    }

    /// Reads the position until the arm is at `target` or stands elsewhere.
    fn stand(&mut self, target: Joints) -> Result<Joints, ArmError> {
        let until = self.wire.line.clock().saturating_add(self.config.motion_timeout);
        let mut before = self.where_()?.joints;
        let mut equal = 0;
        loop {
            if furthest(&before, &target).1 <= self.config.tolerance.min(AS_SENT) {
                return Ok(before);
            }
            if self.wire.line.clock() >= until {
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

    /// The controller refused, or was restarted, or the line broke: where the arm stands is still worth knowing.
    fn given_up(&mut self, failed: Failed) -> ArmError {
        match failed.error {
            error @ ArmError::Refused { .. } => {
                // A part of the motion may have been made before.
                match self.stand_anywhere() {
                    Ok(_) => error,
                    Err(_) => self.lost(error),
                }
            }
            error if failed.maybe_done => self.lost(error),
            error => error,
        }
    }

    fn stand_anywhere(&mut self) -> Result<Joints, ArmError> {
        let nowhere = Joints([f64::MAX; 6]);
        self.stand(nowhere)
    }

    /// The arm's position cannot be read after a motion was commanded: it is told to stop, in case it hears.
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

    /// Moves the hand to a pose in the world frame by `DO MOVE TRANS(...)`, the joints interpolated, or along a straight line.
    ///
    /// Position within 0.1 mm and direction within 0.1 degrees are confirmed by `WHERE`.
    ///
    /// # Errors
    /// [`ArmError::Setting`] if a number of the pose is not finite; [`ArmError::Refused`] if the controller cannot reach it.
    pub fn move_hand(&mut self, hand: &Xyzoat, straight: bool) -> Result<Location, ArmError> {
        if !hand.is_finite() {
            return Err(ArmError::Setting {
                what: "a hand pose",
                value: hand.to_string(),
                allowed: "six finite numbers",
            });
        }
        let word = if straight { "MOVES" } else { "MOVE" };
        let line = format!("DO {word} TRANS({})", hand.val().map(plain).join(","));
        let mut tries = 0;
        loop {
            // The pose is absolute: commanding it again leads to the same place.
            match self.command_once(&line, self.config.motion_timeout) {
                Ok(_) => {}
                Err(failed) if is_doubt(&failed.error) && tries < self.config.retries => {
                    tries += 1;
                    self.wire.settle(&self.config).map_err(|error| self.lost(error))?;
                    continue;
                }
                Err(failed) => return Err(self.given_up(failed)),
            }
            self.stand_anywhere().map_err(|error| self.lost(error))?;
            let location = self.where_().map_err(|error| self.lost(error))?;
            let (wanted, there) = (hand.pose(), location.hand.pose());
            let off = (wanted.translation.vector - there.translation.vector).norm();
            let turned = wanted.rotation.angle_to(&there.rotation).to_degrees();
            if off < 1e-4 && turned < 0.1 {
                return Ok(location);
            }
            let expected = format!("the hand at {hand}");
            return Err(self.wire.garbled(&line, &expected, &location.hand.to_string()));
        }
    }
}

fn not_done(error: ArmError) -> Failed {
    Failed {
        error,
        maybe_done: false,
    }
}

/// Whether a refusal is about the words and not about the arm: the place is not understood.
fn names_no_place(error: &ArmError) -> bool {
    let ArmError::Refused { message, .. } = error else {
        return false;
    };
    let message = message.to_ascii_uppercase();
    !["RANGE", "CLOSE", "POWER", "CALIBRATED", "ENVELOPE", "EXECUTING"]
        .iter()
        .any(|word| message.contains(word))
}

/// The joint that is furthest off, and by how many radians.
pub(super) fn furthest(a: &Joints, b: &Joints) -> (Joint, f64) {
    Joint::ALL
        .into_iter()
        .map(|joint| (joint, (a[joint] - b[joint]).abs()))
        .fold(
            (Joint::J1, 0.0),
            |worst, this| if this.1 > worst.1 { this } else { worst },
        )
}

/// The numbers of a line that holds exactly six, each with what rounding to its decimals can have changed.
pub(super) fn shown_values(line: &str) -> Option<[(f64, f64); 6]> {
    let numbers: Vec<(f64, f64)> = line
        .split_whitespace()
        .map(|word| {
            let decimals = word.split_once('.').map_or(0, |(_, d)| d.len());
            let rounding = if decimals >= 3 {
                0.0
            } else {
                0.5 / 10_f64.powi(decimals as i32)
            };
            Some((word.parse().ok()?, rounding))
        })
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}
