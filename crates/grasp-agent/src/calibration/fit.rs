//! Least squares for a calibration, with the covariance of its result.

use hough_heuristic::Features;
use nalgebra::{DMatrix, DVector, Vector3};
use puma_val2::{Joint, Joints};

use crate::calibration::cell::{Estimated, at};

/// A pose that the arm reported, and the ball as it was seen from there.
pub(crate) type Look = (Joints, Features);

/// Expected corrections of a nominal cell, as standard deviations: radians, metres, logarithm of
/// the focal length, feature units, first radial term, logarithm of the radius, metres, radians.
fn expected(i: usize) -> f64 {
    match i {
        _ if i < at::SHIFT => 0.2,
        _ if i < at::FOCAL => 0.03,
        at::FOCAL => 0.3,
        _ if i < at::DISTORTION => 6.0,
        at::DISTORTION | at::RADIUS => 0.2,
        _ if i < at::ZEROS => 1.0,
        _ => 0.05,
    }
}

/// Least squares of the looks, with or without the expectation of a nominal cell.
pub(crate) struct Fit<'a> {
    pub(crate) looks: &'a [Look],
    pub(crate) zeros: &'a [Joint],
    /// Standard deviation of x and y, and of r, feature units.
    pub(crate) noise: [f64; 2],
    pub(crate) nominal: Option<Estimated>,
}

impl Fit<'_> {
    /// Finds the best cell from `start` by Levenberg–Marquardt iteration, and returns it with its
    /// information matrix; `None` if the numbers leave the range of what can be computed.
    pub(crate) fn solve(&self, start: Estimated) -> Option<(Estimated, DMatrix<f64>)> {
        let (mut cell, mut damping) = (start, 1e-3);
        let (mut least, mut normal) = (self.cost(&cell), self.normal(&cell));
        for _ in 0..80 {
            let (information, gradient) = &normal;
            let mut damped = information.clone();
            for i in 0..damped.nrows() {
                damped[(i, i)] += damping * damped[(i, i)] + 1e-12;
            }
            let step = damped.cholesky().map(|c| -c.solve(gradient));
            let next = step.map(|step| cell.corrected(&step, self.zeros));
            let now = next.map_or(f64::INFINITY, |next| self.cost(&next));
            match next {
                Some(next) if now < least => {
                    let settled = least - now < 1e-9 * (1.0 + least);
                    (cell, least) = (next, now);
                    normal = self.normal(&cell);
                    damping = (damping * 0.1).max(1e-12);
                    if settled {
                        break;
                    }
                }
                _ if damping > 1e8 => break,
                _ => damping *= 10.0,
            }
        }
        let sound = normal.0.iter().all(|v| v.is_finite());
        sound.then_some((cell, normal.0))
    }

    /// Residuals of a look, in standard deviations.
    pub(crate) fn residual(&self, cell: &Estimated, (joints, seen): &Look) -> Option<Vector3<f64>> {
        let off = cell.view(joints)? - Vector3::new(seen.x, seen.y, seen.r);
        Some(off.component_div(&self.deviations()))
    }

    fn deviations(&self) -> Vector3<f64> {
        let [place, radius] = self.noise;
        Vector3::new(place, place, radius)
    }

    /// Robust cost (Huber 1964), of looks and expectation.
    fn cost(&self, cell: &Estimated) -> f64 {
        let of_look = |look| match self.residual(cell, look) {
            Some(off) => off.iter().map(|off| huber(*off)).sum(),
            None => 1e4,
        };
        let looks: f64 = self.looks.iter().map(of_look).sum();
        looks + self.expectation(cell).map_or(0.0, |(cost, _)| cost)
    }

    /// Cost and gradient of the corrections of the nominal cell.
    fn expectation(&self, cell: &Estimated) -> Option<(f64, DVector<f64>)> {
        let off = cell.correction(self.nominal.as_ref()?, self.zeros);
        let gradient = off.map_with_location(|i, _, off| off / expected(i).powi(2));
        Some((off.dot(&gradient), gradient))
    }

    /// Normal equations: information and gradient.
    fn normal(&self, cell: &Estimated) -> (DMatrix<f64>, DVector<f64>) {
        let count = at::ZEROS + self.zeros.len();
        let (mut information, mut gradient) = (DMatrix::zeros(count, count), DVector::zeros(count));
        if let Some((_, of_nominal)) = self.expectation(cell) {
            gradient += of_nominal;
            for i in 0..count {
                information[(i, i)] += expected(i).powi(-2);
            }
        }
        for (joints, seen) in self.looks {
            let Some((here, by_all)) = cell.sensitivity(joints, self.zeros) else {
                continue;
            };
            let off = here - Vector3::new(seen.x, seen.y, seen.r);
            for (i, deviation) in self.deviations().iter().enumerate() {
                let row = by_all.row(i) / *deviation;
                let off = off[i] / deviation;
                let weight = (HUBER / off.abs()).min(1.0);
                information.ger(weight, &row.transpose(), &row.transpose(), 1.0);
                gradient.axpy(weight * off, &row.transpose(), 1.0);
            }
        }
        (information, gradient)
    }

    /// Returns the standard deviations of x and y, and of r, from the residuals at `cell`, with
    /// the numbers of looks lessened by what the fit took of each (its leverage).
    pub(crate) fn noise_at(&self, cell: &Estimated, covariance: &DMatrix<f64>) -> [f64; 2] {
        let (mut squares, mut spare) = ([0.0; 2], [0.0; 2]);
        for look in self.looks {
            let both = (
                self.residual(cell, look),
                cell.sensitivity(&look.0, self.zeros),
            );
            let (Some(off), Some((_, by_all))) = both else {
                continue;
            };
            for (i, deviation) in self.deviations().iter().enumerate() {
                let row = by_all.row(i) / *deviation;
                squares[i / 2] += (off[i] * deviation).powi(2);
                spare[i / 2] += 1.0 - (&row * covariance * row.transpose())[0];
            }
        }
        // Each by itself has few looks to spare: both are drawn toward their common value.
        const COMMON: f64 = 15.0;
        let common = (squares[0] + squares[1]) / (spare[0] + spare[1]).max(1.0);
        std::array::from_fn(|i| {
            let square = (squares[i] + COMMON * common) / (spare[i].max(0.0) + COMMON);
            square.sqrt().max(1e-6)
        })
    }

    /// Returns the looks that fit the others at `cell`, by the median of the residuals: all, if
    /// more than a quarter does not.
    pub(crate) fn good(&self, cell: &Estimated) -> Vec<Look> {
        /// Median of normal residuals, with what a fit takes of them, to their deviation.
        const MEDIAN: f64 = 0.5;
        /// Distance from which a look does not fit, standard deviations.
        const FAR: f64 = 6.0;
        let off = |look| match self.residual(cell, look) {
            Some(off) => [off.x.abs().max(off.y.abs()), off.z.abs()],
            None => [f64::INFINITY; 2],
        };
        let off: Vec<[f64; 2]> = self.looks.iter().map(off).collect();
        let usual: [f64; 2] = std::array::from_fn(|i| {
            let mut sizes: Vec<f64> = off.iter().map(|off| off[i]).collect();
            sizes.sort_by(f64::total_cmp);
            sizes[sizes.len() / 2] / MEDIAN
        });
        let fits = |off: &[f64; 2]| (0..2).all(|i| off[i] <= FAR * usual[i]);
        let kept = self.looks.iter().zip(&off).filter(|(_, off)| fits(off));
        let kept: Vec<Look> = kept.map(|(look, _)| *look).collect();
        if 4 * kept.len() < 3 * self.looks.len() {
            return self.looks.to_vec();
        }
        kept
    }
}

/// Threshold of the Huber loss, standard deviations.
const HUBER: f64 = 3.0;

fn huber(off: f64) -> f64 {
    let size = off.abs();
    if size <= HUBER {
        size * size
    } else {
        HUBER * (2.0 * size - HUBER)
    }
}
