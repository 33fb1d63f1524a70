//! The randomized Hough transform, the nearer of the paper's two rivals.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use image::GrayImage;

use super::pass::Frames;
use crate::acceptance::Acceptance;
use crate::circle::Circle;
use crate::detect::{CircleDetector, Detection, FrameRefused};
use crate::edges::{Canny, EdgeDetector};
use crate::error::{ConfigError, require, require_some};
use crate::sampling::Sampler;
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
    /// Draws all pixels from the whole of `D`, as Xu and Oja do (default false); otherwise see
    /// [`HeuristicConfig::anywhere`](crate::HeuristicConfig::anywhere).
    pub anywhere: bool,
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
            anywhere: false,
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
        let (votes, cell) = (config.votes, config.cell);
        require_some("iterations", config.iterations as usize)?;
        require("votes", votes.into(), "2..=255", (2..=255).contains(&votes))?;
        require("cell", cell, "0.5..=64 px", (0.5..=64.0).contains(&cell))?;
        Ok(Self {
            frames: Frames::new(edge_detector, config.accept)?,
            sampler: Sampler::new(config.anywhere, &config.accept, config.seed),
            cells: Cells::with_capacity_and_hasher(FORESEEN, BuildHasherDefault::default()),
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
        self.frames
            .stages(size_of::<(u64, Cell)>() * self.cells.capacity())
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
                let Some(drawn) = self.sampler.draw(&pass.unexplained.structure) else {
                    break;
                };
                let usable = |circle: &Circle| {
                    radii.contains(&circle.radius)
                        && pass.accept.region.is_none_or(|region| region.holds(circle))
                };
                let mean = drawn
                    .filter(usable)
                    .and_then(|circle| vote(&mut self.cells, &circle, cell, votes));
                let Some(Circle { x, y, radius }) = mean else {
                    continue;
                };
                let radius = radius.clamp(accept.min_radius, accept.max_radius);
                let mean = Circle { x, y, radius };
                if pass.might_be(&mean) && pass.verify(mean, reach) {
                    self.cells.clear();
                    if pass.is_complete() {
                        break;
                    }
                }
            }
        }))
    }
}

/// The sparse accumulator: the cells of the parameter space that have a vote.
type Cells = HashMap<u64, Cell, BuildHasherDefault<KeyHasher>>;

/// The cells that memory is set aside for beforehand.
const FORESEEN: usize = 1 << 13;

/// The sums of the circles that voted for a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    votes: u32,
    x: f64,
    y: f64,
    radius: f64,
}

/// Scatters the keys of neighbouring cells.
#[derive(Clone, Debug, Default)]
struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(self.0 << 8 | u64::from(*byte));
        }
    }

    fn write_u64(&mut self, key: u64) {
        let product = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = product ^ product >> 32;
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// Counts a vote; the mean of the circles in the cell, which is then emptied, if that was the last
/// vote it needed.
fn vote(cells: &mut Cells, circle: &Circle, side: f64, needed: u32) -> Option<Circle> {
    let cell = cells.entry(key(circle, side)).or_default();
    cell.votes += 1;
    cell.x += circle.x;
    cell.y += circle.y;
    cell.radius += circle.radius;
    if cell.votes < needed {
        return None;
    }
    let Cell {
        votes,
        x,
        y,
        radius,
    } = std::mem::take(cell);
    let votes = f64::from(votes);
    Some(Circle {
        x: x / votes,
        y: y / votes,
        radius: radius / votes,
    })
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
    fn a_cell_gives_the_mean_of_its_votes_and_is_emptied() {
        let at = |k: i32| Circle {
            x: f64::from(k % 71) * 4.0 - 40.0,
            y: f64::from(k / 71) * 4.0 + 1.0,
            radius: 20.0,
        };
        let mut cells = Cells::default();
        for k in 0..3000 {
            assert_eq!(vote(&mut cells, &at(k), 4.0, 2), None);
        }
        for k in 0..1500 {
            let moved = Circle {
                x: at(k).x + 1.0,
                ..at(k)
            };
            let mean = vote(&mut cells, &moved, 4.0, 2).unwrap();
            assert!((mean.x - at(k).x - 0.5).abs() < 1e-9);
            assert_eq!(vote(&mut cells, &moved, 4.0, 2), None);
        }
    }
}
