//! One frame through a transform: its edges, the circles that they bear out, and the trace.

use std::time::Duration;

use image::GrayImage;

use super::belonging::{Probes, Unexplained};
use super::fit::fit_circle;
use crate::acceptance::{Acceptance, explained_band};
use crate::circle::Circle;
use crate::clock;
use crate::curve::Curve;
use crate::detect::Detection;
use crate::edges::{EdgeDetector, EdgeMap};
use crate::error::ConfigError;
use crate::region::Region;
use crate::stages::Stages;

/// The parts that the three transforms share.
#[derive(Clone, Debug)]
pub(super) struct Frames<E> {
    edge_detector: E,
    pub(super) accept: Acceptance,
    /// The part of the frame that is searched, and its edges in the whole frame, if it is not all
    /// of the frame.
    window: Option<(GrayImage, EdgeMap)>,
    unexplained: Unexplained,
    /// For circles that are still off by more than the tolerance in places.
    rough: Probes,
    /// Scratch: the edge points around a circle.
    around: Vec<(f64, f64)>,
    found: Vec<Detection>,
    candidates: Option<Vec<Circle>>,
    /// Times of finding edges, of arranging them, and of the search.
    times: [Duration; 3],
}

/// One frame, ready for a search.
#[derive(Debug)]
pub(super) struct Pass<'a> {
    /// The rules, with the region in pixels of what is searched.
    pub(super) accept: &'a Acceptance,
    pub(super) edges: &'a EdgeMap,
    pub(super) unexplained: &'a mut Unexplained,
    rough: &'a Probes,
    around: &'a mut Vec<(f64, f64)>,
    pub(super) found: &'a mut Vec<Detection>,
    candidates: Option<&'a mut Vec<Circle>>,
}

impl<E: EdgeDetector> Frames<E> {
    /// # Errors
    /// The first parameter outside its range.
    pub(super) fn new(edge_detector: E, accept: Acceptance) -> Result<Self, ConfigError> {
        accept.check()?;
        Ok(Self {
            edge_detector,
            accept,
            window: None,
            unexplained: Unexplained::new(accept.tolerance),
            rough: Probes::new(0.6 * accept.theta),
            around: Vec::new(),
            found: Vec::new(),
            candidates: None,
            times: [Duration::ZERO; 3],
        })
    }

    /// Finds the edges of a frame, runs `search` on them, and returns its circles, best first.
    pub(super) fn run(
        &mut self,
        frame: &GrayImage,
        search: impl FnOnce(&mut Pass<'_>),
    ) -> &[Detection] {
        self.found.clear();
        let start = clock::now();
        let (width, height) = frame.dimensions();
        let part = self.accept.part(width, height);
        let mut accept = self.accept;
        let edges = match (accept.region, &mut self.window) {
            (Some(region), window) if (part.width, part.height) != (width, height) => {
                accept.region = Some(Region {
                    left: region.left - part.left,
                    top: region.top - part.top,
                    ..region
                });
                let (cut, shown) = window.get_or_insert_default();
                *cut = part.cut(frame, std::mem::take(cut));
                let edges = self.edge_detector.detect_edges(cut);
                shown.place(edges, (part.left, part.top), (width, height));
                edges
            }
            (_, window) => {
                *window = None;
                self.edge_detector.detect_edges(frame)
            }
        };
        let with_edges = clock::now();
        self.unexplained.fill(edges);
        // A circle has at most all of them around, so that what is found does not decide who
        // allocates.
        self.around.clear();
        self.around.reserve(edges.pixels().len());
        let with_structure = clock::now();
        if let Some(candidates) = &mut self.candidates {
            candidates.clear();
        }
        search(&mut Pass {
            accept: &accept,
            edges,
            unexplained: &mut self.unexplained,
            rough: &self.rough,
            around: &mut self.around,
            found: &mut self.found,
            candidates: self.candidates.as_mut(),
        });
        rank(&mut self.found);
        let found = self.found.iter_mut().map(|found| &mut found.circle);
        for circle in found.chain(self.candidates.iter_mut().flatten()) {
            circle.x += f64::from(part.left);
            circle.y += f64::from(part.top);
        }
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

    /// Returns the stages of the last frame; `search` is the memory of the search alone, bytes.
    pub(super) fn stages(&self, search: usize) -> Stages<'_> {
        let [edge_time, structure_time, search_time] = self.times;
        let around = size_of::<(f64, f64)>() * self.around.capacity();
        Stages {
            edges: match &self.window {
                Some((_, edges)) => edges,
                None => self.edge_detector.edges(),
            },
            candidates: self.candidates.as_deref().unwrap_or_default(),
            tolerance: self.accept.tolerance,
            memory: self.unexplained.memory() + around + search,
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

    /// Looks at a few pixels of a circle that a fit may yet improve; false if it is most likely
    /// none.
    pub(super) fn might_be(&self, circle: &Circle) -> bool {
        self.unexplained.near.promising(circle, self.rough)
    }

    /// Reports the circle if its β exceeds θ, fitted if that is wanted and gives a circle that may
    /// be reported, and takes out of `D` the edge pixels that it explains. Returns `true` if it
    /// reported one.
    pub(super) fn report(&mut self, circle: Circle) -> bool {
        let Some(mut accepted) = self.check(circle) else {
            return false;
        };
        if self.accept.refine {
            // The circle through three whole pixels may be that far off.
            let fitted = self.fitted(circle, 2.0 * self.accept.tolerance + 1.0);
            let fitted = fitted.filter(|circle| self.accept.admits(circle, self.found));
            accepted = fitted
                .and_then(|circle| self.check(circle))
                .unwrap_or(accepted);
        }
        let band = explained_band(self.accept.tolerance, accepted.circle.radius);
        self.unexplained.explain(&accepted.circle, band);
        self.found.push(accepted);
        true
    }

    /// Fits a rough circle to the edge points within `reach` pixels and reports it if it is one;
    /// returns `true` if it was.
    pub(super) fn verify(&mut self, rough: Circle, reach: f64) -> bool {
        self.note(rough);
        let fitted = self.fitted(rough, reach);
        fitted.is_some_and(|circle| self.accept.admits(&circle, self.found) && self.report(circle))
    }

    /// Returns `true` if as many circles are found as are looked for.
    pub(super) fn is_complete(&self) -> bool {
        self.found.len() >= self.accept.max_circles
    }

    /// The circle with its β, if that is above θ.
    fn check(&self, circle: Circle) -> Option<Detection> {
        let near = &self.unexplained.near;
        let score = near.belonging_of_circle(&circle, self.accept.theta)?;
        Some(Detection { circle, score })
    }

    /// Returns the circle fitted to the edge points around it, at first to those within `reach`
    /// pixels, or `None` if the fit fails or leads nowhere.
    fn fitted(&mut self, circle: Circle, reach: f64) -> Option<Circle> {
        let band = self.accept.tolerance + 0.5;
        let (min, max) = (self.accept.min_radius, self.accept.max_radius);
        let fixed = self.accept.known_radius().is_some();
        self.gather(&circle, 2.0 * reach);
        let rough = fit_circle(self.around, circle, reach, fixed)?;
        if !self.might_be(&rough) {
            return None;
        }
        self.gather(&rough, 2.0 * band);
        let fitted = fit_circle(self.around, rough, band, fixed)?;
        if (min..=max).contains(&fitted.radius) {
            return Some(fitted);
        }
        // On the edge of the radius range: the best centre for the nearest radius inside.
        let radius = fitted.radius.clamp(min, max);
        fit_circle(self.around, Circle { radius, ..fitted }, band, true)
    }

    fn gather(&mut self, circle: &Circle, band: f64) {
        self.around.clear();
        let entries = self.unexplained.structure.entries().iter();
        self.around.extend(entries.filter_map(|entry| {
            let near = circle.distance(entry.pixel.x.into(), entry.pixel.y.into()) <= band;
            near.then(|| self.edges.position(entry.index as usize))
        }));
    }
}

/// Best first; equal scores keep the order in which they were found.
fn rank(found: &mut [Detection]) {
    // In place, as the standard sort allocates. Detections are few.
    for end in 1..found.len() {
        let mut place = end;
        while place > 0 && found[place - 1].score < found[place].score {
            found.swap(place - 1, place);
            place -= 1;
        }
    }
}
