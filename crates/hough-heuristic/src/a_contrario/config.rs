//! The settings of the a contrario detector.

use super::rings::Rings;
use crate::error::{ConfigError, require, require_radii, require_some};
use crate::region::Region;

/// Smallest radius that is possible, pixels.
const SMALLEST: f64 = 4.0;
/// Default of the largest radius, in shorter sides of the frame.
const LARGEST: f64 = 0.52;
/// Least default of the largest radius beside a small region, pixels.
const LARGEST_IN_REGION: f64 = 280.0;

/// Settings of [`AContrario`](crate::AContrario).
///
/// The defaults suit every kind of frame; no threshold needs tuning to a scene.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct AContrarioConfig {
    /// Smallest radius, pixels (4..=max_radius). Below 8 the full size of the frame is searched
    /// too, which takes several times as long. The default, None, is 4 px if small closed outlines
    /// are seen in the frame halved once, and 8 px otherwise.
    pub min_radius: Option<f64>,
    /// Largest radius, pixels (min_radius or 8, ..=100000). The default, None, is 0.52 of the
    /// shorter side of the frame. With a `region` it is 0.52 of the region's shorter side, but not
    /// below 280 px and not above the default without a region. If `max_radius` equals
    /// `min_radius`, the radius is known: circles whose measured radius differs from it by at most
    /// 1 px plus 5 % are reported with the known radius.
    pub max_radius: Option<f64>,
    /// Largest number of circles reported, best first (default: all; at least 1).
    pub max_circles: usize,
    /// Circles reported of those about one centre (default [`Rings::All`]).
    pub rings: Rings,
    /// Smallest distance between the centres of two circles, pixels (default 0: any; at least 0).
    /// Of two nearer ones the better is reported.
    pub min_distance: f64,
    /// Smallest ratio of the half-axes of an outline (default 1: circles only; 0.3..=1). Below 1
    /// ellipses are found beside the circles, and each [`Measurement`](crate::Measurement) has one.
    /// The radii of an ellipse, from the shorter half-axis to the longer, must overlap the range.
    /// It takes several times as long.
    pub min_axis_ratio: f64,
    /// Smallest score reported (default 0.5, which bounds circles of pure chance by one in ten
    /// frames; 0..=1). Larger values drop things that are hardly round. Smaller values add mostly
    /// circles of chance.
    pub min_score: f64,
    /// Smallest contrast of an edge that the search draws, gray levels (default 8; above 0, at most
    /// 128). Smaller values find fainter circles and take longer. Noise raises the contrast used.
    pub contrast: f64,
    /// Largest number of pairs drawn per million pixels of the frame (default 50000; at least 1).
    /// A smaller frame than 250,000 pixels counts as that many. One in which circles below 8 px are
    /// sought by default counts twice. Each draw adds 16 looks to the
    /// sample budget, which bounds all work that depends on the frame's content
    /// ([`Effort::looks`](crate::Effort::looks)). Each circle found adds 50 draws and 8,000 looks.
    /// Smaller values miss circles amid dense texture.
    pub draws_per_megapixel: u32,
    /// Time limit of the search, milliseconds per million pixels (default None; above 0). With a
    /// time limit the result depends on the speed of the machine. It has no effect on targets
    /// without a clock.
    pub milliseconds_per_megapixel: Option<f64>,
    /// Region in which the centre must lie (default None: anywhere). Only the region and what lies
    /// within the largest radius of it are searched.
    pub region: Option<Region>,
    /// Seed of the draws (default 1).
    pub seed: u64,
}

impl Default for AContrarioConfig {
    fn default() -> Self {
        Self {
            min_radius: None,
            max_radius: None,
            max_circles: usize::MAX,
            rings: Rings::All,
            min_distance: 0.0,
            min_axis_ratio: 1.0,
            min_score: 0.5,
            contrast: 8.0,
            draws_per_megapixel: 50_000,
            milliseconds_per_megapixel: None,
            region: None,
            seed: 1,
        }
    }
}

impl AContrarioConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let (min, score, contrast) = (self.first_radius(), self.min_score, self.contrast);
        require_radii(min, self.max_radius.unwrap_or(min))?;
        require("min_radius", min, "at least 4", min >= 4.0)?;
        require_some("max_circles", self.max_circles)?;
        let distance = self.min_distance;
        let usable = distance.is_finite() && distance >= 0.0;
        require("min_distance", distance, "finite and at least 0 px", usable)?;
        let ratio = self.min_axis_ratio;
        let usable = (0.3..=1.0).contains(&ratio);
        require("min_axis_ratio", ratio, "0.3..=1", usable)?;
        require("min_score", score, "0..=1", (0.0..=1.0).contains(&score))?;
        let usable = contrast > 0.0 && contrast <= 128.0;
        require("contrast", contrast, "above 0..=128", usable)?;
        require_some("draws_per_megapixel", self.draws_per_megapixel as usize)?;
        let time = self.milliseconds_per_megapixel.unwrap_or(1.0);
        let usable = time > 0.0 && time <= 1e6;
        require("milliseconds_per_megapixel", time, "above 0..=1e6", usable)?;
        self.region.map_or(Ok(()), |region| region.check())
    }

    /// The smallest radius that is always searched.
    pub(super) fn first_radius(&self) -> f64 {
        self.min_radius.unwrap_or(8.0)
    }

    /// The radius, if only one is allowed.
    pub(super) fn known_radius(&self) -> Option<f64> {
        self.max_radius.filter(|max| self.first_radius() >= *max)
    }

    /// Returns the smallest and the largest radius for a frame of this size.
    pub(super) fn radii(&self, width: u32, height: u32) -> (f64, f64) {
        let part = |width: u32, height: u32| LARGEST * f64::from(width.min(height));
        let by_frame = part(width, height);
        let by_region = |region: Region| part(region.width, region.height).max(LARGEST_IN_REGION);
        let default = self
            .region
            .map_or(by_frame, |region| by_region(region).min(by_frame));
        let max = self
            .max_radius
            .unwrap_or(default.max(self.first_radius() + 1.0));
        (self.min_radius.unwrap_or(SMALLEST.min(max)), max)
    }
}
