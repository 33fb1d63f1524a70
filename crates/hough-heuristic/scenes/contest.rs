//! The scenes and the detectors of the comparison, for the benchmarks and the example `compare`.

#![allow(dead_code, unreachable_pub, missing_docs)]

use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Acceptance, CircleDetector, ConfigError, EdgeDetector, EdgeMap, Heuristic, HeuristicConfig,
    RandomizedHough, RandomizedHoughConfig, Sampling, StandardHough, StandardHoughConfig,
};

use crate::scenes::Scene;

/// From the paper's simple case to hard ones.
pub fn scenes() -> Vec<(&'static str, Scene)> {
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
    vec![
        ("1 ball", one),
        (
            "+5 distractors",
            Scene {
                distractors: 5,
                ..one
            },
        ),
        (
            "+20 distractors",
            Scene {
                distractors: 20,
                ..one
            },
        ),
        ("noise 5", Scene { noise: 5.0, ..one }),
        ("noise 15", Scene { noise: 15.0, ..one }),
        ("noise 30", Scene { noise: 30.0, ..one }),
        ("5 balls", many(5)),
        ("20 balls", many(20)),
        (
            "20 distractors, no ball",
            Scene {
                distractors: 20,
                balls: 0,
                ..one
            },
        ),
        ("192x144, 1 ball", small),
        (
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

/// A detector for a scene, which knows the radius range and how many balls to look for, on edges that are already found.
pub fn detector(name: &str, scene: &Scene, edges: EdgeMap) -> Result<Box<dyn Contestant>, ConfigError> {
    let edges = Found(edges);
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
        min_radius: accept.min_radius,
        max_radius: accept.max_radius,
        max_circles: accept.max_circles,
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

/// A detector that tells what memory it holds.
pub trait Contestant: CircleDetector {
    fn memory(&self) -> usize;
}

impl<E: EdgeDetector> Contestant for Heuristic<E> {
    fn memory(&self) -> usize {
        self.memory()
    }
}

impl<E: EdgeDetector> Contestant for RandomizedHough<E> {
    fn memory(&self) -> usize {
        self.memory()
    }
}

impl<E: EdgeDetector> Contestant for StandardHough<E> {
    fn memory(&self) -> usize {
        self.memory()
    }
}

/// The edges of the one frame that is looked at.
struct Found(EdgeMap);

impl EdgeDetector for Found {
    fn detect_edges<'a>(&'a mut self, _frame: &GrayImage) -> &'a EdgeMap {
        &self.0
    }

    fn edges(&self) -> &EdgeMap {
        &self.0
    }
}
