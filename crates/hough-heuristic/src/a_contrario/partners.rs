//! The pairs of a point: further points of its line with mirrored normals.

use super::level::Lines;
use super::polar::{LANES, Ring};

/// Smallest component of a point's unit normal along the line that the pair lies on.
pub(super) const LEAST_ALONG: f32 = 0.58;
/// Largest number of mirrored partners tried per point.
pub(super) const PARTNERS: usize = 6;

impl Lines {
    /// The circles of the point `at` and the nearest points further along its line whose normals
    /// mirror its own.
    #[inline(always)]
    pub(super) fn partners(
        &self,
        (at, line_end): (usize, usize),
        radii: (f32, f32),
        mirror_slack: f32,
        free: &[bool],
        rings: &mut [Ring; PARTNERS],
        looks: &mut u64,
    ) -> usize {
        // Inward: along the line at p, against it at q.
        let sign = 1f32.copysign(self.nx[at]);
        let (x, y, px, py) = (
            self.x[at],
            self.y[at],
            sign * self.nx[at],
            sign * self.ny[at],
        );
        let end = x + 2.0 * radii.1;
        let mut count = 0;
        let mut first = at + 1;
        // The lists end in a margin of points that mirror none.
        while first < line_end && self.x[first] <= end {
            *looks += 1;
            let block = |values: &'_ [f32]| -> [f32; LANES] {
                values[first..first + LANES].as_chunks().0[0]
            };
            let (qx, qy, nx, ny) = (
                block(&self.x),
                block(&self.y),
                block(&self.nx),
                block(&self.ny),
            );
            // By how much what is to be at most 0 is more: one comparison for all of it keeps the
            // lanes together.
            let more = |a: f32, b: f32| if a > b { a } else { b };
            let mut excess = [0.0; LANES];
            for lane in 0..LANES {
                let crossed = (px * ny[lane] + py * nx[lane]).abs();
                let dx = qx[lane] - x;
                let along = px + nx[lane].abs();
                let direction = more(crossed - mirror_slack, LEAST_ALONG - nx[lane].abs());
                let distance = more(radii.0 * along - dx, dx - radii.1 * along);
                excess[lane] = more(more(direction, distance), (qy[lane] - y).abs() - 1.0);
            }
            let fits = std::hint::black_box(excess).map(|excess| u8::from(excess <= 0.0));
            let mut bits = u64::from_le_bytes(fits);
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize / 8;
                bits &= bits - 1;
                if !free[self.id[first + lane] as usize] {
                    continue;
                }
                let sign = -(1f32.copysign(nx[lane]));
                let (along, across) = (px - sign * nx[lane], py + sign * ny[lane]);
                let length = (along * along + across * across).sqrt();
                let r = 0.5 * (qx[lane] - x) * length / along;
                rings[count] = Ring {
                    x: 0.5 * (x + qx[lane]),
                    y: 0.5 * (y + qy[lane]) + r * across / length,
                    r,
                };
                count += 1;
                if count == PARTNERS {
                    return count;
                }
            }
            first += LANES;
        }
        count
    }
}
