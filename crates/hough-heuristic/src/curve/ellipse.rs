use super::{Curve, crowded, round};
use crate::edges::EdgePixel;

/// An ellipse.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ellipse {
    /// Centre, pixels from the centre of the leftmost column.
    pub x: f64,
    /// Centre, pixels from the centre of the top row.
    pub y: f64,
    /// The longer half-axis, pixels.
    pub major: f64,
    /// The shorter half-axis, pixels.
    pub minor: f64,
    /// Direction of the longer half-axis, radians from the x axis toward the y axis, in -π/2..=π/2.
    pub angle: f64,
}

impl Ellipse {
    /// `A dx^2 + B dx dy + C dy^2 = 1` with the centre at the origin.
    fn quadratic(&self) -> (f64, f64, f64) {
        let (sin, cos) = self.angle.sin_cos();
        let (u, v) = (
            1.0 / (self.major * self.major),
            1.0 / (self.minor * self.minor),
        );
        (
            cos * cos * u + sin * sin * v,
            2.0 * cos * sin * (u - v),
            sin * sin * u + cos * cos * v,
        )
    }

    /// The ellipse `a x^2 + b x y + c y^2 + d x + e y + 1 = 0` in coordinates relative to a place
    /// and in units of `spread`; none if the conic is another one, or a half-axis is below one
    /// pixel.
    pub(crate) fn of_conic(
        [a, b, c, d, e]: [f64; 5],
        (mx, my): (f64, f64),
        spread: f64,
    ) -> Option<Self> {
        let discriminant = 4.0 * a * c - b * b;
        if discriminant <= 1e-9 * (a * a + b * b + c * c) {
            return None;
        }
        let (x, y) = (
            (b * e - 2.0 * c * d) / discriminant,
            (b * d - 2.0 * a * e) / discriminant,
        );
        let scale = -(0.5 * (d * x + e * y) + 1.0);
        let (trace, root) = (a + c, ((a - c) * (a - c) + b * b).sqrt());
        // The form's eigenvalues over `scale` are the inverse squares of the half-axes.
        let half_axis = |eigenvalue: f64| {
            let square = scale / eigenvalue;
            (square.is_finite() && square > 0.0).then(|| spread * square.sqrt())
        };
        let (one, two) = (
            half_axis(0.5 * (trace - root))?,
            half_axis(0.5 * (trace + root))?,
        );
        // The axis of the smaller eigenvalue in the sense of `scale` is the longer one.
        let along_one = 0.5 * (-b).atan2(c - a);
        let (major, minor, angle) = if one >= two {
            (one, two, along_one)
        } else if along_one > 0.0 {
            (two, one, along_one - std::f64::consts::FRAC_PI_2)
        } else {
            (two, one, along_one + std::f64::consts::FRAC_PI_2)
        };
        let ellipse = Self {
            x: mx + spread * x,
            y: my + spread * y,
            major,
            minor,
            angle,
        };
        (minor >= 1.0 && ellipse.x.is_finite() && ellipse.y.is_finite() && major < 1e6)
            .then_some(ellipse)
    }
}

impl Curve for Ellipse {
    const PARAMETERS: usize = 5;

    /// The ellipse through five pixels; none if two are nearer than 3 px, or the conic through them
    /// is another one, or a half-axis is below one pixel.
    fn through(pixels: &[EdgePixel]) -> Option<Self> {
        if pixels.len() != Self::PARAMETERS || crowded(pixels) {
            return None;
        }
        // Relative to the mean and in units of the spread, for numbers of one size.
        let mean = |of: fn(&EdgePixel) -> u32| {
            pixels.iter().map(|pixel| f64::from(of(pixel))).sum::<f64>() / 5.0
        };
        let (mx, my) = (mean(|pixel| pixel.x), mean(|pixel| pixel.y));
        let points: [(f64, f64); 5] =
            std::array::from_fn(|k| (f64::from(pixels[k].x) - mx, f64::from(pixels[k].y) - my));
        let spread = points
            .iter()
            .fold(0.0f64, |most, (x, y)| most.max(x.abs()).max(y.abs()));
        let rows = points.map(|(x, y)| {
            let (x, y) = (x / spread, y / spread);
            [x * x, x * y, y * y, x, y, -1.0]
        });
        Self::of_conic(solve(rows)?, (mx, my), spread)
    }

    /// Visits the nearest pixel of each column where the curve is nearer to the horizontal, and
    /// that of each row elsewhere.
    fn outline(&self, _width: u32, _height: u32, mut visit: impl FnMut(i32, i32) -> bool) -> bool {
        let (a, b, c) = self.quadratic();
        // Along a column at dx the curve has dy = (-b dx ± root) / 2c, and the slope there tells
        // whose turn it is.
        let flat_at =
            |dx: f64, dy: f64| (2.0 * a * dx + b * dy).abs() <= (b * dx + 2.0 * c * dy).abs();
        let crossings = |offset: f64, along: f64, across: f64| {
            let under = (b * offset).powi(2) - 4.0 * along * (across * offset * offset - 1.0);
            (under >= 0.0).then(|| {
                let root = under.sqrt();
                [
                    (-b * offset - root) / (2.0 * along),
                    (-b * offset + root) / (2.0 * along),
                ]
            })
        };
        let column = |x: i32| {
            let dx = f64::from(x) - self.x;
            crossings(dx, c, a)
                .map(|both| both.map(|dy| flat_at(dx, dy).then(|| round(self.y + dy))))
        };
        let determinant = 4.0 * a * c - b * b;
        let (reach_x, reach_y) = (
            (4.0 * c / determinant).sqrt(),
            (4.0 * a / determinant).sqrt(),
        );
        for x in (self.x - reach_x).ceil() as i32..=(self.x + reach_x).floor() as i32 {
            let [above, below] = column(x).unwrap_or_default();
            for y in above.into_iter().chain(below.filter(|_| above != below)) {
                if !visit(x, y) {
                    return false;
                }
            }
        }
        let seen = |x: i32, y: i32| column(x).is_some_and(|both| both.contains(&Some(y)));
        for y in (self.y - reach_y).ceil() as i32..=(self.y + reach_y).floor() as i32 {
            let dy = f64::from(y) - self.y;
            let [left, right] = crossings(dy, a, c)
                .map(|both| both.map(|dx| (!flat_at(dx, dy)).then(|| round(self.x + dx))))
                .unwrap_or_default();
            for x in left.into_iter().chain(right.filter(|_| left != right)) {
                if !seen(x, y) && !visit(x, y) {
                    return false;
                }
            }
        }
        true
    }

    /// To first order: the value of the equation over its slope.
    fn distance(&self, x: f64, y: f64) -> f64 {
        let (a, b, c) = self.quadratic();
        let (dx, dy) = (x - self.x, y - self.y);
        // The square root of the form grows evenly along every ray from the centre.
        let level = (a * dx * dx + b * dx * dy + c * dy * dy).max(0.0).sqrt();
        let (gx, gy) = (2.0 * a * dx + b * dy, b * dx + 2.0 * c * dy);
        let slope = (gx * gx + gy * gy).sqrt() / (2.0 * level);
        if slope.is_finite() && slope > 0.0 {
            (level - 1.0).abs() / slope
        } else {
            self.minor
        }
    }
}

/// Solves five linear equations, each given as coefficients and right-hand side; none if they are
/// (nearly) dependent.
pub(crate) fn solve(mut rows: [[f64; 6]; 5]) -> Option<[f64; 5]> {
    for column in 0..5 {
        let pivot =
            (column..5).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
        rows.swap(column, pivot);
        if rows[column][column].abs() < 1e-9 {
            return None;
        }
        let lead = rows[column];
        for (index, row) in rows.iter_mut().enumerate() {
            if index != column {
                let factor = row[column] / lead[column];
                for (value, from) in row.iter_mut().zip(lead) {
                    *value -= factor * from;
                }
            }
        }
    }
    Some(std::array::from_fn(|k| rows[k][5] / rows[k][k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    const TRUE: Ellipse = Ellipse {
        x: 120.0,
        y: 90.0,
        major: 60.0,
        minor: 35.0,
        angle: 0.6,
    };

    fn outline(ellipse: &Ellipse) -> Vec<(i32, i32)> {
        let mut pixels = Vec::new();
        ellipse.outline(0, 0, |x, y| {
            pixels.push((x, y));
            true
        });
        pixels
    }

    #[test]
    fn five_pixels_give_their_ellipse() {
        for angle in [-1.4, -0.7, 0.0, 0.6, 1.3] {
            let ellipse = Ellipse { angle, ..TRUE };
            let pixels = outline(&ellipse);
            let five: Vec<EdgePixel> = (0..5)
                .map(|k| pixels[(k * pixels.len() / 5 + 3) % pixels.len()])
                .map(|(x, y)| EdgePixel {
                    x: x as u32,
                    y: y as u32,
                })
                .collect();
            let found = Ellipse::through(&five).unwrap();
            assert!(
                (found.x - ellipse.x).abs() < 2.0 && (found.y - ellipse.y).abs() < 2.0,
                "{found:?}"
            );
            assert!(
                (found.major - 60.0).abs() < 3.0 && (found.minor - 35.0).abs() < 3.0,
                "{found:?}"
            );
            assert!((found.angle - angle).sin().abs() < 0.1, "{found:?}");
            for pixel in five {
                assert!(found.distance(pixel.x.into(), pixel.y.into()) < 1e-6);
            }
        }
    }

    #[test]
    fn other_conics_and_lines_give_none() {
        let at = |points: [(u32, u32); 5]| points.map(|(x, y)| EdgePixel { x, y });
        assert_eq!(
            Ellipse::through(&at([(0, 0), (10, 10), (20, 20), (30, 30), (5, 30)])),
            None
        );
        // y = x^2 / 10, and a hyperbola.
        assert_eq!(
            Ellipse::through(&at([(0, 0), (10, 10), (20, 40), (30, 90), (40, 160)])),
            None
        );
        assert_eq!(
            Ellipse::through(&at([(1, 120), (2, 60), (4, 30), (40, 3), (120, 1)])),
            None
        );
    }

    #[test]
    fn the_outline_is_thin_and_without_repeats() {
        for step in 0..60 {
            let ellipse = Ellipse {
                x: 0.31 * f64::from(step),
                angle: 0.05 * f64::from(step) - 1.5,
                minor: 3.0 + f64::from(step),
                major: 63.0,
                ..TRUE
            };
            let pixels = outline(&ellipse);
            let set: HashSet<_> = pixels.iter().copied().collect();
            assert_eq!(set.len(), pixels.len(), "{ellipse:?}");
            assert!(
                pixels.len() as f64 > 4.0 * (ellipse.major + ellipse.minor) * 0.6,
                "{ellipse:?}"
            );
            for &(x, y) in &pixels {
                assert!(
                    ellipse.distance(x.into(), y.into()) <= 0.8,
                    "{ellipse:?} {x} {y}"
                );
            }
        }
    }
}
