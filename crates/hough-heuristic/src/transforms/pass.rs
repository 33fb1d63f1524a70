//! One frame through a detector: its edges, the evidence in them, the circles found, and the trace.

use std::time::Duration;

use image::GrayImage;

use super::evidence::{Evidence, rank};
use crate::circle::Circle;
use crate::clock;
use crate::detect::Detection;
use crate::edges::{EdgeDetector, EdgeMap};
use crate::stages::Stages;

/// The parts that the three transforms share.
#[derive(Clone, Debug)]
pub(super) struct Frames<E> {
    edge_detector: E,
    pub(super) evidence: Evidence,
    found: Vec<Detection>,
    candidates: Option<Vec<Circle>>,
    /// Times of finding edges, of arranging them, and of the search.
    times: [Duration; 3],
}

/// One frame, ready for a search.
#[derive(Debug)]
pub(super) struct Pass<'a> {
    pub(super) edges: &'a EdgeMap,
    pub(super) evidence: &'a mut Evidence,
    pub(super) found: &'a mut Vec<Detection>,
    candidates: Option<&'a mut Vec<Circle>>,
}

impl<E: EdgeDetector> Frames<E> {
    pub(super) fn new(edge_detector: E, evidence: Evidence) -> Self {
        Self {
            edge_detector,
            evidence,
            found: Vec::new(),
            candidates: None,
            times: [Duration::ZERO; 3],
        }
    }

    /// Finds the edges of a frame, runs `search` on them, and returns its circles, best first.
    pub(super) fn run(
        &mut self,
        frame: &GrayImage,
        search: impl FnOnce(&mut Pass<'_>),
    ) -> &[Detection] {
        self.found.clear();
        let start = clock::now();
        let edges = self.edge_detector.detect_edges(frame);
        let with_edges = clock::now();
        self.evidence.fill(edges);
        let with_structure = clock::now();
        if let Some(candidates) = &mut self.candidates {
            candidates.clear();
        }
        search(&mut Pass {
            edges,
            evidence: &mut self.evidence,
            found: &mut self.found,
            candidates: self.candidates.as_mut(),
        });
        rank(&mut self.found);
        self.times = [
            clock::between(start, with_edges),
            clock::between(with_edges, with_structure),
            clock::between(with_structure, clock::now()),
        ];
        &self.found
    }

    pub(super) fn keep_candidates(&mut self, keep: bool) {
        self.candidates = keep.then(Vec::new);
    }

    /// Returns the stages of the last frame; `accumulator` is the memory of the search beside the
    /// evidence, bytes.
    pub(super) fn stages(&self, accumulator: usize) -> Stages<'_> {
        let [edge_time, structure_time, search_time] = self.times;
        Stages {
            edges: self.edge_detector.edges(),
            candidates: self.candidates.as_deref().unwrap_or_default(),
            tolerance: self.evidence.acceptance.tolerance,
            memory: self.evidence.memory() + accumulator,
            edge_time,
            structure_time,
            search_time,
        }
    }
}

impl Pass<'_> {
    /// Records a circle that is looked at closely.
    pub(super) fn note(&mut self, candidate: Circle) {
        if let Some(candidates) = &mut self.candidates {
            candidates.push(candidate);
        }
    }

    /// Reports the circle if its β exceeds θ; returns `true` if it did.
    pub(super) fn report(&mut self, circle: Circle) -> bool {
        let Some(detection) = self.evidence.check(circle) else {
            return false;
        };
        self.evidence.accept(self.edges, detection, self.found);
        true
    }

    /// Fits a rough circle to the edge points within `reach` pixels and reports it if it is one;
    /// returns `true` if it was.
    pub(super) fn verify(&mut self, rough: Circle, reach: f64) -> bool {
        self.note(rough);
        let fitted = self.evidence.fitted(self.edges, rough, reach);
        fitted.is_some_and(|circle| {
            self.evidence.acceptance.admits(&circle, self.found) && self.report(circle)
        })
    }

    /// Returns `true` if as many circles are found as are looked for.
    pub(super) fn is_complete(&self) -> bool {
        self.found.len() >= self.evidence.acceptance.max_circles
    }
}
