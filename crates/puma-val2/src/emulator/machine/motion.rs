//! A motion: a path and the time law it is travelled by.
//!
//! The arm keeps the commanded speed where no joint's speed or acceleration is beyond its limit
//! there, and slows down where one would be. A leg that is added before the arm stands gives a new
//! law, from the arm's present place and speed on.

use std::sync::Arc;
use std::time::Duration;

use crate::emulator::machine::path::{Leg, Pace, Piece};
use crate::emulator::message::Fault;
use crate::joints::Joints;
use crate::kinematics::params::PumaParams;

/// Share of a joint's acceleration that the path's curvature may use. The rest remains for gaining
/// and losing speed there.
const CURVATURE_SHARE: f64 = 0.8;

/// Stretch of the path with one limit of speed and one of acceleration. The arm gains speed, keeps
/// it and loses it again.
#[derive(Clone, Copy, Debug)]
struct Cell {
    piece: usize,
    from: f64,
    length: f64,
    /// Rates at which nominal time passes: at the beginning, at most, at the end.
    rates: [f64; 3],
    acceleration: f64,
    /// Seconds since the start of the time law.
    begins: f64,
    /// Seconds of gaining, keeping and losing speed.
    times: [f64; 3],
}

impl Cell {
    fn time(&self) -> f64 {
        self.times.iter().sum()
    }

    /// Sets the times from the rates at both ends and the limit.
    fn pace(&mut self) {
        let [first, limit, last] = self.rates;
        let squares = 0.5 * (first * first + last * last);
        let peak = (squares + self.acceleration * self.length).sqrt();
        let peak = peak.min(limit).max(first).max(last).max(1e-9);
        let (gain, loss) = (peak - first, peak - last);
        let ramps = 0.5 * (gain * (peak + first) + loss * (peak + last)) / self.acceleration;
        self.rates[1] = peak;
        self.times = [
            gain / self.acceleration,
            (self.length - ramps).max(0.0) / peak,
            loss / self.acceleration,
        ];
    }

    /// Returns the place on the piece and the rate, `t` seconds into the cell.
    fn at(&self, t: f64) -> (f64, f64) {
        let [first, peak, last] = self.rates;
        let [gaining, keeping, _] = self.times;
        if t < gaining {
            let rate = first + self.acceleration * t;
            return (self.from + 0.5 * (first + rate) * t, rate);
        }
        if t < gaining + keeping {
            let gained = 0.5 * (first + peak) * gaining;
            return (self.from + gained + peak * (t - gaining), peak);
        }
        let left = (self.time() - t).max(0.0);
        let rate = last + self.acceleration * left;
        (self.from + self.length - 0.5 * (last + rate) * left, rate)
    }
}

/// Lengths of an overlap that are tried, each half of the one before.
const OVERLAPS_TRIED: u32 = 8;

/// Path from rest to rest and the time it is travelled in.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pieces: Vec<Piece>,
    cells: Vec<Cell>,
    last: Arc<Leg>,
    limits: [f64; 6],
    start: Duration,
    /// Way of coming to a stand before the end.
    stop: Option<Stop>,
    /// Fault of the place where the path ends.
    pub(crate) failure: Option<Fault>,
    /// The arm stands at the end, whatever follows.
    pub(crate) closed: bool,
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

impl Motion {
    /// Creates a motion along one leg.
    pub(crate) fn new(leg: Leg, start: Duration, pace: Pace, arm: &PumaParams) -> Self {
        let leg = Arc::new(leg);
        let mut motion = Self {
            pieces: vec![Piece::Along {
                leg: Arc::clone(&leg),
                from: 0.0,
                to: leg.nominal,
            }],
            cells: Vec::new(),
            last: leg,
            limits: arm.ranges.map(|range| range.speed / pace.acceleration_time),
            start,
            stop: None,
            failure: None,
            closed: false,
        };
        // A law from rest to rest always exists.
        motion.cells = motion.law(0.0, 0.0).unwrap_or_default();
        motion
    }

    /// Returns the motion that goes on along `leg` without a stop between, if the arm can.
    pub(crate) fn followed_by(&self, leg: Leg, now: Duration) -> Option<Self> {
        if !self.is_open() {
            return None;
        }
        let (cell, x, rate) = self.place(now.saturating_sub(self.start).as_secs_f64());
        let mut pieces = self.pieces[cell.piece..].to_vec();
        let begun = if pieces.len() == 1 { x } else { 0.0 };
        let Some(Piece::Along { from, to, .. }) = pieces.pop() else {
            return None;
        };
        let (before, after) = (Arc::clone(&self.last), Arc::new(leg));
        let (left, joined) = (before.slope(before.nominal), after.slope(0.0));
        let turn = |i: usize| (joined[i] - left[i]).abs() / self.limits[i];
        let half = (0..6).map(turn).fold(1e-7, f64::max) / (2.0 * CURVATURE_SHARE);
        let half = half.min(0.5 * after.nominal).min(0.5 * before.nominal);
        let half = half.min(to - from - begun);
        // A shorter overlap begins later, where the arm can be slower.
        let overlaps = (0..OVERLAPS_TRIED).map(|i| half / f64::from(1 << i));
        overlaps.filter(|half| *half > 0.0).find_map(|half| {
            let leaves = Piece::Along {
                leg: Arc::clone(&before),
                from,
                to: to - half,
            };
            let overlap = Piece::Overlap {
                before: Arc::clone(&before),
                after: Arc::clone(&after),
                half,
            };
            let rest = Piece::Along {
                leg: Arc::clone(&after),
                from: half,
                to: after.nominal,
            };
            let mut motion = Self {
                pieces: [pieces.as_slice(), &[leaves, overlap, rest]].concat(),
                cells: Vec::new(),
                last: Arc::clone(&after),
                start: now,
                ..self.clone()
            };
            motion.cells = motion.law(x, rate)?;
            Some(motion)
        })
    }

    /// Returns `true` if another leg may follow without a stop between.
    pub(crate) fn is_open(&self) -> bool {
        !self.closed && self.failure.is_none() && self.stop.is_none()
    }

    /// Returns the time law from place `x` on the first piece, where nominal time passes at `rate`,
    /// to a stand at the end; `None` if the arm cannot slow down in time.
    fn law(&self, x: f64, rate: f64) -> Option<Vec<Cell>> {
        let mut cells = Vec::new();
        for (piece, curve) in self.pieces.iter().enumerate() {
            let cuts = curve.cuts(if piece == 0 { x } else { 0.0 });
            for pair in cuts.windows(2) {
                let length = (pair[1] - pair[0]).max(1e-12);
                let (a, b) = (curve.slope(pair[0]), curve.slope(pair[1]));
                let bend = |i: usize| (b[i] - a[i]).abs() / length / self.limits[i];
                let limit = (0..6).map(|i| (CURVATURE_SHARE / bend(i)).sqrt());
                let limit = limit.fold(1.0, f64::min);
                let free = |i: usize| {
                    (1.0 - bend(i) * limit * limit) * self.limits[i] / a[i].abs().max(b[i].abs())
                };
                cells.push(Cell {
                    piece,
                    from: pair[0],
                    length,
                    rates: [0.0, limit, 0.0],
                    acceleration: (0..6).map(free).fold(1e9, f64::min),
                    begins: 0.0,
                    times: [0.0; 3],
                });
            }
        }
        let reached = |rate: f64, cell: &Cell| {
            (rate * rate + 2.0 * cell.acceleration * cell.length)
                .sqrt()
                .min(cell.rates[1])
        };
        // Backwards: the greatest rate from which the arm can still slow down.
        let mut after = 0.0;
        for cell in cells.iter_mut().rev() {
            cell.rates[2] = after;
            after = reached(f64::min(after, cell.rates[1]), cell);
            cell.rates[0] = after;
        }
        for i in 1..cells.len() {
            cells[i - 1].rates[2] = cells[i].rates[0];
        }
        if rate > cells.first()?.rates[0] * (1.0 + 1e-6) + 1e-9 {
            return None;
        }
        // Forwards: no more than the arm can have gained.
        let (mut before, mut begins) = (rate, 0.0);
        for cell in &mut cells {
            cell.rates[0] = before;
            cell.rates[2] = reached(before, cell).min(cell.rates[2]);
            cell.begins = begins;
            before = cell.rates[2];
            cell.pace();
            begins += cell.time();
        }
        Some(cells)
    }

    /// Returns the last knot.
    pub(crate) fn target(&self) -> Joints {
        self.last.last()
    }

    /// Returns the seconds from the start of the time law to rest.
    fn undisturbed(&self) -> f64 {
        self.cells.last().map_or(0.0, |c| c.begins + c.time())
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

    /// Returns the time at which the arm begins to slow down for its stand.
    pub(crate) fn slows_down(&self) -> Duration {
        let mut seconds = self.undisturbed();
        for cell in self.cells.iter().rev() {
            seconds -= cell.times[2];
            if cell.times[0] + cell.times[1] > 1e-6 {
                break;
            }
        }
        self.start + Duration::from_secs_f64(seconds.clamp(0.0, 1e9))
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

    /// Returns the cell, the place on its piece and the rate after `seconds` of undisturbed travel.
    fn place(&self, seconds: f64) -> (Cell, f64, f64) {
        let index = self.cells.partition_point(|cell| cell.begins <= seconds);
        let cell = self.cells[index.saturating_sub(1)];
        let (x, rate) = cell.at(seconds - cell.begins);
        (cell, x, rate)
    }

    /// Returns the joint angles at `now`.
    pub(crate) fn at(&self, now: Duration) -> Joints {
        let seconds = self.travelled(now).max(0.0);
        // A time has whole nanoseconds.
        if seconds + 1e-9 >= self.undisturbed() {
            return self.target();
        }
        let (cell, x, _) = self.place(seconds);
        self.pieces[cell.piece].at(x)
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
        let arm = PumaParams::unimation();
        let leg = Leg::straight(from, to, PACE, &arm);
        Motion::new(leg, Duration::from_secs(5), PACE, &arm)
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
