//! Targets in a frame: balls, eggs, and one of a user's own.

use std::collections::VecDeque;

use grasp_agent::hough_heuristic::image::{GrayImage, Luma};
use grasp_agent::hough_heuristic::{
    Acceptance, Canny, CannyConfig, Circle, CircleDetector, CurveSearch, CurveSearchConfig,
    Detection, Ellipse, Features, FrameError, FrameRefused, FrameSource, Heuristic,
    HeuristicConfig,
};
use grasp_agent::{CameraEye, EggTarget, Eye, Sighting, Target};

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

fn eggs(longest_minor: f64) -> EggTarget {
    let search = CurveSearch::new(CurveSearchConfig {
        theta: 0.75,
        reach: Some(150.0),
        ..CurveSearchConfig::default()
    });
    let edges = Canny::new(CannyConfig::default()).unwrap();
    EggTarget::new(edges, search.unwrap(), 20.0..=longest_minor, 2.2)
}

#[test]
fn an_egg_is_its_centre_and_its_shorter_half_axis() {
    let mut eggs = eggs(200.0);
    for angle in [0.0, 0.5, 1.2, -0.8] {
        let egg = ellipse(400.0, 300.0, 84.0, 60.0, angle);
        let seen = eggs.find(&frame_with(&egg)).unwrap().unwrap();
        let f = seen.features;
        // A feature unit is four pixels here.
        let off = (f.x - 100.0)
            .abs()
            .max((f.y - 75.0).abs())
            .max((f.r - 15.0).abs());
        assert!(off < 0.5, "{angle}: {f:?}");
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
        let mut eggs = eggs(200.0);
        assert!(
            eggs.find(&frame_with(&ellipse(400.0, 300.0, 84.0, 60.0, 0.3)))
                .unwrap()
                .is_some()
        );
        let found = eggs
            .find(&frame_with(&ellipse(400.0, 300.0, major, minor, 0.3)))
            .unwrap();
        assert_eq!(found, None, "{major} x {minor}");
        // Nor does the last outline stay.
        assert_eq!(eggs.outline(), None);
    }
    let mut small = eggs(50.0);
    assert_eq!(
        small
            .find(&frame_with(&ellipse(400.0, 300.0, 84.0, 60.0, 0.3)))
            .unwrap(),
        None
    );
    let mut eggs = eggs(200.0);
    for (width, height) in [(0, 0), (1, 1), (3, 200), (768, 576)] {
        assert_eq!(
            eggs.find(&GrayImage::new(width, height)).unwrap(),
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

/// A camera that delivers what it holds, and then nothing.
struct Film(VecDeque<GrayImage>);

impl FrameSource for Film {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        *frame = self.0.pop_front().ok_or(FrameError::End)?;
        Ok(())
    }
}

/// The ball that an eye with this detector sees in `frame`.
fn ball(detector: &mut dyn CircleDetector, frame: &GrayImage) -> Option<Sighting> {
    let mut film = Film([frame.clone()].into());
    CameraEye::new(&mut film, detector).look().unwrap()
}

#[test]
fn a_ball_is_the_first_circle_with_its_centre_in_the_frame() {
    let frame = GrayImage::new(768, 576);
    let mut saying = Saying(vec![
        circle(-3.0, 100.0, 50.0, 0.9),
        circle(100.0, 580.0, 50.0, 0.9),
        circle(f64::NAN, 100.0, 50.0, 0.9),
        circle(100.0, 100.0, f64::INFINITY, 0.9),
        circle(200.0, 100.0, 40.0, 0.8),
        circle(300.0, 100.0, 40.0, 0.7),
    ]);
    let seen = ball(&mut saying, &frame).unwrap();
    let expected = Features::from_circle(&saying.0[4].circle, 768);
    assert_eq!((seen.features, seen.score), (expected, 0.8));
    saying.0.truncate(4);
    assert_eq!(ball(&mut saying, &frame), None);
}

#[test]
fn a_ball_is_found_by_a_real_detector() {
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
    let frame = frame_with(&ellipse(300.0, 200.0, 90.0, 90.0, 0.0));
    let f = ball(&mut detector, &frame).unwrap().features;
    let off = (f.x - 75.0)
        .abs()
        .max((f.y - 50.0).abs())
        .max((f.r - 22.5).abs());
    assert!(off < 0.5, "{f:?}");
    for (width, height) in [(0, 0), (1, 1), (768, 576)] {
        let nothing = ball(&mut detector, &GrayImage::new(width, height));
        assert_eq!(nothing, None, "{width}x{height}");
    }
}

/// A target of a user's own: the brightest pixel.
struct Brightest;

impl Target for Brightest {
    fn find(&mut self, frame: &GrayImage) -> Result<Option<Sighting>, FrameError> {
        let pixels = frame.enumerate_pixels();
        let brightest = pixels.max_by_key(|(.., pixel)| pixel.0[0]);
        Ok(brightest.map(|(x, y, _)| {
            let (x, y) = (f64::from(x), f64::from(y));
            let circle = Circle { x, y, radius: 1.0 };
            Sighting::new(Features::from_circle(&circle, frame.width()))
        }))
    }
}

#[test]
fn an_eye_looks_for_the_target_that_it_is_given() {
    let egg = frame_with(&ellipse(400.0, 300.0, 84.0, 60.0, 0.4));
    let mut spot = GrayImage::new(768, 576);
    spot.put_pixel(96, 48, Luma([255]));
    let mut film = Film([egg.clone(), spot.clone()].into());
    {
        // By reference, so that the outline can be asked for afterwards.
        let mut eggs = eggs(200.0);
        let mut eye = CameraEye::looking_for(&mut film, &mut eggs);
        let seen = eye.look().unwrap().unwrap();
        assert_eq!(eye.frame(), Some(&egg));
        assert!((seen.features.r - 15.0).abs() < 0.5);
        drop(eye);
        assert!(eggs.outline().is_some());
    }
    let mut eye = CameraEye::looking_for(&mut film, Brightest);
    let place = eye.look().unwrap().unwrap().features.to_circle(768);
    assert_eq!(eye.frame(), Some(&spot));
    let close = (place.x - 96.0).abs() < 1e-9 && (place.y - 48.0).abs() < 1e-9;
    assert!(close, "{place:?}");
    assert!(matches!(eye.look(), Err(FrameError::End)));
}
