//! The rules by which the transforms report a circle.

use crate::circle::Circle;
use crate::detect::{Detection, FrameRefused};
use crate::error::{
    ConfigError, require, require_radii, require_share, require_some, require_tolerance,
};
use crate::region::Region;

/// Pixels beyond the outline that are searched, for the edges of it.
const MARGIN: f64 = 16.0;

/// Rules by which the transforms report a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Acceptance {
    /// Offset θ that β must exceed (default 0.65; 0..1, both excluded). Smaller values find balls
    /// that are more hidden, and more false circles.
    pub theta: f64,
    /// Largest distance of an edge pixel from a circle's pixel that it matches, pixels (default 1;
    /// 0..=8). Larger values accept balls that are not quite round, and texture matches more often
    /// by chance.
    pub tolerance: f64,
    /// Smallest radius, pixels (default 15; 1..=max_radius). Below about 15 px, with a tolerance of
    /// 1, corners and texture begin to pass for circles.
    pub min_radius: f64,
    /// Largest radius, pixels (default 300; min_radius..=100000). If it equals `min_radius`, the
    /// radius is known: two pixels then determine a circle, and only the centre is fitted.
    pub max_radius: f64,
    /// Largest number of circles reported (default 1; at least 1).
    pub max_circles: usize,
    /// Smallest distance between the centres of two circles, pixels (default 8; at least 0). 0
    /// allows concentric circles.
    pub min_distance: f64,
    /// Region in which the centre must lie (default None: anywhere, even outside the frame). Only
    /// the region and what lies within `max_radius` of it are searched.
    pub region: Option<Region>,
    /// Fits an accepted circle to its edge pixels by least squares (default true). Three whole
    /// pixels give the centre to about a pixel, the fit to a twentieth; it goes beyond the paper.
    /// The Hough transforms always fit a candidate once before they verify it, since their cells
    /// are coarse.
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
        require_share("theta", self.theta)?;
        require_radii(self.min_radius, self.max_radius)?;
        require_tolerance(self.tolerance)?;
        require_some("max_circles", self.max_circles)?;
        let distance = self.min_distance;
        let usable = distance.is_finite() && distance >= 0.0;
        require("min_distance", distance, "finite and at least 0 px", usable)?;
        self.region.map_or(Ok(()), |region| region.check())
    }

    /// # Errors
    /// The region of interest, if it sticks out of such a frame.
    pub(crate) fn check_frame(&self, width: u32, height: u32) -> Result<(), FrameRefused> {
        self.region
            .map_or(Ok(()), |region| region.check_frame(width, height))
    }

    /// The part of a frame that is searched: the region and what lies within the largest radius of
    /// it.
    pub(crate) fn part(&self, width: u32, height: u32) -> Region {
        let whole = Region {
            left: 0,
            top: 0,
            width,
            height,
        };
        let reach = self.max_radius + self.tolerance + MARGIN;
        self.region
            .map_or(whole, |region| region.grown(reach, width, height))
    }

    /// The radius, if only one is allowed.
    pub(crate) fn known_radius(&self) -> Option<f64> {
        (self.min_radius >= self.max_radius).then_some(self.min_radius)
    }

    /// Returns `true` if this circle may be reported beside those found.
    pub(crate) fn admits(&self, circle: &Circle, found: &[Detection]) -> bool {
        (self.min_radius..=self.max_radius).contains(&circle.radius)
            && self.region.is_none_or(|region| region.holds(circle))
            && found.iter().all(|other| {
                let (dx, dy) = (circle.x - other.circle.x, circle.y - other.circle.y);
                dx * dx + dy * dy >= self.min_distance * self.min_distance
            })
    }
}

/// Largest distance from an accepted circle of the edge pixels that it explains, pixels: the
/// tolerance, the blur of the border, and a ball that is not quite round.
pub(crate) fn explained_band(tolerance: f64, radius: f64) -> f64 {
    tolerance + 1.5 + 0.01 * radius
}
