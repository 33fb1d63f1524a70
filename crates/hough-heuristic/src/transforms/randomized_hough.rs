//! The randomized Hough transform, the nearer of the paper's two rivals.

use image::GrayImage;

use super::evidence::Evidence;
use super::pass::Frames;
use crate::acceptance::Acceptance;
use crate::circle::Circle;
use crate::detect::{CircleDetector, Detection, FrameRefused};
use crate::edges::{Canny, EdgeDetector};
use crate::error::{ConfigError, require, require_iterations};
use crate::sampling::{Draw, Sampler, Sampling};
use crate::stages::Stages;

/// Settings of [`RandomizedHough`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct RandomizedHoughConfig {
    /// Rules by which circles are reported.
    pub accept: Acceptance,
    /// Largest number of triples drawn per frame (default 60000; at least 1).
    pub iterations: u32,
    /// Number of triples that must agree before their circle is verified (default 2; 2..=255).
    /// Larger values cost fewer verifications and many more draws.
    pub votes: u32,
    /// Side of a cell of the parameter space, pixels, for centre and radius (default 4; 0.5..=64).
    /// Smaller cells are more exact, and triples of one circle agree more rarely.
    pub cell: f64,
    /// Source of the draws (default [`Sampling::Near`]). [`Sampling::Anywhere`] is Xu and Oja's.
    pub sampling: Sampling,
    /// Seed of the draws (default 1). They begin anew with every frame.
    pub seed: u64,
}

impl Default for RandomizedHoughConfig {
    fn default() -> Self {
        Self {
            accept: Acceptance::default(),
            iterations: 60_000,
            votes: 2,
            cell: 4.0,
            sampling: Sampling::default(),
            seed: 1,
        }
    }
}

/// The randomized Hough transform (Xu, Oja and Kultanen, 1990) for circles.
///
/// Draws three edge pixels, solves for their circle, and votes for one cell of the parameter space
/// instead of a surface of it. Only cells that got a vote exist, in a hash table. When enough
/// triples have voted for a cell, their mean circle is verified in the edge image: looked at in a
/// few places as [`Heuristic`](crate::Heuristic) does, fitted to the edge pixels around it, and
/// accepted if its β is above θ. Then its pixels are removed and the accumulator is emptied; a cell
/// that fails is emptied alone. Where the radius is known, draws are of two pixels and one of their
/// two circles, as for [`Heuristic`](crate::Heuristic).
///
/// The score of a [`Detection`] is the β of the circle as reported, counted as
/// [`Heuristic`](crate::Heuristic) counts it.
#[derive(Clone, Debug)]
pub struct RandomizedHough<E = Canny> {
    config: RandomizedHoughConfig,
    sampler: Sampler,
    cells: Cells,
    frames: Frames<E>,
}

impl<E: EdgeDetector> RandomizedHough<E> {
    /// Builds a detector on the edges of `edge_detector`, which may be a `Box<dyn EdgeDetector>`.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn new(config: RandomizedHoughConfig, edge_detector: E) -> Result<Self, ConfigError> {
        let RandomizedHoughConfig {
            accept,
            iterations,
            votes,
            cell,
            sampling,
            seed,
        } = config;
        require_iterations(iterations)?;
        require("votes", votes.into(), "2..=255", (2..=255).contains(&votes))?;
        require("cell", cell, "0.5..=64 px", (0.5..=64.0).contains(&cell))?;
        Ok(Self {
            frames: Frames::new(edge_detector, Evidence::new(accept)?),
            sampler: Sampler::new(sampling, &accept, seed),
            cells: Cells::with_capacity_for(iterations),
            config,
        })
    }

    /// Sets whether the detector remembers the candidates of each frame from now on, for
    /// [`stages`](Self::stages). By default it does not.
    pub fn keep_candidates(&mut self, keep: bool) {
        self.frames.keep_candidates(keep);
    }

    /// Returns the stages of the last frame that was searched.
    pub fn stages(&self) -> Stages<'_> {
        let cells = self.cells.slots.len() + self.cells.moved.len();
        self.frames.stages(size_of::<Cell>() * cells)
    }
}

impl<E: EdgeDetector> CircleDetector for RandomizedHough<E> {
    fn detect(&mut self, frame: &GrayImage) -> Result<&[Detection], FrameRefused> {
        let RandomizedHoughConfig {
            accept,
            iterations,
            votes,
            cell,
            ..
        } = self.config;
        accept.check_frame(frame.width(), frame.height())?;
        self.cells.clear();
        self.sampler.restart();
        // Triples scatter around their circle, so votes are taken from a cell beyond the range of
        // radii.
        let radii = accept.min_radius - cell..=accept.max_radius + cell;
        let reach = cell.max(2.0 * accept.tolerance + 1.0);
        Ok(self.frames.run(frame, |pass| {
            for _ in 0..iterations {
                let circle = match self.sampler.draw(&pass.evidence.structure) {
                    Draw::Exhausted => break,
                    Draw::Nothing => continue,
                    Draw::Circle(circle) => circle,
                };
                if !radii.contains(&circle.radius)
                    || accept.region.is_some_and(|region| !region.holds(&circle))
                {
                    continue;
                }
                let Some(mean) = self.cells.vote(&circle, cell, votes) else {
                    continue;
                };
                let mean = Circle {
                    radius: mean.radius.clamp(accept.min_radius, accept.max_radius),
                    ..mean
                };
                if pass.evidence.might_be(&mean) && pass.verify(mean, reach) {
                    self.cells.clear();
                    if pass.is_complete() {
                        break;
                    }
                }
            }
        }))
    }
}

/// A cell of the parameter space and the circles that voted for it.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    key: u64,
    /// The cells of earlier frames, and of before a circle was found, have another round.
    round: u32,
    votes: u32,
    x: f64,
    y: f64,
    radius: f64,
}

/// The sparse accumulator: a hash table with open addressing that keeps its memory from frame to
/// frame.
#[derive(Clone, Debug, Default)]
struct Cells {
    slots: Vec<Cell>,
    /// Scratch: the cells in use while the table grows.
    moved: Vec<Cell>,
    used: usize,
    round: u32,
}

/// The fewest slots of a table that is not empty.
const SMALLEST: usize = 1024;
/// The most votes that memory is set aside for beforehand.
const FORESEEN: u32 = 1 << 16;

impl Cells {
    /// A table that asks for no memory until more than this many cells have a vote (or 65536, if
    /// that is less). What is set aside is not touched, so it costs nothing, before the table grows
    /// into it.
    fn with_capacity_for(votes: u32) -> Self {
        let slots = (2 * (votes.min(FORESEEN) as usize + 1)).next_power_of_two();
        Self {
            slots: Vec::with_capacity(slots.max(SMALLEST)),
            moved: Vec::with_capacity(slots / 4),
            ..Self::default()
        }
    }

    fn clear(&mut self) {
        self.used = 0;
        self.round = self.round.wrapping_add(1);
        if self.round == 0 {
            self.slots.fill(Cell::default());
            self.round = 1;
        }
    }

    /// Counts a vote; the mean of the circles in the cell, which is then emptied, if that was the
    /// last vote it needed.
    fn vote(&mut self, circle: &Circle, side: f64, needed: u32) -> Option<Circle> {
        if 2 * (self.used + 1) > self.slots.len() {
            self.grow();
        }
        let key = key(circle, side);
        let place = self.place(key);
        let cell = &mut self.slots[place];
        if cell.round != self.round {
            *cell = Cell {
                key,
                round: self.round,
                ..Cell::default()
            };
            self.used += 1;
        }
        cell.votes += 1;
        cell.x += circle.x;
        cell.y += circle.y;
        cell.radius += circle.radius;
        if cell.votes < needed {
            return None;
        }
        let votes = f64::from(cell.votes);
        let mean = Circle {
            x: cell.x / votes,
            y: cell.y / votes,
            radius: cell.radius / votes,
        };
        *cell = Cell {
            key,
            round: self.round,
            ..Cell::default()
        };
        Some(mean)
    }

    /// Index of the cell with this key, or of the slot for it.
    fn place(&self, key: u64) -> usize {
        let mask = self.slots.len() - 1;
        let mut place = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & mask;
        while self.slots[place].round == self.round && self.slots[place].key != key {
            place = (place + 1) & mask;
        }
        place
    }

    fn grow(&mut self) {
        let round = self.round;
        self.moved.clear();
        self.moved
            .extend(self.slots.iter().filter(|cell| cell.round == round));
        let larger = (2 * self.slots.len()).max(SMALLEST);
        self.slots.clear();
        self.slots.resize(larger, Cell::default());
        for index in 0..self.moved.len() {
            let cell = self.moved[index];
            let place = self.place(cell.key);
            self.slots[place] = cell;
        }
    }
}

/// The cell of a circle, 21 bits for each parameter. Radii are bounded, and centres that overflow
/// share a cell at worst.
fn key(circle: &Circle, side: f64) -> u64 {
    let part = |value: f64| ((value / side).floor() as i64 & 0x1f_ffff) as u64;
    part(circle.x) << 42 | part(circle.y) << 21 | part(circle.radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_growing_table_keeps_its_cells_until_it_is_cleared() {
        let mut cells = Cells::default();
        cells.clear();
        let at = |k: i32| Circle {
            x: f64::from(k % 71) * 4.0 - 40.0,
            y: f64::from(k / 71) * 4.0 + 1.0,
            radius: 20.0,
        };
        for k in 0..3000 {
            assert_eq!(cells.vote(&at(k), 4.0, 2), None);
        }
        let moved = |k| Circle {
            x: at(k).x + 1.0,
            ..at(k)
        };
        for k in 0..1500 {
            let mean = cells.vote(&moved(k), 4.0, 2).unwrap();
            assert!((mean.x - at(k).x - 0.5).abs() < 1e-9);
        }
        cells.clear();
        assert_eq!(cells.vote(&moved(2000), 4.0, 2), None);
    }
}
