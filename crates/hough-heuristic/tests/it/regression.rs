//! Kinds of pictures on which circles were missed or made up: each drawn in both polarities, in all
//! eight orientations of the square, and at whole and half pixels.

mod parts;

use circle_scenes::scene::same;
use hough_heuristic::image::{GrayImage, Luma, imageops};
use hough_heuristic::{AContrario, AContrarioConfig, Circle, CircleDetector, Detection};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

/// A square picture, drawn as coverage in 4x4 points a pixel.
struct Picture {
    side: u32,
    /// Deviation of the lens, pixels.
    blur: f32,
    /// Half of the range of uniform noise.
    noise: f64,
}

impl Picture {
    /// Draws what `gray` says of each point.
    fn draw(&self, gray: impl Fn(f64, f64) -> f64) -> GrayImage {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let frame = GrayImage::from_fn(self.side, self.side, |x, y| {
            let points = (0..16).map(|k| {
                let (dx, dy) = (
                    f64::from(k % 4) / 4.0 - 0.375,
                    f64::from(k / 4) / 4.0 - 0.375,
                );
                gray(f64::from(x) + dx, f64::from(y) + dy)
            });
            Luma([(points.sum::<f64>() / 16.0).round() as u8])
        });
        let mut frame = imageops::blur(&frame, self.blur.max(0.4));
        for Luma([gray]) in frame.pixels_mut() {
            let random = (rng.next_u32() >> 8) as f64 / f64::from(1 << 23) - 1.0;
            *gray = (f64::from(*gray) + self.noise * random).clamp(0.0, 255.0) as u8;
        }
        frame
    }
}

const PLAIN: Picture = Picture {
    side: 200,
    blur: 0.7,
    noise: 2.0,
};

/// The frame in all eight orientations of the square and both polarities, with where a circle of
/// the frame lies in each.
fn views(frame: &GrayImage) -> Vec<(GrayImage, impl Fn(&Circle) -> Circle)> {
    let end = f64::from(frame.width()) - 1.0;
    let mut views = Vec::new();
    for view in 0..16 {
        let mut turned = frame.clone();
        if view & 1 != 0 {
            imageops::flip_horizontal_in_place(&mut turned);
        }
        for _ in 0..view / 2 % 4 {
            turned = imageops::rotate90(&turned);
        }
        if view >= 8 {
            imageops::invert(&mut turned);
        }
        let place = move |circle: &Circle| {
            let mut there = *circle;
            if view & 1 != 0 {
                there.x = end - there.x;
            }
            for _ in 0..view / 2 % 4 {
                (there.x, there.y) = (end - there.y, there.x);
            }
            there
        };
        views.push((turned, place));
    }
    views
}

fn detector(min_radius: f64, max_radius: f64) -> AContrario {
    AContrario::new(AContrarioConfig {
        min_radius: Some(min_radius),
        max_radius: Some(max_radius),
        max_circles: 3000,
        ..AContrarioConfig::default()
    })
    .unwrap()
}

/// Asserts that exactly these circles are found in every view of the frame, to two pixels.
fn assert_found(name: &str, frame: &GrayImage, circles: &[Circle]) {
    for (view, (turned, place)) in views(frame).iter().enumerate() {
        let mut detector = detector(8.0, 95.0);
        let found = detector.detect(turned).unwrap();
        assert_eq!(found.len(), circles.len(), "{name}, view {view}: {found:?}");
        for circle in circles {
            let there = place(circle);
            let is_found = found.iter().any(|one| same(&one.circle, &there, 2.0));
            assert!(is_found, "{name}, view {view}: {there:?} in {found:?}");
        }
    }
}

fn circle(x: f64, y: f64, radius: f64) -> Circle {
    Circle { x, y, radius }
}

/// Returns `true` if a point lies in a circle.
fn within(circle: &Circle, x: f64, y: f64) -> bool {
    (x - circle.x).hypot(y - circle.y) < circle.radius
}

#[test]
fn a_ball_behind_a_plate_is_a_circle() {
    for shift in [0.0, 0.5] {
        let ball = circle(90.0 + shift, 100.0, 36.0);
        for plate in [95.0, 225.0] {
            let frame = PLAIN.draw(|x, y| {
                if x > ball.x + 12.0 && x < 160.0 && (y - 95.0).abs() < 60.0 {
                    plate
                } else if within(&ball, x, y) {
                    50.0
                } else {
                    160.0
                }
            });
            assert_found("ball behind a plate", &frame, &[ball]);
        }
    }
}

#[test]
fn polygons_are_no_circles() {
    for corners in [3, 4, 5] {
        for (size, noise) in [(30.0, 2.0), (45.0, 20.0)] {
            let picture = Picture { noise, ..PLAIN };
            let frame = picture.draw(|x, y| {
                let side = |k: i32| {
                    let turn = std::f64::consts::TAU * f64::from(k) / f64::from(corners) + 0.3;
                    (x - 100.5) * turn.cos() + (y - 99.0) * turn.sin()
                };
                if (0..corners).all(|k| side(k) < 0.8 * size) {
                    60.0
                } else {
                    170.0
                }
            });
            assert_found("polygon", &frame, &[]);
        }
    }
}

#[test]
fn ovals_are_no_circles() {
    for (ratio, blur) in [(0.8, 0.7), (0.65, 0.7), (0.75, 2.5)] {
        for size in [24.0, 55.0] {
            let frame = Picture { blur, ..PLAIN }.draw(|x, y| {
                let (u, v) = (x - 101.0, y - 98.5);
                let (u, v) = (0.8 * u + 0.6 * v, (0.8 * v - 0.6 * u) / ratio);
                if u.hypot(v) < size { 60.0 } else { 170.0 }
            });
            assert_found("oval", &frame, &[]);
        }
    }
}

#[test]
fn both_outlines_of_a_ring_are_circles() {
    for (x, outer, inner) in [(100.0, 60.0, 36.0), (99.5, 60.0, 45.0), (100.0, 40.0, 32.0)] {
        let (outer, inner) = (circle(x, 101.0, outer), circle(x, 101.0, inner));
        // A washer, and a coin of two metals.
        for core in [160.0, 225.0] {
            let frame = PLAIN.draw(|x, y| {
                if within(&inner, x, y) {
                    core
                } else if within(&outer, x, y) {
                    60.0
                } else {
                    160.0
                }
            });
            assert_found("ring", &frame, &[outer, inner]);
        }
    }
}

#[test]
fn a_disc_before_another_of_its_size_leaves_it_a_circle() {
    for (dx, dy) in [
        (28.0, 0.0),
        (20.0, 20.0),
        (24.5, 10.5),
        (18.0, 0.0),
        (14.5, 15.5),
    ] {
        let (front, back) = (circle(90.0, 95.0, 45.0), circle(90.0 + dx, 95.0 + dy, 45.0));
        let frame = PLAIN.draw(|x, y| {
            if within(&front, x, y) {
                220.0
            } else if within(&back, x, y) {
                130.0
            } else {
                50.0
            }
        });
        assert_found("pair", &frame, &[front, back]);
    }
}

#[test]
fn dark_things_on_a_ground_as_bright_as_can_be_are_found() {
    for (x, radius) in [(100.0, 10.0), (99.5, 16.0), (100.0, 40.0)] {
        let disc = circle(x, 102.0, radius);
        let frame = Picture {
            noise: 0.0,
            ..PLAIN
        }
        .draw(|x, y| {
            let part = (x - disc.x).hypot(y - disc.y) / disc.radius;
            if part < 1.0 {
                100.0 + 70.0 * part
            } else {
                255.0
            }
        });
        // Inverted it is a bright thing on black, which was never a lamp.
        assert_found("on white", &frame, &[disc]);
    }
}

#[test]
fn discs_out_of_focus_are_found() {
    for (x, radius, blur) in [(100.0, 12.0, 2.0), (99.5, 20.0, 3.0), (100.0, 30.0, 4.0)] {
        let disc = circle(x, 101.0, radius);
        let frame =
            Picture { blur, ..PLAIN }.draw(|x, y| if within(&disc, x, y) { 180.0 } else { 60.0 });
        assert_found("out of focus", &frame, &[disc]);
    }
}

#[test]
fn a_disc_of_which_a_third_shows_beside_a_box_is_found() {
    for shift in [0.0, 0.5] {
        let disc = circle(90.0 + shift, 100.0, 50.0);
        let frame = PLAIN.draw(|x, y| {
            if x > 68.0 && x < 150.0 && (y - 98.0).abs() < 62.0 {
                115.0
            } else if within(&disc, x, y) {
                180.0
            } else {
                65.0
            }
        });
        assert_found("behind a box", &frame, &[disc]);
    }
}

/// A wall of a tenth of the radius is a pixel or two wide where its outlines are proven.
#[test]
fn both_outlines_of_a_thin_ring_are_circles() {
    for (x, outer, inner) in [(100.0, 80.0, 72.0), (99.5, 60.0, 54.0), (100.0, 40.0, 36.0)] {
        let (outer, inner) = (circle(x, 101.0, outer), circle(x, 101.0, inner));
        let frame = PLAIN.draw(|x, y| {
            if within(&inner, x, y) {
                225.0
            } else if within(&outer, x, y) {
                60.0
            } else {
                160.0
            }
        });
        assert_found("thin ring", &frame, &[outer, inner]);
    }
}

/// The fit to all steep edges ends between the outlines of the two.
#[test]
fn a_small_ball_before_a_brighter_disc_is_found() {
    let picture = Picture { side: 100, ..PLAIN };
    for (radius, behind, away, contrast, shade) in [
        (12.0, 12.0, 6.4, 45.0, 0.1),
        (12.0, 14.4, 6.4, 55.0, 0.1),
        (14.5, 14.5, 6.7, 45.0, 0.1),
        (14.5, 17.4, 7.7, 55.0, 0.6),
    ] {
        for shift in [0.0, 0.5] {
            let ball = circle(47.0 + shift, 50.0, radius);
            let behind = circle(ball.x + away, ball.y, behind);
            let frame = picture.draw(|x, y| {
                if within(&ball, x, y) {
                    80.0 + contrast * (1.0 - shade * (x - ball.x) / radius)
                } else if within(&behind, x, y) {
                    220.0 - contrast
                } else {
                    80.0
                }
            });
            for (view, (turned, place)) in views(&frame).iter().enumerate() {
                let mut detector = detector(8.0, 95.0);
                let found = detector.detect(turned).unwrap();
                let is_ball = |one: &Detection| same(&one.circle, &place(&ball), 2.0);
                assert!(found.iter().any(is_ball), "view {view}: {found:?}");
            }
        }
    }
}

/// A square grid of discs, and where they are.
fn discs(count: u32, pitch: f64, radius: f64) -> (GrayImage, Vec<Circle>) {
    let side = (f64::from(count) * pitch).ceil() as u32;
    let near = |at: f64| (at / pitch - 0.5).round() * pitch + 0.5 * pitch;
    let picture = Picture { side, ..PLAIN };
    let frame = picture.draw(|x, y| {
        if (x - near(x)).hypot(y - near(y)) < radius {
            60.0
        } else {
            200.0
        }
    });
    (frame, grid(count, pitch, radius))
}

/// The discs of such a grid.
fn grid(count: u32, pitch: f64, radius: f64) -> Vec<Circle> {
    let place = |k: u32| (f64::from(k) + 0.5) * pitch;
    let circles = (0..count * count).map(|k| circle(place(k % count), place(k / count), radius));
    circles.collect()
}

#[test]
fn hundreds_of_circles_are_all_found() {
    for (count, pitch, radius) in [(12, 30.0, 12.0), (24, 15.5, 6.0)] {
        let (frame, circles) = discs(count, pitch, radius);
        let mut detector = detector(0.8 * radius, 40.0);
        let found = detector.detect(&frame).unwrap();
        assert_eq!(found.len(), circles.len());
        for circle in &circles {
            assert!(found.iter().any(|one| same(&one.circle, circle, 0.5)));
        }
        let effort = detector.effort();
        assert!(effort.proven as usize >= circles.len() && !effort.ended_by_count);
    }
}

#[test]
fn faint_discs_close_to_strong_ones_are_all_found() {
    for (count, pitch, radius) in [(12, 25.0, 9.5), (20, 19.0, 7.0)] {
        let side = (f64::from(count) * pitch).ceil() as u32;
        let circles = grid(count, pitch, radius);
        // Two of three discs have a third of the contrast of the others.
        let frame = Picture { side, ..PLAIN }.draw(|x, y| {
            let place = |at: f64| ((at / pitch) as u32).min(count - 1);
            let index = place(y) * count + place(x);
            let step = if index % 3 == 0 { 140.0 } else { 45.0 };
            if within(&circles[index as usize], x, y) {
                200.0 - step
            } else {
                200.0
            }
        });
        for (turned, at) in views(&frame).iter().step_by(5) {
            let mut detector = detector(0.8 * radius, 40.0);
            let found = detector.detect(turned).unwrap();
            assert_eq!(found.len(), circles.len(), "radius {radius}");
            let is_found = |disc: &Circle| found.iter().any(|one| same(&one.circle, disc, 0.5));
            assert!(circles.iter().map(at).all(|disc| is_found(&disc)));
        }
    }
}

#[test]
fn a_grid_of_discs_is_found_in_the_range_of_its_frame() {
    let (frame, circles) = discs(10, 38.0, 12.0);
    let mut detector = AContrario::new(AContrarioConfig::default()).unwrap();
    assert_eq!(detector.detect(&frame).unwrap().len(), circles.len());
    assert!(!detector.effort().ended_by_count);
}

#[test]
fn small_discs_are_found_without_a_range() {
    for (count, pitch, radius) in [(24, 15.5, 6.0), (3, 70.0, 5.0), (1, 180.0, 6.0)] {
        let (frame, circles) = discs(count, pitch, radius);
        for (turned, place) in views(&frame).iter().step_by(5) {
            let mut detector = AContrario::new(AContrarioConfig::default()).unwrap();
            let found = detector.detect(turned).unwrap();
            assert_eq!(found.len(), circles.len(), "radius {radius}");
            let is_found = |disc: &Circle| found.iter().any(|one| same(&one.circle, disc, 0.5));
            assert!(circles.iter().map(place).all(|disc| is_found(&disc)));
        }
    }
}

#[test]
fn circles_beyond_the_most_are_left_out_and_told() {
    let (frame, _) = discs(7, 30.0, 12.0);
    for (max_circles, all) in [(48, false), (49, true)] {
        let mut detector = AContrario::new(AContrarioConfig {
            max_circles,
            ..AContrarioConfig::default()
        })
        .unwrap();
        assert_eq!(detector.detect(&frame).unwrap().len(), max_circles);
        assert_eq!(detector.effort().ended_by_count, !all);
    }
}

#[test]
fn thin_lines_are_found_at_all_sizes() {
    let lines = [
        circle(100.0, 99.5, 92.0),
        circle(62.0, 66.0, 28.0),
        circle(136.0, 62.5, 24.0),
        circle(64.0, 136.0, 22.0),
        circle(135.5, 132.0, 30.0),
    ];
    let frame = PLAIN.draw(|x, y| {
        let on = |line: &Circle| ((x - line.x).hypot(y - line.y) - line.radius).abs() < 0.8;
        if lines.iter().any(on) { 50.0 } else { 190.0 }
    });
    assert_found("thin lines", &frame, &lines);
}

#[test]
fn lines_drawn_by_hand_or_dashed_are_found() {
    for shift in [0.0, 0.5] {
        let line = circle(100.0 + shift, 101.0, 70.0);
        let on = |x: f64, y: f64, wobble: f64| {
            let turn = (y - line.y).atan2(x - line.x);
            let r = line.radius + wobble * ((3.0 * turn).sin() + (8.0 * turn + 1.0).cos());
            (((x - line.x).hypot(y - line.y) - r).abs() < 1.0, turn)
        };
        let by_hand = PLAIN.draw(|x, y| if on(x, y, 0.9).0 { 50.0 } else { 190.0 });
        assert_found("by hand", &by_hand, &[line]);
        let dashed = PLAIN.draw(|x, y| {
            let (on, turn) = on(x, y, 0.0);
            let dash = (10.0 * turn / std::f64::consts::TAU).rem_euclid(1.0) < 0.6;
            if on && dash { 50.0 } else { 190.0 }
        });
        assert_found("dashed", &dashed, &[line]);
    }
}

#[test]
fn faint_lines_amid_strong_bars_are_found() {
    let ring = circle(168.0, 176.5, 123.0);
    let mut hits = 0;
    for seed in 0..4 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut random = |range: f64| range * f64::from(rng.next_u32()) / f64::from(u32::MAX);
        let mut bar = || [340.0, 340.0, 6.3, 15.0, 1.0].map(&mut random);
        let bars: Vec<[f64; 5]> = (0..44).map(|_| bar()).collect();
        let frame = Picture { side: 340, ..PLAIN }.draw(|x, y| {
            let over = |&&[cx, cy, angle, half, _]: &&[f64; 5]| {
                let (dx, dy) = (x - cx, y - cy);
                if dx.abs() + dy.abs() > 45.0 {
                    return false;
                }
                let (sin, cos) = angle.sin_cos();
                (dx * cos + dy * sin).abs() < 12.0 + half && (dy * cos - dx * sin).abs() < 2.0
            };
            let on = ((x - ring.x).hypot(y - ring.y) - ring.radius).abs() < 0.9;
            let bar = bars.iter().find(over);
            bar.map_or(if on { 60.0 } else { 100.0 }, |bar| {
                10.0 + 235.0 * bar[4].round()
            })
        });
        let mut detector = detector(60.0, 160.0);
        let found = detector.detect(&frame).unwrap();
        hits += usize::from(found.iter().any(|one| same(&one.circle, &ring, 3.0)));
        assert!(found.len() <= 1, "{found:?}");
    }
    assert!(hits >= 3, "{hits} of 4");
}
