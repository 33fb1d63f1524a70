//! Gain scheduling: a linear law for each of several radii, blended.

use hough_heuristic::Features;
use nalgebra::{Matrix3, Vector3};

use crate::controllers::servo::controller::turns;
use crate::controllers::servo::settings::ServoSettings;

/// One linear rule for each fuzzy set of the radius.
#[derive(Clone, Debug)]
pub(crate) struct Schedule(Vec<Rule>);

/// If the radius is about `radius`, then the turns are `turns` times the errors.
#[derive(Clone, Debug)]
struct Rule {
    radius: f64,
    /// Radians of JT1, JT2, JT3 per error of x, y (units) and of 33 / r.
    turns: Matrix3<f64>,
}

/// Peaks of the four triangles, over the radius at the goal.
const SETS: [f64; 4] = [9.0 / 33.0, 17.0 / 33.0, 1.0, 55.0 / 33.0];

/// Weight of the row of 33 / r beside those of x and y, units.
const NEARNESS: f64 = 60.0;

impl Schedule {
    /// Derives the rules from the camera model of `settings`.
    pub(crate) fn new(settings: &ServoSettings) -> Self {
        let rules = SETS
            .iter()
            .zip(&settings.poses)
            .filter_map(|(share, pose)| {
                let radius = share * settings.goal.r;
                let typical = Features {
                    r: radius,
                    ..settings.goal
                };
                let ball = settings.model.locate(pose, &typical)?;
                let mut jacobian = settings.model.image_jacobian(pose, &ball)?;
                // From changes of r to changes of 33 / r, in which distance is linear; scaled up so
                // that the three rows are alike.
                let scale = -NEARNESS * 33.0 / (radius * radius);
                jacobian.row_mut(2).scale_mut(scale);
                let columns = [Vector3::x(), Vector3::y(), Vector3::z() * NEARNESS]
                    .map(|e| turns(&jacobian, &e));
                let [Some(x), Some(y), Some(nearness)] = columns else {
                    return None;
                };
                Some(Rule {
                    radius,
                    turns: Matrix3::from_columns(&[x, y, nearness]),
                })
            });
        Self(rules.collect())
    }

    /// Returns the turns of `JT1` to `JT3` for a ball with the features `seen`, at gain 1; `None`
    /// without rules.
    pub(crate) fn turns(&self, settings: &ServoSettings, seen: &Features) -> Option<Vector3<f64>> {
        let goal = &settings.goal;
        let (x, y) = (goal.x - seen.x, goal.y - seen.y);
        let gate = aligned(x, 25.0, 80.0).min(aligned(y, 25.0, 70.0));
        // Backing off needs no alignment.
        let nearer = 33.0 / goal.r - 33.0 / seen.r;
        let nearness = if nearer < 0.0 { gate * nearer } else { nearer };
        let error = Vector3::new(x, y, nearness);
        let wanted: Vector3<f64> = self
            .0
            .iter()
            .zip(self.degrees(seen.r))
            .map(|(rule, degree)| rule.turns * error * degree)
            .sum();
        (!self.0.is_empty()).then_some(wanted)
    }

    /// Returns the degree to which each rule's condition holds at radius `r`; the sum is 1.
    fn degrees(&self, r: f64) -> Vec<f64> {
        let rules = &self.0;
        let n = rules.len();
        let mut degrees = vec![0.0; n];
        let above = rules.partition_point(|rule| rule.radius <= r);
        if n == 0 || above == 0 || above == n {
            if let Some(edge) = degrees.get_mut(above.min(n.saturating_sub(1))) {
                *edge = 1.0;
            }
            return degrees;
        }
        let (low, high) = (rules[above - 1].radius, rules[above].radius);
        let t = (r - low) / (high - low);
        (degrees[above - 1], degrees[above]) = (1.0 - t, t);
        degrees
    }
}

/// Returns the degree to which an error of `error` units counts as *aligned*: 1 within `full`, 0
/// beyond `none`.
pub(crate) fn aligned(error: f64, full: f64, none: f64) -> f64 {
    ((none - error.abs()) / (none - full)).clamp(0.0, 1.0)
}
