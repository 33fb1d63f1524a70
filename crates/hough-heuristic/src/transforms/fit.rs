//! The least-squares circle through many points.

use crate::circle::Circle;

/// Fits a circle to the points within `band` of it, starting from `start`: least squares of the
/// distances to the curve.
///
/// Gauss and Newton's steps, each over the points that lie within the band of the circle so far.
/// With `fixed_radius` only the centre moves. None if the points do not determine a circle, or the
/// steps run away from `start`.
pub(crate) fn fit_circle(
    points: &[(f64, f64)],
    start: Circle,
    band: f64,
    fixed_radius: bool,
) -> Option<Circle> {
    let mut circle = start;
    for _ in 0..8 {
        // Normal equations of the residuals |p - c| - r; the unit vector u points from the centre
        // to the point.
        let (mut n, mut ux, mut uy, mut uxx, mut uxy, mut uyy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let (mut d, mut dx, mut dy) = (0.0, 0.0, 0.0);
        for &(px, py) in points {
            let (vx, vy) = (px - circle.x, py - circle.y);
            let distance = (vx * vx + vy * vy).sqrt();
            let residual = distance - circle.radius;
            if residual.abs() > band || distance < 1e-9 {
                continue;
            }
            let (x, y) = (vx / distance, vy / distance);
            n += 1.0;
            ux += x;
            uy += y;
            uxx += x * x;
            uxy += x * y;
            uyy += y * y;
            d += residual;
            dx += residual * x;
            dy += residual * y;
        }
        if n < 3.0 {
            return None;
        }
        if !fixed_radius {
            // Eliminate the radius: work with the moments about the mean direction.
            uxx -= ux * ux / n;
            uxy -= ux * uy / n;
            uyy -= uy * uy / n;
            dx -= ux * d / n;
            dy -= uy * d / n;
        }
        let determinant = uxx * uyy - uxy * uxy;
        if determinant < 1e-6 * n * n {
            return None;
        }
        let step_x = (dx * uyy - dy * uxy) / determinant;
        let step_y = (dy * uxx - dx * uxy) / determinant;
        circle.x += step_x;
        circle.y += step_y;
        let mut step_r = 0.0;
        if !fixed_radius {
            step_r = (d - ux * step_x - uy * step_y) / n;
            circle.radius += step_r;
        }
        let (off_x, off_y) = (circle.x - start.x, circle.y - start.y);
        let moved = (off_x * off_x + off_y * off_y).sqrt() + (circle.radius - start.radius).abs();
        let runaway = moved > 4.0 * band + 0.1 * start.radius;
        if !moved.is_finite() || runaway {
            return None;
        }
        if step_x.abs() + step_y.abs() + step_r.abs() < 1e-3 {
            break;
        }
    }
    Some(circle)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(circle: Circle, degrees: std::ops::Range<u32>) -> Vec<(f64, f64)> {
        degrees
            .map(|degree| {
                let (sin, cos) = f64::from(degree).to_radians().sin_cos();
                (
                    circle.x + circle.radius * cos,
                    circle.y + circle.radius * sin,
                )
            })
            .collect()
    }

    const TRUE: Circle = Circle {
        x: 50.3,
        y: 40.7,
        radius: 30.2,
    };

    #[test]
    fn exact_points_give_the_exact_circle_whatever_lies_apart() {
        let start = Circle {
            x: 51.0,
            y: 40.0,
            radius: 31.0,
        };
        for span in [0..360, 20..200] {
            let mut points = arc(TRUE, span);
            points.extend([(0.0, 0.0), (50.0, 41.0), (100.0, 3.0)]);
            let fit = fit_circle(&points, start, 3.0, false).unwrap();
            assert!(
                (fit.x - TRUE.x).abs() < 1e-3 && (fit.y - TRUE.y).abs() < 1e-3,
                "{fit:?}"
            );
            assert!((fit.radius - TRUE.radius).abs() < 1e-3, "{fit:?}");
        }
    }

    #[test]
    fn a_known_radius_stays() {
        let start = Circle {
            x: 51.0,
            y: 40.0,
            radius: TRUE.radius,
        };
        let fit = fit_circle(&arc(TRUE, 0..90), start, 3.0, true).unwrap();
        assert!(
            (fit.x - TRUE.x).abs() < 1e-3 && (fit.y - TRUE.y).abs() < 1e-3,
            "{fit:?}"
        );
        assert_eq!(fit.radius.to_bits(), TRUE.radius.to_bits());
    }

    #[test]
    fn too_few_points_give_none() {
        assert_eq!(
            fit_circle(&[(80.5, 40.7), (20.1, 40.7)], TRUE, 1.0, false),
            None
        );
        assert_eq!(
            fit_circle(&arc(TRUE, 10..11).repeat(9), TRUE, 1.0, false),
            None
        );
    }
}
