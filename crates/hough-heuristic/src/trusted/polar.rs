//! A frame around an outline, unrolled: a row for each direction, a column for each distance from the outline.

use super::directions::UnitCircle;

/// A grey frame of any size of the pyramid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grey<'a> {
    pub(super) pixels: &'a [u8],
    pub(super) width: usize,
    pub(super) height: usize,
}

/// An outline that is nearly a circle: `r + cos2 cos(2 a) + sin2 sin(2 a)` in direction `a`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Oval {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) r: f32,
    pub(super) cos2: f32,
    pub(super) sin2: f32,
}

impl Oval {
    #[inline]
    pub(super) fn radius(&self, (ux, uy): (f32, f32)) -> f32 {
        self.r + self.cos2 * (ux * ux - uy * uy) + self.sin2 * (2.0 * ux * uy)
    }

    /// The outline in a frame whose pixels are `factor` times as large.
    pub(super) fn shrunk(&self, factor: f32) -> Self {
        let corner = 0.5 * (factor - 1.0);
        Self {
            x: (self.x - corner) / factor,
            y: (self.y - corner) / factor,
            r: self.r / factor,
            cos2: self.cos2 / factor,
            sin2: self.sin2 / factor,
        }
    }

    /// The outline in a frame whose pixels are `factor` times as small.
    pub(super) fn grown(&self, factor: f32) -> Self {
        let corner = 0.5 * (factor - 1.0);
        Self {
            x: self.x * factor + corner,
            y: self.y * factor + corner,
            r: self.r * factor,
            cos2: self.cos2 * factor,
            sin2: self.sin2 * factor,
        }
    }
}

/// Derivatives along and across the outline, on a grid of directions and distances.
#[derive(Clone, Debug, Default)]
pub(super) struct Polar {
    /// Directions.
    pub(super) rays: usize,
    /// Distances.
    pub(super) columns: usize,
    /// Grey levels, a ray a row, one more than distances.
    grey: Vec<f32>,
    /// Derivative outward per pixel, averaged along the outline.
    pub(super) outward: Vec<f32>,
    /// Derivative along the outline per pixel.
    pub(super) along: Vec<f32>,
    /// Whether the outline is inside the frame there.
    pub(super) visible: Vec<bool>,
}

impl Polar {
    /// How far a column lies outside of the outline, pixels; fractions lie between columns.
    #[inline]
    pub(super) fn distance(&self, column: f32) -> f32 {
        column - 0.5 * (self.columns - 1) as f32
    }

    /// Samples the frame along `rays` directions, up to `reach` pixels on either side of the outline, and averages the
    /// slopes over `2 half + 1` neighbouring directions.
    pub(super) fn sample(
        &mut self,
        frame: Grey<'_>,
        circle: &UnitCircle,
        oval: &Oval,
        (rays, reach, half): (usize, usize, usize),
    ) {
        let samples = 2 * reach + 2;
        self.rays = rays;
        self.columns = samples - 1;
        self.grey.resize(rays * samples, 0.0);
        self.visible.clear();
        let Grey { pixels, width, height } = frame;
        let (right, bottom) = ((width - 1) as f32, (height - 1) as f32);
        let (last_left, last_top) = (width.saturating_sub(2), height.saturating_sub(2));
        for (index, ray) in self.grey.chunks_exact_mut(samples).enumerate() {
            let (ux, uy) = circle.point(index, rays);
            let radius = oval.radius((ux, uy));
            let (at_x, at_y) = (oval.x + radius * ux, oval.y + radius * uy);
            let inside = at_x >= 0.5 && at_y >= 0.5 && at_x <= right - 0.5 && at_y <= bottom - 0.5;
            self.visible.push(inside);
            if !inside {
                ray.fill(0.0);
                continue;
            }
            let start = radius - reach as f32 - 0.5;
            let (x, y) = (oval.x + start * ux, oval.y + start * uy);
            let (end_x, end_y) = (x + (samples - 1) as f32 * ux, y + (samples - 1) as f32 * uy);
            if x.min(end_x) >= 0.0 && y.min(end_y) >= 0.0 && x.max(end_x) < right && y.max(end_y) < bottom {
                for (step, out) in ray.iter_mut().enumerate() {
                    let (cx, cy) = (x + step as f32 * ux, y + step as f32 * uy);
                    let (left, top) = (cx as i32, cy as i32);
                    let (fx, fy) = (cx - left as f32, cy - top as f32);
                    let at = (top * width as i32 + left) as usize;
                    let Some(square) = pixels.get(at..at + width + 2) else { continue };
                    let (a, b) = (f32::from(square[0]), f32::from(square[1]));
                    let (c, d) = (f32::from(square[width]), f32::from(square[width + 1]));
                    let (ab, cd) = (a + (b - a) * fx, c + (d - c) * fx);
                    *out = ab + (cd - ab) * fy;
                }
                continue;
            }
            for (step, out) in ray.iter_mut().enumerate() {
                let step = step as f32;
                let (cx, cy) = ((x + step * ux).clamp(0.0, right), (y + step * uy).clamp(0.0, bottom));
                let (left, top) = ((cx as usize).min(last_left), (cy as usize).min(last_top));
                let (fx, fy) = (cx - left as f32, cy - top as f32);
                let at = top * width + left;
                let (upper, lower) = (&pixels[at..at + 2], &pixels[at + width..at + width + 2]);
                let (a, b) = (f32::from(upper[0]), f32::from(upper[1]));
                let (c, d) = (f32::from(lower[0]), f32::from(lower[1]));
                let (ab, cd) = (a + (b - a) * fx, c + (d - c) * fx);
                *out = ab + (cd - ab) * fy;
            }
        }
        self.differentiate(oval.r, half);
    }

    fn differentiate(&mut self, r: f32, half: usize) {
        let (n, m) = (self.rays, self.columns);
        let samples = m + 1;
        self.outward.resize(n * m, 0.0);
        self.along.resize(n * m, 0.0);
        let arc = r * std::f32::consts::TAU / n as f32;
        // The slope along the outline is taken over at least two pixels.
        let lag = ((1.0 / arc.max(0.1)) as usize + 1).max(half);
        let (share, slope) = (1.0 / (2 * half + 1) as f32, 0.25 / (lag as f32 * arc));
        for index in 0..n {
            let out = &mut self.outward[index * m..][..m];
            out.fill(0.0);
            for step in 0..=2 * half {
                let ray = &self.grey[((index + n + step - half) % n) * samples..][..samples];
                for column in 0..m {
                    out[column] += (ray[column + 1] - ray[column]) * share;
                }
            }
            let ahead = &self.grey[((index + lag) % n) * samples..][..samples];
            let behind = &self.grey[((index + n - lag % n) % n) * samples..][..samples];
            let out = &mut self.along[index * m..][..m];
            for column in 0..m {
                out[column] = slope * (ahead[column] + ahead[column + 1] - behind[column] - behind[column + 1]);
            }
        }
    }
}
