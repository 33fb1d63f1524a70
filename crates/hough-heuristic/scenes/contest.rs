//! The scenes and the detectors of the comparison, for the benchmarks and the example `compare`.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{Acceptance, Canny, CannyConfig, ConfigError, EdgeDetector, EdgeMap};

use crate::scene::Scene;
use crate::staged::{Staged, transform};

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
        radius: (20.0, 140.0),
        ..Scene::default()
    };
    let small = Scene {
        width: 192,
        height: 144,
        radius: (10.0, 35.0),
        ..one
    };
    let many = |balls| Scene {
        balls,
        radius: (20.0, 60.0),
        ..one
    };
    let clutter = |distractors, scene| Scene {
        distractors,
        ..scene
    };
    let noisy = |noise| Scene { noise, ..one };
    let rounds = [
        ("1 ball", one),
        ("+5 distractors", clutter(5, one)),
        ("+20 distractors", clutter(20, one)),
        ("noise 5", noisy(5.0)),
        ("noise 15", noisy(15.0)),
        ("noise 30", noisy(30.0)),
        ("noise 20, fixed", noisy(20.0)),
        ("noise 30, fixed", noisy(30.0)),
        ("5 balls", many(5)),
        ("20 balls", many(20)),
        ("no ball, 20 distr.", clutter(20, Scene { balls: 0, ..one })),
        ("192x144, 1 ball", small),
        ("192x144, +5", clutter(5, small)),
    ];
    let round = |(name, scene): (&'static str, _)| Round {
        name,
        scene,
        fixed_thresholds: name.ends_with("fixed"),
    };
    rounds.map(round).into()
}

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
    transform(name, accept, edges)
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
