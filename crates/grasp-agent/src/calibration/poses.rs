//! The choice of the next pose to look from.

use hough_heuristic::Features;
use nalgebra::{DMatrix, Matrix3, Point3, Vector3};
use puma_val2::{Joint, JointDelta, Joints};
use qtable::rand::{Rng, RngExt};

use crate::calibration::cell::{Estimated, at};
use crate::calibration::hand_eye::HandEye;

/// Number of poses to choose among.
const CANDIDATES: usize = 120;
/// Largest turn of a wrist joint from where the calibration began, radians.
const WRIST: f64 = 1.4;

/// A cell as known so far.
pub(crate) struct Known<'a> {
    pub(crate) cell: &'a Estimated,
    pub(crate) covariance: &'a DMatrix<f64>,
    pub(crate) zeros: &'a [Joint],
    /// Poses of the looks so far, the first one that of the beginning.
    pub(crate) poses: &'a [Joints],
    /// Deviations of the expected image that must lie within the frame.
    pub(crate) care: f64,
}

impl Known<'_> {
    /// Returns the pose that promises most among those in which the ball will surely be seen, by
    /// the determinant of the information (Fedorov 1972); `None` if there is none.
    pub(crate) fn next(
        &self,
        task: &HandEye,
        free: &mut dyn FnMut(&Joints) -> bool,
        rng: &mut impl Rng,
    ) -> Option<Joints> {
        let mut best: Option<(f64, Joints)> = None;
        for _ in 0..CANDIDATES {
            let Some(pose) = self.candidate(task, rng) else {
                continue;
            };
            let Some(worth) = self.worth(task, &pose) else {
                continue;
            };
            let better = best.is_none_or(|(most, _)| worth > most);
            if better && self.way_is_free(task, &pose, free) {
                best = Some((worth, pose));
            }
        }
        best.map(|(_, pose)| pose)
    }

    /// Returns `true` if the hand stays clear of the ball, and free, on the way to `pose`: all
    /// joints in step, first to where they come from.
    fn way_is_free(
        &self,
        task: &HandEye,
        pose: &Joints,
        free: &mut dyn FnMut(&Joints) -> bool,
    ) -> bool {
        /// Largest turn of a joint between two checks, radians.
        const STEP: f64 = 0.05;
        let mut from = self.poses[self.poses.len() - 1];
        // A hand that is too near already may go away.
        let clearance = task.clearance.min(self.distance(&from) - 1e-6);
        if self.distance(pose) < task.clearance {
            return false;
        }
        [task.before(pose), *pose].into_iter().all(|to| {
            let turns: [f64; 6] = std::array::from_fn(|i| to.0[i] - from.0[i]);
            let most = turns
                .iter()
                .fold(0.0, |most: f64, turn| most.max(turn.abs()));
            let steps = (most / STEP).ceil().max(1.0) as u32;
            let clear = (1..=steps).all(|k| {
                let share = f64::from(k) / f64::from(steps);
                let on_the_way = from + JointDelta(turns.map(|turn| share * turn));
                self.distance(&on_the_way) >= clearance && free(&on_the_way)
            });
            from = to;
            clear
        })
    }

    /// Returns the distance of the ball's centre from the line between hand and tool point, or from
    /// the camera if that is nearer, less what the place of the ball is uncertain by.
    fn distance(&self, pose: &Joints) -> f64 {
        /// Deviations of the ball's place, over those of the image.
        const SURE: f64 = 1.0;
        let (model, ball) = (&self.cell.model, &self.cell.ball);
        let wrist = model.arm.wrist(&(*pose + self.cell.zeros));
        let hand = wrist * Point3::new(0.0, 0.0, model.arm.flange());
        let along = wrist * Vector3::new(0.0, 0.0, model.tool);
        let share = (ball - hand).dot(&along) / along.norm_squared().max(1e-12);
        let nearest = hand + along * share.clamp(0.0, 1.0);
        let camera = wrist * Point3::from(model.mount.translation.vector);
        let unsure = self.covariance.fixed_view::<3, 3>(at::BALL, at::BALL);
        let surely = |from: Point3<f64>| {
            let (away, distance) = ((ball - from).normalize(), (ball - from).norm());
            distance - SURE * self.care * (away.transpose() * unsure * away)[0].max(0.0).sqrt()
        };
        surely(nearest).min(surely(camera))
    }

    /// Draws a pose that shows the ball somewhere in the image, or one on the way there.
    fn candidate(&self, task: &HandEye, rng: &mut impl Rng) -> Option<Joints> {
        let (begun, from) = (
            self.poses.first()?,
            self.poses[rng.random_range(0..self.poses.len())],
        );
        let mut pose = from;
        for i in 3..6 {
            let (low, high) = task.limits.0[i];
            let low = low.max(begun.0[i] - WRIST);
            let high = high.min(begun.0[i] + WRIST);
            if low < high {
                pose.0[i] = rng.random_range(low..high);
            }
        }
        let wanted = Features::new(
            rng.random_range(20.0..172.0),
            rng.random_range(20.0..124.0),
            rng.random_range(8.0..45.0),
        );
        let wanted = self.cell.model.in_camera(&wanted)?;
        let (pose, _) = self
            .cell
            .model
            .pose_placing(&self.cell.ball, &wanted, &pose);
        let share = [1.0, 0.5, 0.25, 0.1][rng.random_range(0..4)];
        Some(Joints(std::array::from_fn(|i| {
            from.0[i] + share * (pose.0[i] - from.0[i])
        })))
    }

    /// Returns the logarithm of the factor by which a look from `pose` enlarges the determinant of
    /// the information; `None` for a pose that cannot be taken or may not show the ball.
    fn worth(&self, task: &HandEye, pose: &Joints) -> Option<f64> {
        /// Noise that is counted upon, feature units.
        const NOISE: f64 = 0.5;
        if !task.limits.admit(pose) || !task.limits.admit(&task.before(pose)) {
            return None;
        }
        let (seen, by_all) = self.cell.sensitivity(pose, self.zeros)?;
        let spread = &by_all * self.covariance * by_all.transpose();
        let spread = Matrix3::from_fn(|i, j| spread[(i, j)]);
        let off = spread.diagonal().map(|v| self.care * v.max(0.0).sqrt());
        let radius = seen.z + off.z;
        let within = |v: f64, off: f64, size: f64| {
            v - off - 0.5 * radius > 0.0 && v + off + 0.5 * radius < size
        };
        let shown = within(seen.x, off.x, Features::WIDTH)
            && within(seen.y, off.y, Features::HEIGHT)
            && seen.z - off.z > 4.0
            && radius < 50.0;
        let gain = (Matrix3::identity() + spread / (NOISE * NOISE)).determinant();
        (shown && gain.is_finite()).then(|| gain.ln())
    }
}
