//! One size of the frame: its edge points, in lists by row and by column, and as a map of directions.

use super::directions::code;
use crate::edges::Candidate;

/// Set in the mark of a pixel with an edge.
pub(super) const EDGE: u8 = 0x80;

/// An edge point, as it lies in a list of rows; in a list of columns x and y have changed places.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EdgePoint {
    /// Position, pixels of the level.
    pub(super) x: f32,
    pub(super) y: f32,
    /// Unit vector across the edge, from dark to bright.
    pub(super) nx: f32,
    pub(super) ny: f32,
    /// Its place in the list of rows.
    pub(super) id: u32,
}

/// Edge points in rows, or transposed in columns.
#[derive(Clone, Debug, Default)]
pub(super) struct Lines {
    /// Where each line begins in `points`, and at the end their number.
    pub(super) starts: Vec<u32>,
    pub(super) points: Vec<EdgePoint>,
}

/// The edges of one level.
#[derive(Clone, Debug, Default)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rows: Lines,
    pub(super) columns: Lines,
    /// Which points no circle explains so far.
    pub(super) free: Vec<bool>,
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

        let rows = &mut self.rows;
        rows.points.clear();
        rows.starts.clear();
        for candidate in candidates {
            let (px, py) = (candidate.pixel.x as usize, candidate.pixel.y as usize);
            let id = rows.points.len() as u32;
            while rows.starts.len() <= py {
                rows.starts.push(id);
            }
            let (gx, gy, dx, dy) = candidate.gradient.level_geometry();
            let unit = 1.0 / (gx * gx + gy * gy).sqrt().max(1e-20);
            rows.points.push(EdgePoint {
                x: px as f32 + dx,
                y: py as f32 + dy,
                nx: gx * unit,
                ny: gy * unit,
                id,
            });
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
            rows.starts.push(rows.points.len() as u32);
        }
        self.columns.transpose(&self.rows, width);
    }

    /// The mark of the pixel, or None outside.
    #[inline]
    pub(super) fn mark(&self, x: f32, y: f32) -> Option<(u8, usize)> {
        // Casts of what lies outside saturate at either end.
        let (column, row) = ((x + 0.5) as i32 as usize, (y + 0.5) as i32 as usize);
        if x < -0.5 || y < -0.5 || column >= self.width || row >= self.height {
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

    /// The point that a mark stands for.
    #[inline]
    pub(super) fn point_at(&self, pixel: usize) -> &EdgePoint {
        &self.rows.points[self.nearest[pixel] as usize]
    }

    /// Share of the pixels that have an edge within a pixel.
    pub(super) fn density(&self) -> f32 {
        5.0 * self.rows.points.len() as f32 / (self.near.len() as f32).max(1.0)
    }
}

impl Lines {
    /// Makes this list the columns of `rows`.
    fn transpose(&mut self, rows: &Lines, width: usize) {
        self.starts.clear();
        self.starts.resize(width + 2, 0);
        let column = |point: &EdgePoint| ((point.x + 0.5) as usize).min(width - 1);
        for point in &rows.points {
            self.starts[column(point) + 2] += 1;
        }
        for index in 2..self.starts.len() {
            self.starts[index] += self.starts[index - 1];
        }
        self.points.resize(rows.points.len(), EdgePoint::default());
        for point in &rows.points {
            let slot = &mut self.starts[column(point) + 1];
            self.points[*slot as usize] = EdgePoint {
                x: point.y,
                y: point.x,
                nx: point.ny,
                ny: point.nx,
                id: point.id,
            };
            *slot += 1;
        }
        self.starts.pop();
    }
}
