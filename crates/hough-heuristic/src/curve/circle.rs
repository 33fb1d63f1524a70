use super::{Curve, crowded, round};
use crate::circle::Circle;
use crate::edges::EdgePixel;

impl Curve for Circle {
    const PARAMETERS: usize = 3;

    /// Returns the circle through three pixels, or `None` if two of them are nearer than 3 px or
    /// the three lie in a line.
    fn through(pixels: &[EdgePixel]) -> Option<Self> {
        let &[a, b, c] = pixels else {
            return None;
        };
        // Whole numbers as floats: exact in frames of up to 2^16 pixels a side, and no overflow in
        // larger ones.
        let from_a = |pixel: EdgePixel| {
            (
                f64::from(pixel.x) - f64::from(a.x),
                f64::from(pixel.y) - f64::from(a.y),
            )
        };
        let ((bx, by), (cx, cy)) = (from_a(b), from_a(c));
        let cross = bx * cy - by * cx;
        if cross == 0.0 || crowded(pixels) {
            return None;
        }
        let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
        let scale = 0.5 / cross;
        let x = (b2 * cy - c2 * by) * scale;
        let y = (c2 * bx - b2 * cx) * scale;
        Some(Circle {
            x: f64::from(a.x) + x,
            y: f64::from(a.y) + y,
            // Not `hypot`, whose last bit depends on the platform.
            radius: (x * x + y * y).sqrt(),
        })
    }

    /// The rule is that of the midpoint circle, for a centre and radius that need not be whole
    /// numbers: in the two arcs above and below the centre, out to 45 degrees, the pixel of each
    /// column that lies nearest to the curve; in the arcs left and right of it the nearest pixel of
    /// each row. The pixels form a closed line of about 5.7 pixels per pixel of radius.
    fn outline(&self, _width: u32, _height: u32, mut visit: impl FnMut(i32, i32) -> bool) -> bool {
        let &Circle {
            x: cx,
            y: cy,
            radius,
        } = self;
        // Half a pixel beyond 45 degrees, so that the arcs meet.
        let diagonal = radius * std::f64::consts::FRAC_1_SQRT_2 + 0.5;
        // Half the chord of the column or row at this distance from the centre.
        let half_chord = |distance: f64| (radius * radius - distance * distance).max(0.0).sqrt();
        let (first, last) = (
            (cx - diagonal).ceil() as i32,
            (cx + diagonal).floor() as i32,
        );
        let column = |x: i32| {
            let rise = half_chord(f64::from(x) - cx);
            (round(cy - rise), round(cy + rise))
        };
        for x in first..=last {
            let (above, below) = column(x);
            if !visit(x, above) || (below != above && !visit(x, below)) {
                return false;
            }
        }
        // Where the arcs meet, a column may already have the pixel of the row.
        let seen =
            |x: i32, y: i32| (first..=last).contains(&x) && (column(x).0 == y || column(x).1 == y);
        for y in (cy - diagonal).ceil() as i32..=(cy + diagonal).floor() as i32 {
            let run = half_chord(f64::from(y) - cy);
            let (left, right) = (round(cx - run), round(cx + run));
            if !seen(left, y) && !visit(left, y)
                || left != right && !seen(right, y) && !visit(right, y)
            {
                return false;
            }
        }
        true
    }

    fn distance(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.x, y - self.y);
        ((dx * dx + dy * dy).sqrt() - self.radius).abs()
    }
}

/// The most pixels that the outline of a circle of this radius can have.
pub(crate) fn longest_outline(radius: f64) -> f64 {
    4.0 * std::f64::consts::SQRT_2 * radius + 8.0
}

/// The two circles of a known radius through two pixels; none if the pixels are nearer than 3 px or
/// too far apart.
pub(crate) fn circles_of_radius(pixels: [EdgePixel; 2], radius: f64) -> Option<[Circle; 2]> {
    let [a, b] = pixels.map(|pixel| (f64::from(pixel.x), f64::from(pixel.y)));
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let chord = dx * dx + dy * dy;
    // From the middle of the chord to the centre, in chords.
    let square = radius * radius / chord - 0.25;
    if crowded(&pixels) || square < 0.0 {
        return None;
    }
    let aside = square.sqrt();
    let centre = |side: f64| Circle {
        x: 0.5 * (a.0 + b.0) - side * aside * dy,
        y: 0.5 * (a.1 + b.1) + side * aside * dx,
        radius,
    };
    Some([centre(1.0), centre(-1.0)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn at(x: u32, y: u32) -> EdgePixel {
        EdgePixel { x, y }
    }

    #[test]
    fn three_pixels_give_their_circle() {
        let circle = Circle::through(&[at(30, 20), at(20, 30), at(10, 20)]).unwrap();
        assert!((circle.x - 20.0).abs() < 1e-9 && (circle.y - 20.0).abs() < 1e-9);
        assert!((circle.radius - 10.0).abs() < 1e-9);
    }

    #[test]
    fn degenerate_triples_give_none() {
        for triple in [
            [at(1, 1), at(5, 5), at(9, 9)],
            [at(1, 1), at(1, 1), at(9, 3)],
            [at(1, 1), at(3, 1), at(9, 3)],
        ] {
            assert_eq!(Circle::through(&triple), None);
        }
        assert_eq!(Circle::through(&[at(1, 1), at(9, 3)]), None);
    }

    #[test]
    fn two_pixels_and_the_radius_give_two_circles() {
        let (a, b) = (at(10, 20), at(40, 7));
        for circle in circles_of_radius([a, b], 25.5).unwrap() {
            assert!(circle.distance(10.0, 20.0) < 1e-9 && circle.distance(40.0, 7.0) < 1e-9);
        }
        assert_eq!(circles_of_radius([a, b], 10.0), None);
        assert_eq!(circles_of_radius([a, at(11, 20)], 10.0), None);
    }

    #[test]
    fn pixels_however_far_apart_give_a_finite_circle_or_none() {
        // The longest frames that there can be, and so flat that every circle through three of
        // their pixels is huge.
        let far = [at(0, 0), at(u32::MAX, 2), at(u32::MAX / 3, 1)];
        let circle = Circle::through(&far).unwrap();
        assert!(circle.x.is_finite() && circle.y.is_finite() && circle.radius.is_finite());
        let corners = Circle::through(&[at(0, 0), at(u32::MAX, 0), at(0, u32::MAX)]).unwrap();
        let half = f64::from(u32::MAX) / 2.0;
        assert!((corners.x - half).abs() < 1.0 && (corners.y - half).abs() < 1.0);
        assert_eq!(
            Circle::through(&[at(0, 0), at(u32::MAX, u32::MAX), at(7, 7)]),
            None
        );
    }

    #[test]
    fn the_outline_is_thin_closed_and_without_repeats() {
        for step in 0..400 {
            let circle = Circle {
                x: 0.37 * f64::from(step % 17),
                y: -0.29 * f64::from(step % 13),
                radius: 1.0 + 0.37 * f64::from(step),
            };
            let mut pixels = Vec::new();
            circle.outline(0, 0, |x, y| {
                pixels.push((x, y));
                true
            });
            let set: HashSet<_> = pixels.iter().copied().collect();
            assert_eq!(set.len(), pixels.len(), "{circle:?}");
            assert!(
                pixels.len() as f64 <= longest_outline(circle.radius),
                "{circle:?}"
            );
            for &(x, y) in &pixels {
                assert!(
                    circle.distance(x.into(), y.into()) <= 0.5 + 1e-9,
                    "{circle:?} {x} {y}"
                );
                let neighbours = (-1..=1)
                    .flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)))
                    .filter(|&(dx, dy)| (dx, dy) != (0, 0) && set.contains(&(x + dx, y + dy)))
                    .count();
                assert!(neighbours >= 2, "{circle:?} breaks at {x} {y}");
            }
        }
    }
}
