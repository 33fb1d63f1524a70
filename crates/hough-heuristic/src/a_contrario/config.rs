//! The settings of the a contrario detector.

use crate::error::ConfigError;
use crate::error::{require, require_radii};
use crate::region::Region;

/// Settings of [`AContrario`](crate::AContrario).
///
/// The defaults suit every kind of frame; no threshold needs tuning to a scene.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct AContrarioConfig {
    /// Smallest radius, pixels (default 8; 4..=max_radius). Below 8 the full size of the frame is
    /// searched too, which takes several times as long.
    pub min_radius: f64,
    /// Largest radius, pixels (default 280; min_radius..=100000). If it equals `min_radius`, the
    /// radius is known: circles whose measured radius is within 1 px plus 5 % of it are reported
    /// with that radius.
    pub max_radius: f64,
    /// Largest number of circles reported, best first (default 32; at least 1).
    pub max_circles: usize,
    /// Smallest score reported (default 0.5, which bounds circles of pure chance by one in ten
    /// frames; 0..=1). Larger values drop things that are hardly round. Smaller values add mostly
    /// circles of chance.
    pub min_score: f64,
    /// Smallest contrast of an edge that is drawn, gray levels (default 8; above 0..=128). Smaller
    /// values find fainter circles and take longer. Noise raises it.
    pub contrast: f64,
    /// Largest number of pairs drawn per million pixels of the frame (default 50000; at least 1).
    /// A frame below 250,000 pixels counts as that many. Each draw brings a budget of 16 looks,
    /// which bounds all work that depends on the frame's content; each circle found adds 50 draws
    /// and 8,000 looks. Smaller values miss circles amid dense texture.
    pub draws_per_megapixel: u32,
    /// Time limit of the search, milliseconds per million pixels (default None; above 0). With a
    /// time limit the result depends on the speed of the machine. It has no effect on targets
    /// without a clock.
    pub milliseconds_per_megapixel: Option<f64>,
    /// Region in which the centre must lie (default None: anywhere).
    pub region: Option<Region>,
    /// Seed of the draws (default 1).
    pub seed: u64,
}

impl Default for AContrarioConfig {
    fn default() -> Self {
        Self {
            min_radius: 8.0,
            max_radius: 280.0,
            max_circles: 32,
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
        require_radii(self.min_radius, self.max_radius)?;
        require(
            "min_radius",
            self.min_radius,
            "at least 4",
            self.min_radius >= 4.0,
        )?;
        require(
            "max_circles",
            self.max_circles as f64,
            "at least 1",
            self.max_circles > 0,
        )?;
        require(
            "min_score",
            self.min_score,
            "0..=1",
            (0.0..=1.0).contains(&self.min_score),
        )?;
        require(
            "contrast",
            self.contrast,
            "above 0..=128",
            self.contrast > 0.0 && self.contrast <= 128.0,
        )?;
        require(
            "draws_per_megapixel",
            self.draws_per_megapixel.into(),
            "at least 1",
            self.draws_per_megapixel > 0,
        )?;
        let time = self.milliseconds_per_megapixel.unwrap_or(1.0);
        require(
            "milliseconds_per_megapixel",
            time,
            "above 0..=1e6",
            time > 0.0 && time <= 1e6,
        )?;
        self.region.map_or(Ok(()), |region| region.check())
    }
}
