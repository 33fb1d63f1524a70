//! Robust least squares: model parameters and ball positions from evidence.

use nalgebra::{Isometry3, Matrix3, Point3, SMatrix, Vector3};

use crate::controllers::hybrid::belief::Belief;
use crate::controllers::hybrid::evidence::{Evidence, Stands};
use crate::controllers::hybrid::parameters::{
    Information, LEARNED, METRE_STEP, Numbers, STEPS, ThreeBy, WithBall, at, corrected, vector,
};
use crate::sight::camera_model::CameraModel;

/// Result of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) numbers: Numbers,
    /// Ball position of each piece of evidence; `None` without a sighting.
    pub(crate) balls: Vec<Option<Point3<f64>>>,
    /// Information matrix of the parameters, marginal over the ball positions.
    pub(crate) information: Information,
    /// Joint information matrix of the parameters and the last ball.
    pub(crate) with_last_ball: WithBall,
    /// Weighted sum of squared residuals, feature units squared.
    squares: f64,
    /// Degrees of freedom: residuals minus fitted values.
    spare: f64,
}

/// Largest number of iterations.
const ITERATIONS: usize = 12;
/// Threshold of the Huber loss (Huber 1964), standard deviations. False circles exceed it.
const OUTLIER: f64 = 3.0;

impl Fit {
    /// Finds the most probable parameters and ball positions by Levenberg–Marquardt iteration.
    pub(crate) fn of(
        belief: &Belief,
        start: &Numbers,
        nominal: &CameraModel,
        evidence: &[&Evidence],
    ) -> Option<Self> {
        let before = belief.numbers();
        let prior = *belief.information();
        let noise = belief.noise();
        let model = corrected(nominal, start);
        let mut numbers = *start;
        let first_guess = |evidence: &&Evidence| {
            let (joints, features) = *evidence.stands(start).views.last()?;
            model.locate(&joints, &features)
        };
        let mut balls: Vec<_> = evidence.iter().map(first_guess).collect();
        let cost_of = |numbers: &Numbers, balls: &[Option<Point3<f64>>]| {
            let off = numbers - before;
            let own: f64 = evidence
                .iter()
                .zip(balls)
                .map(|(e, ball)| ball.map_or(0.0, |ball| cost(e, nominal, numbers, &ball, noise)))
                .sum();
            (off.transpose() * prior * off)[0] + own
        };
        let mut least = cost_of(&numbers, &balls);
        let mut damping = 1e-4;
        let mut normal = Normal::of(&before, &prior, &numbers, nominal, evidence, &balls, noise);
        for _ in 0..ITERATIONS {
            let Some((next, moved)) = normal.step(&numbers, &balls, damping) else {
                damping *= 10.0;
                continue;
            };
            let now = cost_of(&next, &moved);
            // False for a NaN cost, too.
            if now < least {
                let settled = least - now < 1e-6 * (1.0 + least);
                (numbers, balls, least) = (next, moved, now);
                damping = (damping * 0.1).max(1e-9);
                normal = Normal::of(&before, &prior, &numbers, nominal, evidence, &balls, noise);
                if settled {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        let information = normal.marginal();
        let finite = information
            .iter()
            .chain(numbers.iter())
            .all(|v| v.is_finite());
        finite.then(|| Self {
            information,
            with_last_ball: normal.with_last_ball(),
            squares: normal.squares,
            spare: normal.spare,
            numbers,
            balls,
        })
    }

    /// Returns the posterior belief.
    pub(crate) fn belief(&self, noise: f64) -> Belief {
        Belief::of(self.numbers, self.information, noise)
    }

    /// Returns the standard deviation of the residuals; `None` if there are too few.
    pub(crate) fn noise(&self) -> Option<f64> {
        const LEAST: f64 = 0.05;
        const MOST: f64 = 4.0;
        (self.spare >= 20.0).then(|| (self.squares / self.spare).sqrt().clamp(LEAST, MOST))
    }
}

/// Projects `ball` into the camera on the hand at `wrist`.
fn seen(model: &CameraModel, wrist: &Isometry3<f64>, ball: &Point3<f64>) -> Option<Vector3<f64>> {
    let place = model
        .mount
        .inverse_transform_point(&wrist.inverse_transform_point(ball));
    model.outline(&place).map(|f| vector(&f))
}

/// Cost of a sighting that the model excludes, squared standard deviations.
const INEXPLICABLE: f64 = 1e3;

fn huber(residual: f64) -> f64 {
    let size = residual.abs();
    if size <= OUTLIER {
        size * size
    } else {
        OUTLIER * (2.0 * size - OUTLIER)
    }
}

fn cost(
    evidence: &Evidence,
    nominal: &CameraModel,
    numbers: &Numbers,
    ball: &Point3<f64>,
    noise: f64,
) -> f64 {
    let model = corrected(nominal, numbers);
    let Stands { views, held } = evidence.stands(numbers);
    let of_view = |(joints, features)| match seen(&model, &model.arm.wrist(joints), ball) {
        Some(expected) => (expected - vector(features))
            .iter()
            .map(|r| huber(r / noise))
            .sum(),
        None => INEXPLICABLE,
    };
    let of_grip = held.map_or(0.0, |(joints, unsure)| {
        ((model.tool_point(&joints) - ball) / unsure).norm_squared()
    });
    views.iter().map(|(j, f)| of_view((j, f))).sum::<f64>() + of_grip
}

/// Normal equations in blocks: the parameters, and three columns for each ball.
struct Normal {
    numbers: Information,
    gradient: Numbers,
    balls: Vec<Option<BallBlock>>,
    squares: f64,
    spare: f64,
}

struct BallBlock {
    own: Matrix3<f64>,
    cross: SMatrix<f64, LEARNED, 3>,
    gradient: Vector3<f64>,
}

impl Normal {
    fn of(
        before: &Numbers,
        prior: &Information,
        numbers: &Numbers,
        nominal: &CameraModel,
        evidence: &[&Evidence],
        balls: &[Option<Point3<f64>>],
        noise: f64,
    ) -> Self {
        let mut normal = Self {
            numbers: *prior,
            gradient: prior * (numbers - before),
            balls: Vec::with_capacity(balls.len()),
            squares: 0.0,
            spare: -(LEARNED as f64),
        };
        let varied = Varied::new(nominal, numbers);
        for (evidence, ball) in evidence.iter().zip(balls) {
            let block = ball.map(|ball| normal.add(&varied, evidence, &ball, noise));
            normal.balls.push(block);
        }
        normal
    }

    /// Adds one piece of evidence.
    fn add(
        &mut self,
        varied: &Varied,
        evidence: &Evidence,
        ball: &Point3<f64>,
        noise: f64,
    ) -> BallBlock {
        let mut block = BallBlock {
            own: Matrix3::zeros(),
            cross: SMatrix::zeros(),
            gradient: Vector3::zeros(),
        };
        let Stands { views, held } = evidence.stands(&varied.numbers);
        let moved: Vec<Stands> = varied.arms.iter().map(|n| evidence.stands(n)).collect();
        self.spare -= 3.0;
        for (index, (joints, features)) in views.iter().enumerate() {
            let wrist = varied.model.arm.wrist(joints);
            let Some(expected) = seen(&varied.model, &wrist, ball) else {
                continue;
            };
            let mut by_numbers = ThreeBy::<LEARNED>::zeros();
            for (i, model) in varied.models.iter().enumerate() {
                if let Some(v) = seen(model, &wrist, ball) {
                    by_numbers.set_column(i, &((v - expected) / STEPS[i]));
                }
            }
            for (i, stands) in (at::PLAY..).zip(&moved) {
                let wrist = varied.model.arm.wrist(&stands.views[index].0);
                if let Some(v) = seen(&varied.model, &wrist, ball) {
                    by_numbers.set_column(i, &((v - expected) / STEPS[i]));
                }
            }
            let mut by_place = Matrix3::zeros();
            for i in 0..3 {
                let mut moved = *ball;
                moved[i] += METRE_STEP;
                if let Some(v) = seen(&varied.model, &wrist, &moved) {
                    by_place.set_column(i, &((v - expected) / METRE_STEP));
                }
            }
            let residual = expected - vector(features);
            let weights = residual.map(|r| {
                let size = r.abs() / noise;
                (if size <= OUTLIER { 1.0 } else { OUTLIER / size }) / (noise * noise)
            });
            let weighed = Matrix3::from_diagonal(&weights);
            self.numbers += by_numbers.transpose() * weighed * by_numbers;
            self.gradient += by_numbers.transpose() * weighed * residual;
            block.own += by_place.transpose() * weighed * by_place;
            block.cross += by_numbers.transpose() * weighed * by_place;
            block.gradient += by_place.transpose() * weighed * residual;
            self.squares += residual.component_mul(&residual).dot(&weights) * noise * noise;
            self.spare += 3.0;
        }
        if let Some((joints, unsure)) = held {
            let tool = varied.model.tool_point(&joints);
            let mut by_numbers = ThreeBy::<LEARNED>::zeros();
            for (i, stands) in (at::PLAY..).zip(&moved) {
                if let Some((joints, _)) = &stands.held {
                    by_numbers
                        .set_column(i, &((tool - varied.model.tool_point(joints)) / STEPS[i]));
                }
            }
            let (residual, weight) = (ball - tool, unsure.powi(-2));
            self.numbers += by_numbers.transpose() * by_numbers * weight;
            self.gradient += by_numbers.transpose() * residual * weight;
            block.own += Matrix3::identity() * weight;
            block.cross += by_numbers.transpose() * weight;
            block.gradient += residual * weight;
        }
        block
    }

    /// Returns the next parameters and balls.
    fn step(
        &self,
        numbers: &Numbers,
        balls: &[Option<Point3<f64>>],
        damping: f64,
    ) -> Option<(Numbers, Vec<Option<Point3<f64>>>)> {
        let (mut reduced, mut gradient) = (self.numbers, self.gradient);
        for i in 0..LEARNED {
            reduced[(i, i)] *= 1.0 + damping;
        }
        let mut inverses = Vec::with_capacity(self.balls.len());
        for block in &self.balls {
            let inverse = match block {
                Some(block) => Some(inverse_of(&block.own, damping)?),
                None => None,
            };
            if let (Some(block), Some(inverse)) = (block, inverse) {
                reduced -= block.cross * inverse * block.cross.transpose();
                gradient -= block.cross * inverse * block.gradient;
            }
            inverses.push(inverse);
        }
        let step = reduced.cholesky()?.solve(&gradient);
        let moved = balls
            .iter()
            .zip(&self.balls)
            .zip(&inverses)
            .map(|((ball, block), inverse)| {
                let (ball, block, inverse) = ((*ball)?, block.as_ref()?, (*inverse)?);
                Some(ball - inverse * (block.gradient - block.cross.transpose() * step))
            });
        Some((numbers - step, moved.collect()))
    }

    /// Returns the information matrix of the parameters, marginal over the balls.
    fn marginal(&self) -> Information {
        let mut reduced = self.numbers;
        for block in self.balls.iter().flatten() {
            if let Some(inverse) = inverse_of(&block.own, 0.0) {
                reduced -= block.cross * inverse * block.cross.transpose();
            }
        }
        0.5 * (reduced + reduced.transpose())
    }

    /// Returns the joint information matrix of the parameters and the last ball.
    fn with_last_ball(&self) -> WithBall {
        let mut joint = WithBall::identity();
        joint
            .fixed_view_mut::<LEARNED, LEARNED>(0, 0)
            .copy_from(&self.numbers);
        if let Some(Some(block)) = self.balls.last() {
            joint
                .fixed_view_mut::<LEARNED, 3>(0, LEARNED)
                .copy_from(&block.cross);
            joint
                .fixed_view_mut::<3, LEARNED>(LEARNED, 0)
                .copy_from(&block.cross.transpose());
            joint
                .fixed_view_mut::<3, 3>(LEARNED, LEARNED)
                .copy_from(&block.own);
        }
        joint
    }
}

fn inverse_of(own: &Matrix3<f64>, damping: f64) -> Option<Matrix3<f64>> {
    let mut damped = *own;
    for i in 0..3 {
        damped[(i, i)] = damped[(i, i)] * (1.0 + damping) + 1e-9;
    }
    damped.try_inverse()
}

/// The model, and one variation of it for each parameter, for numerical derivatives.
struct Varied {
    numbers: Numbers,
    model: CameraModel,
    /// Models with another parameter of camera or ball, in the order of the parameters.
    models: Vec<CameraModel>,
    /// Numbers with another parameter of the arm, from [`at::PLAY`] on.
    arms: Vec<Numbers>,
}

impl Varied {
    fn new(nominal: &CameraModel, numbers: &Numbers) -> Self {
        let other = |i: usize| {
            let mut other = *numbers;
            other[i] += STEPS[i];
            other
        };
        Self {
            numbers: *numbers,
            model: corrected(nominal, numbers),
            models: (0..at::PLAY)
                .map(|i| corrected(nominal, &other(i)))
                .collect(),
            arms: (at::PLAY..LEARNED).map(other).collect(),
        }
    }
}
