//! The detectors behind one trait, stages included, and the three transforms by name.

use hough_heuristic::{
    AContrario, Acceptance, CircleDetector, ConfigError, EdgeDetector, Heuristic, HeuristicConfig,
    RandomizedHough, RandomizedHoughConfig, Stages, StandardHough, StandardHoughConfig,
};

pub const TRANSFORMS: [&str; 6] = [
    "heuristic",
    "heuristic, anywhere",
    "RHT",
    "RHT, anywhere",
    "SHT",
    "SHT, gradient",
];

pub trait Staged: CircleDetector {
    fn stages(&self) -> Stages<'_>;
    fn keep_candidates(&mut self, keep: bool);
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

impl Staged for AContrario {
    fn stages(&self) -> Stages<'_> {
        self.stages()
    }

    fn keep_candidates(&mut self, keep: bool) {
        self.keep_candidates(keep);
    }
}

/// One of [`TRANSFORMS`].
pub fn transform(
    name: &str,
    accept: Acceptance,
    edges: impl EdgeDetector + 'static,
) -> Result<Box<dyn Staged>, ConfigError> {
    let anywhere = name.ends_with("anywhere");
    let heuristic = HeuristicConfig {
        accept,
        anywhere,
        ..HeuristicConfig::default()
    };
    let rht = RandomizedHoughConfig {
        accept,
        anywhere,
        ..RandomizedHoughConfig::default()
    };
    let sht = StandardHoughConfig {
        accept,
        gradient: name.ends_with("gradient"),
        ..StandardHoughConfig::default()
    };
    Ok(match &name[..3] {
        "SHT" => Box::new(StandardHough::new(sht, edges)?),
        "RHT" => Box::new(RandomizedHough::new(rht, edges)?),
        _ => Box::new(Heuristic::new(heuristic, edges)?),
    })
}
