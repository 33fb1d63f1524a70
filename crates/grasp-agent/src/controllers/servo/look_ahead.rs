//! One step of model look-ahead over the paper's discrete actions.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};
use qtable::Action;

use crate::behaviour::spec::{BehaviourSpec, GoalInterval};
use crate::controller::Feedback;
use crate::controllers::servo::settings::ServoSettings;
use crate::limits::JointLimits;

/// Moves of the paper's two behaviours, and those that went wrong in this run.
#[derive(Clone, Debug)]
pub(crate) struct LookAhead {
    turns: Vec<JointDelta>,
    reaches: Vec<JointDelta>,
    /// The move made last, and the pose it was made from.
    last: Option<(Joints, JointDelta)>,
    /// Moves of this run that are not made again.
    barred: Vec<(Joints, JointDelta)>,
}

/// Largest difference of any joint between poses that count as the same, radians: a third of the
/// smallest step.
const SAME_POSE: f64 = 0.001;

impl LookAhead {
    pub(crate) fn new() -> Self {
        let moves =
            |spec: &BehaviourSpec| (0..spec.actions()).map(|a| spec.delta(Action(a))).collect();
        Self {
            turns: moves(&BehaviourSpec::centering()),
            reaches: moves(&BehaviourSpec::approaching()),
            last: None,
            barred: Vec::new(),
        }
    }

    /// Returns the move after which a ball with the features `seen` would be nearest to the goal;
    /// `None` if no move is left.
    pub(crate) fn best(
        &mut self,
        settings: &ServoSettings,
        seen: &Features,
        joints: &Joints,
        limits: &JointLimits,
    ) -> Option<JointDelta> {
        let model = &settings.model;
        let ball = model.locate(joints, seen)?;
        let near =
            |a: &Joints, b: &Joints| a.0.iter().zip(b.0).all(|(a, b)| (a - b).abs() <= SAME_POSE);
        let barred = self.barred.iter().filter(|(from, _)| near(from, joints));
        let barred: Vec<JointDelta> = barred.map(|(_, delta)| *delta).collect();
        let mut best: Option<(f64, JointDelta)> = None;
        for reach in &self.reaches {
            for turn in &self.turns {
                let delta = JointDelta(std::array::from_fn(|i| turn.0[i] + reach.0[i]));
                let pose = *joints + delta;
                let after = if limits.admit(&pose) && !barred.contains(&delta) {
                    model.view(&pose, &ball)
                } else {
                    None
                };
                let Some(after) = after.filter(|after| in_view(after, &settings.goal)) else {
                    continue;
                };
                let distance = distance(&after, &settings.goal);
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, delta));
                }
            }
        }
        let (_, delta) = best?;
        self.last = Some((*joints, delta));
        Some(delta)
    }

    pub(crate) fn notice(&mut self, feedback: &Feedback) {
        match feedback {
            Feedback::Begin => self.barred.clear(),
            Feedback::Lost | Feedback::TakenBack => self.barred.extend(self.last),
            Feedback::Seen { .. } | Feedback::Missed => {}
            _ => return,
        }
        self.last = None;
    }
}

/// Returns the squared distance between features, in half widths of the paper's goal intervals.
fn distance(f: &Features, goal: &Features) -> f64 {
    let x = (f.x - goal.x) / GoalInterval::X.half_width();
    let y = (f.y - goal.y) / GoalInterval::Y.half_width();
    let r = goal.r * (f.r / goal.r).ln();
    x * x + y * y + r * r
}

/// Returns `true` for a ball well inside the frame, and no larger than near the goal.
fn in_view(f: &Features, goal: &Features) -> bool {
    const MARGIN: f64 = 8.0;
    let largest = (1.25 * goal.r).max(60.0);
    let inside = |v: f64, size: f64| (MARGIN..=size - MARGIN).contains(&v);
    inside(f.x, Features::WIDTH) && inside(f.y, Features::HEIGHT) && (5.0..=largest).contains(&f.r)
}
