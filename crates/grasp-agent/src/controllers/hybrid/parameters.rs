//! The parameters of a belief: their table, the model they define, and its derivatives.

use hough_heuristic::Features;
use nalgebra::{
    Isometry3, Point3, Rotation3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3,
};

use crate::sight::camera_model::CameraModel;

/// Number of parameters.
pub(crate) const LEARNED: usize = 18;

/// Index of each parameter in the vector. Those before [`at::PLAY`] enter the camera model, the
/// others the angles of the joints ([`Links`](crate::controllers::hybrid::evidence::Links)).
pub(crate) mod at {
    pub(crate) const FOCAL: usize = 0;
    pub(crate) const CENTRE: usize = 1;
    pub(crate) const TURN: usize = 3;
    pub(crate) const SHIFT: usize = 6;
    pub(crate) const RADIUS: usize = 9;
    pub(crate) const PLAY: usize = 10;
    pub(crate) const ARM: usize = 13;
}

pub(crate) type Numbers = SVector<f64, LEARNED>;
pub(crate) type Information = SMatrix<f64, LEARNED, LEARNED>;

/// Number of parameters and coordinates of one ball together.
pub(crate) const WITH_BALL: usize = LEARNED + 3;
pub(crate) type WithBall = SMatrix<f64, WITH_BALL, WITH_BALL>;

/// Step of the derivatives by a backlash. Sightings depend on it with kinks, so that its error is
/// given by the slope over a whole step.
const ACROSS_KINKS: f64 = 2e-3;
/// Steps of the numerical derivatives, for each parameter.
pub(crate) const STEPS: [f64; LEARNED] = steps(1.0);
/// Steps of the derivatives of derivatives.
pub(crate) const WIDE_STEPS: [f64; LEARNED] = steps(100.0);

const fn steps(times: f64) -> [f64; LEARNED] {
    let (one, unit, metre) = (1e-5 * times, 1e-3 * times, 1e-6 * times);
    let play = ACROSS_KINKS;
    [
        one, unit, unit, one, one, one, metre, metre, metre, one, play, play, play, one, one, one,
        one, one,
    ]
}

/// Step of numerical derivatives with respect to a coordinate, metres.
pub(crate) const METRE_STEP: f64 = 1e-6;

pub(crate) type ThreeBy<const N: usize> = SMatrix<f64, 3, N>;

/// Applies the parameters of the camera and the ball to `nominal`.
pub(crate) fn corrected(nominal: &CameraModel, numbers: &Numbers) -> CameraModel {
    let three = |i: usize| Vector3::new(numbers[i], numbers[i + 1], numbers[i + 2]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_scaled_axis(three(at::TURN)));
    CameraModel {
        focal: nominal.focal * numbers[at::FOCAL].exp(),
        centre: [
            nominal.centre[0] + numbers[at::CENTRE],
            nominal.centre[1] + numbers[at::CENTRE + 1],
        ],
        mount: nominal.mount * Isometry3::from_parts(Translation3::from(three(at::SHIFT)), turn),
        ball_radius: nominal.ball_radius * numbers[at::RADIUS].exp(),
        ..*nominal
    }
}

pub(crate) fn vector(f: &Features) -> Vector3<f64> {
    Vector3::new(f.x, f.y, f.r)
}

/// Returns a prediction and its derivatives by parameters and ball place; `None` if there is none.
pub(crate) fn sensitivity(
    numbers: &Numbers,
    ball: &Point3<f64>,
    mut predict: impl FnMut(&Numbers, &Point3<f64>) -> Option<Vector3<f64>>,
) -> Option<(Vector3<f64>, ThreeBy<WITH_BALL>)> {
    let here = predict(numbers, ball)?;
    let mut by_all = ThreeBy::<WITH_BALL>::zeros();
    for i in 0..WITH_BALL {
        let (mut other, mut place) = (*numbers, *ball);
        let step = match i.checked_sub(LEARNED) {
            None => {
                other[i] += STEPS[i];
                STEPS[i]
            }
            Some(axis) => {
                place[axis] += METRE_STEP;
                METRE_STEP
            }
        };
        by_all.set_column(i, &((predict(&other, &place)? - here) / step));
    }
    Some((here, by_all))
}

/// Returns the standard deviations of a prediction.
pub(crate) fn deviations(by_all: &ThreeBy<WITH_BALL>, covariance: &WithBall) -> Vector3<f64> {
    (by_all * covariance * by_all.transpose())
        .diagonal()
        .map(|v| v.max(0.0).sqrt())
}
