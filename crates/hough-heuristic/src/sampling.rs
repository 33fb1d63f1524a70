//! The draws of the random searches.

pub(crate) mod structure;

use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

use crate::acceptance::Acceptance;
use crate::circle::Circle;
use crate::curve::Curve;
use crate::curve::circles_of_radius;
use crate::edges::EdgePixel;
use crate::sampling::structure::Structure;

/// Draws pixels and solves for the circle: the paper's steps 3a and 3b.
///
/// Three pixels determine a circle. Where only one radius is allowed, two leave the choice between
/// two circles, of which one is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Sampler {
    known_radius: Option<f64>,
    /// The reaches of the windows, pixels; empty where pixels come from anywhere.
    reaches: Vec<f64>,
    seed: u64,
    rng: Xoshiro256PlusPlus,
}

impl Sampler {
    pub(crate) fn new(anywhere: bool, accept: &Acceptance, seed: u64) -> Self {
        let reaches = || reaches(accept.min_radius, accept.max_radius);
        Self {
            known_radius: accept.known_radius(),
            reaches: if anywhere { Vec::new() } else { reaches() },
            seed,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// Begins the sequence of draws anew.
    pub(crate) fn restart(&mut self) {
        self.rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
    }

    /// Draws pixels and returns the circle that they determine, if they determine one; none if too
    /// few pixels are left.
    pub(crate) fn draw(&mut self, structure: &Structure) -> Option<Option<Circle>> {
        let Some(radius) = self.known_radius else {
            let triple: [_; 3] = self.pixels(structure)?;
            return Some(Circle::through(&triple));
        };
        let pair = self.pixels(structure)?;
        let side = self.rng.next_u32() as usize % 2;
        Some(circles_of_radius(pair, radius).map(|both| both[side]))
    }

    fn pixels<const N: usize>(&mut self, structure: &Structure) -> Option<[EdgePixel; N]> {
        let reach = (!self.reaches.is_empty())
            .then(|| self.reaches[self.rng.next_u32() as usize % self.reaches.len()]);
        let mut pixels = [EdgePixel::default(); N];
        structure
            .draw(reach, &mut self.rng, &mut pixels)
            .then_some(pixels)
    }
}

/// Returns the reaches of the windows: 64 diameters in geometric progression.
fn reaches(min_radius: f64, max_radius: f64) -> Vec<f64> {
    // The 64th root by square roots, which have the same bits on every platform.
    let factor = (0..6).fold(max_radius / min_radius, |root, _| root.sqrt());
    let mut reach = 2.0 * min_radius;
    (0..64)
        .map(|_| {
            reach *= factor;
            reach.ceil()
        })
        .collect()
}
