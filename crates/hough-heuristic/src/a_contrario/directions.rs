//! Directions as small whole numbers, and points on the unit circle, without sines: the same bits
//! on every machine.

use super::polar::whole;

/// Codes of the direction of a line, 0..180 degrees: one stands for 2.8 degrees.
pub(super) const CODES: u8 = 64;
/// Points of the table of the unit circle.
pub(super) const TURN: usize = 1024;

/// The unit circle at [`TURN`] even steps, beginning at +x and turning to +y.
#[derive(Clone, Debug)]
pub(super) struct UnitCircle {
    points: Vec<(f32, f32)>,
    /// Their codes.
    codes: Vec<u8>,
    /// The points in lists of x and of y, for 64, 128 and 256 steps.
    rays: [(Vec<f32>, Vec<f32>); 3],
}

/// Evenly spaced unit vectors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rays<'a> {
    pub(super) x: &'a [f32],
    pub(super) y: &'a [f32],
}

impl UnitCircle {
    pub(super) fn new() -> Self {
        let mut points = vec![(0.0, 0.0); TURN];
        points[0] = (1.0, 0.0);
        points[TURN / 4] = (0.0, 1.0);
        // Halve every angle between two known points of the first quarter: square roots and
        // quotients only.
        let mut step = TURN / 4;
        while step > 1 {
            for start in (0..TURN / 4).step_by(step) {
                let ((ax, ay), (bx, by)): ((f64, f64), (f64, f64)) =
                    (points[start], points[start + step]);
                let (x, y) = (ax + bx, ay + by);
                let length = (x * x + y * y).sqrt();
                points[start + step / 2] = (x / length, y / length);
            }
            step /= 2;
        }
        for index in TURN / 4..TURN {
            let (x, y) = points[index - TURN / 4];
            points[index] = (-y, x);
        }
        let points: Vec<(f32, f32)> = points
            .into_iter()
            .map(|(x, y)| (x as f32, y as f32))
            .collect();
        let rays = [64, 128, 256].map(|count| points.iter().step_by(TURN / count).copied().unzip());
        let codes = points.iter().map(|&(x, y)| code(x, y)).collect();
        Self {
            points,
            codes,
            rays,
        }
    }

    /// About `wanted` evenly spaced directions: 64, 128 or 256.
    #[inline]
    pub(super) fn rays(&self, wanted: usize) -> Rays<'_> {
        let (x, y) = match wanted {
            0..=64 => &self.rays[0],
            65..=128 => &self.rays[1],
            _ => &self.rays[2],
        };
        Rays { x, y }
    }

    /// Point `index` of `count` evenly spaced ones.
    #[inline]
    pub(super) fn point(&self, index: usize, count: usize) -> (f32, f32) {
        self.points[(index * TURN / count) % TURN]
    }

    /// Returns a point as [`point`](Self::point) does, and its code.
    #[inline(always)]
    pub(super) fn coded_point(&self, index: usize, count: usize) -> ((f32, f32), u8) {
        let index = (index * TURN / count) % TURN;
        (self.points[index], self.codes[index])
    }
}

/// The code of the line along `(x, y)`; opposite vectors have one code.
#[inline(always)]
pub(super) fn code(x: f32, y: f32) -> u8 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = if ax < ay { (ax, ay) } else { (ay, ax) };
    let ratio = small / large.max(1e-20);
    // The arc tangent to a quarter of a degree, in codes.
    let eighth = ratio * (16.0 + 5.56 * (1.0 - ratio));
    let quarter = if ax < ay { 32.0 - eighth } else { eighth };
    let half = if (x < 0.0) == (y < 0.0) {
        quarter
    } else {
        64.0 - quarter
    };
    // The whole number below, which is the nearest one or the one below that.
    let (nearest, place) = whole(half + 0.5);
    (nearest - i32::from(place > half + 0.5)) as u8 % CODES
}

/// Difference of two codes, 0..=32.
#[cfg(test)]
fn apart(a: u8, b: u8) -> u8 {
    let difference = a.wrapping_sub(b) % CODES;
    difference.min(CODES - difference)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_unit_circle() {
        let circle = UnitCircle::new();
        for index in 0..TURN {
            let (sin, cos) = (index as f64 / TURN as f64 * std::f64::consts::TAU).sin_cos();
            let (x, y) = circle.point(index, TURN);
            assert!(
                (f64::from(x) - cos).abs() < 1e-6 && (f64::from(y) - sin).abs() < 1e-6,
                "{index}"
            );
        }
    }

    #[test]
    fn codes_are_directions() {
        let circle = UnitCircle::new();
        for index in 0..TURN {
            let (x, y) = circle.point(index, TURN);
            let expected = (index as f64 * 128.0 / TURN as f64) % 64.0;
            let off = (f64::from(code(x, y)) - expected).rem_euclid(64.0);
            assert!(off.min(64.0 - off) < 0.65, "{index}: {off}");
            assert_eq!(code(x, y), code(-x, -y));
        }
        assert_eq!((apart(0, 63), apart(3, 5), apart(0, 32)), (1, 2, 32));
    }
}
