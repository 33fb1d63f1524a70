//! The scenes and the detectors of the comparison, for the benchmarks and the example `compare`.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Acceptance, Canny, CannyConfig, ConfigError, EdgeDetector, EdgeMap, Heuristic, HeuristicConfig,
    RandomizedHough, RandomizedHoughConfig, Sampling, StandardHough, StandardHoughConfig,
};

use crate::scene::Scene;
use crate::staged::Staged;

/// A scene of the comparison.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    pub name: &'static str,
    pub scene: Scene,
    /// Keeps the edge thresholds in noise.
    pub fixed_thresholds: bool,
}

impl Round {
    pub fn canny(&self) -> Canny {
        let noise_factor = if self.fixed_thresholds {
            0.0
        } else {
            CannyConfig::default().noise_factor
        };
        Canny::new(CannyConfig {
            noise_factor,
            ..CannyConfig::default()
        })
        .expect("usable settings")
    }
}

/// From the paper's simple case to hard ones.
pub fn rounds() -> Vec<Round> {
    let one = Scene {
        noise: 2.0,
        radius: (20.0, 140.0),
        ..Scene::default()
    };
    let many = |balls| Scene {
        balls,
        radius: (20.0, 60.0),
        ..one
    };
    let small = Scene {
        width: 192,
        height: 144,
        radius: (10.0, 35.0),
        ..one
    };
    let round = |name, scene| Round {
        name,
        scene,
        fixed_thresholds: false,
    };
    let fixed = |name, scene| Round {
        name,
        scene,
        fixed_thresholds: true,
    };
    vec![
        round("1 ball", one),
        round(
            "+5 distractors",
            Scene {
                distractors: 5,
                ..one
            },
        ),
        round(
            "+20 distractors",
            Scene {
                distractors: 20,
                ..one
            },
        ),
        round("noise 5", Scene { noise: 5.0, ..one }),
        round("noise 15", Scene { noise: 15.0, ..one }),
        round("noise 30", Scene { noise: 30.0, ..one }),
        fixed("noise 20, fixed", Scene { noise: 20.0, ..one }),
        fixed("noise 30, fixed", Scene { noise: 30.0, ..one }),
        round("5 balls", many(5)),
        round("20 balls", many(20)),
        round(
            "no ball, 20 distr.",
            Scene {
                distractors: 20,
                balls: 0,
                ..one
            },
        ),
        round("192x144, 1 ball", small),
        round(
            "192x144, +5",
            Scene {
                distractors: 5,
                ..small
            },
        ),
    ]
}

pub const DETECTORS: [&str; 6] = [
    "heuristic",
    "heuristic, anywhere",
    "RHT",
    "RHT, anywhere",
    "SHT",
    "SHT, gradient",
];

/// A detector for a scene, which knows the radius range and how many balls to look for, on edges
/// that are already found.
pub fn detector(
    name: &str,
    scene: &Scene,
    edges: impl EdgeDetector + 'static,
) -> Result<Box<dyn Staged>, ConfigError> {
    let small = scene.width < 400;
    let accept = Acceptance {
        min_radius: if small { 8.0 } else { 15.0 },
        max_radius: if small { 70.0 } else { 280.0 },
        max_circles: scene.balls.max(1),
        ..Acceptance::default()
    };
    let sampling = if name.ends_with("anywhere") {
        Sampling::Anywhere
    } else {
        Sampling::Near
    };
    let heuristic = HeuristicConfig {
        accept,
        sampling,
        ..HeuristicConfig::default()
    };
    let rht = RandomizedHoughConfig {
        accept,
        sampling,
        ..RandomizedHoughConfig::default()
    };
    let sht = StandardHoughConfig {
        accept,
        gradient: name.ends_with("gradient"),
        ..StandardHoughConfig::default()
    };
    Ok(match name {
        "SHT" | "SHT, gradient" => Box::new(StandardHough::new(sht, edges)?),
        "RHT" | "RHT, anywhere" => Box::new(RandomizedHough::new(rht, edges)?),
        _ => Box::new(Heuristic::new(heuristic, edges)?),
    })
}

/// Edges found beforehand, so that only the circle search is timed.
#[derive(Clone, Debug)]
pub struct Found(pub EdgeMap);

impl EdgeDetector for Found {
    fn detect_edges<'a>(&'a mut self, _frame: &GrayImage) -> &'a EdgeMap {
        &self.0
    }

    fn edges(&self) -> &EdgeMap {
        &self.0
    }
}
