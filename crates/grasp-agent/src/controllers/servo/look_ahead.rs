//! One step of model look-ahead over the paper's discrete actions.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};
use qtable::Action;

use crate::behaviour::spec::BehaviourSpec;
use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::controllers::servo::settings::ServoSettings;
use crate::limits::JointLimits;

/// Tries all 9 x 81 moves of the paper's behaviours in the model and makes the one after which the
/// ball would be nearest to the goal.
///
/// Nearest: least sum of squared errors in x, y and the logarithm of r, each in half widths of its
/// goal interval, the last one so weighted that it counts like the others at the goal.
///
/// A move that lost the ball or was taken back is not made again from the same pose in the same
/// run, as the learned behaviours do not either: the model that was wrong then would have it made
/// for ever.
#[derive(Clone, Debug)]
pub struct LookAhead {
    settings: ServoSettings,
    turns: Vec<JointDelta>,
    reaches: Vec<JointDelta>,
    /// The move made last, and from where.
    last: Option<(Joints, JointDelta)>,
    /// Moves of this run that are not made again.
    barred: Vec<(Joints, JointDelta)>,
}

/// Poses that differ by no more than this in any joint are the same, radians: a third of the
/// smallest step.
const SAME_POSE: f64 = 0.001;

impl LookAhead {
    /// With the given model; gain and step limits play no part.
    pub fn new(settings: ServoSettings) -> Self {
        let moves =
            |spec: &BehaviourSpec| (0..spec.actions()).map(|a| spec.delta(Action(a))).collect();
        Self {
            settings,
            turns: moves(&BehaviourSpec::centering()),
            reaches: moves(&BehaviourSpec::approaching()),
            last: None,
            barred: Vec::new(),
        }
    }

    fn distance(&self, f: &Features) -> f64 {
        let goal = &self.settings.goal;
        let (x, y) = ((f.x - goal.x) / 4.5, (f.y - goal.y) / 4.0);
        let r = goal.r * (f.r / goal.r).ln();
        x * x + y * y + r * r
    }
}

/// Whether a ball that shows like this is well inside the frame.
pub(crate) fn in_view(f: &Features, margin: f64) -> bool {
    let inside = |v: f64, size: f64| (margin..=size - margin).contains(&v);
    inside(f.x, Features::WIDTH) && inside(f.y, Features::HEIGHT) && (5.0..=60.0).contains(&f.r)
}

impl Controller for LookAhead {
    fn name(&self) -> &str {
        "look-ahead"
    }

    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp> {
        let model = &self.settings.model;
        let ball = model
            .locate(&now.joints, &now.features)
            .ok_or(GaveUp::NoMoveLeft)?;
        let near =
            |a: &Joints, b: &Joints| a.0.iter().zip(b.0).all(|(a, b)| (a - b).abs() <= SAME_POSE);
        let barred = self
            .barred
            .iter()
            .filter(|(from, _)| near(from, &now.joints));
        let barred: Vec<JointDelta> = barred.map(|(_, delta)| *delta).collect();
        let mut best: Option<(f64, JointDelta)> = None;
        for reach in &self.reaches {
            for turn in &self.turns {
                let delta = JointDelta(std::array::from_fn(|i| turn.0[i] + reach.0[i]));
                let pose = now.joints + delta;
                let seen = if limits.admit(&pose) && !barred.contains(&delta) {
                    model.view(&pose, &ball)
                } else {
                    None
                };
                let Some(distance) = seen.filter(|f| in_view(f, 8.0)).map(|f| self.distance(&f))
                else {
                    continue;
                };
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, delta));
                }
            }
        }
        let (_, delta) = best.ok_or(GaveUp::NoMoveLeft)?;
        self.last = Some((now.joints, delta));
        Ok(delta)
    }

    fn judge(&mut self, consequence: &Consequence) {
        if matches!(consequence, Consequence::Lost | Consequence::TakenBack) {
            self.barred.extend(self.last);
        }
        self.last = None;
    }

    fn begin(&mut self) {
        self.last = None;
        self.barred.clear();
    }
}
