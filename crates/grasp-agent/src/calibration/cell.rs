//! The quantities of a calibration, and the image that they predict.

use std::f64::consts::TAU;

use nalgebra::{DVector, Matrix2, Matrix3xX, Point3, Translation3, UnitQuaternion};
use nalgebra::{Vector2, Vector3};
use puma_val2::{Arm, Joint, JointDelta, Joints};

use crate::sight::camera_model::CameraModel;

/// Index of each quantity in the vector of corrections. The zeros of joints follow.
pub(crate) mod at {
    pub(crate) const TURN: usize = 0;
    pub(crate) const SHIFT: usize = 3;
    pub(crate) const FOCAL: usize = 6;
    pub(crate) const CENTRE: usize = 7;
    pub(crate) const DISTORTION: usize = 9;
    pub(crate) const RADIUS: usize = 10;
    pub(crate) const BALL: usize = 11;
    pub(crate) const ZEROS: usize = 14;
}

/// Camera, ball and joint zeros, as estimated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimated {
    pub(crate) model: CameraModel,
    pub(crate) distortion: f64,
    pub(crate) zeros: JointDelta,
    pub(crate) ball: Point3<f64>,
}

impl Estimated {
    /// Returns the cell with a correction of each quantity; `joints` are those with a zero.
    pub(crate) fn corrected(&self, by: &DVector<f64>, joints: &[Joint]) -> Self {
        let three = |i: usize| Vector3::new(by[i], by[i + 1], by[i + 2]);
        let mut next = *self;
        let mount = &mut next.model.mount;
        mount.translation = Translation3::from(mount.translation.vector + three(at::SHIFT));
        mount.rotation *= UnitQuaternion::from_scaled_axis(three(at::TURN));
        mount.rotation.renormalize();
        next.model.focal *= by[at::FOCAL].exp();
        next.model.centre[0] += by[at::CENTRE];
        next.model.centre[1] += by[at::CENTRE + 1];
        next.distortion += by[at::DISTORTION];
        next.model.ball_radius *= by[at::RADIUS].exp();
        next.ball += three(at::BALL);
        for (joint, zero) in joints.iter().zip(by.iter().skip(at::ZEROS)) {
            next.zeros.0[joint.index()] += zero;
        }
        next
    }

    /// Returns the correction that leads from `nominal` here.
    pub(crate) fn correction(&self, nominal: &Self, joints: &[Joint]) -> DVector<f64> {
        let (mine, theirs) = (&self.model, &nominal.model);
        let turn = (theirs.mount.rotation.inverse() * mine.mount.rotation).scaled_axis();
        let shift = mine.mount.translation.vector - theirs.mount.translation.vector;
        let ball = self.ball - nominal.ball;
        let single = [
            (mine.focal / theirs.focal).ln(),
            mine.centre[0] - theirs.centre[0],
            mine.centre[1] - theirs.centre[1],
            self.distortion - nominal.distortion,
            (mine.ball_radius / theirs.ball_radius).ln(),
        ];
        let zero = |joint: &Joint| self.zeros[*joint] - nominal.zeros[*joint];
        let parts = turn.iter().chain(&shift).chain(&single).chain(&ball);
        let all: Vec<f64> = parts.copied().chain(joints.iter().map(zero)).collect();
        DVector::from_vec(all)
    }

    /// Predicts the outline of the ball from a pose that the arm reports; `None` if it has none:
    /// the middle and the mean semi-axis of the ellipse with the area moments of the outline after
    /// the lens, which moves a point p on the plane at unit depth to p (1 + `k1` |p|²).
    pub(crate) fn view(&self, joints: &Joints) -> Option<Vector3<f64>> {
        /// The integrands are trigonometric polynomials of degree 12: the sums are exact.
        const POINTS: u32 = 16;
        let model = &self.model;
        let camera = model.arm.wrist(&(*joints + self.zeros)) * model.mount;
        let ball = camera.inverse_transform_point(&self.ball);
        let (scale, major, minor) = model.ellipse(&ball)?;
        let middle = ball.xy().coords * (scale / model.focal);
        let along = middle.try_normalize(1e-12).unwrap_or(Vector2::x());
        let major = along * (major / model.focal);
        let minor = Vector2::new(-along.y, along.x) * (minor / model.focal);
        let stretched = |p: &Vector2<f64>| 1.0 + self.distortion * p.norm_squared();
        let from = middle * stretched(&middle);
        let (mut area, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
        for k in 0..POINTS {
            let (sin, cos) = (f64::from(k) * TAU / f64::from(POINTS)).sin_cos();
            let (p, by) = (
                middle + major * cos + minor * sin,
                minor * cos - major * sin,
            );
            let q = p * stretched(&p) - from;
            let by = by * stretched(&p) + p * (2.0 * self.distortion * p.dot(&by));
            // Green's theorem.
            let sector = q.x * by.y - q.y * by.x;
            area += sector / 2.0;
            first += q * (sector / 3.0);
            second += q * q.transpose() * (sector / 4.0);
        }
        if area.is_nan() || area <= 0.0 {
            return None;
        }
        let off = first / area;
        let spread = second / area - off * off.transpose();
        // The sum of the roots of the eigenvalues.
        let axes = (spread.trace() + 2.0 * spread.determinant().max(0.0).sqrt()).sqrt();
        let place = (from + off) * model.focal;
        let [cx, cy] = model.centre;
        let seen = Vector3::new(cx + place.x, cy + place.y, axes * model.focal);
        seen.iter().all(|v| v.is_finite()).then_some(seen)
    }

    /// Returns the prediction and its derivatives by the corrections.
    pub(crate) fn sensitivity(
        &self,
        joints: &Joints,
        zeros: &[Joint],
    ) -> Option<(Vector3<f64>, Matrix3xX<f64>)> {
        const STEP: f64 = 1e-6;
        let here = self.view(joints)?;
        let mut by_all = Matrix3xX::zeros(at::ZEROS + zeros.len());
        for i in 0..by_all.ncols() {
            let mut by = DVector::zeros(by_all.ncols());
            by[i] = STEP;
            let there = self.corrected(&by, zeros).view(joints)?;
            by_all.set_column(i, &((there - here) / STEP));
        }
        Some((here, by_all))
    }
}

/// Returns the joints whose zeros looks at a ball can tell: all that move the hand, but the first,
/// whose zero turns the whole cell, and the last, whose zero turns the camera.
pub(crate) fn joints_with_zeros(arm: &Arm) -> Vec<Joint> {
    let here = Joints([0.5; 6]);
    let moves = |joint: &Joint| {
        let turned = arm.wrist(&(here + JointDelta::of(*joint, 0.5)));
        (turned.to_homogeneous() - arm.wrist(&here).to_homogeneous()).amax() > 1e-9
    };
    let mut joints: Vec<Joint> = Joint::ALL.into_iter().filter(moves).collect();
    joints.pop();
    joints.drain(..1.min(joints.len()));
    joints
}
