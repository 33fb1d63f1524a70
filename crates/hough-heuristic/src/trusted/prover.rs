//! Proves candidates, each at the size of the frame where its radius is one or two dozen pixels.

use image::GrayImage;

use super::candidate::Candidate;
use super::directions::UnitCircle;
use super::polar::{Grey, Polar, Ring};
use super::proof::{self, Proof, Setting};
use crate::edges::{Vectorized, widest};

/// From this radius on a circle is proven at half the size, pixels.
const LARGE: f32 = 24.0;
/// In noise, from this radius on.
const SMALL: f32 = 9.0;
/// What noise that is, grey levels.
const NOISY: f32 = 8.0;

/// The frame and its halves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pyramid<'a> {
    pub(super) frame: &'a GrayImage,
    pub(super) sizes: &'a [Size],
}

/// A frame of a power of two below the full size.
#[derive(Clone, Debug, Default)]
pub(super) struct Size {
    pub(super) grey: Vec<u8>,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl<'a> Pyramid<'a> {
    /// How many times the frame was halved.
    pub(super) fn depth(&self) -> usize {
        self.sizes.len()
    }

    /// The frame, or the one that is as many times half of it.
    pub(super) fn grey(&self, depth: usize) -> Grey<'a> {
        match depth.checked_sub(1).and_then(|index| self.sizes.get(index)) {
            None => Grey {
                pixels: self.frame.as_raw(),
                width: self.frame.width() as usize,
                height: self.frame.height() as usize,
            },
            Some(size) => Grey {
                pixels: &size.grey,
                width: size.width,
                height: size.height,
            },
        }
    }
}

/// What is needed for proofs, and what has been proven.
pub(super) struct Prover<'a> {
    pub(super) pyramid: Pyramid<'a>,
    pub(super) circle: &'a UnitCircle,
    pub(super) polar: &'a mut Polar,
    /// Deviation of the frame's noise, grey levels.
    pub(super) noise: f32,
    /// Decimal logarithm of the number of circles that might have been tested.
    pub(super) tests: f32,
    pub(super) proofs: &'a mut Vec<Proof>,
}

impl Prover<'_> {
    /// Proves a candidate as far as it goes; the circle in pixels of the frame if it is beyond doubt.
    pub(super) fn prove(&mut self, candidate: &Candidate) -> Option<Ring> {
        let depth = self.depth_for(candidate.r);
        let scale = (1 << depth) as f32;
        let proof = widest(Proving {
            grey: self.pyramid.grey(depth),
            circle: self.circle,
            polar: self.polar,
            start: candidate.ring().shrunk(scale),
            setting: Setting {
                noise: self.noise / scale + 0.3,
                tests: self.tests,
            },
        });
        let proof = Proof { depth, ..proof? };
        self.proofs.push(proof);
        proof.is_beyond_doubt().then(|| proof.in_frame())
    }

    /// How many times the frame is to be halved for a circle of this radius.
    fn depth_for(&self, mut r: f32) -> usize {
        let mut depth = 0;
        while depth < self.pyramid.depth()
            && (r >= LARGE || (r >= SMALL && self.noise > NOISY * (1 << depth) as f32))
        {
            depth += 1;
            r *= 0.5;
        }
        depth
    }
}

/// The proof of a candidate.
struct Proving<'a> {
    grey: Grey<'a>,
    circle: &'a UnitCircle,
    polar: &'a mut Polar,
    start: Ring,
    setting: Setting,
}

impl Vectorized for Proving<'_> {
    type Output = Option<Proof>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        proof::prove(self.grey, self.circle, self.polar, self.start, &self.setting)
    }
}
