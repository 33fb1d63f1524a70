//! Forms that the library does not offer, and samples drawn in other ways, for comparison.

use hough_heuristic::Features;
use pipeline_sim::nalgebra::{DMatrix, DVector};
use pipeline_sim::rand::{Rng, RngExt};
use pipeline_sim::{Cell, CentreSample, MoveLists, ReachSample, with_noise};
use puma_val2::{JointDelta, Joints};

/// Where balls are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Balls {
    /// Anywhere in the image.
    Anywhere,
    /// In the arm's plane, as if the arm had been turned toward them.
    InPlane,
    /// Anywhere in the image, at these distances from the waist's axis and these heights, metres.
    Within([f64; 2], [f64; 2]),
}

/// What samples start from: balls, and uniform `JT2` and `JT3`, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Starts {
    pub(crate) balls: Balls,
    pub(crate) jt2: [f64; 2],
    pub(crate) jt3: [f64; 2],
}

impl Starts {
    /// The ranges of `exploring_start`, for other balls.
    pub(crate) fn paper(balls: Balls) -> Self {
        Self {
            balls,
            jt2: [-125.0, -30.0],
            jt3: [150.0, 214.0],
        }
    }

    /// A ball in sight that the arm can reach, on or above the table, and the joints, within their
    /// limits.
    pub(crate) fn draw<R: Rng>(&self, cell: &Cell, rng: &mut R) -> Option<(Cell, Joints)> {
        let uniform = |[low, high]: [f64; 2], rng: &mut R| rng.random_range(low..high);
        (0..100_000).find_map(|_| {
            let y = rng.random_range(4.0..140.0);
            let r = rng.random_range(6.0_f64.ln()..60.0_f64.ln()).exp();
            let x = match self.balls {
                Balls::InPlane => in_plane(cell, r),
                _ => rng.random_range(4.0..188.0),
            };
            let (jt2, jt3) = (uniform(self.jt2, rng), uniform(self.jt3, rng));
            let joints =
                Joints::from_degrees([0.0, jt2, jt3, 0.0, Cell::REACHING_JT5_DEGREES, 0.0]);
            let mut start = *cell;
            start.place_ball(cell.ball_showing(&joints, &Features { x, y, r })?);
            let place = start.ball.centre;
            let there = match self.balls {
                Balls::Within([near, far], [low, high]) => {
                    (near..=far).contains(&place.x.hypot(place.y))
                        && (low..=high).contains(&place.z)
                }
                // Not those behind the waist, which the arm could reach after turning round.
                Balls::InPlane => place.x > 0.0,
                Balls::Anywhere => true,
            };
            let kept = there
                && place.z > start.table + start.ball.radius
                && start.within_limits(&joints)
                && start.circle(&joints).is_some()
                && start.reachable();
            kept.then_some((start, joints))
        })
    }
}

/// Where a ball of this radius in the arm's plane shows: the camera sits beside that plane.
pub(crate) fn in_plane(cell: &Cell, r: f64) -> f64 {
    96.0 + r * cell.mount.0.translation.y / cell.ball.radius
}

/// `count` samples of each kind from these starts, as `sample_moves` has them, and the share of
/// moves of `JT2` and `JT3` that keep the ball in sight and the arm within its limits.
pub(crate) fn sample<R: Rng>(
    cell: &Cell,
    starts: &Starts,
    count: usize,
    noise: f64,
    rng: &mut R,
) -> (Vec<CentreSample>, Vec<ReachSample>, f64) {
    let moves = MoveLists::paper();
    let (mut centring, mut reaching) = (Vec::new(), Vec::new());
    let (mut tried, mut kept) = (0.0, 0.0);
    while centring.len() < count || reaching.len() < count {
        let Some((start, joints)) = starts.draw(cell, rng) else {
            break;
        };
        let mut draw = |list: &[f64; 9]| list[rng.random_range(0..9)];
        let (d1, d2, d3) = (draw(&moves.jt1), draw(&moves.jt2), draw(&moves.jt3));
        let mut seen = |delta: [f64; 6]| {
            let after = joints + JointDelta::from_degrees(delta);
            let before = start.features(&joints)?;
            let after = start
                .within_limits(&after)
                .then(|| start.features(&after))
                .flatten()?;
            Some((
                with_noise(before, noise, rng),
                with_noise(after, noise, rng),
            ))
        };
        if let Some((before, after)) =
            seen([d1, 0.0, 0.0, 0.0, 0.0, 0.0]).filter(|_| centring.len() < count)
        {
            centring.push(CentreSample { before, d1, after });
        }
        tried += 1.0;
        if let Some((before, after)) = seen([0.0, d2, d3, 0.0, 0.0, 0.0]) {
            kept += 1.0;
            let jt3_degrees = joints.degrees()[2];
            reaching.push(ReachSample {
                before,
                jt3_degrees,
                d2,
                d3,
                after,
            });
        }
    }
    reaching.truncate(count);
    (centring, reaching, kept / tried)
}

/// The terms of a form.
pub(crate) type Terms = fn(&Features, f64, f64, f64) -> Vec<f64>;

/// 1 and the moves, as `ReachForm::Linear` has them.
pub(crate) fn linear(_: &Features, _: f64, d2: f64, d3: f64) -> Vec<f64> {
    vec![1.0, d2 / 20.0, d3 / 16.0]
}

/// 1, the moves, and their products with r, the elbow angle and y: changes of y and r in units.
pub(crate) fn with_products(before: &Features, jt3: f64, d2: f64, d3: f64) -> Vec<f64> {
    let [r, y, e] = place(before, jt3);
    let moved = [d2 / 20.0, d3 / 16.0];
    let products = moved.iter().flat_map(|m| [1.0, r, y, e].map(|p| m * p));
    std::iter::once(1.0).chain(products).collect()
}

/// 1, the moves times 1, r, y, the elbow angle, r² and r y, and their squares and product times 1,
/// r and r²: 22 terms.
pub(crate) fn to_second_order(before: &Features, jt3: f64, d2: f64, d3: f64) -> Vec<f64> {
    let [r, y, e] = place(before, jt3);
    let (a, b) = (d2 / 20.0, d3 / 16.0);
    let first = [a, b]
        .into_iter()
        .flat_map(|m| [1.0, r, y, e, r * r, r * y].map(|p| m * p));
    let second = [a * a, a * b, b * b]
        .into_iter()
        .flat_map(|m| [1.0, r, r * r].map(|p| m * p));
    std::iter::once(1.0).chain(first).chain(second).collect()
}

/// 1, and the moves, their squares and product times 1, r, y and the elbow angle, and its square
/// times the first: 22 terms, those of `Rigid22` with r and y in the place of Z and V.
pub(crate) fn as_rigid22(before: &Features, jt3: f64, d2: f64, d3: f64) -> Vec<f64> {
    let [r, y, e] = place(before, jt3);
    let (a, b) = (d2 / 20.0, d3 / 16.0);
    let products = [a, b, a * a, a * b, b * b]
        .into_iter()
        .flat_map(|m| [1.0, r, y, e].map(|p| m * p));
    std::iter::once(1.0)
        .chain(products)
        .chain([e * e * a])
        .collect()
}

fn place(before: &Features, jt3: f64) -> [f64; 3] {
    [
        before.r / 33.0,
        (before.y - 72.0) / 33.0,
        (jt3 - 140.0) / 40.0,
    ]
}

/// 1, the moves times 1, r, y, the elbow angle, its product with r and its square, and the squares
/// and product of the moves times 1, r and y: 22 terms.
pub(crate) fn elbow_to_second_order(before: &Features, jt3: f64, d2: f64, d3: f64) -> Vec<f64> {
    let [r, y, e] = place(before, jt3);
    let (a, b) = (d2 / 20.0, d3 / 16.0);
    let first = [a, b]
        .into_iter()
        .flat_map(|m| [1.0, r, y, e, r * e, e * e].map(|p| m * p));
    let second = [a * a, a * b, b * b]
        .into_iter()
        .flat_map(|m| [1.0, r, y].map(|p| m * p));
    std::iter::once(1.0).chain(first).chain(second).collect()
}

/// What a form is linear in: y and r themselves, or Z = 33 / r and V = (y - 72) / r in units that
/// make them alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Linear {
    Image,
    Plane,
}

impl Linear {
    /// There and, which is the same, back.
    fn swap(self, f: &Features) -> Features {
        match self {
            Self::Image => *f,
            Self::Plane => Features {
                y: 72.0 + 33.0 * (f.y - 72.0) / f.r,
                r: 33.0 * 33.0 / f.r,
                ..*f
            },
        }
    }
}

/// A form linear in y and r, or Z and V, a fit for each interval of the elbow.
pub(crate) struct Form {
    linear: Linear,
    terms: Terms,
    edges: Vec<f64>,
    /// For each interval the coefficients of dy and of dr.
    pieces: Vec<[DVector<f64>; 2]>,
}

impl Form {
    pub(crate) fn fit(
        samples: &[ReachSample],
        linear: Linear,
        terms: Terms,
        edges: &[f64],
    ) -> Option<Self> {
        let mut form = Self {
            linear,
            terms,
            edges: edges.to_vec(),
            pieces: Vec::new(),
        };
        for piece in 0..=edges.len() {
            let group: Vec<&ReachSample> = samples
                .iter()
                .filter(|s| form.piece(s.jt3_degrees) == piece)
                .collect();
            let rows: Vec<Vec<f64>> = group
                .iter()
                .map(|s| terms(&linear.swap(&s.before), s.jt3_degrees, s.d2, s.d3))
                .collect();
            let pairs: Vec<[Features; 2]> = group
                .iter()
                .map(|s| [&s.before, &s.after].map(|f| linear.swap(f)))
                .collect();
            let dy = pairs
                .iter()
                .map(|[before, after]| after.y - before.y)
                .collect();
            let dr = pairs
                .iter()
                .map(|[before, after]| after.r - before.r)
                .collect();
            form.pieces
                .push([least_squares(&rows, dy)?, least_squares(&rows, dr)?]);
        }
        Some(form)
    }

    fn piece(&self, jt3: f64) -> usize {
        self.edges.iter().filter(|edge| jt3 >= **edge).count()
    }

    pub(crate) fn predict(&self, before: &Features, jt3: f64, d2: f64, d3: f64) -> Features {
        let before = self.linear.swap(before);
        let terms = DVector::from_vec((self.terms)(&before, jt3, d2, d3));
        let [y, r] = self.pieces[self.piece(jt3)]
            .each_ref()
            .map(|c| c.dot(&terms));
        self.linear.swap(&Features {
            y: before.y + y,
            r: before.r + r,
            ..before
        })
    }

    /// R² of dy and dr, and their errors.
    pub(crate) fn quality(&self, samples: &[ReachSample]) -> [f64; 4] {
        let predicted: Vec<Features> = samples
            .iter()
            .map(|s| self.predict(&s.before, s.jt3_degrees, s.d2, s.d3))
            .collect();
        let judge = |change: fn(&Features, &Features) -> f64| {
            let pairs = samples.iter().zip(&predicted);
            judged(pairs.map(|(s, p)| (change(&s.before, &s.after), change(&s.before, p))))
        };
        let (y, r) = (judge(|a, b| b.y - a.y), judge(|a, b| b.r - a.r));
        [y.0, r.0, y.1, r.1]
    }

    /// Mean error of y after 1, 3 and 5 moves that the form does not see. A run ends with the first
    /// move that loses the ball or leaves the limits, if `at_loss`; otherwise another move is
    /// drawn.
    pub(crate) fn open_loop<R: Rng>(
        &self,
        cell: &Cell,
        starts: &Starts,
        at_loss: bool,
        runs: usize,
        rng: &mut R,
    ) -> [f64; 3] {
        let lists = MoveLists::paper();
        let mut errors = vec![Vec::new(); 5];
        for _ in 0..runs {
            let Some((start, mut joints)) = starts.draw(cell, rng) else {
                break;
            };
            let Some(mut believed) = start.features(&joints) else {
                continue;
            };
            for error in &mut errors {
                let next = (0..if at_loss { 1 } else { 100 }).find_map(|_| {
                    let mut draw = |list: &[f64; 9]| list[rng.random_range(0..9)];
                    let (d2, d3) = (draw(&lists.jt2), draw(&lists.jt3));
                    let there = joints + JointDelta::from_degrees([0.0, d2, d3, 0.0, 0.0, 0.0]);
                    let seen = start
                        .within_limits(&there)
                        .then(|| start.features(&there))
                        .flatten()?;
                    Some((d2, d3, there, seen))
                });
                let Some((d2, d3, there, seen)) = next else {
                    break;
                };
                believed = self.predict(&believed, joints.degrees()[2], d2, d3);
                // A believed ball does not vanish.
                believed.r = believed.r.max(1.0);
                joints = there;
                error.push((believed.y - seen.y).abs());
            }
        }
        [0, 2, 4].map(|k| errors[k].iter().sum::<f64>() / errors[k].len() as f64)
    }
}

/// R² and error of dx on 1, d1, r d1, r² d1, on the samples it is fitted to.
pub(crate) fn centring_with_square(samples: &[CentreSample]) -> Option<[f64; 2]> {
    let terms = |s: &CentreSample| {
        let r = s.before.r / 33.0;
        vec![1.0, s.d1, r * s.d1, r * r * s.d1]
    };
    let rows: Vec<Vec<f64>> = samples.iter().map(terms).collect();
    let dx: Vec<f64> = samples.iter().map(|s| s.after.x - s.before.x).collect();
    let coefficients = least_squares(&rows, dx.clone())?;
    let predicted = rows
        .into_iter()
        .map(|row| DVector::from_vec(row).dot(&coefficients));
    let (r2, error) = judged(dx.into_iter().zip(predicted));
    Some([r2, error])
}

fn least_squares(rows: &[Vec<f64>], targets: Vec<f64>) -> Option<DVector<f64>> {
    let width = rows.first()?.len();
    let design = DMatrix::from_row_iterator(rows.len(), width, rows.iter().flatten().copied());
    design
        .svd(true, true)
        .solve(&DVector::from_vec(targets), 1e-10)
        .ok()
}

/// R² and root mean square error of (observed, predicted).
fn judged(pairs: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let pairs: Vec<(f64, f64)> = pairs.collect();
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|p| p.0).sum::<f64>() / n;
    let spread: f64 = pairs.iter().map(|p| (p.0 - mean).powi(2)).sum();
    let error: f64 = pairs.iter().map(|p| (p.0 - p.1).powi(2)).sum();
    (1.0 - error / spread, (error / n).sqrt())
}
