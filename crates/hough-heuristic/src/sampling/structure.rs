//! The paper's dynamic structure `D`, ordered so that pixels near one another can be drawn
//! together.

use rand::Rng;

use crate::edges::EdgePixel;

/// Side of a cell, pixels: a window of a small ball spans a few cells, one of the whole frame a few
/// dozen rows of cells.
const CELL: u32 = 16;

/// The edge pixels not yet explained, in cells of 16x16 pixels, row by row of cells.
///
/// The pixels of neighbouring cells of one row lie together, so a window of cells is one run per
/// row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Structure {
    columns: u32,
    rows: u32,
    /// Index of each cell's first entry, and at the end their number.
    starts: Vec<u32>,
    entries: Vec<Entry>,
    spare: Vec<Entry>,
}

/// A record of `D`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Entry {
    pub(crate) pixel: EdgePixel,
    /// The pixel's place in the list of the edge map.
    pub(crate) index: u32,
}

impl Structure {
    pub(crate) fn fill(&mut self, width: u32, height: u32, pixels: &[EdgePixel]) {
        self.columns = width.div_ceil(CELL);
        self.rows = height.div_ceil(CELL);
        self.spare.clear();
        self.spare.extend(
            (0..)
                .zip(pixels)
                .map(|(index, &pixel)| Entry { pixel, index }),
        );
        self.order();
    }

    /// All records that are left.
    pub(crate) fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Takes out the pixels for which `explained` is true.
    pub(crate) fn remove(&mut self, mut explained: impl FnMut(EdgePixel) -> bool) {
        self.spare.clear();
        self.spare
            .extend(self.entries.iter().filter(|entry| !explained(entry.pixel)));
        self.order();
    }

    /// Draws pixels, the paper's step 3a: the first from the whole of `D`. The others come from
    /// there too or, with a `reach`, from the pixels within about that distance of the first along
    /// each axis. Returns `false` if there are too few pixels.
    pub(crate) fn draw(
        &self,
        reach: Option<f64>,
        rng: &mut impl Rng,
        pixels: &mut [EdgePixel],
    ) -> bool {
        let count = self.entries.len() as u64;
        if self.entries.len() < pixels.len() {
            return false;
        }
        let anywhere = |rng: &mut _| self.entries[below(count, rng)].pixel;
        if let [first, others @ ..] = pixels {
            *first = anywhere(rng);
            let window = reach.map(|reach| self.window(*first, reach));
            for pixel in others {
                *pixel = match &window {
                    Some(window) => self.pick(window, rng),
                    None => anywhere(rng),
                };
            }
        }
        true
    }

    fn window(&self, around: EdgePixel, reach: f64) -> Window {
        let reach = reach as u32;
        let left = around.x.saturating_sub(reach) / CELL;
        let right = (around.x.saturating_add(reach) / CELL).min(self.columns - 1);
        let top = around.y.saturating_sub(reach) / CELL;
        let bottom = (around.y.saturating_add(reach) / CELL).min(self.rows - 1);
        let mut window = Window {
            left,
            right,
            top,
            bottom,
            count: 0,
        };
        window.count = (top..=bottom).map(|row| self.run(&window, row).1).sum();
        window
    }

    /// First index and number of the pixels in a row of the window.
    fn run(&self, window: &Window, row: u32) -> (u32, u32) {
        let start = self.starts[(row * self.columns + window.left) as usize];
        let end = self.starts[(row * self.columns + window.right + 1) as usize];
        (start, end - start)
    }

    /// Draws a pixel of a window that holds one.
    fn pick(&self, window: &Window, rng: &mut impl Rng) -> EdgePixel {
        let mut number = below(window.count.into(), rng) as u32;
        for row in window.top..window.bottom {
            let (start, length) = self.run(window, row);
            if number < length {
                return self.entries[(start + number) as usize].pixel;
            }
            number -= length;
        }
        self.entries[(self.run(window, window.bottom).0 + number) as usize].pixel
    }

    /// The memory it holds, bytes.
    pub(crate) fn memory(&self) -> usize {
        size_of::<u32>() * self.starts.capacity()
            + size_of::<Entry>() * (self.entries.capacity() + self.spare.capacity())
    }

    /// Sorts `spare` into the cells by counting.
    fn order(&mut self) {
        let cells = self.columns as usize * self.rows as usize;
        self.starts.clear();
        self.starts.resize(cells + 2, 0);
        let cell =
            |entry: &Entry| ((entry.pixel.y / CELL) * self.columns + entry.pixel.x / CELL) as usize;
        for entry in &self.spare {
            self.starts[cell(entry) + 2] += 1;
        }
        for index in 2..self.starts.len() {
            self.starts[index] += self.starts[index - 1];
        }
        // `starts[c + 1]` is now where cell c begins; filling moves it to where the cell ends.
        self.entries.clear();
        self.entries.resize(self.spare.len(), Entry::default());
        for entry in &self.spare {
            let place = &mut self.starts[cell(entry) + 1];
            self.entries[*place as usize] = *entry;
            *place += 1;
        }
    }
}

/// A rectangle of cells, borders included, and how many pixels it holds.
struct Window {
    left: u32,
    right: u32,
    top: u32,
    bottom: u32,
    count: u32,
}

/// Draws a whole number from `0..count`, where `count` is at most 2^32.
fn below(count: u64, rng: &mut impl Rng) -> usize {
    ((u64::from(rng.next_u32()) * count) >> 32) as usize
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
    fn every_pixel_can_be_drawn_and_near_ones_are_near() {
        let pixels: Vec<_> = (0..40).map(|i| at(7 * i % 100, 11 * i % 60)).collect();
        let mut structure = Structure::default();
        structure.fill(100, 60, &pixels);
        let mut sorted: Vec<_> = structure
            .entries()
            .iter()
            .map(|entry| entry.pixel)
            .collect();
        let mut expected = pixels.clone();
        sorted.sort_by_key(|p| (p.y, p.x));
        expected.sort_by_key(|p| (p.y, p.x));
        assert_eq!(sorted, expected);

        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut seen = std::collections::HashSet::new();
        for _ in 0..5000 {
            let mut drawn = [at(0, 0); 3];
            assert!(structure.draw(Some(10.0), &mut rng, &mut drawn));
            let [first, others @ ..] = drawn;
            for other in others {
                assert!(
                    first.x.abs_diff(other.x) < 10 + CELL && first.y.abs_diff(other.y) < 10 + CELL
                );
                seen.insert(other);
            }
        }
        assert_eq!(seen.len(), 40);

        structure.remove(|pixel| pixel.x < 50);
        assert!(
            structure
                .entries()
                .iter()
                .all(|entry| entry.pixel.x >= 50 && pixels[entry.index as usize] == entry.pixel)
        );
        structure.remove(|_| true);
        for reach in [None, Some(10.0)] {
            assert!(!structure.draw(reach, &mut rng, &mut [at(0, 0)]));
        }
    }
}
