//! The settings of the a contrario detector.

use crate::error::ConfigError;
use crate::error::{require, require_radii};
use crate::region::Region;

/// The settings of [`AContrario`](crate::AContrario).
///
/// The defaults are meant for every frame: there is no threshold to tune to a scene.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct AContrarioConfig {
    /// The smallest radius, pixels (default 8; 4..=max_radius). Below 8 the full size of the frame
    /// is searched too, which takes several times as long.
    pub min_radius: f64,
    /// The largest radius, pixels (default 280; min_radius..=100000). If it equals `min_radius` the
    /// radius is known: circles that measure within a pixel and 5 % of it are reported, with that
    /// radius.
    pub max_radius: f64,
    /// The most circles reported (default 32; at least 1): the best.
    pub max_circles: usize,
    /// The least score reported (default 0.5, at most one circle of pure chance in ten frames;
    /// 0..=1). Higher: fewer things that are hardly round. Lower: little more, as what is below is
    /// mostly chance.
    pub min_score: f64,
    /// The least contrast of an edge to be drawn, grey levels (default 8; above 0..=128). Lower
    /// finds fainter circles and takes longer; noise raises it.
    pub contrast: f64,
    /// How many pairs may be drawn, for each million pixels of the frame (default 50000; at least
    /// 1), a frame of less than a quarter of a million counting as a quarter. Sixteen looks go with
    /// each draw and bound all of the work that depends on what the frame shows. Less leaves out
    /// circles amid dense texture, more finds little.
    pub draws_per_megapixel: u32,
    /// How long the search may take, milliseconds for each million pixels (default None: no clock
    /// is looked at; above 0). With a clock what is found depends on the machine too.
    pub milliseconds_per_megapixel: Option<f64>,
    /// Where the centre may lie (default None: anywhere).
    pub region: Option<Region>,
    /// The seed of the draws (default 1).
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
