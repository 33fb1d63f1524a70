//! The detectors by name, and what they tell of a frame.

use std::error::Error;
use std::time::Duration;

use image::GrayImage;

use super::{DetectorName, Options};
use crate::a_contrario::{AContrario, AContrarioConfig, Effort, Measurement};
use crate::acceptance::Acceptance;
use crate::detect::{CircleDetector, Detection};
use crate::edges::{Canny, EdgeDetector};
use crate::stages::Stages;
use crate::transforms::{
    Heuristic, HeuristicConfig, RandomizedHough, RandomizedHoughConfig, StandardHough,
    StandardHoughConfig,
};

/// A detector that shows the stages of its last frame.
pub(super) trait Staged: CircleDetector {
    fn stages(&self) -> Stages<'_>;

    fn keep_candidates(&mut self, keep: bool);

    /// Measurements and effort, from the detector that has them.
    fn details(&self) -> Option<(&[Measurement], Effort)> {
        None
    }
}

impl Staged for AContrario {
    fn stages(&self) -> Stages<'_> {
        self.stages()
    }

    fn keep_candidates(&mut self, keep: bool) {
        self.keep_candidates(keep);
    }

    fn details(&self) -> Option<(&[Measurement], Effort)> {
        Some((self.measurements(), self.effort()))
    }
}

macro_rules! staged {
    ($($detector:ident)*) => {$(
        impl<E: EdgeDetector> Staged for $detector<E> {
            fn stages(&self) -> Stages<'_> {
                self.stages()
            }

            fn keep_candidates(&mut self, keep: bool) {
                self.keep_candidates(keep);
            }
        }
    )*};
}

staged!(Heuristic RandomizedHough StandardHough);

/// The circles of one frame, and the times of the quickest search.
pub(super) struct Searched {
    pub(super) found: Vec<Detection>,
    pub(super) cpu: Duration,
    /// Times of the edges, of the structure and of the search, where the detector tells them.
    pub(super) stages: Option<[Duration; 3]>,
}

/// Searches a frame `repeat` times and takes the least time.
pub(super) fn search(
    frame: &GrayImage,
    detector: &mut dyn Staged,
    repeat: u32,
) -> Result<Searched, String> {
    if frame.is_empty() {
        return Err("the image has no pixels".into());
    }
    let mut searched = Searched {
        found: Vec::new(),
        cpu: Duration::MAX,
        stages: None,
    };
    for _ in 0..repeat {
        let before = cpu_time();
        let found = detector.detect(frame).map_err(|error| error.to_string())?;
        let spent = cpu_time().saturating_sub(before);
        searched.found = found.to_vec();
        if spent < searched.cpu {
            searched.cpu = spent;
            let stages = detector.stages();
            let times = [stages.edge_time, stages.structure_time, stages.search_time];
            searched.stages = detector.details().is_none().then_some(times);
        }
    }
    Ok(searched)
}

impl Options {
    /// The detector with the settings of the command line.
    pub(super) fn detector(&self) -> Result<Box<dyn Staged>, Box<dyn Error>> {
        let mut detector = match self.detector {
            DetectorName::AContrario => Box::new(AContrario::new(self.a_contrario())?),
            _ => self.transform()?,
        };
        detector.keep_candidates(self.stages.is_some());
        Ok(detector)
    }

    fn a_contrario(&self) -> AContrarioConfig {
        let default = AContrarioConfig::default();
        AContrarioConfig {
            min_radius: self.min_radius,
            max_radius: self.max_radius,
            max_circles: self.max_circles.unwrap_or(default.max_circles),
            rings: self.rings.unwrap_or(default.rings),
            min_distance: self.min_distance.unwrap_or(default.min_distance),
            min_axis_ratio: self.min_axis_ratio.unwrap_or(default.min_axis_ratio),
            min_score: self.min_score.unwrap_or(default.min_score),
            contrast: self.contrast.unwrap_or(default.contrast),
            draws_per_megapixel: self.draws.unwrap_or(default.draws_per_megapixel),
            milliseconds_per_megapixel: self.time_limit,
            region: self.region,
            seed: self.seed.unwrap_or(default.seed),
        }
    }

    fn transform(&self) -> Result<Box<dyn Staged>, Box<dyn Error>> {
        for (option, given) in [
            ("--rings", self.rings.is_some()),
            ("--min-axis-ratio", self.min_axis_ratio.is_some()),
            ("--contrast", self.contrast.is_some()),
            ("--draws", self.draws.is_some()),
            ("--time-limit", self.time_limit.is_some()),
        ] {
            if given {
                return Err(format!("{option} is for --detector a-contrario only").into());
            }
        }
        let (name, canny) = (self.detector, Canny::default());
        if self.seed.is_some() && matches!(name, DetectorName::Sht | DetectorName::ShtGradient) {
            return Err(
                "--seed is for the detectors that draw, not for sht and sht-gradient".into(),
            );
        }
        let seed = self.seed.unwrap_or(1);
        let default = Acceptance::default();
        let accept = Acceptance {
            theta: self.min_score.unwrap_or(default.theta),
            min_radius: self.min_radius.unwrap_or(8.0),
            max_radius: self.max_radius.unwrap_or(280.0),
            max_circles: self.max_circles.unwrap_or(32),
            min_distance: self.min_distance.unwrap_or(default.min_distance),
            region: self.region,
            ..default
        };
        Ok(match name {
            DetectorName::Rht | DetectorName::RhtAnywhere => {
                let config = RandomizedHoughConfig {
                    accept,
                    seed,
                    anywhere: name == DetectorName::RhtAnywhere,
                    ..RandomizedHoughConfig::default()
                };
                Box::new(RandomizedHough::new(config, canny)?)
            }
            DetectorName::Sht | DetectorName::ShtGradient => {
                let config = StandardHoughConfig {
                    accept,
                    gradient: name == DetectorName::ShtGradient,
                    ..StandardHoughConfig::default()
                };
                Box::new(StandardHough::new(config, canny)?)
            }
            _ => Box::new(Heuristic::with_canny(HeuristicConfig {
                accept,
                seed,
                anywhere: name == DetectorName::HeuristicAnywhere,
                ..HeuristicConfig::default()
            })?),
        })
    }
}

/// CPU time of this thread.
#[cfg(unix)]
fn cpu_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Time on the wall where the system's CPU time is not at hand.
#[cfg(not(unix))]
fn cpu_time() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}
