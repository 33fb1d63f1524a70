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

/// Source of the pixels of a draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Sampling {
    /// All from the whole of `D`, as the paper has it. For a circle that owns the share `p` of all
    /// edge pixels, one draw of three in `p^-3` hits it.
    Anywhere,
    /// The first from the whole of `D`; the others from a window around it that is as wide as a
    /// circle of some radius between the smallest and the largest can reach, the radius drawn anew
    /// each time (small ones more often: its logarithm is uniform). Beyond the paper; in clutter it
    /// hits a small ball hundreds of times as often.
    #[default]
    Near,
}

/// A draw that ended the search, or the circle it determines, if it determines one.
pub(crate) enum Draw {
    Exhausted,
    Nothing,
    Circle(Circle),
}

/// Draws pixels and solves for the circle: the paper's steps 3a and 3b.
///
/// Three pixels determine a circle. Where only one radius is allowed, two leave the choice between
/// two circles, of which one is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Sampler {
    sampling: Sampling,
    known_radius: Option<f64>,
    /// The reaches of [`Sampling::Near`], pixels.
    reaches: Vec<f64>,
    seed: u64,
    rng: Xoshiro256PlusPlus,
}

impl Sampler {
    pub(crate) fn new(sampling: Sampling, accept: &Acceptance, seed: u64) -> Self {
        Self {
            sampling,
            known_radius: accept.known_radius(),
            reaches: reaches(accept.min_radius, accept.max_radius),
            seed,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// Begins the sequence of draws anew.
    pub(crate) fn restart(&mut self) {
        self.rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
    }

    pub(crate) fn draw(&mut self, structure: &Structure) -> Draw {
        let circle = match self.known_radius {
            Some(radius) => self.pixels::<2>(structure).map(|pair| {
                let side = self.rng.next_u32() as usize % 2;
                circles_of_radius(pair, radius).map(|both| both[side])
            }),
            None => self
                .pixels::<3>(structure)
                .map(|triple| Circle::through(&triple)),
        };
        match circle {
            None => Draw::Exhausted,
            Some(None) => Draw::Nothing,
            Some(Some(circle)) => Draw::Circle(circle),
        }
    }

    fn pixels<const N: usize>(&mut self, structure: &Structure) -> Option<[EdgePixel; N]> {
        match self.sampling {
            Sampling::Anywhere => structure.draw_anywhere(&mut self.rng),
            Sampling::Near => {
                let reach = self.reaches[self.rng.next_u32() as usize % self.reaches.len()];
                structure.draw_near(reach, &mut self.rng)
            }
        }
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
