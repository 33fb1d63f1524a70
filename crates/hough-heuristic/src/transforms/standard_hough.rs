//! The standard Hough transform for circles, the other of the paper's rivals.

use image::GrayImage;

use super::pass::Frames;
use crate::acceptance::Acceptance;
use crate::circle::Circle;
use crate::detect::{CircleDetector, Detection, FrameRefused};
use crate::edges::{Canny, EdgeDetector};
use crate::error::{ConfigError, require, require_share};
use crate::stages::Stages;

/// Settings of [`StandardHough`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct StandardHoughConfig {
    /// Rules by which circles are reported.
    pub accept: Acceptance,
    /// Side of an accumulator cell along both axes of the centre and along the radius, pixels
    /// (default 2; 1..=16). Memory falls with its third power, time with its second. Cells much
    /// larger than the tolerance blur neighbouring circles.
    pub cell: f64,
    /// Votes only along the gradient, if the edge detector knows it (default false). A pixel then
    /// votes for arcs of `direction_error` to either side of the two directions instead of the full
    /// circle.
    pub gradient: bool,
    /// Largest error of the gradient's direction, radians (default 0.15; 0..=1). Noise turns a
    /// gradient by the ratio of the noise's deviation to the edge's strength.
    pub direction_error: f64,
    /// Share of the outline's cells that must have voted before a peak is verified (default 0.4;
    /// 0..1).
    pub min_votes: f64,
    /// Largest memory of the accumulator, bytes (default 2^29, half a gigabyte; at
    /// least 1). A frame that needs more is refused: [`FrameRefused::Accumulator`].
    pub max_memory: u64,
}

impl Default for StandardHoughConfig {
    fn default() -> Self {
        Self {
            accept: Acceptance::default(),
            cell: 2.0,
            gradient: false,
            direction_error: 0.15,
            min_votes: 0.4,
            max_memory: 1 << 29,
        }
    }
}

/// The standard Hough transform for circles (Duda and Hart, 1972), with a three-dimensional
/// accumulator.
///
/// Every edge pixel votes, for every radius, for the centres of the circles through it; with
/// [`gradient`](StandardHoughConfig::gradient) only for those that its gradient points to. The
/// local peaks, as shares of the votes that a complete circle of their radius would have, are
/// verified best first: fitted to the edge pixels around, and accepted if their β is above θ, their
/// pixels then no longer counting for the others.
///
/// Centres outside the frame have no cells. The accumulator's memory is
/// `width height radii / cell^3` counts of 16 bits: 32 MB for 768x576 pixels, radii of 15 to 300 px
/// and cells of 2 px, and 1.1 GB for 3840x2160 pixels and radii of 15 to 1080 px, which is beyond
/// the default of [`max_memory`](StandardHoughConfig::max_memory).
///
/// The score of a [`Detection`] is the β of the circle as reported, counted as
/// [`Heuristic`](crate::Heuristic) counts it.
#[derive(Clone, Debug)]
pub struct StandardHough<E = Canny> {
    config: StandardHoughConfig,
    frames: Frames<E>,
    /// For each radius the cells around a pixel that it votes for, by direction.
    rings: Vec<Ring>,
    accumulator: Accumulator,
    peaks: Vec<Peak>,
    /// The directions of the gradients, in turns.
    turns: Vec<f64>,
}

/// The cells at one radius from the origin.
#[derive(Clone, Debug)]
struct Ring {
    radius: f64,
    /// Around the full circle in the order of their direction, each once, then again those of the
    /// first and before them those of the last directions, so that every arc is in one piece.
    around: Vec<(i32, i32)>,
    /// Number of cells to either side of a direction that its error covers.
    spread: usize,
    /// The votes a complete circle gets in its cell.
    complete: f64,
}

/// The peaks that memory is set aside for beforehand: many times as many as pictures without dense
/// texture have.
const FORESEEN_PEAKS: usize = 1 << 14;

/// Votes by radius, then row, then column.
#[derive(Clone, Debug, Default)]
struct Accumulator {
    columns: usize,
    rows: usize,
    votes: Vec<u16>,
}

#[derive(Clone, Copy, Debug)]
struct Peak {
    share: f64,
    circle: Circle,
}

impl<E: EdgeDetector> StandardHough<E> {
    /// Builds a detector on the edges of `edge_detector`, which may be a `Box<dyn EdgeDetector>`.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn new(config: StandardHoughConfig, edge_detector: E) -> Result<Self, ConfigError> {
        let (cell, error) = (config.cell, config.direction_error);
        let (min, max) = (config.accept.min_radius, config.accept.max_radius);
        require("cell", cell, "1..=16 px", (1.0..=16.0).contains(&cell))?;
        let usable = (0.0..=1.0).contains(&error);
        require("direction_error", error, "0..=1 rad", usable)?;
        require_share("min_votes", config.min_votes)?;
        let frames = Frames::new(edge_detector, config.accept)?;
        require(
            "max_radius",
            max,
            "at most 1000 cells",
            max <= 1000.0 * cell,
        )?;
        let layers = ((max - min) / cell).floor() as u32;
        Ok(Self {
            rings: (0..=layers)
                .map(|layer| Ring::new(min + cell * f64::from(layer), cell, error))
                .collect(),
            frames,
            accumulator: Accumulator::default(),
            peaks: Vec::with_capacity(FORESEEN_PEAKS),
            turns: Vec::new(),
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
        let cells = self.rings.iter().map(|ring| ring.around.capacity());
        let memory = size_of::<(i32, i32)>() * cells.sum::<usize>()
            + size_of::<u16>() * self.accumulator.votes.capacity()
            + size_of::<Peak>() * self.peaks.capacity()
            + size_of::<f64>() * self.turns.capacity();
        self.frames.stages(memory)
    }

    /// Number of radii that a frame can hold.
    fn fitting(&self, width: u32, height: u32) -> usize {
        // No circle through a pixel of the frame has its centre in the frame and a larger radius.
        let (w, h) = (f64::from(width), f64::from(height));
        let diagonal = (w * w + h * h).sqrt();
        self.rings
            .iter()
            .take_while(|ring| ring.radius <= diagonal + self.config.cell)
            .count()
    }

    /// Refuses a frame whose accumulator would take too much memory.
    fn check_frame(&self, width: u32, height: u32) -> Result<(), FrameRefused> {
        self.config.accept.check_frame(width, height)?;
        let part = self.config.accept.part(width, height);
        let side = |pixels: u32| (f64::from(pixels) / self.config.cell).ceil() as u64;
        let layers = self.fitting(part.width, part.height) as u64;
        let needed = [side(part.height), layers, size_of::<u16>() as u64]
            .into_iter()
            .fold(side(part.width), u64::saturating_mul);
        let limit = self.config.max_memory;
        if needed <= limit {
            return Ok(());
        }
        Err(FrameRefused::Accumulator {
            frame_width: width,
            frame_height: height,
            needed,
            limit,
        })
    }
}

impl<E: EdgeDetector> CircleDetector for StandardHough<E> {
    fn detect(&mut self, frame: &GrayImage) -> Result<&[Detection], FrameRefused> {
        self.check_frame(frame.width(), frame.height())?;
        let part = self.config.accept.part(frame.width(), frame.height());
        let rings = &self.rings[..self.fitting(part.width, part.height)];
        let StandardHoughConfig {
            accept,
            cell,
            gradient,
            min_votes,
            ..
        } = self.config;
        let reach = (1.5 * cell).max(2.0 * accept.tolerance + 1.0);
        let (accumulator, peaks, turns) = (&mut self.accumulator, &mut self.peaks, &mut self.turns);
        Ok(self.frames.run(frame, |pass| {
            let edges = pass.edges;
            accumulator.clear(edges.width(), edges.height(), cell, rings.len());
            turns.clear();
            if gradient {
                let gradients = (0..edges.pixels().len()).map_while(|index| edges.gradient(index));
                turns.extend(gradients.map(|(gx, gy)| gy.atan2(gx) / std::f64::consts::TAU));
            }
            for (layer, ring) in rings.iter().enumerate() {
                for (index, pixel) in edges.pixels().iter().enumerate() {
                    let at = [pixel.x, pixel.y].map(|at| (f64::from(at) / cell) as i32);
                    match turns.get(index) {
                        Some(&turn) => accumulator.vote(layer, at, ring.along(turn)),
                        None => accumulator.vote(layer, at, [ring.cells(), &[]]),
                    }
                }
            }
            accumulator.find_peaks(rings, min_votes, cell, peaks);
            for peak in peaks.iter() {
                if pass.is_complete() {
                    break;
                }
                pass.verify(peak.circle, reach);
            }
        }))
    }
}

impl Ring {
    fn new(radius: f64, cell: f64, direction_error: f64) -> Self {
        let steps = (8.0 * std::f64::consts::TAU * radius / cell).ceil();
        let mut cells: Vec<(i32, i32)> = Vec::new();
        for step in 0..steps as u32 {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(step) / steps).sin_cos();
            let cell = (
                (radius * cos / cell).round() as i32,
                (radius * sin / cell).round() as i32,
            );
            // On the border between two cells rounding may go back and forth.
            let recent = &cells[cells.len().saturating_sub(3)..];
            let closing =
                step > steps as u32 / 2 && cells.iter().take(3).any(|first| *first == cell);
            if !closing && !recent.contains(&cell) {
                cells.push(cell);
            }
        }
        let spread =
            (cells.len() as f64 * direction_error / std::f64::consts::TAU).round() as usize;
        let spread = spread.min(cells.len() / 4);
        let (first, last) = (&cells[..spread], &cells[cells.len() - spread..]);
        Self {
            around: [last, &cells, first].concat(),
            spread,
            // The pixels of the outline, about 5.66 per pixel of radius.
            complete: 4.0 * std::f64::consts::SQRT_2 * radius,
            radius,
        }
    }

    /// The cells around the full circle, each once.
    fn cells(&self) -> &[(i32, i32)] {
        &self.around[self.spread..self.around.len() - self.spread]
    }

    /// The cells in the direction of a gradient, given in turns, and those in the opposite one.
    fn along(&self, turn: f64) -> [&[(i32, i32)]; 2] {
        let count = self.around.len() - 2 * self.spread;
        [turn, turn + 0.5].map(|turn| {
            let middle = (turn.rem_euclid(1.0) * count as f64) as usize % count;
            &self.around[middle..=middle + 2 * self.spread]
        })
    }
}

impl Accumulator {
    fn clear(&mut self, width: u32, height: u32, cell: f64, layers: usize) {
        self.columns = (f64::from(width) / cell).ceil() as usize;
        self.rows = (f64::from(height) / cell).ceil() as usize;
        self.votes.clear();
        self.votes.resize(self.columns * self.rows * layers, 0);
    }

    /// Votes for the circles of one radius around a cell.
    fn vote(&mut self, layer: usize, [x, y]: [i32; 2], cells: [&[(i32, i32)]; 2]) {
        let (columns, rows) = (self.columns, self.rows);
        let votes = &mut self.votes[layer * columns * rows..][..columns * rows];
        for arc in cells {
            for (dx, dy) in arc {
                let (column, row) = (x + dx, y + dy);
                if (column as u32) < columns as u32 && (row as u32) < rows as u32 {
                    let votes = &mut votes[row as usize * columns + column as usize];
                    *votes = votes.saturating_add(1);
                }
            }
        }
    }

    /// The cells that no neighbour exceeds, best first by their share of a complete circle's votes.
    fn find_peaks(&self, rings: &[Ring], min_votes: f64, cell: f64, peaks: &mut Vec<Peak>) {
        peaks.clear();
        let size = self.columns * self.rows;
        for (layer, ring) in rings.iter().enumerate() {
            let least = (min_votes * ring.complete).ceil() as u16;
            let votes = &self.votes[layer * size..][..size];
            for (index, &count) in votes.iter().enumerate() {
                if count >= least && self.is_peak(layer, index, rings) {
                    let (row, column) = (index / self.columns, index % self.columns);
                    peaks.push(Peak {
                        share: f64::from(count) / ring.complete,
                        circle: Circle {
                            x: (column as f64 + 0.5) * cell - 0.5,
                            y: (row as f64 + 0.5) * cell - 0.5,
                            radius: ring.radius,
                        },
                    });
                }
            }
        }
        peaks.sort_unstable_by(|a, b| {
            let Circle { x, y, radius } = b.circle;
            let shares = b.share.total_cmp(&a.share);
            let places = || a.circle.y.total_cmp(&y).then(a.circle.x.total_cmp(&x));
            shares.then_with(|| a.circle.radius.total_cmp(&radius).then_with(places))
        });
    }

    /// Returns `true` if the cell's share is above that of the neighbours before it and not below
    /// that of those behind.
    fn is_peak(&self, layer: usize, index: usize, rings: &[Ring]) -> bool {
        let size = self.columns * self.rows;
        let (row, column) = (index / self.columns, index % self.columns);
        let share = |layer: usize, index: usize| {
            f64::from(self.votes[layer * size + index]) / rings[layer].complete
        };
        let here = share(layer, index);
        let around = |middle: usize, end: usize| middle.saturating_sub(1)..(middle + 2).min(end);
        around(layer, rings.len()).all(|l| {
            around(row, self.rows).all(|r| {
                around(column, self.columns).all(|c| {
                    let other = share(l, r * self.columns + c);
                    let before = (l, r, c) < (layer, row, column);
                    other < here || (other <= here && !before)
                })
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_is_a_closed_line_of_cells_each_once() {
        for (radius, cell) in [
            (31.0, 2.0),
            (15.0, 1.0),
            (200.3, 2.0),
            (33.0, 16.0),
            (4.0, 2.0),
        ] {
            let ring = Ring::new(radius, cell, 0.06);
            for (a, b) in ring.cells().iter().zip(ring.cells().iter().cycle().skip(1)) {
                assert!(
                    a != b && (a.0 - b.0).abs() <= 1 && (a.1 - b.1).abs() <= 1,
                    "{radius} {cell}"
                );
            }
            let mut sorted = ring.cells().to_vec();
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(sorted.len(), ring.cells().len(), "{radius} {cell}");
        }
        assert_eq!(Ring::new(1.0, 16.0, 1.0).cells(), [(0, 0)]);
    }

    #[test]
    fn a_gradient_votes_for_both_sides() {
        let ring = Ring::new(40.0, 2.0, 0.06);
        let cells = ring.along(0.0).concat();
        assert!(
            cells.contains(&(20, 0)) && cells.contains(&(-20, 0)),
            "{cells:?}"
        );
        assert!(cells.iter().all(|cell| cell.1.abs() <= 3), "{cells:?}");
    }
}
