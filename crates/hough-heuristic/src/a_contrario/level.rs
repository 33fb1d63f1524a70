//! One size of the frame: its edge points, in lists by row and by column, and as a map of
//! directions.

use std::ops::Range;

use super::directions::code;
use super::polar::{LANES, whole};
use crate::edges::{Candidate, Geometry, Vectorized, widest};

/// Set in the mark of a pixel with an edge.
pub(super) const EDGE: u8 = 0x80;

/// Edge points in rows, one list for each of their parts; or transposed in columns, where x and y
/// have changed places.
#[derive(Clone, Debug, Default)]
pub(super) struct Lines {
    /// Index of each line's first point, and at the end the number of points.
    starts: Vec<u32>,
    /// Position, pixels of the level.
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    /// Unit vector across the edge, from dark to bright.
    pub(super) nx: Vec<f32>,
    pub(super) ny: Vec<f32>,
    /// Its place in the list of rows.
    pub(super) id: Vec<u32>,
}

/// The edges of one level.
#[derive(Clone, Debug, Default)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rows: Lines,
    pub(super) columns: Lines,
    /// Which points no circle explains so far, and no arc in which they lie was looked at.
    pub(super) free: Vec<bool>,
    /// Steepness of the edge at each point.
    strength: Vec<f32>,
    /// For each pixel: 0 where no edge is within a pixel, else [`EDGE`] and the code of the edge's
    /// normal.
    near: Vec<u8>,
    /// Index of the point, where `near` is not 0.
    nearest: Vec<u32>,
}

impl Level {
    /// Takes in the maxima of a frame of `width` x `height` pixels.
    pub(super) fn fill(&mut self, width: usize, height: usize, candidates: &[Candidate]) {
        self.width = width;
        self.height = height;
        self.near.clear();
        self.near.resize(width * height, 0);
        self.nearest.resize(width * height, 0);
        self.free.clear();
        self.free.resize(candidates.len(), true);
        widest(Filling {
            level: self,
            candidates,
        });
    }

    /// Lists the candidates row by row, and marks them.
    #[inline(always)]
    fn fill_rows(&mut self, candidates: &[Candidate]) {
        let (width, rows) = (self.width, &mut self.rows);
        rows.reserve(candidates.len());
        let ids = rows.id.len() as u32..(candidates.len() + LANES) as u32;
        rows.id.extend(ids);
        self.strength
            .resize(self.strength.len().max(candidates.len() + LANES), 0.0);
        rows.starts.clear();
        for (block, eight) in candidates.chunks(LANES).enumerate() {
            let lane = |lane: usize| &eight[lane.min(eight.len() - 1)];
            let Geometry { x, y, dx, dy } =
                Geometry::<LANES>::of(std::array::from_fn(|i| &lane(i).gradient));
            let pixel: [_; LANES] = std::array::from_fn(|i| lane(i).pixel);
            let (mut px, mut py) = ([0.0; LANES], [0.0; LANES]);
            let (mut strength, mut nx, mut ny) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            let mut marks = [0; LANES];
            for i in 0..LANES {
                strength[i] = (x[i] * x[i] + y[i] * y[i]).sqrt();
                let unit = 1.0 / strength[i].max(1e-20);
                (nx[i], ny[i]) = (x[i] * unit, y[i] * unit);
                (px[i], py[i]) = (
                    pixel[i].x as i32 as f32 + dx[i],
                    pixel[i].y as i32 as f32 + dy[i],
                );
                marks[i] = EDGE | code(x[i], y[i]);
            }
            // The last block reaches into the margin.
            let first = block * LANES;
            rows.x[first..first + LANES].copy_from_slice(&px);
            rows.y[first..first + LANES].copy_from_slice(&py);
            rows.nx[first..first + LANES].copy_from_slice(&nx);
            rows.ny[first..first + LANES].copy_from_slice(&ny);
            self.strength[first..first + LANES].copy_from_slice(&strength);
            for i in 0..eight.len() {
                let id = (first + i) as u32;
                let row = pixel[i].y as usize;
                while rows.starts.len() <= row {
                    rows.starts.push(id);
                }
                // The candidate's own pixel and its four neighbours; candidates never lie on the
                // border.
                let centre = row * width + pixel[i].x as usize;
                for pixel in [centre - width, centre - 1, centre + 1, centre + width] {
                    if self.near[pixel] == 0 {
                        self.near[pixel] = marks[i];
                        self.nearest[pixel] = id;
                    }
                }
                self.near[centre] = marks[i];
                self.nearest[centre] = id;
            }
        }
        while rows.starts.len() <= self.height {
            rows.starts.push(candidates.len() as u32);
        }
        rows.end(candidates.len());
    }

    /// The positions of all points.
    pub(super) fn points(&self) -> impl Iterator<Item = (f32, f32)> {
        let positions = self.rows.x.iter().zip(&self.rows.y);
        positions.map(|(&x, &y)| (x, y)).take(self.free.len())
    }

    /// The mark of the pixel, or None outside.
    #[inline]
    pub(super) fn mark(&self, x: f32, y: f32) -> Option<(u8, usize)> {
        // Numbers below 0 become very large ones.
        let (column, row) = (whole(x).0 as usize, whole(y).0 as usize);
        if column >= self.width || row >= self.height {
            return None;
        }
        let pixel = row * self.width + column;
        Some((self.near[pixel], pixel))
    }

    /// The marks of all pixels, row by row.
    #[inline]
    pub(super) fn marks(&self) -> &[u8] {
        &self.near
    }

    /// The position of the point that a mark stands for.
    #[inline(always)]
    pub(super) fn point_at(&self, pixel: usize) -> (f32, f32) {
        let id = self.nearest[pixel] as usize;
        (self.rows.x[id], self.rows.y[id])
    }

    /// The point that a mark stands for.
    #[inline(always)]
    pub(super) fn id_at(&self, pixel: usize) -> usize {
        self.nearest[pixel] as usize
    }

    /// Steepness of the edge at the point that a mark stands for.
    #[inline(always)]
    pub(super) fn strength_at(&self, pixel: usize) -> f32 {
        self.strength[self.nearest[pixel] as usize]
    }

    /// Takes the point that a mark stands for out of the search.
    #[inline(always)]
    pub(super) fn explain(&mut self, pixel: usize) {
        self.free[self.nearest[pixel] as usize] = false;
    }

    /// Index range of the points of one row, or of one column if `transposed`.
    #[inline(always)]
    pub(super) fn line(&self, transposed: bool, line: usize) -> Range<usize> {
        let starts = if transposed {
            &self.columns.starts
        } else {
            &self.rows.starts
        };
        starts[line] as usize..starts[line + 1] as usize
    }
}

impl Lines {
    /// Reserves space for `count` points and a margin.
    fn reserve(&mut self, count: usize) {
        let space = self.x.len().max(count + LANES);
        for values in [&mut self.x, &mut self.y, &mut self.nx, &mut self.ny] {
            values.resize(space, 0.0);
        }
    }

    /// Makes the margin behind `count` points one that is far from all of them.
    fn end(&mut self, count: usize) {
        self.y[count..count + LANES].fill(f32::INFINITY);
    }

    /// Makes this list the columns of `rows`.
    #[inline(always)]
    fn transpose(&mut self, rows: &Self, count: usize, width: usize) {
        self.starts.clear();
        self.starts.resize(width + 2, 0);
        let column = |x: f32| ((x + 0.5) as usize).min(width - 1);
        for &x in &rows.x[..count] {
            self.starts[column(x) + 2] += 1;
        }
        for index in 2..self.starts.len() {
            self.starts[index] += self.starts[index - 1];
        }
        self.reserve(count);
        self.id.resize(self.x.len(), 0);
        for index in 0..count {
            let slot = &mut self.starts[column(rows.x[index]) + 1];
            let at = *slot as usize;
            *slot += 1;
            (self.x[at], self.y[at]) = (rows.y[index], rows.x[index]);
            (self.nx[at], self.ny[at]) = (rows.ny[index], rows.nx[index]);
            self.id[at] = index as u32;
        }
        self.end(count);
        self.starts.pop();
    }
}

/// Taking in the maxima of a frame.
struct Filling<'a> {
    level: &'a mut Level,
    candidates: &'a [Candidate],
}

impl Vectorized for Filling<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { level, candidates } = self;
        level.fill_rows(candidates);
        level
            .columns
            .transpose(&level.rows, candidates.len(), level.width);
    }
}
