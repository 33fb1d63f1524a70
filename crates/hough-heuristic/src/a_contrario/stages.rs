//! The stages of the detector, for pictures.

use std::time::Duration;

use image::{GrayImage, Luma};

use super::candidate::Candidate;
use super::polar::Ring;
use super::proof::Proof;
use super::{AContrario, LEAST_SIDE};
use crate::circle::Circle;
use crate::edges::EdgeMap;
use crate::region::Region;
use crate::stages::Stages;

/// The stages of the last frame, if they are kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Shown {
    keep: bool,
    edges: EdgeMap,
    candidates: Vec<Circle>,
}

impl AContrario {
    /// Sets whether the detector remembers the edges and the candidates of each frame from now on,
    /// for [`stages`](Self::stages). By default it does not.
    pub fn keep_candidates(&mut self, keep: bool) {
        let shown = Shown::default();
        self.shown = Shown { keep, ..shown };
    }

    /// Returns the stages of the last frame, empty unless they are
    /// [kept](Self::keep_candidates): the edges of the largest size that was searched, the circles
    /// that were proven, and those that waited for a proof. Their times and memory are zero, since
    /// the stages overlap.
    pub fn stages(&self) -> Stages<'_> {
        Stages {
            edges: &self.shown.edges,
            candidates: &self.shown.candidates,
            tolerance: 0.5,
            memory: 0,
            edge_time: Duration::ZERO,
            structure_time: Duration::ZERO,
            search_time: Duration::ZERO,
        }
    }

    /// Remembers the stages after the search of `part` of a frame.
    pub(super) fn show(&mut self, frame: &GrayImage, part: Region) {
        if !self.shown.keep {
            return;
        }
        let mut edges = GrayImage::new(frame.width(), frame.height());
        self.shown.candidates.clear();
        if part.width >= LEAST_SIDE && part.height >= LEAST_SIDE {
            let level = &self.edges[1].level;
            let scale = if level.width < part.width as usize {
                2.0
            } else {
                1.0
            };
            let (left, top) = (part.left as f32, part.top as f32);
            for (x, y) in level.points() {
                let [x, y] = [x, y].map(|at| at * scale + 0.5 * (scale - 1.0) + 0.5);
                if let Some(pixel) =
                    edges.get_pixel_mut_checked((left + x) as u32, (top + y) as u32)
                {
                    *pixel = Luma([255]);
                }
            }
            let proven = self.proofs.iter().map(Proof::in_frame);
            let waiting = self.collected.candidates.iter().map(Candidate::ring);
            let circle = |Ring { x, y, r }| Circle {
                x: (left + x).into(),
                y: (top + y).into(),
                radius: r.into(),
            };
            self.shown
                .candidates
                .extend(proven.chain(waiting).map(circle));
        }
        self.shown.edges.copy_from(&edges);
    }
}
