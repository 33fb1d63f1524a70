use super::{Curve, crowded, round};
use crate::edges::EdgePixel;

/// A straight line without ends, in Hesse's normal form `x cos φ + y sin φ = ρ`.
///
/// Its outline is the part inside the frame, so that β is the share of the whole chord of the frame
/// that is edge.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Line {
    /// Cosine of the direction of the normal.
    pub cos: f64,
    /// Sine of the direction of the normal.
    pub sin: f64,
    /// Distance from the centre of the top-left pixel along the normal, pixels; may be negative.
    pub rho: f64,
}

impl Curve for Line {
    const PARAMETERS: usize = 2;

    /// The line through two pixels; none if they are nearer than 3 px.
    fn through(pixels: &[EdgePixel]) -> Option<Self> {
        let &[a, b] = pixels else {
            return None;
        };
        if crowded(pixels) {
            return None;
        }
        let [(ax, ay), (bx, by)] = [a, b].map(|pixel| (f64::from(pixel.x), f64::from(pixel.y)));
        let (dx, dy) = (bx - ax, by - ay);
        let length = (dx * dx + dy * dy).sqrt();
        let (cos, sin) = (dy / length, -dx / length);
        Some(Self {
            cos,
            sin,
            rho: ax * cos + ay * sin,
        })
    }

    /// One pixel per column of the frame for a line nearer to the horizontal, else one per row.
    fn outline(&self, width: u32, height: u32, mut visit: impl FnMut(i32, i32) -> bool) -> bool {
        let (w, h) = (width as i32, height as i32);
        if self.sin.abs() >= self.cos.abs() {
            (0..w).all(|x| {
                let y = round((self.rho - f64::from(x) * self.cos) / self.sin);
                !(0..h).contains(&y) || visit(x, y)
            })
        } else {
            (0..h).all(|y| {
                let x = round((self.rho - f64::from(y) * self.sin) / self.cos);
                !(0..w).contains(&x) || visit(x, y)
            })
        }
    }

    fn distance(&self, x: f64, y: f64) -> f64 {
        (x * self.cos + y * self.sin - self.rho).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_pixels_give_their_line() {
        let (a, b) = (EdgePixel { x: 3, y: 40 }, EdgePixel { x: 50, y: 11 });
        let line = Line::through(&[a, b]).unwrap();
        for pixel in [a, b] {
            assert!(line.distance(pixel.x.into(), pixel.y.into()) < 1e-9);
        }
        assert_eq!(Line::through(&[a, EdgePixel { x: 4, y: 41 }]), None);
    }

    #[test]
    fn the_outline_crosses_the_frame_once_per_column_or_row() {
        for (end, expected) in [((39, 20), 40), ((10, 29), 30)] {
            let line = Line::through(&[EdgePixel { x: 0, y: 0 }, EdgePixel { x: end.0, y: end.1 }])
                .unwrap();
            let mut pixels = Vec::new();
            line.outline(40, 30, |x, y| {
                pixels.push((x, y));
                true
            });
            assert_eq!(pixels.len(), expected);
            assert!(
                pixels
                    .iter()
                    .all(|&(x, y)| line.distance(x.into(), y.into()) <= 0.5)
            );
        }
    }
}
