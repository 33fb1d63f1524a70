//! Canny's passes as plainly as they can be written: whole planes, one pixel at a time. What the fused rows must equal.

use super::rows::{Passes, STRONG, WEAK};

/// The marks of every pixel of a frame of at least 3x3 pixels.
pub(super) fn marks(passes: &Passes, grey: &[u8], width: usize) -> Vec<u8> {
    let (w, h) = (width as isize, (grey.len() / width) as isize);
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
            .map(|k| weight(k) * i32::from(grey[at(x, y + k)]))
            .sum();
        (sum + 8) >> 4
    });
    let smooth = plane(&|x, y| {
        let sum: i32 = (-reach..=reach).map(|k| weight(k) * down[at(x + k, y)]).sum();
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

    plane(&|x, y| {
        if x == 0 || y == 0 || x == w - 1 || y == h - 1 {
            return 0;
        }
        let (dx, dy) = (f64::from(gx[at(x, y)]), f64::from(gy[at(x, y)]));
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
        let here = square[at(x, y)];
        let (before, behind) = (
            square[at(x - step_x, y - step_y)],
            square[at(x + step_x, y + step_y)],
        );
        if here <= passes.low || here <= before || here < behind {
            0
        } else if here > passes.high {
            STRONG.into()
        } else {
            WEAK.into()
        }
    })
    .into_iter()
    .map(|mark| mark as u8)
    .collect()
}
