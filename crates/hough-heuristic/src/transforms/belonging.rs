//! The checking procedure: how many pixels of an estimated curve are edges.

use crate::circle::Circle;
use crate::curve::{Curve, longest_outline, round};
use crate::edges::{EdgeMap, EdgePixel};
use crate::sampling::structure::Structure;

/// The edge pixels of a frame that no curve explains yet.
#[derive(Clone, Debug)]
pub(crate) struct Unexplained {
    pub(crate) structure: Structure,
    pub(crate) near: NearEdges,
}

impl Unexplained {
    pub(crate) fn new(tolerance: f64) -> Self {
        Self {
            structure: Structure::default(),
            near: NearEdges::new(tolerance),
        }
    }

    /// Takes in the edges of a frame.
    pub(crate) fn fill(&mut self, edges: &EdgeMap) {
        let (width, height) = (edges.width(), edges.height());
        self.structure.fill(width, height, edges.pixels());
        self.near.fill(width, height, edges.pixels());
    }

    /// Takes out the pixels within `band` of the curve.
    pub(crate) fn explain(&mut self, curve: &impl Curve, band: f64) {
        let near = &mut self.near;
        self.structure.remove(|pixel| {
            let explained = curve.distance(pixel.x.into(), pixel.y.into()) <= band;
            if explained {
                near.forget(pixel);
            }
            explained
        });
    }

    /// The memory it holds, bytes.
    pub(crate) fn memory(&self) -> usize {
        self.structure.memory() + self.near.counts.capacity()
    }
}

/// Answers for every pixel of a frame whether an edge pixel lies within the tolerance of it.
///
/// Holds, per pixel, how many edge pixels are that near, so that explained ones can be taken out
/// again one by one.
#[derive(Clone, Debug, Default)]
pub(crate) struct NearEdges {
    width: i32,
    height: i32,
    counts: Vec<u8>,
    /// No fewer than the pixels of the frame that match.
    most_matched: usize,
    /// The offsets at a distance of at most `tolerance`; at most 197 of them, so that a count fits
    /// in a byte.
    disc: Vec<(i32, i32)>,
}

/// Largest number of directions of the first look.
const PROBES: usize = 32;

impl NearEdges {
    pub(crate) fn new(tolerance: f64) -> Self {
        let reach = tolerance.floor() as i32;
        let disc = (-reach..=reach)
            .flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)))
            .filter(|&(dx, dy)| f64::from(dx * dx + dy * dy) <= tolerance * tolerance)
            .collect();
        Self {
            disc,
            ..Self::default()
        }
    }

    /// Takes in the edge pixels of a frame of `width` x `height`.
    pub(crate) fn fill(&mut self, width: u32, height: u32, pixels: &[EdgePixel]) {
        self.width = width as i32;
        self.height = height as i32;
        self.most_matched = pixels.len().saturating_mul(self.disc.len());
        self.counts.clear();
        self.counts.resize(width as usize * height as usize, 0);
        for pixel in pixels {
            self.stamp(*pixel, 1);
        }
    }

    /// Takes one edge pixel out again.
    pub(crate) fn forget(&mut self, pixel: EdgePixel) {
        self.stamp(pixel, 1u8.wrapping_neg());
    }

    fn stamp(&mut self, pixel: EdgePixel, step: u8) {
        let (x, y) = (pixel.x as i32, pixel.y as i32);
        for &(dx, dy) in &self.disc {
            if let Some(index) = index(x + dx, y + dy, self.width, self.height) {
                self.counts[index] = self.counts[index].wrapping_add(step);
            }
        }
    }

    /// Returns `true` if an edge pixel lies within the tolerance of the pixel. Pixels outside the
    /// frame never match.
    #[inline]
    pub(crate) fn matches(&self, x: i32, y: i32) -> bool {
        index(x, y, self.width, self.height).is_some_and(|index| self.counts[index] != 0)
    }

    /// The belonging β of a curve, if it is above `theta`; a curve without pixels has none.
    pub(crate) fn belonging(&self, curve: &impl Curve, theta: f64) -> Option<f64> {
        // On a longer outline even all pixels that can match would not do.
        let longest = self.most_matched as f64 / theta;
        self.count(curve, theta, |pixels, _| f64::from(pixels) <= longest)
    }

    /// The β of a circle, if it is above `theta`.
    pub(crate) fn belonging_of_circle(&self, circle: &Circle, theta: f64) -> Option<f64> {
        let spare = (1.0 - theta) * longest_outline(circle.radius);
        self.count(circle, theta, |_, misses| f64::from(misses) <= spare)
    }

    /// Counts the pixels of a curve and those that miss, for as long as `may_pass` is true of them.
    #[inline(always)]
    fn count(
        &self,
        curve: &impl Curve,
        theta: f64,
        may_pass: impl Fn(u32, u32) -> bool,
    ) -> Option<f64> {
        let (mut pixels, mut misses) = (0u32, 0u32);
        let complete = curve.outline(self.width as u32, self.height as u32, |x, y| {
            pixels += 1;
            misses += u32::from(!self.matches(x, y));
            may_pass(pixels, misses)
        });
        let beta = f64::from(pixels - misses) / f64::from(pixels.max(1));
        (complete && beta > theta).then_some(beta)
    }

    /// A first look at a few pixels of the outline: false if too few of them match for a circle
    /// with β above `theta`.
    ///
    /// After 8, 16, 24 and 32 probes the share of matches must not lie more than 1.5 standard
    /// deviations below `theta`. A draw whose β is far above passes: were the probes independent,
    /// 97 % of those at θ + 0.1 for θ = 0.65. Of the draws at θ itself 18 % are turned away, and
    /// have their further chances in later draws of the same curve.
    pub(crate) fn promising(&self, circle: &Circle, probes: &Probes) -> bool {
        let mut matched = 0u32;
        for (chunk, &needed) in probes.directions.chunks_exact(8).zip(&probes.needed) {
            for &(cos, sin) in chunk {
                let x = round(circle.x + circle.radius * cos);
                let y = round(circle.y + circle.radius * sin);
                matched += u32::from(self.matches(x, y));
            }
            if matched < needed {
                return false;
            }
        }
        true
    }
}

/// The directions of the first look, and how many must have matched after each eight.
#[derive(Clone, Debug)]
pub(crate) struct Probes {
    directions: Vec<(f64, f64)>,
    needed: [u32; PROBES / 8],
}

impl Probes {
    pub(crate) fn new(theta: f64) -> Self {
        // Rotations by 11.25 degrees, from square roots alone so that every platform has the same
        // bits.
        let half_angle = |cos: f64| (0.5 + 0.5 * cos).sqrt();
        let cos = half_angle(half_angle(half_angle(0.0)));
        let sin = (1.0 - cos * cos).sqrt();
        let mut around = [(1.0f64, 0.0f64); PROBES];
        for probe in 1..PROBES {
            let (x, y) = around[probe - 1];
            around[probe] = (x * cos - y * sin, x * sin + y * cos);
        }
        // Counting by bit-reversed numbers spreads every first few of the directions around the
        // circle.
        let directions = (0..PROBES as u32)
            .map(|probe| around[(probe.reverse_bits() >> (32 - PROBES.trailing_zeros())) as usize])
            .collect();
        let needed = std::array::from_fn(|chunk| {
            let looked = 8.0 * (chunk as f64 + 1.0);
            let spread = (looked * theta * (1.0 - theta)).sqrt();
            (looked * theta - 1.5 * spread).ceil().max(0.0) as u32
        });
        Self { directions, needed }
    }
}

#[inline]
fn index(x: i32, y: i32, width: i32, height: i32) -> Option<usize> {
    ((x as u32) < width as u32 && (y as u32) < height as u32)
        .then(|| y as usize * width as usize + x as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline_of(circle: Circle) -> Vec<(i32, i32)> {
        let mut pixels = Vec::new();
        circle.outline(40, 40, |x, y| {
            pixels.push((x, y));
            true
        });
        pixels
    }

    #[test]
    fn beta_counts_pixels_outside_the_frame_as_missed() {
        let circle = Circle {
            x: -0.0,
            y: 20.0,
            radius: 12.0,
        };
        let outline = outline_of(circle);
        let inside: Vec<EdgePixel> = outline
            .iter()
            .filter(|&&(x, _)| x >= 0)
            .map(|&(x, y)| EdgePixel {
                x: x as u32,
                y: y as u32,
            })
            .collect();
        let mut near = NearEdges::new(0.0);
        near.fill(40, 40, &inside);
        let beta = near.belonging_of_circle(&circle, 0.1).unwrap();
        let expected = inside.len() as f64 / outline.len() as f64;
        assert!((beta - expected).abs() < 1e-12, "{beta} {expected}");
        assert!(expected < 0.6);
        assert_eq!(near.belonging(&circle, 0.1), Some(beta));
        assert_eq!(near.belonging(&circle, expected), None);
        assert_eq!(near.belonging_of_circle(&circle, expected), None);
    }

    #[test]
    fn the_first_look_turns_away_few_that_are_good() {
        let needed = Probes::new(0.65).needed;
        // The share of draws that pass when each probe matches with this probability, independently
        // of the others.
        let passing = |beta: f64| {
            let mut by_matches = [0.0; PROBES + 1];
            by_matches[0] = 1.0;
            for needed in needed {
                for _ in 0..8 {
                    for matched in (0..by_matches.len()).rev() {
                        let before = if matched > 0 {
                            by_matches[matched - 1]
                        } else {
                            0.0
                        };
                        by_matches[matched] = (1.0 - beta) * by_matches[matched] + beta * before;
                    }
                }
                by_matches[..needed as usize].fill(0.0);
            }
            by_matches.iter().sum::<f64>()
        };
        assert!((passing(0.75) - 0.97).abs() < 0.01, "{}", passing(0.75));
        assert!((passing(0.65) - 0.82).abs() < 0.01, "{}", passing(0.65));
        assert!(passing(0.3) < 0.01, "{}", passing(0.3));
    }

    #[test]
    fn an_endless_curve_is_turned_away() {
        struct Endless;
        impl Curve for Endless {
            const PARAMETERS: usize = 1;
            fn through(_: &[EdgePixel]) -> Option<Self> {
                Some(Self)
            }
            fn outline(&self, _: u32, _: u32, mut visit: impl FnMut(i32, i32) -> bool) -> bool {
                assert!((-100..1000).any(|x| !visit(x, 5)), "still counting");
                false
            }
            fn distance(&self, _: f64, y: f64) -> f64 {
                (y - 5.0).abs()
            }
        }
        let row: Vec<EdgePixel> = (0..40).map(|x| EdgePixel { x, y: 5 }).collect();
        let mut near = NearEdges::new(1.0);
        near.fill(40, 12, &row);
        assert_eq!(near.belonging(&Endless, 0.5), None);
        near.fill(40, 12, &[]);
        assert_eq!(near.belonging(&Endless, 0.5), None);
    }

    #[test]
    fn the_tolerance_is_a_distance_and_forgetting_undoes_filling() {
        let pixels = [EdgePixel { x: 5, y: 5 }, EdgePixel { x: 6, y: 5 }];
        let mut near = NearEdges::new(1.0);
        near.fill(12, 12, &pixels);
        assert!(near.matches(4, 5) && near.matches(5, 4) && near.matches(7, 5));
        assert!(!near.matches(4, 4) && !near.matches(8, 5) && !near.matches(-1, 5));
        near.forget(pixels[0]);
        assert!(near.matches(5, 5) && !near.matches(4, 5));
        near.forget(pixels[1]);
        assert!(near.counts.iter().all(|&count| count == 0));
    }
}
