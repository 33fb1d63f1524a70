//! The handling of a candidate that the detectors share: its edge pixels are counted, it is fitted
//! to them, and they are taken out.

use super::belonging::{NearEdges, Probes};
use super::fit::fit_circle;
use crate::acceptance::{Acceptance, explained_band};
use crate::circle::Circle;
use crate::curve::Curve;
use crate::detect::Detection;
use crate::edges::EdgeMap;
use crate::error::ConfigError;
use crate::sampling::structure::Structure;

/// The edge pixels of a frame that no circle explains yet.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    pub(crate) acceptance: Acceptance,
    pub(crate) structure: Structure,
    pub(crate) near: NearEdges,
    /// For circles that are still off by more than the tolerance here and there.
    rough: Probes,
    /// Scratch: the edge points around a circle.
    around: Vec<(f64, f64)>,
}

impl Evidence {
    /// # Errors
    /// The first parameter outside its range.
    pub(crate) fn new(acceptance: Acceptance) -> Result<Self, ConfigError> {
        acceptance.check()?;
        Ok(Self {
            acceptance,
            structure: Structure::default(),
            near: NearEdges::new(acceptance.tolerance),
            rough: Probes::new(0.6 * acceptance.theta),
            around: Vec::new(),
        })
    }

    pub(crate) fn fill(&mut self, edges: &EdgeMap) {
        self.structure
            .fill(edges.width(), edges.height(), edges.pixels());
        self.near
            .fill(edges.width(), edges.height(), edges.pixels());
        // A circle has at most all of them around, so that what is found does not decide who
        // allocates.
        self.around.clear();
        self.around.reserve(edges.pixels().len());
    }

    /// The circle with its β, if that is above θ.
    pub(crate) fn check(&self, circle: Circle) -> Option<Detection> {
        let score = self.near.belonging_above(&circle, self.acceptance.theta)?;
        Some(Detection { circle, score })
    }

    /// A look at a few pixels of a circle that a fit may yet improve: false if it is most likely
    /// none.
    pub(crate) fn might_be(&self, circle: &Circle) -> bool {
        self.near.promising(circle, &self.rough)
    }

    /// The circle fitted to the edge points around it, at first to those within `reach` pixels;
    /// none if the fit fails or leads nowhere.
    pub(crate) fn fitted(&mut self, edges: &EdgeMap, circle: Circle, reach: f64) -> Option<Circle> {
        let band = self.acceptance.tolerance + 0.5;
        let Acceptance {
            min_radius,
            max_radius,
            ..
        } = self.acceptance;
        self.gather(edges, &circle, 2.0 * reach);
        let fixed = self.acceptance.known_radius().is_some();
        let rough = fit_circle(&self.around, circle, reach, fixed)?;
        if !self.might_be(&rough) {
            return None;
        }
        self.gather(edges, &rough, 2.0 * band);
        let fitted = fit_circle(&self.around, rough, band, fixed)?;
        if (min_radius..=max_radius).contains(&fitted.radius) {
            return Some(fitted);
        }
        // On the edge of the radius range: the best centre for the nearest radius inside.
        let radius = fitted.radius.clamp(min_radius, max_radius);
        fit_circle(&self.around, Circle { radius, ..fitted }, band, true)
    }

    /// Reports a circle: fits it, if that is wanted and gives a circle that may be reported, and
    /// takes out of `D` the edge pixels that it explains.
    pub(crate) fn accept(&mut self, edges: &EdgeMap, drawn: Detection, found: &mut Vec<Detection>) {
        let mut accepted = drawn;
        if self.acceptance.refine {
            // The circle through three whole pixels may be that far off.
            let reach = 2.0 * self.acceptance.tolerance + 1.0;
            let fitted = self.fitted(edges, drawn.circle, reach);
            let fitted = fitted.filter(|circle| self.acceptance.admits(circle, found));
            accepted = fitted
                .and_then(|circle| self.check(circle))
                .unwrap_or(drawn);
        }
        self.explain(&accepted.circle);
        found.push(accepted);
    }

    fn explain(&mut self, circle: &Circle) {
        let band = explained_band(self.acceptance.tolerance, circle.radius);
        let near = &mut self.near;
        self.structure.remove(|pixel| {
            let explained = circle.distance(pixel.x.into(), pixel.y.into()) <= band;
            if explained {
                near.forget(pixel);
            }
            explained
        });
    }

    fn gather(&mut self, edges: &EdgeMap, circle: &Circle, band: f64) {
        self.around.clear();
        self.around
            .extend(self.structure.entries().iter().filter_map(|entry| {
                let near = circle.distance(entry.pixel.x.into(), entry.pixel.y.into()) <= band;
                near.then(|| edges.position(entry.index as usize))
            }));
    }

    /// The memory it holds, bytes.
    pub(crate) fn memory(&self) -> usize {
        self.structure.memory()
            + self.near.memory()
            + size_of::<(f64, f64)>() * self.around.capacity()
    }
}

/// Best first; equal scores keep the order in which they were found.
pub(crate) fn rank(found: &mut [Detection]) {
    // In place, as the standard sort allocates. Detections are few.
    for end in 1..found.len() {
        let mut place = end;
        while place > 0 && found[place - 1].score < found[place].score {
            found.swap(place - 1, place);
            place -= 1;
        }
    }
}
