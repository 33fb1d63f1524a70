//! A fuzzy controller.

use nalgebra::{Matrix3, Vector3};
use puma_val2::{JointDelta, Joints};

use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::controllers::servo::settings::{Boldness, ServoSettings, turns};
use crate::limits::JointLimits;

/// A fuzzy controller of the Takagi–Sugeno kind, the paper's "alternative AI method" (section 1).
///
/// The radius is *tiny*, *small*, *right* or *large*, in triangles that overlap; each of them has
/// its own linear rule from the errors in x, y and 1/r to joint turns, and the rules act in
/// proportion to how far their condition holds. A second set of rules gates the approach: the
/// farther the ball is from its line in the image, the less it is approached.
#[derive(Clone, Debug)]
pub struct Fuzzy {
    settings: ServoSettings,
    boldness: Boldness,
    rules: Vec<Rule>,
}

/// If the radius is about `radius`, then the turns are `turns` times the errors.
#[derive(Clone, Debug)]
struct Rule {
    radius: f64,
    /// Radians of JT1, JT2, JT3 per error of x, y (units) and of 33 / r.
    turns: Matrix3<f64>,
}

/// The peaks of the four triangles, feature units, and a pose (degrees of JT2 and JT3) in which
/// balls of that radius are typically seen.
const SETS: [(f64, f64, f64); 4] = [
    (9.0, -105.0, 205.0),
    (17.0, -80.0, 195.0),
    (33.0, -57.0, 186.0),
    (55.0, -57.0, 186.0),
];

impl Fuzzy {
    /// With rules derived for the given model.
    pub fn new(settings: ServoSettings) -> Self {
        let rules = SETS.iter().filter_map(|&(radius, jt2, jt3)| {
            let pose = Joints::from_degrees([0.0, jt2, jt3, 0.0, 45.0, 0.0]);
            let typical = hough_heuristic::Features {
                r: radius,
                ..settings.goal
            };
            let ball = settings.model.locate(&pose, &typical)?;
            let mut jacobian = settings.model.image_jacobian(&pose, &ball)?;
            // From changes of r to changes of 33 / r, in which distance is linear; scaled up so
            // that the three rows are alike.
            let scale = -NEARNESS * 33.0 / (radius * radius);
            jacobian.row_mut(2).scale_mut(scale);
            let columns =
                [Vector3::x(), Vector3::y(), Vector3::z() * NEARNESS].map(|e| turns(&jacobian, &e));
            let [Some(x), Some(y), Some(nearness)] = columns else {
                return None;
            };
            Some(Rule {
                radius,
                turns: Matrix3::from_columns(&[x, y, nearness]),
            })
        });
        Self {
            rules: rules.collect(),
            settings,
            boldness: Boldness::FULL,
        }
    }

    /// How far each rule's condition holds at radius `r`; the degrees sum to 1.
    fn degrees(&self, r: f64) -> Vec<f64> {
        let n = self.rules.len();
        let mut degrees = vec![0.0; n];
        let above = self.rules.partition_point(|rule| rule.radius <= r);
        if n == 0 || above == 0 || above == n {
            if let Some(edge) = degrees.get_mut(above.min(n.saturating_sub(1))) {
                *edge = 1.0;
            }
            return degrees;
        }
        let (low, high) = (self.rules[above - 1].radius, self.rules[above].radius);
        let t = (r - low) / (high - low);
        (degrees[above - 1], degrees[above]) = (1.0 - t, t);
        degrees
    }
}

/// Weight of the row of 33 / r beside those of x and y, units.
const NEARNESS: f64 = 60.0;

/// How far an error of `error` units counts as *aligned*: wholly within `full`, not at all beyond
/// `none`.
fn aligned(error: f64, full: f64, none: f64) -> f64 {
    ((none - error.abs()) / (none - full)).clamp(0.0, 1.0)
}

impl Controller for Fuzzy {
    fn name(&self) -> &str {
        "fuzzy"
    }

    fn decide(&mut self, now: &Situation, limits: &JointLimits) -> Result<JointDelta, GaveUp> {
        let ServoSettings {
            goal, gain, steps, ..
        } = &self.settings;
        let seen = now.features;
        let (x, y) = (goal.x - seen.x, goal.y - seen.y);
        let gate = aligned(x, 25.0, 80.0).min(aligned(y, 25.0, 70.0));
        // Backing off needs no alignment.
        let nearer = 33.0 / goal.r - 33.0 / seen.r;
        let nearness = if nearer < 0.0 { gate * nearer } else { nearer };
        let error = Vector3::new(x, y, nearness);
        let wanted: Vector3<f64> = self
            .rules
            .iter()
            .zip(self.degrees(seen.r))
            .map(|(rule, degree)| rule.turns * error * degree)
            .sum();
        if self.rules.is_empty() {
            return Err(GaveUp::NoMoveLeft);
        }
        Ok(self
            .boldness
            .cut((wanted * *gain).into(), steps, &now.joints, limits))
    }

    fn begin(&mut self) {
        self.boldness = Boldness::FULL;
    }

    fn judge(&mut self, consequence: &Consequence) {
        self.boldness.judge(consequence);
    }
}
