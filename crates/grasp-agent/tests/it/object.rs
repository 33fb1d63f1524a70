//! What is looked for in a frame: balls, eggs, and anything else that comes in through the same
//! door.

use std::collections::VecDeque;

use grasp_agent::hough_heuristic::image::{GrayImage, Luma};
use grasp_agent::hough_heuristic::{
    Acceptance, Canny, CannyConfig, Circle, CircleDetector, CurveSearch, CurveSearchConfig,
    Detection, Ellipse, Features, FrameError, FrameRefused, FrameSource, Heuristic,
    HeuristicConfig,
};
use grasp_agent::{BallFeatures, CameraEye, EggFeatures, EggLimits, Eye, ObjectFeatures, Sighting};

/// A bright ellipse on a dark ground, its longer half-axis at `angle` radians from x; 768x576
/// pixels.
fn frame_with(ellipse: &Ellipse) -> GrayImage {
    let (sin, cos) = ellipse.angle.sin_cos();
    GrayImage::from_fn(768, 576, |x, y| {
        let (dx, dy) = (f64::from(x) - ellipse.x, f64::from(y) - ellipse.y);
        let along = (dx * cos + dy * sin) / ellipse.major;
        let across = (dy * cos - dx * sin) / ellipse.minor;
        Luma([if along.hypot(across) <= 1.0 { 210 } else { 40 }])
    })
}

fn ellipse(x: f64, y: f64, major: f64, minor: f64, angle: f64) -> Ellipse {
    Ellipse {
        x,
        y,
        major,
        minor,
        angle,
    }
}

fn eggs(limits: EggLimits) -> EggFeatures {
    let search = CurveSearch::new(CurveSearchConfig {
        theta: 0.75,
        reach: Some(150.0),
        ..CurveSearchConfig::default()
    });
    EggFeatures::new(
        Canny::new(CannyConfig::default()).unwrap(),
        search.unwrap(),
        limits,
    )
}

const LIMITS: EggLimits = EggLimits {
    min_minor: 20.0,
    max_minor: 200.0,
    elongation: 2.2,
};

#[test]
fn an_egg_is_its_centre_and_its_shorter_half_axis_however_it_lies() {
    let mut eggs = eggs(LIMITS);
    for angle in [0.0, 0.5, 1.2, -0.8] {
        let egg = ellipse(400.0, 300.0, 84.0, 60.0, angle);
        let seen = eggs.find(&frame_with(&egg)).unwrap();
        let f = seen.features;
        // A feature unit is four pixels here.
        let off = (f.x - 100.0)
            .abs()
            .max((f.y - 75.0).abs())
            .max((f.r - 15.0).abs());
        assert!(off < 0.5, "{angle}: {f:?}");
        assert!(
            (seen.detection.circle.radius - 60.0).abs() < 2.0,
            "{seen:?}"
        );
        let outline = eggs.outline().unwrap();
        let turned = (outline.angle - angle).rem_euclid(std::f64::consts::PI);
        let turned = turned.min(std::f64::consts::PI - turned);
        assert!(
            (outline.major - 84.0).abs() < 3.0 && turned < 0.1,
            "{angle}: {outline:?}"
        );
    }
}

#[test]
fn what_is_too_small_too_large_or_too_long_is_no_egg() {
    for (major, minor) in [(22.0, 16.0), (160.0, 60.0)] {
        let mut eggs = eggs(LIMITS);
        assert!(
            eggs.find(&frame_with(&ellipse(400.0, 300.0, 84.0, 60.0, 0.3)))
                .is_some()
        );
        let found = eggs.find(&frame_with(&ellipse(400.0, 300.0, major, minor, 0.3)));
        assert_eq!(found, None, "{major} x {minor}");
        // Nor does the last outline stay.
        assert_eq!(eggs.outline(), None);
    }
    let mut small = eggs(EggLimits {
        max_minor: 50.0,
        ..LIMITS
    });
    assert_eq!(
        small.find(&frame_with(&ellipse(400.0, 300.0, 84.0, 60.0, 0.3))),
        None
    );
    let mut eggs = eggs(LIMITS);
    for (width, height) in [(0, 0), (1, 1), (3, 200), (768, 576)] {
        assert_eq!(
            eggs.find(&GrayImage::new(width, height)),
            None,
            "{width}x{height}"
        );
    }
}

/// A detector that reports what it is told to.
struct Saying(Vec<Detection>);

impl CircleDetector for Saying {
    fn detect(&mut self, _frame: &GrayImage) -> Result<&[Detection], FrameRefused> {
        Ok(&self.0)
    }
}

fn circle(x: f64, y: f64, radius: f64, score: f64) -> Detection {
    Detection {
        circle: Circle { x, y, radius },
        score,
    }
}

#[test]
fn a_ball_is_the_first_circle_whose_centre_lies_in_the_frame() {
    let frame = GrayImage::new(768, 576);
    let mut saying = Saying(vec![
        circle(-3.0, 100.0, 50.0, 0.9),
        circle(100.0, 580.0, 50.0, 0.9),
        circle(f64::NAN, 100.0, 50.0, 0.9),
        circle(100.0, 100.0, f64::INFINITY, 0.9),
        circle(200.0, 100.0, 40.0, 0.8),
        circle(300.0, 100.0, 40.0, 0.7),
    ]);
    let seen = BallFeatures::new(&mut saying).find(&frame).unwrap();
    assert_eq!(seen.detection, saying.0[4]);
    assert!((seen.features.x - Features::from_circle(&saying.0[4].circle, 768).x).abs() < 1e-12);
    saying.0.truncate(4);
    assert_eq!(BallFeatures::new(&mut saying).find(&frame), None);
}

#[test]
fn a_ball_is_found_by_a_detector_that_looks() {
    let canny = Canny::new(CannyConfig::default()).unwrap();
    let config = HeuristicConfig {
        accept: Acceptance {
            min_radius: 20.0,
            max_radius: 272.0,
            ..Acceptance::default()
        },
        ..HeuristicConfig::default()
    };
    let mut detector = Heuristic::new(config, canny).unwrap();
    let seen =
        BallFeatures::new(&mut detector).find(&frame_with(&ellipse(300.0, 200.0, 90.0, 90.0, 0.0)));
    let f = seen.unwrap().features;
    let off = (f.x - 75.0)
        .abs()
        .max((f.y - 50.0).abs())
        .max((f.r - 22.5).abs());
    assert!(off < 0.5, "{f:?}");
    for (width, height) in [(0, 0), (1, 1), (768, 576)] {
        let nothing = BallFeatures::new(&mut detector).find(&GrayImage::new(width, height));
        assert_eq!(nothing, None, "{width}x{height}");
    }
}

/// A camera that delivers what it holds, and then nothing.
struct Film(VecDeque<GrayImage>);

impl FrameSource for Film {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        *frame = self.0.pop_front().ok_or(FrameError::End)?;
        Ok(())
    }
}

/// Features of one's own: the brightest pixel.
struct Brightest;

impl ObjectFeatures for Brightest {
    fn find(&mut self, frame: &GrayImage) -> Option<Sighting> {
        let (x, y, _) = frame
            .enumerate_pixels()
            .max_by_key(|(_, _, pixel)| pixel.0[0])?;
        let detection = circle(f64::from(x), f64::from(y), 1.0, 1.0);
        Some(Sighting {
            features: Features::from_circle(&detection.circle, frame.width()),
            detection,
            long_axis: None,
        })
    }
}

#[test]
fn an_eye_looks_for_whatever_it_is_told_to() {
    let egg = frame_with(&ellipse(400.0, 300.0, 84.0, 60.0, 0.4));
    let mut spot = GrayImage::new(768, 576);
    spot.put_pixel(96, 48, Luma([255]));
    let mut film = Film([egg.clone(), spot.clone()].into());
    {
        // By reference, so that what it found can be asked for afterwards.
        let mut eggs = eggs(LIMITS);
        let look = CameraEye::looking_for(&mut film, &mut eggs).look().unwrap();
        assert_eq!(look.frame, Some(egg));
        assert!((look.ball.unwrap().features.r - 15.0).abs() < 0.5 && eggs.outline().is_some());
    }
    let mut eye = CameraEye::looking_for(&mut film, Brightest);
    let look = eye.look().unwrap();
    assert_eq!(look.frame, Some(spot));
    let place = look.ball.unwrap().detection.circle;
    assert!(
        (place.x - 96.0).abs() < 1e-9 && (place.y - 48.0).abs() < 1e-9,
        "{place:?}"
    );
    assert!(matches!(eye.look(), Err(FrameError::End)));
}
