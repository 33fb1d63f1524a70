//! A motion: a path through joint space and the time it is travelled in.

use std::time::Duration;

use super::Fault;
use crate::{Joints, PumaParams};

/// A path from knot to knot, evenly spaced, travelled from rest to rest.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    knots: Vec<Joints>,
    start: Duration,
    /// Greatest speed and acceleration along the path, whose length is 1; per second, per second squared.
    speed: f64,
    acceleration: f64,
    /// When it was broken off, and how long coming to a stand takes.
    stop: Option<(Duration, Duration)>,
    /// What is wrong with the place where the path ends.
    pub(super) failure: Option<Fault>,
}

/// How fast joints may turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// Fraction of full joint speed.
    pub(super) fraction: f64,
    /// Time in which full joint speed is reached, seconds.
    pub(super) acceleration_time: f64,
}

impl Motion {
    /// All joints start together, stop together, and none exceeds its limits; the joint that needs longest sets the pace.
    pub(super) fn joint_interpolated(
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

    /// Along the knots, at most `path_speed` (path lengths per second).
    pub(super) fn along(
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

    /// The last knot.
    pub(super) fn target(&self) -> Joints {
        self.knots[self.knots.len() - 1]
    }

    fn ramp(&self) -> (f64, f64) {
        let peak = self.speed.min(self.acceleration.sqrt());
        (peak, peak / self.acceleration)
    }

    /// Seconds from start to rest when nothing breaks it off.
    fn undisturbed(&self) -> f64 {
        let (peak, ramp) = self.ramp();
        1.0 / peak + ramp
    }

    /// When the arm stands.
    pub(super) fn end(&self) -> Duration {
        let end = self
            .start
            .saturating_add(Duration::from_secs_f64(self.undisturbed().min(1e9)));
        match self.stop {
            Some((at, time)) => end.min(at.saturating_add(time)),
            None => end,
        }
    }

    /// Whether it was broken off before its end.
    pub(super) fn is_broken_off(&self) -> bool {
        self.stop.is_some()
    }

    /// Brings the arm to a stand within `time`, on the path.
    pub(super) fn break_off(&mut self, now: Duration, time: Duration) {
        if self.stop.is_none() {
            self.stop = Some((now, time));
        }
    }

    /// Seconds of undisturbed travel that have been used up at `now`. While stopping, the path is travelled ever more slowly.
    fn travelled(&self, now: Duration) -> f64 {
        let since_start = |t: Duration| t.saturating_sub(self.start).as_secs_f64();
        match self.stop {
            Some((at, time)) if now > at => {
                let (passed, time) = ((now - at).as_secs_f64(), time.as_secs_f64());
                let passed = passed.min(time);
                let slowing = if time > 0.0 {
                    passed - passed * passed / (2.0 * time)
                } else {
                    0.0
                };
                since_start(at) + slowing
            }
            _ => since_start(now),
        }
    }

    /// The joint angles at `now`.
    pub(super) fn at(&self, now: Duration) -> Joints {
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

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace {
        fraction: 1.0,
        acceleration_time: 0.25,
    };

    fn motion() -> Motion {
        let from = Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
        let to = Joints::from_degrees([80.0, -60.0, 90.0, 0.0, -30.0, 0.0]);
        Motion::joint_interpolated(from, to, Duration::from_secs(5), PACE, &PumaParams::unimation())
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
}
