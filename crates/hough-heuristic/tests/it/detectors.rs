//! What holds for every detector.

use hough_heuristic::image::{GrayImage, Luma, imageops};
use hough_heuristic::{
    Acceptance, Canny, CannyConfig, Circle, CircleDetector, ConfigError, Detection, Heuristic,
    HeuristicConfig, ImageprocCanny, RandomizedHough, RandomizedHoughConfig, Region, Sampling, StandardHough,
    StandardHoughConfig,
};
use proptest::prelude::*;

use crate::scenes::{Scene, same};

/// All detectors with these settings, by name.
pub(crate) fn all(accept: Acceptance) -> Vec<(&'static str, Box<dyn CircleDetector>)> {
    all_on(accept, CannyConfig::default())
}

/// All detectors with these settings on edges with those, by name.
fn all_on(accept: Acceptance, edges: CannyConfig) -> Vec<(&'static str, Box<dyn CircleDetector>)> {
    let canny = || Canny::new(edges).unwrap();
    let rht = |sampling| RandomizedHoughConfig {
        accept,
        sampling,
        ..RandomizedHoughConfig::default()
    };
    let sht = |gradient| StandardHoughConfig {
        accept,
        gradient,
        ..StandardHoughConfig::default()
    };
    vec![
        (
            "heuristic",
            Box::new(Heuristic::new(heuristic(accept, Sampling::Near), canny()).unwrap()),
        ),
        (
            "anywhere",
            Box::new(Heuristic::new(heuristic(accept, Sampling::Anywhere), canny()).unwrap()),
        ),
        (
            "rht",
            Box::new(RandomizedHough::new(rht(Sampling::Near), canny()).unwrap()),
        ),
        (
            "rht anywhere",
            Box::new(RandomizedHough::new(rht(Sampling::Anywhere), canny()).unwrap()),
        ),
        ("sht", Box::new(StandardHough::new(sht(false), canny()).unwrap())),
        (
            "sht gradient",
            Box::new(StandardHough::new(sht(true), canny()).unwrap()),
        ),
    ]
}

fn heuristic(accept: Acceptance, sampling: Sampling) -> HeuristicConfig {
    HeuristicConfig {
        theta: accept.theta,
        tolerance: accept.tolerance,
        min_radius: accept.min_radius,
        max_radius: accept.max_radius,
        max_circles: accept.max_circles,
        min_distance: accept.min_distance,
        region: accept.region,
        refine: accept.refine,
        sampling,
        ..HeuristicConfig::default()
    }
}

const SCENE: Scene = Scene {
    width: 240,
    height: 180,
    balls: 3,
    distractors: 4,
    noise: 3.0,
    radius: (16.0, 34.0),
    seed: 5,
};

const ACCEPT: Acceptance = Acceptance {
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
            let found = detector.detect(&frame);
            for ball in &balls {
                assert!(
                    found.iter().any(|f| same(&f.circle, ball, 0.35)),
                    "{name}, seed {seed}: {ball:?} is not among {found:?}"
                );
            }
            assert_eq!(found.len(), balls.len(), "{name}, seed {seed}");
            assert!(found.windows(2).all(|pair| pair[0].score >= pair[1].score));
            assert!(found.iter().all(|f| f.score > ACCEPT.theta && f.score <= 1.0));
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
        let found = detector.detect(&frame);
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
    let region = Region::in_frame((0, 0), (120, 180), (240, 180)).unwrap();
    for (name, mut detector) in all(Acceptance {
        region: Some(region),
        ..ACCEPT
    }) {
        let found = detector.detect(&frame);
        let expected = balls.iter().filter(|ball| region.holds(ball)).count();
        assert!(expected < balls.len());
        assert_eq!(found.len(), expected, "{name}: {found:?}");
    }
}

const TINY: Circle = Circle {
    x: 1.0,
    y: 1.0,
    radius: 1.0,
};

#[test]
fn a_frame_that_the_region_sticks_out_of_is_refused() {
    let (frame, _) = SCENE.render();
    let region = Region::in_frame((200, 100), (40, 80), (240, 180)).unwrap();
    let accept = Acceptance {
        region: Some(region),
        ..ACCEPT
    };
    for (name, mut detector) in all(accept) {
        detector.check_frame(240, 180).unwrap();
        let mut found = Vec::new();
        detector.try_detect_into(&frame, &mut found).unwrap();
        for (width, height) in [(239, 180), (240, 179), (192, 144), (0, 0)] {
            let small = imageops::crop_imm(&frame, 0, 0, width, height).to_image();
            let stale = Detection {
                circle: TINY,
                score: 1.0,
            };
            let mut found = vec![stale; 2];
            let error = detector.try_detect_into(&small, &mut found).unwrap_err();
            assert!(matches!(error, ConfigError::Region { .. }), "{name}: {error}");
            let (error, size) = (error.to_string(), format!("{width}x{height}"));
            assert!(
                error.contains("40x80 px at (200, 100)") && error.contains(&size),
                "{name}: {error}"
            );
            assert_eq!(found, [], "{name}");
            assert_eq!(detector.detect(&small), [], "{name}");
        }
    }
}

#[test]
fn the_accumulator_is_bounded() {
    let mut detector = StandardHough::new(
        StandardHoughConfig {
            accept: Acceptance {
                max_radius: 2000.0,
                ..ACCEPT
            },
            ..StandardHoughConfig::default()
        },
        Canny::default(),
    )
    .unwrap();
    detector.check_frame(1280, 960).unwrap();
    // 1920 x 1080 centres, 995 radii and two bytes each.
    let error = detector.check_frame(3840, 2160).unwrap_err();
    assert_eq!(
        error,
        ConfigError::Accumulator {
            frame_width: 3840,
            frame_height: 2160,
            needed: 2 * 1920 * 1080 * 995,
            limit: 1 << 29,
        }
    );
    let mut found = Vec::new();
    let before = detector.memory();
    let large = GrayImage::from_fn(3840, 2160, |x, y| Luma([((x / 40 + y / 40) % 2 * 200) as u8]));
    assert_eq!(detector.try_detect_into(&large, &mut found), Err(error));
    assert_eq!(detector.detect(&large), []);
    assert_eq!(detector.memory(), before, "a refused frame takes no memory");
    // No size overflows the reckoning.
    assert!(detector.check_frame(u32::MAX, u32::MAX).is_err());

    let tight = StandardHoughConfig {
        accept: ACCEPT,
        max_memory: 120 * 90 * 17 * 2,
        ..StandardHoughConfig::default()
    };
    let detector = StandardHough::new(tight, Canny::default()).unwrap();
    detector.check_frame(240, 180).unwrap();
    assert!(detector.check_frame(241, 180).is_err());
}

#[test]
fn the_memory_told_holds_all_tables() {
    let (frame, _) = SCENE.render();
    let memory = |gradient| {
        let config = StandardHoughConfig {
            accept: ACCEPT,
            gradient,
            ..StandardHoughConfig::default()
        };
        let mut detector = StandardHough::new(config, Canny::default()).unwrap();
        detector.detect(&frame);
        (detector.memory(), detector.edges().pixels().len())
    };
    let ((plain, _), (with_turns, edges)) = (memory(false), memory(true));
    // The direction of each edge pixel; peaks and accumulator take about the same in both.
    assert!(
        with_turns + 2000 > plain + 8 * edges,
        "{plain} {with_turns} {edges}"
    );
    // Accumulator alone: 120 x 90 centres, 17 radii.
    assert!(plain > 2 * 120 * 90 * 17);
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
            sampling: Sampling::Anywhere,
            iterations: 300,
            ..RandomizedHoughConfig::default()
        };
        let mut detector = RandomizedHough::new(config, Canny::default()).unwrap();
        let circles = detector.detect(&frame);
        found += usize::from(circles.iter().any(|f| same(&f.circle, &balls[0], 0.5)));
    }
    assert!(found >= 16, "found {found} of 20 balls");
}

/// A frame turned, and where its circles are then.
pub(crate) type Turn = (GrayImage, Box<dyn Fn(&Circle) -> Circle>);

/// The frame flipped both ways, turned by a quarter, and transposed.
pub(crate) fn turns(frame: &GrayImage) -> [Turn; 4] {
    let (right, bottom) = (f64::from(frame.width()) - 1.0, f64::from(frame.height()) - 1.0);
    let transposed = GrayImage::from_fn(frame.height(), frame.width(), |x, y| *frame.get_pixel(y, x));
    [
        (
            imageops::flip_horizontal(frame),
            Box::new(move |c| Circle { x: right - c.x, ..*c }),
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
        (transposed, Box::new(|c| Circle { x: c.y, y: c.x, ..*c })),
    ]
}

#[test]
fn turned_frames_give_turned_circles() {
    let (frame, balls) = SCENE.render();
    let turns = turns(&frame);
    for (name, mut detector) in all(ACCEPT) {
        let upright = detector.detect(&frame);
        assert_eq!(upright.len(), balls.len());
        for (turned, turn) in &turns {
            let found = detector.detect(turned);
            assert_eq!(found.len(), upright.len(), "{name}");
            for one in &upright {
                let expected = turn(&one.circle);
                assert!(
                    found.iter().any(|f| same(&f.circle, &expected, 0.1)),
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
            let fresh = all(ACCEPT).swap_remove(index).1.detect(&frames[frame]);
            let again = used.detect(&frames[frame]);
            assert_eq!(again, fresh, "{name}");
        }
        assert_eq!(used.detect(&GrayImage::new(0, 0)), [], "{name}");
    }
}

/// Thresholds that noise does not raise, so that noise is full of edges.
const FIXED: CannyConfig = CannyConfig {
    low: 30.0,
    high: 70.0,
    sigma: 1.2,
    noise_factor: 0.0,
};

/// Black and white at random.
fn saturated_noise(width: u32, height: u32, seed: u32) -> GrayImage {
    let mut state = seed;
    GrayImage::from_fn(width, height, |_, _| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Luma([if state >> 31 == 0 { 0 } else { 255 }])
    })
}

/// How many edge pixels a detector had to search.
trait EdgesOf {
    fn edges_of(&mut self, frame: &GrayImage) -> usize;
}

impl EdgesOf for Box<dyn CircleDetector> {
    fn edges_of(&mut self, frame: &GrayImage) -> usize {
        self.detect(frame);
        self.stages().unwrap().edges.pixels().len()
    }
}

#[test]
fn every_small_size_and_every_flat_frame_passes() {
    let small = Acceptance {
        min_radius: 1.0,
        max_radius: 6.0,
        max_circles: 50,
        min_distance: 0.0,
        ..ACCEPT
    };
    for (name, mut detector) in all_on(small, FIXED) {
        for width in 0..9 {
            for height in 0..9 {
                let edges = detector.edges_of(&saturated_noise(width, height, width * 31 + height));
                assert!(edges > 0 || width < 6 || height < 6, "{name} {width}x{height}");
                for grey in [0, 255] {
                    let flat = GrayImage::from_pixel(width, height, Luma([grey]));
                    assert_eq!(detector.detect(&flat), [], "{name} {width}x{height}");
                }
            }
        }
        let edges = detector.edges_of(&saturated_noise(120, 90, 7));
        assert!(edges > 1000, "{name}: only {edges} edge pixels");
        for (width, height) in [(1, 700), (700, 1), (2, 700), (3, 700), (700, 3)] {
            let frame = GrayImage::from_fn(width, height, |x, y| Luma([((x ^ y) * 85) as u8]));
            detector.detect(&frame);
        }
    }
}

#[test]
fn any_edge_detector_will_do() {
    let (frame, balls) = SCENE.render();
    let edges = ImageprocCanny::new(30.0, 70.0).unwrap();
    let found = Heuristic::new(heuristic(ACCEPT, Sampling::Near), edges)
        .unwrap()
        .detect(&frame);
    for ball in &balls {
        assert!(
            found.iter().any(|f| same(&f.circle, ball, 0.7)),
            "{ball:?} {found:?}"
        );
    }
}

#[test]
fn unusable_settings_are_refused() {
    let rht = RandomizedHoughConfig::default;
    for config in [
        RandomizedHoughConfig {
            iterations: 0,
            ..rht()
        },
        RandomizedHoughConfig { votes: 1, ..rht() },
        RandomizedHoughConfig { cell: 0.0, ..rht() },
        RandomizedHoughConfig {
            accept: Acceptance { theta: 2.0, ..ACCEPT },
            ..rht()
        },
    ] {
        assert!(
            RandomizedHough::new(config, Canny::default()).is_err(),
            "{config:?}"
        );
    }
    let sht = StandardHoughConfig::default;
    for config in [
        StandardHoughConfig { cell: 0.5, ..sht() },
        StandardHoughConfig {
            direction_error: f64::NAN,
            ..sht()
        },
        StandardHoughConfig {
            min_votes: 0.0,
            ..sht()
        },
        StandardHoughConfig {
            accept: Acceptance {
                max_radius: 1e9,
                ..ACCEPT
            },
            ..sht()
        },
        StandardHoughConfig {
            accept: Acceptance {
                min_radius: 0.0,
                ..ACCEPT
            },
            ..sht()
        },
    ] {
        assert!(
            StandardHough::new(config, Canny::default()).is_err(),
            "{config:?}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn any_bytes_are_a_frame(
        bytes in proptest::collection::vec(any::<u8>(), 1..4000), width in 1u32..80, min in 1f64..20.0, span in 0f64..40.0
    ) {
        let height = bytes.len() as u32 / width;
        let pixels = bytes[..(width * height) as usize].to_vec();
        let frame = GrayImage::from_raw(width, height, pixels).unwrap();
        let accept = Acceptance {
            min_radius: min,
            max_radius: min + span,
            max_circles: 40,
            theta: 0.3,
            ..ACCEPT
        };
        for (name, mut detector) in all_on(accept, FIXED) {
            let found = detector.detect(&frame);
            let edges = detector.stages().unwrap().edges.pixels().len();
            prop_assert!(edges > 0 || width < 12 || height < 12, "{}: no edges in {}x{}", name, width, height);
            for f in &found {
                let Circle { x, y, radius } = f.circle;
                prop_assert!(x.is_finite() && y.is_finite(), "{}", name);
                prop_assert!((min..=min + span).contains(&radius), "{}", name);
                prop_assert!(f.score > 0.3 && f.score <= 1.0, "{}", name);
            }
            prop_assert_eq!(detector.detect(&frame), found);
        }
    }
}
