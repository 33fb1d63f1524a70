//! Aiming of the grip.

use nalgebra::{Matrix3, Point3, Vector3};
use puma_val2::JointDelta;

use crate::controller::Request;
use crate::controllers::hybrid::controller::Hybrid;
use crate::controllers::hybrid::parameters::{Numbers, deviations, sensitivity};
use crate::percept::Sighting;

/// Standard deviation of an aim, metres, with which it does not miss the ball by chance.
const SURE: f64 = 0.003;

impl Hybrid {
    /// Returns the move that brings the jaws to the ball; `None` if it is too uncertain.
    pub(super) fn aim(&mut self, ball: &Sighting, request: &Request) -> Option<JointDelta> {
        if self.surprise(&ball.features).is_some() {
            // The grip that missed has moved it.
            self.remember();
            self.run.evidence.forget_sightings();
            (self.run.seen, self.run.estimate) = (None, None);
        }
        for seen in self.run.seen.take().into_iter().chain([ball.features]) {
            self.run.evidence.saw(seen);
        }
        self.run.estimate = self.estimate();
        let estimate = self.run.estimate.as_ref()?;
        // An aim that has missed is followed by the taught grip.
        if std::mem::take(&mut self.run.missed) && self.shown {
            return None;
        }
        let links = self
            .run
            .evidence
            .links(&estimate.numbers, &self.settings.nominal.arm);
        let mut from = links.stand();
        for (angle, turn) in from.0[3..].iter_mut().zip(self.settings.grip) {
            *angle += turn;
        }
        let stand = estimate.model.pose_gripping(&estimate.ball, &from)?;
        let motors = links.motors_for(&stand, &request.joints);
        let miss = |numbers: &Numbers, ball: &Point3<f64>| {
            let mut links = self.run.evidence.links(numbers, &self.settings.nominal.arm);
            links.follow(&motors);
            Some(estimate.model.tool_point(&links.stand()) - ball)
        };
        let (_, by_all) = sensitivity(&estimate.numbers, &estimate.ball, miss)?;
        let uncertainty = deviations(&by_all, &estimate.covariance).norm();
        if self.run.misses == 0 {
            self.run.sure = uncertainty < SURE;
        }
        let motors = match displaced(
            &(by_all * estimate.covariance * by_all.transpose()),
            self.run.misses,
        ) {
            Some(beside) => {
                let stand = estimate
                    .model
                    .pose_gripping(&(estimate.ball + beside), &from)?;
                links.motors_for(&stand, &request.joints)
            }
            None => motors,
        };
        // The configured grip has missed; accept a less certain aim each time.
        let enough = self.settings.grip_certainty * 4_f64.powi(self.run.grips);
        self.run.grips = (self.run.grips + 1).min(10);
        self.run.aimed = uncertainty <= enough && request.limits.admit(&motors);
        self.run.aimed.then(|| motors - request.joints)
    }
}

/// Returns the displacement of the next aim after so many that have missed: along the axes of
/// uncertainty, the least improbable first.
fn displaced(covariance: &Matrix3<f64>, misses: usize) -> Option<Vector3<f64>> {
    /// Displacement of the next aim, metres: as far as jaws close on a ball beside their middle.
    const STEP: f64 = 0.008;
    let axes = covariance.symmetric_eigen();
    let mut tries: Vec<(f64, Vector3<f64>)> = Vec::new();
    for (variance, axis) in axes.eigenvalues.iter().zip(axes.eigenvectors.column_iter()) {
        for steps in [1.0, -1.0, 2.0, -2.0] {
            let way: f64 = steps * STEP;
            tries.push((way * way / variance.max(1e-12), axis * way));
        }
    }
    tries.sort_by(|a, b| a.0.total_cmp(&b.0));
    let number = misses.checked_sub(1)? % (tries.len() + 1);
    tries.get(number).map(|(_, displacement)| *displacement)
}
