//! The path of a motion: curves through joint space, one for each instruction, and their overlaps.
//!
//! A leg is a curve over its *nominal time*, the time at the commanded speed. Where one leg follows
//! another before the arm stands, the end of the first and the beginning of the second overlap: the
//! arm leaves the first at the rate at which it joins the second.

use std::sync::Arc;

use crate::joints::Joints;
use crate::kinematics::params::PumaParams;

/// Parts of an overlap with a curved leg, each with one limit of speed.
const OVERLAP_PARTS: usize = 24;

/// Speed and acceleration of the joints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Fraction of full joint speed.
    pub(crate) fraction: f64,
    /// Time in which full joint speed is reached, seconds.
    pub(crate) acceleration_time: f64,
}

/// Curve through joint space of one instruction. Evenly spaced knots, whose corners are rounded by
/// parabolas from the middle of one span to the middle of the next.
#[derive(Clone, Debug)]
pub(crate) struct Leg {
    knots: Vec<Joints>,
    /// Seconds at the commanded speed.
    pub(crate) nominal: f64,
}

impl Leg {
    /// Creates a leg in which all joints start and stop together and none exceeds its speed.
    pub(crate) fn straight(from: Joints, to: Joints, pace: Pace, arm: &PumaParams) -> Self {
        Self::along(vec![from, to], 0.0, pace, arm)
    }

    /// Creates a leg along the knots that takes `seconds` or, where a joint is too slow for that,
    /// more.
    pub(crate) fn along(knots: Vec<Joints>, seconds: f64, pace: Pace, arm: &PumaParams) -> Self {
        let spans = (knots.len() - 1) as f64;
        let mut nominal = seconds.max(1e-6);
        for pair in knots.windows(2) {
            for i in 0..6 {
                let way = (pair[1].0[i] - pair[0].0[i]).abs() * spans;
                nominal = nominal.max(way / (arm.ranges[i].speed * pace.fraction));
            }
        }
        Self { knots, nominal }
    }

    /// Returns the span whose middle comes last before `at`, and the nominal time since then.
    fn span(&self, at: f64) -> (usize, f64) {
        let width = self.nominal / (self.knots.len() - 1) as f64;
        let middles = (at / width - 0.5).max(0.0);
        let span = (middles as usize).min(self.knots.len() - 2);
        (span, at - (span as f64 + 0.5) * width)
    }

    fn slope_of(&self, span: usize) -> [f64; 6] {
        let span = span.min(self.knots.len() - 2);
        let (a, b) = (self.knots[span].0, self.knots[span + 1].0);
        let per_second = (self.knots.len() - 1) as f64 / self.nominal;
        std::array::from_fn(|i| (b[i] - a[i]) * per_second)
    }

    /// Returns the joint angles at a nominal time.
    pub(crate) fn at(&self, at: f64) -> [f64; 6] {
        let (span, since) = self.span(at);
        let (a, b) = (self.knots[span].0, self.knots[span + 1].0);
        let (slope, next) = (self.slope_of(span), self.slope_of(span + 1));
        let width = self.nominal / (self.knots.len() - 1) as f64;
        let bend = since.max(0.0).powi(2) / (2.0 * width);
        std::array::from_fn(|i| {
            0.5 * (a[i] + b[i]) + slope[i] * since + (next[i] - slope[i]) * bend
        })
    }

    /// Returns the joint speeds at a nominal time and the commanded speed.
    pub(crate) fn slope(&self, at: f64) -> [f64; 6] {
        let (span, since) = self.span(at);
        let (slope, next) = (self.slope_of(span), self.slope_of(span + 1));
        let width = self.nominal / (self.knots.len() - 1) as f64;
        let part = (since / width).clamp(0.0, 1.0);
        std::array::from_fn(|i| slope[i] + (next[i] - slope[i]) * part)
    }

    pub(crate) fn first(&self) -> Joints {
        self.knots[0]
    }

    pub(crate) fn last(&self) -> Joints {
        self.knots[self.knots.len() - 1]
    }

    /// Returns `true` if the leg has no bend.
    fn is_straight(&self) -> bool {
        self.knots.len() == 2
    }
}

/// Part of the path.
#[derive(Clone, Debug)]
pub(crate) enum Piece {
    /// A leg from one nominal time to another.
    Along { leg: Arc<Leg>, from: f64, to: f64 },
    /// The last `half` seconds of a leg and the first of the next, at once. It takes twice that.
    Overlap {
        before: Arc<Leg>,
        after: Arc<Leg>,
        half: f64,
    },
}

impl Piece {
    pub(crate) fn length(&self) -> f64 {
        match self {
            Self::Along { from, to, .. } => to - from,
            Self::Overlap { half, .. } => 2.0 * half,
        }
    }

    pub(crate) fn at(&self, x: f64) -> Joints {
        Joints(match self {
            Self::Along { leg, from, .. } => leg.at(from + x),
            Self::Overlap {
                before,
                after,
                half,
            } => {
                let joined = x * x / (4.0 * half);
                let left = before.at(before.nominal - half + x - joined);
                let (right, corner) = (after.at(joined), after.first().0);
                std::array::from_fn(|i| left[i] + right[i] - corner[i])
            }
        })
    }

    pub(crate) fn slope(&self, x: f64) -> [f64; 6] {
        match self {
            Self::Along { leg, from, .. } => leg.slope(from + x),
            Self::Overlap {
                before,
                after,
                half,
            } => {
                let joined = x * x / (4.0 * half);
                let left = before.slope(before.nominal - half + x - joined);
                let (right, rate) = (after.slope(joined), x / (2.0 * half));
                std::array::from_fn(|i| left[i] * (1.0 - rate) + right[i] * rate)
            }
        }
    }

    /// Returns where the bend of the path changes, from `from` to the end of the piece.
    pub(crate) fn cuts(&self, from: f64) -> Vec<f64> {
        let length = self.length();
        let mut cuts = vec![from];
        match self {
            Self::Along {
                leg, from: begun, ..
            } if !leg.is_straight() => {
                let width = leg.nominal / (leg.knots.len() - 1) as f64;
                let middles = (0..leg.knots.len() - 1).map(|i| (i as f64 + 0.5) * width - begun);
                cuts.extend(middles.filter(|x| *x > from + 1e-9 && *x < length - 1e-9));
            }
            Self::Overlap { before, after, .. } => {
                let straight = before.is_straight() && after.is_straight();
                let parts = if straight { 1 } else { OVERLAP_PARTS };
                let inner = (1..parts).map(|i| length * i as f64 / parts as f64);
                cuts.extend(inner.filter(|x| *x > from + 1e-9));
            }
            Self::Along { .. } => {}
        }
        cuts.push(length);
        cuts
    }
}
