//! A motion: a path through joint space and the time it is travelled in.

use std::time::Duration;

use crate::emulator::message::Fault;
use crate::joints::Joints;
use crate::kinematics::params::PumaParams;

/// Path from knot to knot, evenly spaced, travelled from rest to rest.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    knots: Vec<Joints>,
    start: Duration,
    /// Greatest speed and acceleration along the path, whose length is 1.
    speed: f64,
    acceleration: f64,
    /// Way of coming to a stand before the end.
    stop: Option<Stop>,
    /// Fault of the place where the path ends.
    pub(crate) failure: Option<Fault>,
}

/// Deceleration of a motion that is broken off.
#[derive(Clone, Copy, Debug)]
struct Stop {
    at: Duration,
    /// Time of coming to a stand.
    time: Duration,
    /// Seconds of undisturbed travel used up by then.
    travelled: f64,
    /// Speed on the path then, as a fraction of the undisturbed motion.
    pace: f64,
}

/// Speed and acceleration of the joints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Fraction of full joint speed.
    pub(crate) fraction: f64,
    /// Time in which full joint speed is reached, seconds.
    pub(crate) acceleration_time: f64,
}

impl Motion {
    /// Creates a motion in which all joints start and stop together and none exceeds its limits.
    pub(crate) fn joint_interpolated(
        from: Joints,
        to: Joints,
        start: Duration,
        pace: Pace,
        arm: &PumaParams,
    ) -> Self {
        let mut motion = Self::along(vec![from, to], start, f64::INFINITY, pace, arm);
        motion.failure = None;
        motion
    }

    /// Creates a motion along the knots, at most `path_speed` (path lengths per second).
    pub(crate) fn along(
        knots: Vec<Joints>,
        start: Duration,
        path_speed: f64,
        pace: Pace,
        arm: &PumaParams,
    ) -> Self {
        let spans = (knots.len().max(2) - 1) as f64;
        let mut speed = path_speed.min(1e6);
        let mut acceleration = 1e9_f64;
        for pair in knots.windows(2) {
            for i in 0..6 {
                let slope = (pair[1].0[i] - pair[0].0[i]).abs() * spans;
                if slope > 0.0 {
                    let limit = arm.ranges[i].speed;
                    speed = speed.min(limit * pace.fraction / slope);
                    acceleration = acceleration.min(limit / pace.acceleration_time / slope);
                }
            }
        }
        Self {
            knots,
            start,
            speed: speed.max(1e-6),
            acceleration: acceleration.max(1e-6),
            stop: None,
            failure: None,
        }
    }

    /// Returns the last knot.
    pub(crate) fn target(&self) -> Joints {
        self.knots[self.knots.len() - 1]
    }

    fn ramp(&self) -> (f64, f64) {
        let peak = self.speed.min(self.acceleration.sqrt());
        (peak, peak / self.acceleration)
    }

    /// Returns the seconds from start to rest of an undisturbed motion.
    fn undisturbed(&self) -> f64 {
        let (peak, ramp) = self.ramp();
        1.0 / peak + ramp
    }

    /// Returns the time at which the arm stands.
    pub(crate) fn end(&self) -> Duration {
        let end = self
            .start
            .saturating_add(Duration::from_secs_f64(self.undisturbed().min(1e9)));
        match self.stop {
            Some(stop) => end.min(stop.at.saturating_add(stop.time)),
            None => end,
        }
    }

    /// Returns `true` if the motion was broken off before its end.
    pub(crate) fn is_broken_off(&self) -> bool {
        self.stop.is_some()
    }

    /// Brings the arm to a stand within `time`, on the path. A motion that is slowing down does so
    /// more sharply, if that is sooner.
    pub(crate) fn break_off(&mut self, now: Duration, time: Duration) {
        let end = now.saturating_add(time);
        if self
            .stop
            .is_some_and(|stop| stop.at.saturating_add(stop.time) <= end)
        {
            return;
        }
        let pace = self
            .stop
            .map_or(1.0, |stop| 1.0 - stop.passed(now) / stop.time.as_secs_f64());
        self.stop = Some(Stop {
            at: now,
            time,
            travelled: self.travelled(now),
            pace,
        });
    }

    /// Returns the seconds of undisturbed travel used up at `now`.
    fn travelled(&self, now: Duration) -> f64 {
        match self.stop {
            Some(stop) if now > stop.at && !stop.time.is_zero() => {
                let passed = stop.passed(now);
                let slowing = passed - passed * passed / (2.0 * stop.time.as_secs_f64());
                stop.travelled + stop.pace * slowing
            }
            Some(stop) => stop.travelled,
            None => now.saturating_sub(self.start).as_secs_f64(),
        }
    }

    /// Returns the joint angles at `now`.
    pub(crate) fn at(&self, now: Duration) -> Joints {
        let (peak, ramp) = self.ramp();
        let whole = self.undisturbed();
        let t = self.travelled(now).clamp(0.0, whole);
        let s = if t < ramp {
            0.5 * self.acceleration * t * t
        } else if t > whole - ramp {
            1.0 - 0.5 * self.acceleration * (whole - t) * (whole - t)
        } else {
            peak * (t - 0.5 * ramp)
        };
        if s >= 1.0 || t >= whole {
            return self.target();
        }
        let position = s.max(0.0) * (self.knots.len() - 1) as f64;
        let span = (position as usize).min(self.knots.len() - 2);
        let (a, b) = (self.knots[span].0, self.knots[span + 1].0);
        let part = position - span as f64;
        Joints(std::array::from_fn(|i| a[i] + (b[i] - a[i]) * part))
    }
}

impl Stop {
    /// Returns the seconds since the stop began, at most those it takes.
    fn passed(&self, now: Duration) -> f64 {
        now.saturating_sub(self.at).min(self.time).as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace {
        fraction: 1.0,
        acceleration_time: 0.25,
    };

    fn motion() -> Motion {
        let from = Joints::READY;
        let to = Joints::from_degrees([80.0, -60.0, 90.0, 0.0, -30.0, 0.0]);
        Motion::joint_interpolated(
            from,
            to,
            Duration::from_secs(5),
            PACE,
            &PumaParams::unimation(),
        )
    }

    #[test]
    fn joints_stay_within_speed_and_arrive_together() {
        let (motion, arm) = (motion(), PumaParams::unimation());
        let step = Duration::from_millis(1);
        let mut now = Duration::from_secs(5);
        let mut last = motion.at(now);
        let mut fastest = 0.0_f64;
        while now < motion.end() {
            now += step;
            let here = motion.at(now);
            for i in 0..6 {
                let used = (here.0[i] - last.0[i]).abs() / 0.001 / arm.ranges[i].speed;
                assert!(used < 1.0 + 1e-9, "joint {i} at {used}");
                fastest = fastest.max(used);
            }
            let part = here.0[0].to_degrees() / 80.0;
            assert!(((here.0[1].to_degrees() + 90.0) / 30.0 - part).abs() < 1e-9);
            last = here;
        }
        assert!(fastest > 0.99, "{fastest}");
        assert_eq!(motion.at(motion.end()), motion.target());
    }

    #[test]
    fn a_motion_broken_off_stands_on_its_path_and_stays() {
        let mut motion = motion();
        let at = Duration::from_millis(5500);
        let before = motion.at(at);
        motion.break_off(at, Duration::from_millis(60));
        assert_eq!(motion.end(), at + Duration::from_millis(60));
        let stands = motion.at(motion.end());
        assert!(stands.0[0] > before.0[0] && stands.0[0] < motion.target().0[0]);
        assert_eq!(motion.at(at + Duration::from_secs(9)), stands);
    }
    #[test]
    fn a_stopping_motion_can_be_stopped_more_sharply_but_not_less() {
        let mut motion = motion();
        let at = Duration::from_millis(5500);
        motion.break_off(at, Duration::from_millis(600));
        let later = at + Duration::from_millis(100);
        let before = motion.at(later);
        motion.break_off(later, Duration::from_secs(2));
        assert_eq!(motion.end(), at + Duration::from_millis(600));
        motion.break_off(later, Duration::from_millis(20));
        assert_eq!(motion.end(), later + Duration::from_millis(20));
        assert!((motion.at(later).0[0] - before.0[0]).abs() < 1e-12);
        let stands = motion.at(motion.end());
        let by = (stands.0[0] - before.0[0]).to_degrees();
        assert!(by > 0.1 && by < 2.0, "{by}");
        motion.break_off(later, Duration::ZERO);
        assert_eq!(motion.end(), later);
        assert!((motion.at(later + Duration::from_secs(1)).0[0] - before.0[0]).abs() < 1e-12);
    }
}
