//! The circles that the a contrario detector is asked for: of a region, about one centre, apart
//! from one another, and of which size by default.

use hough_heuristic::image::{GrayImage, Luma, imageops};
use hough_heuristic::{AContrario, AContrarioConfig, Circle, CircleDetector, Region, Rings};

use circle_scenes::scene::same;

/// Draws discs one over the other: each a circle and a gray level.
fn draw(width: u32, height: u32, discs: &[(Circle, u8)]) -> GrayImage {
    let frame = GrayImage::from_fn(width, height, |x, y| {
        let holds = |(circle, _): &&(Circle, u8)| {
            (f64::from(x) - circle.x).hypot(f64::from(y) - circle.y) < circle.radius
        };
        Luma([discs
            .iter()
            .rev()
            .find(holds)
            .map_or(200, |(_, gray)| *gray)])
    });
    imageops::blur(&frame, 0.7)
}

fn circle(x: f64, y: f64, radius: f64) -> Circle {
    Circle { x, y, radius }
}

fn detector(change: impl FnOnce(&mut AContrarioConfig)) -> AContrario {
    let mut config = AContrarioConfig::default();
    change(&mut config);
    AContrario::new(config).unwrap()
}

/// Asserts that the detector finds exactly these circles, to a pixel.
fn assert_found(detector: &mut AContrario, frame: &GrayImage, circles: &[Circle]) {
    let found = detector.detect(frame).unwrap().to_vec();
    assert_eq!(found.len(), circles.len(), "{found:?}");
    for circle in circles {
        let is_found = found.iter().any(|one| same(&one.circle, circle, 1.0));
        assert!(is_found, "{circle:?} in {found:?}");
    }
    let measured = detector.measurements().iter().map(|m| m.circle);
    assert!(measured.eq(found.iter().map(|one| one.circle)));
}

#[test]
fn of_a_washer_the_outer_or_the_inner_edge_is_chosen() {
    let (outer, inner) = (circle(110.0, 100.0, 60.0), circle(112.0, 99.0, 35.0));
    let lone = circle(250.0, 90.0, 25.0);
    let frame = draw(320, 200, &[(outer, 60), (inner, 200), (lone, 90)]);
    for (rings, expected) in [
        (Rings::All, vec![outer, inner, lone]),
        (Rings::Outer, vec![outer, lone]),
        (Rings::Inner, vec![inner, lone]),
    ] {
        assert_found(
            &mut detector(|config| config.rings = rings),
            &frame,
            &expected,
        );
    }
}

#[test]
fn a_hole_beside_the_centre_is_kept_beside_its_disc() {
    let (disc, hole) = (circle(110.0, 100.0, 70.0), circle(140.0, 100.0, 20.0));
    let frame = draw(220, 200, &[(disc, 60), (hole, 200)]);
    for rings in [Rings::Outer, Rings::Inner] {
        assert_found(
            &mut detector(|config| config.rings = rings),
            &frame,
            &[disc, hole],
        );
    }
}

#[test]
fn the_better_of_two_near_circles_is_reported() {
    let (large, small) = (circle(80.0, 100.0, 50.0), circle(165.0, 100.0, 20.0));
    let frame = draw(220, 200, &[(large, 60), (small, 90)]);
    let mut all = detector(|_| ());
    assert_found(&mut all, &frame, &[large, small]);
    let best = all.measurements()[0].circle;
    for (least, expected) in [(80.0, vec![large, small]), (90.0, vec![best])] {
        assert_found(
            &mut detector(|config| config.min_distance = least),
            &frame,
            &expected,
        );
    }
}

#[test]
fn the_most_circles_are_counted_after_the_choice() {
    let rings: Vec<_> = (0..4)
        .map(|k| circle(100.0, 100.0, 80.0 - 18.0 * f64::from(k)))
        .collect();
    let grays = [60, 200, 60, 200];
    let mut discs: Vec<_> = rings.iter().copied().zip(grays).collect();
    let lone = circle(250.0, 100.0, 25.0);
    discs.push((lone, 90));
    let frame = draw(320, 200, &discs);
    for (max_circles, ended) in [(2, false), (1, true)] {
        let mut detector = detector(|config| {
            config.rings = Rings::Outer;
            config.max_circles = max_circles;
        });
        assert_eq!(detector.detect(&frame).unwrap().len(), max_circles);
        assert_eq!(detector.effort().ended_by_count, ended);
    }
}

#[test]
fn a_region_gives_the_circles_and_the_work_of_its_part() {
    let disc = |k: u32| {
        let (column, row) = (f64::from(k % 10), f64::from(k / 10));
        (circle(45.0 + 90.0 * column, 45.0 + 90.0 * row, 24.0), 60)
    };
    let discs: Vec<_> = (0..100).map(disc).collect();
    let frame = draw(900, 900, &discs);
    let mut whole = detector(|config| config.max_radius = Some(40.0));
    assert_eq!(whole.detect(&frame).unwrap().len(), 100);
    let all = whole.effort();
    for (left, top) in [(0, 0), (370, 280), (720, 720)] {
        let region = Region {
            left,
            top,
            width: 180,
            height: 180,
        };
        let mut part = detector(|config| {
            config.max_radius = Some(40.0);
            config.region = Some(region);
        });
        let inside = |at: f64, start: u32| (0.0..180.0).contains(&(at - f64::from(start)));
        let centres = discs.iter().map(|disc| disc.0);
        let expected: Vec<_> = centres
            .filter(|disc| inside(disc.x, left) && inside(disc.y, top))
            .collect();
        assert!(expected.len() >= 4);
        assert_found(&mut part, &frame, &expected);
        assert!(
            4 * part.effort().looks < all.looks,
            "{:?} {all:?}",
            part.effort()
        );
    }
}

#[test]
fn circles_in_parts_of_the_frame_are_found_without_settings() {
    for (side, radius) in [(650, 310.0), (1300, 600.0)] {
        let middle = 0.5 * f64::from(side);
        let dish = circle(middle, middle + 3.0, radius);
        let frame = draw(side, side, &[(dish, 120)]);
        assert_found(&mut detector(|_| ()), &frame, &[dish]);
    }
}
