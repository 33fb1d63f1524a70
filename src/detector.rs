//! Circle detectors by name, configured for the camera on the hand.

use std::fmt;
use std::str::FromStr;

use hough_heuristic::{
    AContrario, AContrarioConfig, Acceptance, Canny, CannyConfig, CircleDetector, ConfigError,
    Heuristic, HeuristicConfig, RandomizedHough, RandomizedHoughConfig, StandardHough,
    StandardHoughConfig,
};

use crate::rig::RigError;

/// A circle detector for the ball in frames of the camera on the hand.
///
/// Command lines accept the names of all that are in [`BallDetector::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum BallDetector {
    /// The *a contrario* detector: pairs of edge points at several sizes, each circle tested
    /// against chance. Beyond the paper.
    #[default]
    AContrario,
    /// Three random edge pixels, belonging against a threshold: the paper's.
    Heuristic,
    /// The randomized Hough transform.
    RandomizedHough,
    /// The standard Hough transform, voting along the gradient; some seconds a frame.
    StandardHough,
}

/// Width of the rendered frames, pixels.
const FRAME_WIDTH: u32 = 768;

/// Radii of the ball's outline, pixels of the camera's frame: 5 to 68 feature units.
const RADII: (f64, f64) = (20.0, 272.0);

/// The belonging that a circle must exceed.
const THETA: f64 = 0.6;

impl BallDetector {
    /// All detectors.
    pub const ALL: [Self; 4] = [
        Self::AContrario,
        Self::Heuristic,
        Self::RandomizedHough,
        Self::StandardHough,
    ];

    /// Returns the detector's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::AContrario => "a-contrario",
            Self::Heuristic => "heuristic",
            Self::RandomizedHough => "rht",
            Self::StandardHough => "sht",
        }
    }

    /// Builds the detector for the ball of 20 mm radius in frames of 768x576 pixels. `seed` is that
    /// of its random draws.
    ///
    /// # Errors
    /// None: the settings made here are valid.
    pub fn build(self, seed: u64) -> Result<Box<dyn CircleDetector + Send>, ConfigError> {
        self.build_for(FRAME_WIDTH, 1.0, seed)
    }

    /// Builds the detector for frames `width` pixels wide and a ball with a radius of `size` times
    /// 20 mm.
    ///
    /// # Errors
    /// A size for which there are no radii.
    pub fn build_for(
        self,
        width: u32,
        size: f64,
        seed: u64,
    ) -> Result<Box<dyn CircleDetector + Send>, ConfigError> {
        let scale = f64::from(width) / f64::from(FRAME_WIDTH);
        // A small ball must be seen from afar too.
        let radii = (RADII.0 * scale * size.min(1.0), RADII.1 * scale * size);
        let accept = Acceptance {
            theta: THETA,
            min_radius: radii.0,
            max_radius: radii.1,
            ..Acceptance::default()
        };
        Ok(match self {
            Self::AContrario => {
                let config = AContrarioConfig {
                    min_radius: Some(radii.0),
                    max_radius: Some(radii.1),
                    max_circles: 1,
                    min_score: MIN_SCORE,
                    seed,
                    ..AContrarioConfig::default()
                };
                Box::new(AContrario::new(config)?)
            }
            Self::Heuristic => {
                let config = HeuristicConfig {
                    accept,
                    seed,
                    ..HeuristicConfig::default()
                };
                Box::new(Heuristic::new(config, weak_edges()?)?)
            }
            Self::RandomizedHough => {
                let config = RandomizedHoughConfig {
                    accept,
                    seed,
                    ..RandomizedHoughConfig::default()
                };
                Box::new(RandomizedHough::new(config, weak_edges()?)?)
            }
            Self::StandardHough => {
                let config = StandardHoughConfig {
                    accept,
                    gradient: true,
                    ..StandardHoughConfig::default()
                };
                Box::new(StandardHough::new(config, weak_edges()?)?)
            }
        })
    }
}

/// Least score of a circle that the arm goes for. Curves of the clutter score up to 0.5 and would
/// lead the arm astray in the many frames without a ball; the ball scores above 0.9 unless the
/// border cuts it.
const MIN_SCORE: f64 = 0.8;

/// Builds an edge detector with low thresholds: the shaded side of the ball is hardly brighter than
/// the table.
fn weak_edges() -> Result<Canny, ConfigError> {
    Canny::new(CannyConfig {
        low: 20.0,
        high: 50.0,
        ..CannyConfig::default()
    })
}

impl fmt::Display for BallDetector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for BallDetector {
    type Err = RigError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        // Former name of the a contrario detector.
        let text = if text == "trusted" {
            "a-contrario"
        } else {
            text
        };
        Self::ALL
            .into_iter()
            .find(|detector| detector.name() == text)
            .ok_or_else(|| RigError::UnknownDetector(text.into()))
    }
}
