//! The frame in linear light, and the filling of convex shapes with smooth edges.

use hough_heuristic::Vectorized;
use nalgebra::Point2;

/// Light per pixel, 1 = just white.
#[derive(Clone, Debug, Default)]
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) light: Vec<f32>,
    coverage: Vec<f32>,
    shade: Vec<f32>,
    /// Edges of the polygon that begin below the present row, the next one last, without level
    /// ones.
    edges: Vec<Edge>,
    /// Edges that the present row may touch.
    active: Vec<Edge>,
}

/// An edge of a polygon, from its upper end down.
#[derive(Clone, Copy, Debug)]
struct Edge {
    top: f64,
    bottom: f64,
    /// Column of the upper end.
    x: f64,
    /// Change of x for each row.
    slope: f64,
}

/// Scan lines per row of pixels; coverage is exact along x and sampled this finely along y.
const SUBROWS: usize = 4;

impl Canvas {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            light: vec![0.0; width * height],
            coverage: vec![0.0; width + 2],
            shade: vec![0.0; width + 2],
            edges: Vec::with_capacity(8),
            active: Vec::with_capacity(8),
        }
    }

    /// Resizes the canvas; the light on it is undefined afterwards.
    pub(super) fn resize(&mut self, width: usize, height: usize) {
        self.light.resize(width * height, 0.0);
        self.coverage.resize(width + 2, 0.0);
        self.shade.resize(width + 2, 0.0);
        (self.width, self.height) = (width, height);
    }

    /// Fills a convex polygon. `shade(y, x0, row)` writes the light of the pixels x0.. of row y
    /// into `row`.
    pub(super) fn fill(
        &mut self,
        polygon: &[Point2<f64>],
        shade: impl FnMut(usize, usize, &mut [f32]),
    ) {
        Filling(self, polygon, shade).widest();
    }

    /// Lays an even layer of light over a convex polygon that replaces `share` of what is below.
    pub(super) fn blend(&mut self, polygon: &[Point2<f64>], light: f32, share: f32) {
        for y in self.rows_of(polygon) {
            let Some((start, end, solid)) = self.cover_row(y) else {
                continue;
            };
            let row = &mut self.light[y * self.width..][start..end];
            for (value, coverage) in row.iter_mut().zip(&self.coverage[start..end]) {
                let coverage = if solid { 1.0 } else { *coverage };
                *value += (light - *value) * coverage * share;
            }
        }
    }

    /// Lists the edges of a polygon and returns the rows that it may touch.
    #[inline(always)]
    fn rows_of(&mut self, polygon: &[Point2<f64>]) -> std::ops::Range<usize> {
        let (left, right) = extent(polygon.iter().map(|p| p.x));
        let (top, bottom) = extent(polygon.iter().map(|p| p.y));
        let first = (top + 0.5).floor().max(0.0);
        let last = (bottom + 0.5).floor().min(self.height as f64 - 1.0);
        if polygon.len() < 3 || left > self.width as f64 || right < -1.0 || first > last {
            return 0..0;
        }
        self.edges.clear();
        let mut p = polygon[polygon.len() - 1];
        for &q in polygon {
            let (upper, lower) = if p.y <= q.y { (p, q) } else { (q, p) };
            if upper.y < lower.y {
                self.edges.push(Edge {
                    top: upper.y,
                    bottom: lower.y,
                    x: upper.x,
                    slope: (lower.x - upper.x) / (lower.y - upper.y),
                });
            }
            p = q;
        }
        self.edges.sort_unstable_by(|a, b| b.top.total_cmp(&a.top));
        self.active.clear();
        first as usize..last as usize + 1
    }

    /// Computes the coverage of one row, after those above it. Returns the touched pixels
    /// start..end, and `true` if all of them are covered wholly.
    #[inline(always)]
    fn cover_row(&mut self, y: usize) -> Option<(usize, usize, bool)> {
        let (above, below) = (y as f64 - 0.5, y as f64 + 0.5);
        let lines: [f64; SUBROWS] =
            std::array::from_fn(|i| above + (i as f64 + 0.5) / SUBROWS as f64);
        let (mut lefts, mut rights) = ([f64::INFINITY; SUBROWS], [f64::NEG_INFINITY; SUBROWS]);
        while let Some(edge) = self.edges.pop_if(|edge| edge.top <= below) {
            self.active.push(edge);
        }
        self.active.retain(|edge| edge.bottom >= above);
        for edge in &self.active {
            for i in 0..SUBROWS {
                let x = edge.x + (lines[i] - edge.top) * edge.slope;
                let crosses = edge.top <= lines[i] && lines[i] < edge.bottom;
                let (left, right) = (lefts[i], rights[i]);
                lefts[i] = if crosses && x < left { x } else { left };
                rights[i] = if crosses && x > right { x } else { right };
            }
        }
        let mut spans = [(0.0_f64, -1.0_f64); SUBROWS];
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut inner_left, mut inner_right) = (f64::NEG_INFINITY, f64::INFINITY);
        for (span, (left, right)) in spans.iter_mut().zip(lefts.into_iter().zip(rights)) {
            // Pixel x covers x - 0.5 .. x + 0.5; here its left border is at x.
            let (left, right) = ((left + 0.5).max(0.0), (right + 0.5).min(self.width as f64));
            if left < right {
                *span = (left, right);
                least = least.min(left);
                greatest = greatest.max(right);
                inner_left = inner_left.max(left);
                inner_right = inner_right.min(right);
            } else {
                inner_right = f64::NEG_INFINITY;
            }
        }
        if least >= greatest {
            return None;
        }
        let up = |x: f64| x as usize + usize::from((x as usize as f64) < x);
        let (start, end) = (least as usize, up(greatest).min(self.width));
        let (from, to) = (up(inner_left), inner_right as usize);
        // Pixels from..to are covered by every scan line.
        let (from, to) = if from < to { (from, to) } else { (end, end) };
        if from == start && to == end {
            return Some((start, end, true));
        }
        let (from, to) = (from.clamp(start, end), to.clamp(start, end));
        self.coverage[from..to].fill(1.0);
        for part in [start..from, to..end] {
            for (x, coverage) in part.clone().zip(&mut self.coverage[part]) {
                let x = x as f64;
                *coverage = 0.0;
                for (left, right) in &spans {
                    let share = right.min(x + 1.0) - left.max(x);
                    *coverage += share.max(0.0) as f32 / SUBROWS as f32;
                }
            }
        }
        Some((start, end, false))
    }
}

/// Arguments of [`Canvas::fill`].
struct Filling<'a, S>(&'a mut Canvas, &'a [Point2<f64>], S);

impl<S: FnMut(usize, usize, &mut [f32])> Vectorized for Filling<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(canvas, polygon, mut shade) = self;
        for y in canvas.rows_of(polygon) {
            let Some((start, end, solid)) = canvas.cover_row(y) else {
                continue;
            };
            let row = &mut canvas.light[y * canvas.width..][start..end];
            if solid {
                shade(y, start, row);
                continue;
            }
            let shades = &mut canvas.shade[..end - start];
            shade(y, start, shades);
            let shares = &canvas.coverage[start..end];
            for ((light, new), share) in row.iter_mut().zip(&*shades).zip(shares) {
                *light += (new - *light) * share;
            }
        }
    }
}

/// Returns the least and the greatest of some numbers.
#[inline(always)]
fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), v| {
        (least.min(v), most.max(v))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covered_area_is_the_polygons_area() {
        let mut canvas = Canvas::new(40, 30);
        let polygon =
            [(3.2, 2.1), (30.7, 5.9), (25.3, 24.4), (6.6, 20.2)].map(|(x, y)| Point2::new(x, y));
        canvas.fill(&polygon, |_, _, row| row.fill(1.0));
        let mut area = 0.0;
        for (i, p) in polygon.iter().enumerate() {
            let q = polygon[(i + 1) % 4];
            area += 0.5 * (p.x * q.y - q.x * p.y);
        }
        let covered: f64 = canvas.light.iter().map(|v| f64::from(*v)).sum();
        assert!(
            (covered - area).abs() < 0.002 * area,
            "{covered} against {area}"
        );
    }

    #[test]
    fn polygons_are_cut_at_the_frame() {
        let mut canvas = Canvas::new(8, 8);
        let polygon =
            [(-1e6, -1e6), (1e6, -1e6), (1e6, 1e6), (-1e6, 1e6)].map(|(x, y)| Point2::new(x, y));
        canvas.fill(&polygon, |_, _, row| row.fill(1.0));
        assert!(canvas.light.iter().all(|v| *v > 0.999));
        canvas.fill(&[Point2::new(f64::NAN, 0.0); 3], |_, _, row| row.fill(0.0));
        assert!(canvas.light.iter().all(|v| *v > 0.999));
    }
}
