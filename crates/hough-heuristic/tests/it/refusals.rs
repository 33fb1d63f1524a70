//! Settings and frames that a detector refuses, and what memory it takes for the others.

use hough_heuristic::image::{GrayImage, imageops};
use hough_heuristic::{
    Acceptance, Canny, CircleDetector, FrameRefused, RandomizedHough, RandomizedHoughConfig,
    Region, StandardHough, StandardHoughConfig,
};

use crate::detectors::{ACCEPT, SCENE, all};

#[test]
fn a_frame_that_the_region_sticks_out_of_is_refused() {
    let (frame, _) = SCENE.render();
    let region = Region {
        left: 200,
        top: 100,
        width: 40,
        height: 80,
    };
    let accept = Acceptance {
        region: Some(region),
        ..ACCEPT
    };
    for (name, mut detector) in all(accept) {
        detector.detect(&frame).unwrap();
        for (width, height) in [(239, 180), (240, 179), (192, 144), (0, 0)] {
            let small = imageops::crop_imm(&frame, 0, 0, width, height).to_image();
            let error = detector.detect(&small).unwrap_err();
            assert!(
                matches!(error, FrameRefused::Region { .. }),
                "{name}: {error}"
            );
            let (error, size) = (error.to_string(), format!("{width}x{height}"));
            assert!(
                error.contains("40x80 px at (200, 100)") && error.contains(&size),
                "{name}: {error}"
            );
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
    // 1920 x 1080 centres, 995 radii and two bytes each.
    let before = detector.stages().memory;
    let error = detector.detect(&GrayImage::new(3840, 2160)).unwrap_err();
    assert_eq!(
        error,
        FrameRefused::Accumulator {
            frame_width: 3840,
            frame_height: 2160,
            needed: 2 * 1920 * 1080 * 995,
            limit: 1 << 29,
        }
    );
    let memory = detector.stages().memory;
    assert_eq!(memory, before, "a refused frame takes no memory");

    let tight = StandardHoughConfig {
        accept: ACCEPT,
        max_memory: 120 * 90 * 17 * 2,
        ..StandardHoughConfig::default()
    };
    let mut detector = StandardHough::new(tight, Canny::default()).unwrap();
    detector.detect(&GrayImage::new(240, 180)).unwrap();
    assert!(detector.detect(&GrayImage::new(241, 180)).is_err());
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
        detector.detect(&frame).unwrap();
        (
            detector.stages().memory,
            detector.stages().edges.pixels().len(),
        )
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
    let rht: [fn(&mut RandomizedHoughConfig); 4] = [
        |config| config.iterations = 0,
        |config| config.votes = 1,
        |config| config.cell = 0.0,
        |config| config.accept.theta = 2.0,
    ];
    for change in rht {
        let mut config = RandomizedHoughConfig::default();
        change(&mut config);
        assert!(RandomizedHough::new(config, Canny::default()).is_err());
    }
    let sht: [fn(&mut StandardHoughConfig); 5] = [
        |config| config.cell = 0.5,
        |config| config.direction_error = f64::NAN,
        |config| config.min_votes = 0.0,
        |config| config.accept.max_radius = 1e9,
        |config| config.accept.min_radius = 0.0,
    ];
    for change in sht {
        let mut config = StandardHoughConfig::default();
        change(&mut config);
        assert!(StandardHough::new(config, Canny::default()).is_err());
    }
}
