//! The frame around a circle, unrolled: a row for each direction, a column for each distance from the outline.

use image::GrayImage;

use super::directions::UnitCircle;

/// A circle in pixels of the frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outline {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) r: f32,
}

/// Derivatives along and across the outline, on a grid of directions and distances.
#[derive(Clone, Debug, Default)]
pub(super) struct Polar {
    /// Directions.
    pub(super) directions: usize,
    /// Distances, one less than the samples along a ray.
    pub(super) distances: usize,
    /// Grey levels, a ray a row; two rows more than directions on either side are not stored but wrapped.
    grey: Vec<f32>,
    /// Derivative outward per pixel, averaged along the outline.
    pub(super) outward: Vec<f32>,
    /// Derivative along the outline per pixel.
    pub(super) along: Vec<f32>,
    /// Whether the outline is inside the frame there.
    pub(super) visible: Vec<bool>,
    scratch: Vec<f32>,
}

impl Polar {
    /// The distance of a column from the outline, pixels; fractions lie between columns.
    pub(super) fn distance(&self, column: f32) -> f32 {
        column - 0.5 * (self.distances - 1) as f32
    }

    /// Samples the frame at `directions` rays, up to `reach` pixels on either side of the outline, and averages over
    /// `average` (odd) neighbouring directions.
    pub(super) fn sample(
        &mut self,
        frame: &GrayImage,
        circle: &UnitCircle,
        outline: &Outline,
        (directions, reach, average): (usize, usize, usize),
    ) {
        let samples = 2 * reach + 2;
        self.directions = directions;
        self.distances = samples - 1;
        self.grey.clear();
        self.visible.clear();
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let grey = frame.as_raw();
        let (right, bottom) = ((width - 1) as f32, (height - 1) as f32);
        let start = outline.r - reach as f32 - 0.5;
        for index in 0..directions {
            let (ux, uy) = circle.point(index, directions);
            let (mut x, mut y) = (outline.x + start * ux, outline.y + start * uy);
            let (at_x, at_y) = (outline.x + outline.r * ux, outline.y + outline.r * uy);
            self.visible
                .push(at_x >= 1.0 && at_y >= 1.0 && at_x <= right - 1.0 && at_y <= bottom - 1.0);
            for _ in 0..samples {
                let (cx, cy) = (x.clamp(0.0, right), y.clamp(0.0, bottom));
                let (left, top) = (
                    (cx as usize).min(width.saturating_sub(2)),
                    (cy as usize).min(height.saturating_sub(2)),
                );
                let (fx, fy) = (cx - left as f32, cy - top as f32);
                let upper = &grey[top * width + left..];
                let lower = &grey[(top + 1) * width + left..];
                let (a, b) = (f32::from(upper[0]), f32::from(upper[1]));
                let (c, d) = (f32::from(lower[0]), f32::from(lower[1]));
                let (ab, cd) = (a + (b - a) * fx, c + (d - c) * fx);
                self.grey.push(ab + (cd - ab) * fy);
                x += ux;
                y += uy;
            }
        }
        self.differentiate(outline, average);
    }

    fn differentiate(&mut self, outline: &Outline, average: usize) {
        let (n, m) = (self.directions, self.distances);
        let samples = m + 1;
        // Between two samples of a ray: their difference, and their mean.
        self.scratch.resize(n * m, 0.0);
        self.outward.resize(n * m, 0.0);
        self.along.resize(n * m, 0.0);
        for index in 0..n {
            let ray = &self.grey[index * samples..][..samples];
            for column in 0..m {
                self.scratch[index * m + column] = ray[column + 1] - ray[column];
            }
        }
        let half = average / 2;
        let share = 1.0 / average as f32;
        let wrap = |index: usize, step: isize| (index as isize + step).rem_euclid(n as isize) as usize;
        let arc = outline.r * std::f32::consts::TAU / n as f32;
        let lag = (half as isize + 1).max((1.5 / arc) as isize);
        for index in 0..n {
            let out = &mut self.outward[index * m..][..m];
            out.fill(0.0);
            for step in -(half as isize)..=half as isize {
                let row = &self.scratch[wrap(index, step) * m..][..m];
                for column in 0..m {
                    out[column] += row[column] * share;
                }
            }
            let out = &mut self.along[index * m..][..m];
            out.fill(0.0);
            // The slope over twice `lag` directions, each end the mean of as many directions as `lag` has room for.
            let scale = 0.5 / (lag as f32 * arc) / (half + 1) as f32;
            for offset in 0..=half as isize {
                let ahead = &self.grey[wrap(index, lag + offset - (half as isize + 1) / 2) * samples..][..samples];
                let behind = &self.grey[wrap(index, -(lag + offset) + (half as isize + 1) / 2) * samples..][..samples];
                for column in 0..m {
                    out[column] +=
                        0.5 * scale * (ahead[column] + ahead[column + 1] - behind[column] - behind[column + 1]);
                }
            }
        }
    }
}
