//! Robust least squares: model parameters and ball positions from evidence.

use nalgebra::{Isometry3, Matrix3, Point3, SMatrix, Vector3};

use crate::controllers::hybrid::belief::Belief;
use crate::controllers::hybrid::evidence::{Evidence, Stands};
use crate::controllers::hybrid::parameters::{
    Information, LEARNED, METRE_STEP, Numbers, STEPS, ThreeBy, WIDE_STEPS, WithBall, at, corrected,
    vector,
};
use crate::sight::camera_model::CameraModel;

/// Result of a fit.
pub(crate) struct Fit {
    pub(crate) numbers: Numbers,
    /// Ball position of each piece of evidence; `None` without a sighting.
    pub(crate) balls: Vec<Option<Point3<f64>>>,
    /// Robust cost: squared standard deviations of residuals and prior.
    pub(crate) cost: f64,
    normal: Normal,
}

/// Largest number of iterations.
const ITERATIONS: usize = 12;
/// Threshold of the Huber loss (Huber 1964), standard deviations. False circles exceed it.
const OUTLIER: f64 = 3.0;
/// Threshold of the Cauchy loss of a grip, standard deviations. A ball that was taken for held may
/// lie anywhere.
const NOT_HELD: f64 = 1.5;
/// Increase of the variances over those of the linear model, per squared share of the noise in the
/// radius: by it, 95 % intervals hold in drawn cells at every level of errors.
const NONLINEAR: f64 = 9.0;

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
            let (joints, features) = *evidence.stands(start, &nominal.arm).views.last()?;
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
        let mut all = normal.numbers.iter().chain(numbers.iter());
        all.all(|v| v.is_finite()).then_some(Self {
            numbers,
            balls,
            cost: least,
            normal,
        })
    }

    /// Returns the posterior belief.
    pub(crate) fn belief(&self, noise: f64) -> Belief {
        let coarse = self.normal.coarse / self.normal.sightings.max(1) as f64;
        let information = self.normal.marginal() / (1.0 + NONLINEAR * coarse);
        Belief::of(self.numbers, information, noise)
    }

    /// Returns the covariance of the parameters and the last ball.
    pub(crate) fn with_last_ball(&self) -> Option<WithBall> {
        self.normal.with_last_ball().try_inverse()
    }

    /// Moves the parameters from the most probable ones, together with the ball positions, to the
    /// most probable ones over all ball positions.
    ///
    /// A position for every few sightings biases a nonlinear fit, however many balls there are
    /// (Neyman and Scott 1948). By Laplace's approximation, the integral over a position costs half
    /// the logarithm of the determinant of its information (Tierney and Kadane 1986).
    #[must_use]
    pub(crate) fn over_all_places(mut self, nominal: &CameraModel, evidence: &[&Evidence]) -> Self {
        let varied = Varied::new(nominal, &self.numbers, &WIDE_STEPS);
        let mut gradient = Numbers::zeros();
        for ((evidence, ball), block) in evidence.iter().zip(&self.balls).zip(&self.normal.balls) {
            let (Some(ball), Some(block)) = (ball, block) else {
                continue;
            };
            let Some(inverse) = inverse_of(&block.own, 0.0) else {
                continue;
            };
            let here = evidence.stands(&self.numbers, &nominal.arm);
            let views = |stands: &Stands, model: &CameraModel, ball: &Point3<f64>| {
                let mut own = Matrix3::zeros();
                let (mut nearest, mut unit) = (0.0, 1.0);
                for ((joints, f), weights) in stands.views.iter().zip(&block.weights) {
                    let wrist = model.arm.wrist(joints);
                    let by_place = by_place(model, &wrist, ball);
                    if nearest == 0.0 {
                        (nearest, unit) = (f.r, by_place.determinant());
                    }
                    own += by_place.transpose() * Matrix3::from_diagonal(weights) * by_place;
                }
                if let Some((_, unsure)) = stands.held {
                    own += Matrix3::identity() * unsure.powi(-2);
                }
                (own.determinant() / (unit * unit)).ln()
            };
            let before = views(&here, &varied.model, ball);
            for i in 0..LEARNED {
                let step = WIDE_STEPS[i];
                let moved = ball - inverse * block.cross.row(i).transpose() * step;
                let after = match i.checked_sub(at::PLAY) {
                    None => views(&here, &varied.models[i], &moved),
                    Some(arm) => views(
                        &evidence.stands(&varied.arms[arm], &nominal.arm),
                        &varied.model,
                        &moved,
                    ),
                };
                let slope = 0.5 * (after - before) / step;
                if slope.is_finite() {
                    gradient[i] += slope;
                }
            }
        }
        if let Some(information) = self.normal.marginal().cholesky() {
            self.numbers -= information.solve(&gradient);
        }
        self
    }

    /// Returns `evidence`, the only one of this fit, with the sightings that lie within so many
    /// feature units of their expected place; `None` if no ball was seen.
    pub(crate) fn within(
        &self,
        nominal: &CameraModel,
        evidence: &Evidence,
        far: f64,
    ) -> Option<Evidence> {
        let ball = (*self.balls.first()?)?;
        let model = corrected(nominal, &self.numbers);
        let stands = evidence.stands(&self.numbers, &nominal.arm);
        let mut near = stands.views.iter().map(|(joints, f)| {
            let expected = seen(&model, &model.arm.wrist(joints), &ball);
            expected.is_some_and(|expected| (expected - vector(f)).norm() < far)
        });
        Some(evidence.with_sightings(|_, _| near.next().unwrap_or_default()))
    }

    /// Returns the standard deviation of the residuals; `None` if there are too few.
    pub(crate) fn noise(&self) -> Option<f64> {
        const LEAST: f64 = 0.05;
        const MOST: f64 = 4.0;
        let Normal { squares, spare, .. } = self.normal;
        (spare >= 20.0).then(|| (squares / spare).sqrt().clamp(LEAST, MOST))
    }
}

/// Projects `ball` into the camera on the hand at `wrist`.
fn seen(model: &CameraModel, wrist: &Isometry3<f64>, ball: &Point3<f64>) -> Option<Vector3<f64>> {
    let place = model
        .mount
        .inverse_transform_point(&wrist.inverse_transform_point(ball));
    model.outline(&place).map(|f| vector(&f))
}

/// Returns the derivative of [`seen`] by the place of the ball, 0 where nothing is seen.
fn by_place(model: &CameraModel, wrist: &Isometry3<f64>, ball: &Point3<f64>) -> Matrix3<f64> {
    let mut by_place = Matrix3::zeros();
    if let Some(expected) = seen(model, wrist, ball) {
        for i in 0..3 {
            let mut moved = *ball;
            moved[i] += METRE_STEP;
            if let Some(v) = seen(model, wrist, &moved) {
                by_place.set_column(i, &((v - expected) / METRE_STEP));
            }
        }
    }
    by_place
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
    let Stands { views, held } = evidence.stands(numbers, &nominal.arm);
    let of_view = |(joints, features)| match seen(&model, &model.arm.wrist(joints), ball) {
        Some(expected) => (expected - vector(features))
            .iter()
            .map(|r| huber(r / noise))
            .sum(),
        None => INEXPLICABLE,
    };
    let of_grip = held.map_or(0.0, |(joints, unsure)| {
        let off = (model.tool_point(&joints) - ball).norm() / (unsure * NOT_HELD);
        NOT_HELD.powi(2) * (off * off).ln_1p()
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
    sightings: usize,
    /// Sum of the squared shares of the noise in the radius.
    coarse: f64,
}

struct BallBlock {
    own: Matrix3<f64>,
    cross: SMatrix<f64, LEARNED, 3>,
    gradient: Vector3<f64>,
    /// Weights of each sighting, inverse variances.
    weights: Vec<Vector3<f64>>,
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
            sightings: 0,
            coarse: 0.0,
        };
        let varied = Varied::new(nominal, numbers, &STEPS);
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
            weights: Vec::new(),
        };
        let Stands { views, held } = evidence.stands(&varied.numbers, &varied.model.arm);
        let moved: Vec<Stands> = varied
            .arms
            .iter()
            .map(|n| evidence.stands(n, &varied.model.arm))
            .collect();
        self.spare -= 3.0;
        for (index, (joints, features)) in views.iter().enumerate() {
            let wrist = varied.model.arm.wrist(joints);
            let Some(expected) = seen(&varied.model, &wrist, ball) else {
                block.weights.push(Vector3::zeros());
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
            let by_place = by_place(&varied.model, &wrist, ball);
            let residual = expected - vector(features);
            let weights = residual.map(|r| {
                let size = r.abs() / noise;
                (if size <= OUTLIER { 1.0 } else { OUTLIER / size }) / (noise * noise)
            });
            let weighed = Matrix3::from_diagonal(&weights);
            block.weights.push(weights);
            self.numbers += by_numbers.transpose() * weighed * by_numbers;
            self.gradient += by_numbers.transpose() * weighed * residual;
            block.own += by_place.transpose() * weighed * by_place;
            block.cross += by_numbers.transpose() * weighed * by_place;
            block.gradient += by_place.transpose() * weighed * residual;
            self.squares += residual.component_mul(&residual).dot(&weights) * noise * noise;
            self.spare += 3.0;
            self.sightings += 1;
            self.coarse += (noise / features.r).powi(2);
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
            let residual = ball - tool;
            let off = residual.norm() / (unsure * NOT_HELD);
            let weight = unsure.powi(-2) / (1.0 + off * off);
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
        let mut step = reduced.cholesky()?.solve(&gradient);
        // No backlash is below 0, where sightings would not depend on it.
        let negative = |i: &usize| numbers[*i] - step[*i] < 0.0;
        let ended: Vec<usize> = (at::PLAY..at::ARM).filter(negative).collect();
        if !ended.is_empty() {
            for i in ended {
                let bar = 1e9 * reduced[(i, i)];
                reduced[(i, i)] += bar;
                gradient[i] += bar * numbers[i];
            }
            step = reduced.cholesky()?.solve(&gradient);
        }
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
    /// Varies each parameter by its step.
    fn new(nominal: &CameraModel, numbers: &Numbers, steps: &[f64; LEARNED]) -> Self {
        let other = |i: usize| {
            let mut other = *numbers;
            other[i] += steps[i];
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
