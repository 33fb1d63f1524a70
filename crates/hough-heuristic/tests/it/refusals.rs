//! Settings and frames that a detector refuses, and what memory it takes for the others.

use hough_heuristic::image::{GrayImage, Luma, imageops};
use hough_heuristic::{
    Acceptance, Canny, Circle, CircleDetector, ConfigError, Detection, RandomizedHough,
    RandomizedHoughConfig, Region, StandardHough, StandardHoughConfig,
};

use crate::detectors::{ACCEPT, SCENE, all};

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
            assert!(
                matches!(error, ConfigError::Region { .. }),
                "{name}: {error}"
            );
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
    let large = GrayImage::from_fn(3840, 2160, |x, y| {
        Luma([((x / 40 + y / 40) % 2 * 200) as u8])
    });
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
            accept: Acceptance {
                theta: 2.0,
                ..ACCEPT
            },
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
