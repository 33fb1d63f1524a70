//! The settings of the trusted detector.

use crate::error::{require, require_radii};
use crate::{ConfigError, Region};

/// The settings of [`Trusted`](crate::Trusted).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TrustedConfig {
    /// The smallest radius, pixels (default 8; 4..=max_radius).
    pub min_radius: f64,
    /// The largest radius, pixels (default 280; min_radius..=100000).
    pub max_radius: f64,
    /// The most circles reported (default 32; at least 1).
    pub max_circles: usize,
    /// The least score reported (default 0.5; 0..=1).
    pub min_score: f64,
    /// The least contrast of an edge, grey levels (default 5; above 0..=128).
    pub contrast: f64,
    /// Where the centre may lie (default None: anywhere).
    pub region: Option<Region>,
    /// The seed of the draws (default 1).
    pub seed: u64,
}

impl Default for TrustedConfig {
    fn default() -> Self {
        Self {
            min_radius: 8.0,
            max_radius: 280.0,
            max_circles: 32,
            min_score: 0.5,
            contrast: 5.0,
            region: None,
            seed: 1,
        }
    }
}

impl TrustedConfig {
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
        )
    }
}
