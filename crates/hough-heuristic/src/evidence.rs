//! What every detector does with a candidate: count its edge pixels, fit it to them, and take them
//! out.

use crate::belonging::{MAX_TOLERANCE, NearEdges, Probes};
use crate::error::{require, require_radii};
use crate::fit::fit_circle;
use crate::structure::Structure;
use crate::{Circle, ConfigError, Curve, Detection, EdgeMap, Region};

/// Which circles a detector reports.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Acceptance {
    /// The offset θ that β must exceed (default 0.65; 0..1, both excluded). Lower: balls more
    /// hidden are found, and more circles that are none.
    pub theta: f64,
    /// How far an edge pixel may lie from a pixel of the circle to match it, pixels (default 1;
    /// 0..=8). Larger: rounder than round is forgiven, and texture matches more by chance.
    pub tolerance: f64,
    /// The smallest radius, pixels (default 15; 1..=max_radius). Below about 15 px, with a
    /// tolerance of 1, corners and texture begin to pass for circles.
    pub min_radius: f64,
    /// The largest radius, pixels (default 300; min_radius..=100000). If it equals `min_radius` the
    /// radius is known: two pixels then determine a circle, and only the centre is fitted.
    pub max_radius: f64,
    /// How many circles to look for (default 1; at least 1).
    pub max_circles: usize,
    /// The least distance between the centres of two circles found, pixels (default 8; at least 0).
    /// 0 allows concentric ones.
    pub min_distance: f64,
    /// Where the centre may lie (default None: anywhere, even outside the frame).
    pub region: Option<Region>,
    /// Whether to fit an accepted circle to its edge pixels by least squares (default true). The
    /// Hough transforms, whose cells are coarse, fit a candidate once before they verify it in any
    /// case.
    pub refine: bool,
}

impl Default for Acceptance {
    fn default() -> Self {
        Self {
            theta: 0.65,
            tolerance: 1.0,
            min_radius: 15.0,
            max_radius: 300.0,
            max_circles: 1,
            min_distance: 8.0,
            region: None,
            refine: true,
        }
    }
}

impl Acceptance {
    /// # Errors
    /// The first parameter outside its range.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let &Self {
            theta,
            tolerance,
            min_distance,
            ..
        } = self;
        require(
            "theta",
            theta,
            "between 0 and 1, both excluded",
            theta > 0.0 && theta < 1.0,
        )?;
        require_radii(self.min_radius, self.max_radius)?;
        require(
            "tolerance",
            tolerance,
            "0..=8 px",
            (0.0..=MAX_TOLERANCE).contains(&tolerance),
        )?;
        require(
            "max_circles",
            self.max_circles as f64,
            "at least 1",
            self.max_circles > 0,
        )?;
        let usable = min_distance.is_finite() && min_distance >= 0.0;
        require(
            "min_distance",
            min_distance,
            "finite and at least 0 px",
            usable,
        )
    }

    /// # Errors
    /// The region of interest, if it does not lie in such a frame.
    pub(crate) fn check_frame(&self, width: u32, height: u32) -> Result<(), ConfigError> {
        self.region
            .map_or(Ok(()), |region| region.check_frame(width, height))
    }

    /// The radius, if only one is allowed.
    pub(crate) fn known_radius(&self) -> Option<f64> {
        (self.min_radius >= self.max_radius).then_some(self.min_radius)
    }

    /// Whether this circle may be reported beside those found.
    pub(crate) fn admits(&self, circle: &Circle, found: &[Detection]) -> bool {
        (self.min_radius..=self.max_radius).contains(&circle.radius)
            && self.region.is_none_or(|region| region.holds(circle))
            && found.iter().all(|other| {
                let (dx, dy) = (circle.x - other.circle.x, circle.y - other.circle.y);
                dx * dx + dy * dy >= self.min_distance * self.min_distance
            })
    }
}

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
            // Room for the error of a circle through three whole pixels.
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

/// How far from an accepted circle the edge pixels lie that it explains, pixels: what matches it,
/// and what the blur of the border and a ball that is not quite round leave beside it.
pub(crate) fn explained_band(tolerance: f64, radius: f64) -> f64 {
    tolerance + 1.5 + 0.01 * radius
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
