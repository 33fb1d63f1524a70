//! Canny's passes as plainly as they can be written: whole planes, one pixel at a time. What the
//! fused rows must equal.

use super::rows::{Passes, STRONG, WEAK};

/// A candidate, with all that is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Maximum {
    /// Place in the frame, row by row.
    pub(super) index: usize,
    pub(super) mark: u8,
    /// The gradient in gray levels.
    pub(super) vector: (f64, f64),
    /// Its length.
    pub(super) strength: f64,
    /// From the pixel's centre to the steepest point, pixels.
    pub(super) offset: (f64, f64),
}

/// The candidates of a frame of at least 3x3 pixels, row by row.
pub(super) fn maxima(passes: &Passes, gray: &[u8], width: usize) -> Vec<Maximum> {
    let (w, h) = (width as isize, (gray.len() / width) as isize);
    let at = |x: isize, y: isize| (y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize;
    let plane = |value: &dyn Fn(isize, isize) -> i32| -> Vec<i32> {
        (0..h)
            .flat_map(|y| (0..w).map(move |x| (x, y)))
            .map(|(x, y)| value(x, y))
            .collect()
    };
    let reach = passes.weights.len() as isize - 1;
    let weight = |k: isize| i32::from(passes.weights[k.unsigned_abs()]);

    let down = plane(&|x, y| {
        let sum: i32 = (-reach..=reach)
            .map(|k| weight(k) * i32::from(gray[at(x, y + k)]))
            .sum();
        (sum + 8) >> 4
    });
    let smooth = plane(&|x, y| {
        let sum: i32 = (-reach..=reach)
            .map(|k| weight(k) * down[at(x + k, y)])
            .sum();
        (sum + 8) >> 4
    });
    let s = |x, y| smooth[at(x, y)];
    let gx = plane(&|x, y| {
        s(x + 1, y - 1) + 2 * s(x + 1, y) + s(x + 1, y + 1)
            - s(x - 1, y - 1)
            - 2 * s(x - 1, y)
            - s(x - 1, y + 1)
    });
    let gy = plane(&|x, y| {
        s(x - 1, y + 1) + 2 * s(x, y + 1) + s(x + 1, y + 1)
            - s(x - 1, y - 1)
            - 2 * s(x, y - 1)
            - s(x + 1, y - 1)
    });
    let square = plane(&|x, y| gx[at(x, y)].pow(2) + gy[at(x, y)].pow(2));

    let inner = (1..h - 1).flat_map(|y| (1..w - 1).map(move |x| (x, y)));
    inner
        .filter_map(|(x, y)| {
            let index = at(x, y);
            let (dx, dy) = (f64::from(gx[index]), f64::from(gy[index]));
            // The tangent of 22.5 degrees as the passes have it.
            let tangent = 13573.0 / 32768.0;
            let (step_x, step_y) = if dy.abs() < dx.abs() * tangent {
                (1, 0)
            } else if dx.abs() < dy.abs() * tangent {
                (0, 1)
            } else if (dx < 0.0) == (dy < 0.0) {
                (1, 1)
            } else {
                (-1, 1)
            };
            let here = square[index];
            let (before, behind) = (
                square[at(x - step_x, y - step_y)],
                square[at(x + step_x, y + step_y)],
            );
            if here <= passes.low || here <= before || here < behind {
                return None;
            }
            let [a, b, c] = [before, here, behind].map(|square| f64::from(square).sqrt());
            // The top of the parabola through the three lengths at -1, 0 and 1.
            let (slope, curvature) = ((c - a) / 2.0, a + c - 2.0 * b);
            let top = if curvature < 0.0 {
                (-slope / curvature).clamp(-0.5, 0.5)
            } else {
                0.0
            };
            Some(Maximum {
                index,
                mark: if here > passes.high { STRONG } else { WEAK },
                vector: (dx / 16.0, dy / 16.0),
                strength: dx.hypot(dy) / 16.0,
                offset: (top * step_x as f64, top * step_y as f64),
            })
        })
        .collect()
}
