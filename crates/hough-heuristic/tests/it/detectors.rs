//! Properties of every detector.

use hough_heuristic::image::{GrayImage, Luma, imageops};
use hough_heuristic::{
    AContrario, AContrarioConfig, Acceptance, Canny, CannyConfig, Circle, CircleDetector,
    RandomizedHough, RandomizedHoughConfig, Region,
};

use circle_scenes::scene::{Scene, same};
use circle_scenes::staged::{Staged, TRANSFORMS, transform};

/// All detectors with these settings, by name.
pub(crate) fn all(accept: Acceptance) -> Vec<(&'static str, Box<dyn CircleDetector>)> {
    let staged = all_on(accept, CannyConfig::default()).into_iter();
    let mut all: Vec<(_, Box<dyn CircleDetector>)> = staged
        .map(|(name, detector)| (name, detector as Box<dyn CircleDetector>))
        .collect();
    let a_contrario = AContrarioConfig {
        min_radius: Some(accept.min_radius),
        max_radius: Some(accept.max_radius),
        max_circles: accept.max_circles,
        region: accept.region,
        ..AContrarioConfig::default()
    };
    all.push((
        "a contrario",
        Box::new(AContrario::new(a_contrario).unwrap()),
    ));
    all
}

/// All detectors that go by β with these settings on edges with those, by name.
pub(crate) fn all_on(
    accept: Acceptance,
    edges: CannyConfig,
) -> Vec<(&'static str, Box<dyn Staged>)> {
    let build = |name| {
        let canny = Canny::new(edges).unwrap();
        (name, transform(name, accept, canny).unwrap())
    };
    TRANSFORMS.map(build).into()
}

pub(crate) const SCENE: Scene = Scene {
    width: 240,
    height: 180,
    balls: 3,
    distractors: 4,
    noise: 3.0,
    radius: (16.0, 34.0),
    seed: 5,
};

pub(crate) const ACCEPT: Acceptance = Acceptance {
    theta: 0.65,
    tolerance: 1.0,
    min_radius: 12.0,
    max_radius: 45.0,
    max_circles: 3,
    min_distance: 8.0,
    region: None,
    refine: true,
};

#[test]
fn known_circles_are_recovered() {
    for seed in 0..4 {
        let (frame, balls) = Scene { seed, ..SCENE }.render();
        for (name, mut detector) in all(ACCEPT) {
            let found = detector.detect(&frame).unwrap().to_vec();
            for ball in &balls {
                assert!(
                    found.iter().any(|f| same(&f.circle, ball, 0.35)),
                    "{name}, seed {seed}: {ball:?} is not among {found:?}"
                );
            }
            assert_eq!(found.len(), balls.len(), "{name}, seed {seed}");
            assert!(found.windows(2).all(|pair| pair[0].score >= pair[1].score));
            assert!(
                found.iter().all(|f| (0.65..=1.0).contains(&f.score)),
                "{name}: {found:?}"
            );
        }
    }
}

#[test]
fn a_known_radius_is_kept() {
    let radius = 25.0;
    let (frame, balls) = Scene {
        radius: (radius, radius),
        ..SCENE
    }
    .render();
    let accept = Acceptance {
        min_radius: radius,
        max_radius: radius,
        ..ACCEPT
    };
    for (name, mut detector) in all(accept) {
        let found = detector.detect(&frame).unwrap().to_vec();
        for ball in &balls {
            assert!(
                found.iter().any(|f| same(&f.circle, ball, 0.35)),
                "{name}: {ball:?} {found:?}"
            );
        }
        assert!(
            found
                .iter()
                .all(|f| f.circle.radius.to_bits() == radius.to_bits()),
            "{name}: {found:?}"
        );
    }
}

#[test]
fn the_region_bounds_the_centre() {
    let (frame, balls) = SCENE.render();
    let region = Region {
        left: 0,
        top: 0,
        width: 120,
        height: 180,
    };
    for (name, mut detector) in all(Acceptance {
        region: Some(region),
        ..ACCEPT
    }) {
        let found = detector.detect(&frame).unwrap().to_vec();
        let expected = balls.iter().filter(|ball| ball.x <= 119.5).count();
        assert!(expected < balls.len());
        assert_eq!(found.len(), expected, "{name}: {found:?}");
    }
}

#[test]
fn the_region_of_a_transform_bounds_the_work() {
    // A ball in a corner of a large frame whose rest is texture.
    let inside = |x: u32, y: u32| (f64::from(x) - 840.0).hypot(f64::from(y) - 650.0) < 30.0;
    let frame = GrayImage::from_fn(960, 720, |x, y| {
        let texture = x < 700 && (x / 3 + y / 3) % 2 == 0;
        Luma([if inside(x, y) || texture { 200 } else { 60 }])
    });
    let region = Region {
        left: 800,
        top: 600,
        width: 100,
        height: 100,
    };
    let accept = Acceptance {
        region: Some(region),
        ..ACCEPT
    };
    for (name, mut detector) in all_on(accept, CannyConfig::default()) {
        detector.keep_candidates(true);
        let found = detector.detect(&frame).unwrap().to_vec();
        assert_eq!(found.len(), 1, "{name}: {found:?}");
        let truth = Circle {
            x: 840.0,
            y: 650.0,
            radius: 30.0,
        };
        assert!(same(&found[0].circle, &truth, 0.7), "{name}: {found:?}");
        let stages = detector.stages();
        assert_eq!(stages.edges.image().dimensions(), (960, 720), "{name}");
        let mut edges = stages.edges.pixels().iter();
        assert!(edges.all(|pixel| pixel.x > 730 && pixel.y > 530), "{name}");
        let mut candidates = stages.candidates.iter();
        assert!(
            candidates.all(|circle| region_holds(&region, circle)),
            "{name}"
        );
        // The accumulator of the whole frame has ten times as many cells.
        assert!(stages.memory < 2_000_000, "{name}: {}", stages.memory);
    }
}

fn region_holds(region: &Region, circle: &Circle) -> bool {
    let inside = |at: f64, start: u32, length: u32| {
        (-2.0..=f64::from(length) + 2.0).contains(&(at - f64::from(start)))
    };
    inside(circle.x, region.left, region.width) && inside(circle.y, region.top, region.height)
}

/// Of a circle that owns the share p of the edges a draw of two hits p^2, of three p^3.
#[test]
fn a_known_radius_needs_pairs_only() {
    let radius = 24.0;
    let accept = Acceptance {
        min_radius: radius,
        max_radius: radius,
        max_circles: 1,
        ..ACCEPT
    };
    let mut found = 0;
    for seed in 0..20 {
        let (frame, balls) = Scene {
            balls: 1,
            distractors: 12,
            radius: (radius, radius),
            seed,
            ..SCENE
        }
        .render();
        let config = RandomizedHoughConfig {
            accept,
            anywhere: true,
            iterations: 300,
            ..RandomizedHoughConfig::default()
        };
        let mut detector = RandomizedHough::new(config, Canny::default()).unwrap();
        let circles = detector.detect(&frame).unwrap().to_vec();
        found += usize::from(circles.iter().any(|f| same(&f.circle, &balls[0], 0.5)));
    }
    assert!(found >= 16, "found {found} of 20 balls");
}

/// A frame turned, and where its circles are then.
pub(crate) type Turn = (GrayImage, Box<dyn Fn(&Circle) -> Circle>);

/// The frame flipped both ways, turned by a quarter, and transposed.
pub(crate) fn turns(frame: &GrayImage) -> [Turn; 4] {
    let (right, bottom) = (
        f64::from(frame.width()) - 1.0,
        f64::from(frame.height()) - 1.0,
    );
    let transposed =
        GrayImage::from_fn(frame.height(), frame.width(), |x, y| *frame.get_pixel(y, x));
    [
        (
            imageops::flip_horizontal(frame),
            Box::new(move |c| Circle {
                x: right - c.x,
                ..*c
            }),
        ),
        (
            imageops::flip_vertical(frame),
            Box::new(move |c| Circle {
                y: bottom - c.y,
                ..*c
            }),
        ),
        (
            imageops::rotate90(frame),
            Box::new(move |c| Circle {
                x: bottom - c.y,
                y: c.x,
                ..*c
            }),
        ),
        (
            transposed,
            Box::new(|c| Circle {
                x: c.y,
                y: c.x,
                ..*c
            }),
        ),
    ]
}

#[test]
fn turned_frames_give_turned_circles() {
    let (frame, balls) = SCENE.render();
    let turns = turns(&frame);
    for (name, mut detector) in all(ACCEPT) {
        let upright = detector.detect(&frame).unwrap().to_vec();
        assert_eq!(upright.len(), balls.len(), "{name}");
        for (turned, turn) in &turns {
            let found = detector.detect(turned).unwrap().to_vec();
            assert_eq!(found.len(), upright.len(), "{name}");
            for one in &upright {
                let expected = turn(&one.circle);
                assert!(
                    found.iter().any(|f| same(&f.circle, &expected, 0.15)),
                    "{name}: {expected:?} {found:?}"
                );
            }
        }
    }
}

#[test]
fn what_lies_in_the_buffers_does_not_matter() {
    let frames: Vec<GrayImage> = [(0, 240, 180), (1, 100, 90), (2, 240, 180), (3, 150, 200)]
        .map(|(seed, width, height)| {
            Scene {
                seed,
                width,
                height,
                ..SCENE
            }
            .render()
            .0
        })
        .into();
    for (index, (name, mut used)) in all(ACCEPT).into_iter().enumerate() {
        for frame in [0, 1, 2, 0, 3, 1] {
            let fresh = all(ACCEPT)
                .swap_remove(index)
                .1
                .detect(&frames[frame])
                .unwrap()
                .to_vec();
            let again = used.detect(&frames[frame]).unwrap().to_vec();
            assert_eq!(again, fresh, "{name}");
        }
        assert_eq!(used.detect(&GrayImage::new(0, 0)).unwrap(), [], "{name}");
    }
}

#[cfg(feature = "imageproc")]
#[test]
fn any_edge_detector_will_do() {
    let (frame, balls) = SCENE.render();
    let edges = hough_heuristic::ImageprocCanny::new(30.0, 70.0).unwrap();
    let mut detector = transform("heuristic", ACCEPT, edges).unwrap();
    let found = detector.detect(&frame).unwrap();
    for ball in &balls {
        assert!(
            found.iter().any(|f| same(&f.circle, ball, 0.7)),
            "{ball:?} {found:?}"
        );
    }
}
