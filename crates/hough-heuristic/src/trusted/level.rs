//! One size of the frame: its edge points, in lists by row and by column, and as a map of directions.

use std::ops::Range;

use super::directions::code;
use super::polar::{LANES, whole};
use crate::edges::Candidate;

/// Set in the mark of a pixel with an edge.
pub(super) const EDGE: u8 = 0x80;

/// Edge points in rows, one list for each of their parts; or transposed in columns, where x and y have changed places.
#[derive(Clone, Debug, Default)]
pub(super) struct Lines {
    /// Where each line begins, and at the end the number of points.
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
    /// How steep the edge is at each point.
    strength: Vec<f32>,
    /// For each pixel: 0 where no edge is within a pixel, else [`EDGE`] and the code of the edge's normal.
    near: Vec<u8>,
    /// Where `near` is not 0: which point it is.
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

        self.strength.clear();

        let rows = &mut self.rows;
        rows.resize(candidates.len());
        rows.starts.clear();
        for (index, candidate) in candidates.iter().enumerate() {
            let (px, py) = (candidate.pixel.x as usize, candidate.pixel.y as usize);
            let id = index as u32;
            while rows.starts.len() <= py {
                rows.starts.push(id);
            }
            let (gx, gy, dx, dy) = candidate.gradient.level_geometry();
            let strength = (gx * gx + gy * gy).sqrt();
            self.strength.push(strength);
            let unit = 1.0 / strength.max(1e-20);
            rows.x[index] = px as f32 + dx;
            rows.y[index] = py as f32 + dy;
            rows.nx[index] = gx * unit;
            rows.ny[index] = gy * unit;
            rows.id[index] = id;
            // The candidate's own pixel and its four neighbours; candidates never lie on the border.
            let mark = EDGE | code(gx, gy);
            let centre = py * width + px;
            for pixel in [centre - width, centre - 1, centre + 1, centre + width] {
                if self.near[pixel] == 0 {
                    self.near[pixel] = mark;
                    self.nearest[pixel] = id;
                }
            }
            self.near[centre] = mark;
            self.nearest[centre] = id;
        }
        while rows.starts.len() <= height {
            rows.starts.push(candidates.len() as u32);
        }
        self.columns.transpose(&self.rows, candidates.len(), width);
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

    /// How steep the edge is at the point that a mark stands for.
    #[inline(always)]
    pub(super) fn strength_at(&self, pixel: usize) -> f32 {
        self.strength[self.nearest[pixel] as usize]
    }

    /// Takes the point that a mark stands for out of the search.
    #[inline(always)]
    pub(super) fn explain(&mut self, pixel: usize) {
        self.free[self.nearest[pixel] as usize] = false;
    }

    /// The points of a row, or of a column.
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
    /// Makes room for `count` points and a margin that is far from all of them.
    fn resize(&mut self, count: usize) {
        for values in [&mut self.x, &mut self.nx, &mut self.ny] {
            values.resize(count + LANES, 0.0);
        }
        self.y.resize(count + LANES, 0.0);
        self.y[count..].fill(f32::INFINITY);
        self.id.resize(count + LANES, 0);
    }

    /// Makes this list the columns of `rows`.
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
        self.resize(count);
        for index in 0..count {
            let slot = &mut self.starts[column(rows.x[index]) + 1];
            let at = *slot as usize;
            *slot += 1;
            (self.x[at], self.y[at]) = (rows.y[index], rows.x[index]);
            (self.nx[at], self.ny[at]) = (rows.ny[index], rows.nx[index]);
            self.id[at] = index as u32;
        }
        self.starts.pop();
    }
}
