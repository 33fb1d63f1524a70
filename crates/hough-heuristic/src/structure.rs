//! The paper's dynamic structure `D`, ordered so that pixels near one another can be drawn together.

use rand::Rng;

use crate::{Circle, EdgePixel};

/// Side of a cell, pixels: a window of a small ball spans a few cells, one of the whole frame a few dozen rows of cells.
const CELL: u32 = 16;

/// The edge pixels not yet explained, in cells of 16x16 pixels, row by row of cells.
///
/// The pixels of neighbouring cells of one row lie together, so a window of cells is one run per row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Structure {
    columns: u32,
    rows: u32,
    /// Where each cell begins in `pixels`, and at the end their number.
    starts: Vec<u32>,
    pixels: Vec<EdgePixel>,
    spare: Vec<EdgePixel>,
}

impl Structure {
    pub(crate) fn fill(&mut self, width: u32, height: u32, pixels: &[EdgePixel]) {
        self.columns = width.div_ceil(CELL);
        self.rows = height.div_ceil(CELL);
        self.spare.clear();
        self.spare.extend_from_slice(pixels);
        self.order();
    }

    /// All pixels that are left.
    pub(crate) fn pixels(&self) -> &[EdgePixel] {
        &self.pixels
    }

    /// Takes out the pixels for which `explained` is true.
    pub(crate) fn remove(&mut self, mut explained: impl FnMut(EdgePixel) -> bool) {
        self.spare.clear();
        self.spare
            .extend(self.pixels.iter().filter(|pixel| !explained(**pixel)));
        self.order();
    }

    /// Draws three pixels, all from the whole of `D`: the paper's step 3a.
    pub(crate) fn draw_anywhere<R: Rng + ?Sized>(&self, rng: &mut R) -> Option<[EdgePixel; 3]> {
        let count = self.pixels.len() as u64;
        if count < 3 {
            return None;
        }
        Some(std::array::from_fn(|_| self.pixels[below(count, rng)]))
    }

    /// Draws one pixel from the whole of `D`, and two from those within about `reach` of it along each axis.
    pub(crate) fn draw_near<R: Rng + ?Sized>(&self, reach: f64, rng: &mut R) -> Option<[EdgePixel; 3]> {
        let count = self.pixels.len() as u64;
        if count < 3 {
            return None;
        }
        let first = self.pixels[below(count, rng)];
        let reach = reach as u32;
        let left = first.x.saturating_sub(reach) / CELL;
        let right = (first.x.saturating_add(reach) / CELL).min(self.columns - 1);
        let top = first.y.saturating_sub(reach) / CELL;
        let bottom = (first.y.saturating_add(reach) / CELL).min(self.rows - 1);
        let run = |row: u32| {
            let start = self.starts[(row * self.columns + left) as usize];
            (
                start,
                self.starts[(row * self.columns + right + 1) as usize] - start,
            )
        };
        let inside: u32 = (top..=bottom).map(|row| run(row).1).sum();
        let pick = |mut number: u32| {
            for row in top..=bottom {
                let (start, length) = run(row);
                if number < length {
                    return self.pixels[(start + number) as usize];
                }
                number -= length;
            }
            first
        };
        let second = pick(below(inside.into(), rng) as u32);
        let third = pick(below(inside.into(), rng) as u32);
        Some([first, second, third])
    }

    /// Sorts `spare` into the cells by counting.
    fn order(&mut self) {
        let cells = self.columns as usize * self.rows as usize;
        self.starts.clear();
        self.starts.resize(cells + 2, 0);
        let cell = |pixel: EdgePixel| ((pixel.y / CELL) * self.columns + pixel.x / CELL) as usize;
        for &pixel in &self.spare {
            self.starts[cell(pixel) + 2] += 1;
        }
        for index in 2..self.starts.len() {
            self.starts[index] += self.starts[index - 1];
        }
        // `starts[c + 1]` is now where cell c begins; filling moves it to where the cell ends.
        self.pixels.clear();
        self.pixels.resize(self.spare.len(), EdgePixel { x: 0, y: 0 });
        for &pixel in &self.spare {
            let place = &mut self.starts[cell(pixel) + 1];
            self.pixels[*place as usize] = pixel;
            *place += 1;
        }
    }
}

/// A whole number in `0..count`, for a `count` of at most 2^32.
fn below<R: Rng + ?Sized>(count: u64, rng: &mut R) -> usize {
    ((u64::from(rng.next_u32()) * count) >> 32) as usize
}

/// The circle through three pixels; none if two of them are nearer than 3 px or the three lie in a line.
pub(crate) fn circle_through(pixels: [EdgePixel; 3]) -> Option<Circle> {
    let [a, b, c] = pixels.map(|pixel| (i64::from(pixel.x), i64::from(pixel.y)));
    let (bx, by) = (b.0 - a.0, b.1 - a.1);
    let (cx, cy) = (c.0 - a.0, c.1 - a.1);
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    let (dx, dy) = (cx - bx, cy - by);
    let cross = bx * cy - by * cx;
    if b2 < 9 || c2 < 9 || dx * dx + dy * dy < 9 || cross == 0 {
        return None;
    }
    let scale = 0.5 / cross as f64;
    let x = (b2 * cy - c2 * by) as f64 * scale;
    let y = (c2 * bx - b2 * cx) as f64 * scale;
    Some(Circle {
        x: a.0 as f64 + x,
        y: a.1 as f64 + y,
        // Not `hypot`, whose last bit depends on the platform.
        radius: (x * x + y * y).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    fn at(x: u32, y: u32) -> EdgePixel {
        EdgePixel { x, y }
    }

    #[test]
    fn three_pixels_give_their_circle() {
        let circle = circle_through([at(30, 20), at(20, 30), at(10, 20)]).unwrap();
        assert!((circle.x - 20.0).abs() < 1e-9 && (circle.y - 20.0).abs() < 1e-9);
        assert!((circle.radius - 10.0).abs() < 1e-9);
    }

    #[test]
    fn degenerate_triples_give_none() {
        assert_eq!(circle_through([at(1, 1), at(5, 5), at(9, 9)]), None);
        assert_eq!(circle_through([at(1, 1), at(1, 1), at(9, 3)]), None);
        assert_eq!(circle_through([at(1, 1), at(3, 1), at(9, 3)]), None);
    }

    #[test]
    fn every_pixel_can_be_drawn_and_near_ones_are_near() {
        let pixels: Vec<_> = (0..40).map(|i| at(7 * i % 100, 11 * i % 60)).collect();
        let mut structure = Structure::default();
        structure.fill(100, 60, &pixels);
        let mut sorted = structure.pixels().to_vec();
        let mut expected = pixels.clone();
        sorted.sort_by_key(|p| (p.y, p.x));
        expected.sort_by_key(|p| (p.y, p.x));
        assert_eq!(sorted, expected);

        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut seen = std::collections::HashSet::new();
        for _ in 0..5000 {
            let [first, second, third] = structure.draw_near(10.0, &mut rng).unwrap();
            for other in [second, third] {
                assert!(first.x.abs_diff(other.x) < 10 + CELL && first.y.abs_diff(other.y) < 10 + CELL);
                seen.insert(other);
            }
        }
        assert_eq!(seen.len(), 40);

        structure.remove(|pixel| pixel.x < 50);
        assert!(structure.pixels().iter().all(|pixel| pixel.x >= 50));
        structure.remove(|_| true);
        assert_eq!(structure.draw_near(10.0, &mut rng), None);
        assert_eq!(structure.draw_anywhere(&mut rng), None);
    }
}
