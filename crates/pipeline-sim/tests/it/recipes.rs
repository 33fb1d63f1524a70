//! Frames of each recipe show what it says.

use pipeline_sim::{
    Camera, QuantityError, Recipe, Renderer, Round, RoundOutline, Sensor, Snapshot,
};

use crate::rng;

fn drawn(name: &str, size: (u32, u32), seed: u64) -> (Renderer, Snapshot) {
    let mut rng = rng(seed);
    let recipe = Recipe::named(name).expect("a recipe");
    recipe.draw(size, &mut rng).expect("a usable size")
}

/// The balls among the truth.
fn balls(renderer: &Renderer, snapshot: &Snapshot) -> Vec<RoundOutline> {
    let truth = snapshot.truth(renderer);
    assert!(
        truth
            .iter()
            .all(|s| matches!(s.what, Round::Target | Round::Ball))
    );
    truth
}

#[test]
fn frames_of_each_recipe_repeat_with_their_seed() {
    let unknown = Recipe::named("nothing").expect_err("no such recipe");
    for recipe in Recipe::cell().iter().chain(Recipe::benchmark()) {
        let kind = recipe.name();
        assert!(unknown.to_string().contains(kind), "{unknown}");
        let (mut renderer, snapshot) = drawn(kind, (192, 144), 3);
        assert_eq!(renderer.scene().check(), Ok(()), "{kind}");
        assert_eq!(snapshot.shot.check(), Ok(()), "{kind}");
        let truth = snapshot.truth(&renderer);
        let target = truth.first().is_some_and(|s| s.what == Round::Target);
        assert_eq!(target, !kind.contains("empty"), "{kind}");
        let frame = snapshot.take(&mut renderer).clone();
        let darkest = frame.iter().min().copied().unwrap_or(0);
        let brightest = frame.iter().max().copied().unwrap_or(0);
        assert!(brightest - darkest > 40, "{kind}: {darkest}..{brightest}");
        // The scenes of both lists are made alike.
        if matches!(kind, "occluded" | "interlaced" | "textured" | "many") {
            let (mut again, same) = drawn(kind, (192, 144), 3);
            assert!(
                *same.take(&mut again) == frame && same.truth(&again) == truth,
                "{kind}"
            );
            assert!(drawn(kind, (192, 144), 4).1 != same, "{kind}");
        }
    }
}

#[test]
fn balls_have_the_number_size_and_visibility_of_the_recipe() {
    for size in [(192, 144), (768, 576), (1920, 1080)] {
        let scale = Camera::paper()
            .resized(size.0, size.1)
            .expect("a usable size")
            .focal_px()
            / Camera::paper().focal_px();
        for kind in Recipe::benchmark().iter().map(Recipe::name) {
            let sampled = matches!(kind, "clean" | "many" | "textured");
            for seed in 0..u64::from(sampled || size.0 == 768) {
                let (renderer, snapshot) = drawn(kind, size, seed);
                let balls = balls(&renderer, &snapshot);
                let count = match kind {
                    "empty-table" | "noisy-empty" => 0,
                    "many" => 20,
                    "textured" => 4,
                    _ => 1,
                };
                assert_eq!(balls.len(), count, "{kind} {size:?} {seed}");
                for ball in &balls {
                    let radius = ball.ellipse.circle().radius / scale;
                    let most = if kind == "many" { 60.0 } else { 145.0 };
                    // In motion the truth is half a motion away from where the ball was put.
                    let slack = if kind == "motion-blur" { 0.5 } else { 1e-6 };
                    assert!(
                        (12.0 - slack..=most + slack).contains(&radius),
                        "{kind} {size:?} {seed}: {radius}"
                    );
                    assert!(
                        ball.ellipse.share_inside(size.0, size.1) >= 1.0,
                        "{kind} {size:?} {seed}"
                    );
                    let shown = if kind == "occluded-40" {
                        // The segment that 40 % of the circumference cut off.
                        let angle = 0.4 * std::f64::consts::PI;
                        1.0 - (angle - angle.sin() * angle.cos()) / std::f64::consts::PI
                    } else {
                        1.0
                    };
                    assert!(
                        (ball.visible - shown).abs() < 0.04,
                        "{kind} {size:?} {seed}: {} {radius}",
                        ball.visible
                    );
                }
            }
        }
    }
}

#[test]
fn radii_are_spread_over_the_whole_range() {
    let mut radii: Vec<f64> = (0..24)
        .map(|seed| {
            let Snapshot { cell, joints, .. } = drawn("clean", (192, 144), seed).1;
            4.0 * cell.outline(&joints).expect("in view").circle().radius
        })
        .collect();
    radii.sort_by(f64::total_cmp);
    // The median of an even spread on a logarithmic scale is the geometric mean of the ends.
    let middle = (12.0_f64 * 145.0).sqrt();
    assert!(radii[0] < 20.0 && radii[23] > 95.0, "{radii:?}");
    assert!((0.6..1.6).contains(&(radii[12] / middle)), "{}", radii[12]);
}

#[test]
fn noise_has_the_strength_of_the_recipe() {
    for (kind, expected) in [
        ("clean", Sensor::default().read_noise),
        ("noise-10", 10.0),
        ("noise-40", 40.0),
        ("distractors-noise-25", 25.0),
    ] {
        let (mut renderer, snapshot) = drawn(kind, (768, 576), 5);
        let (a, b) = (
            snapshot.take(&mut renderer).clone(),
            snapshot.take(&mut renderer).clone(),
        );
        // Where the noise is not cut off at black or white.
        let differences: Vec<f64> = a
            .iter()
            .zip(b.iter())
            .map(|(p, q)| (f64::from(*p) + f64::from(*q), f64::from(*p) - f64::from(*q)))
            .filter(|(sum, _)| (160.0..320.0).contains(sum))
            .map(|(_, difference)| difference)
            .collect();
        let variance =
            differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64 / 2.0;
        let deviation = variance.sqrt();
        let shot = if kind == "clean" { 1.3 } else { 0.0 };
        assert!(
            (deviation - expected - shot).abs() < 0.12 * expected + 0.6,
            "{kind}: {deviation}, {} pixels",
            differences.len()
        );
    }
}

#[test]
fn motion_blur_is_four_to_twelve_pixels() {
    for seed in 0..4 {
        let (_, snapshot) = drawn("motion-blur", (768, 576), seed);
        let place = |seconds| {
            let (cell, joints) = snapshot.moment(seconds);
            cell.outline(&joints).expect("in view").centre
        };
        let moved = (place(snapshot.shot.exposure) - place(0.0)).norm();
        assert!((3.99..12.01).contains(&moved), "{seed}: {moved}");
        assert!(snapshot.shot.moments as f64 >= moved / 2.0);
    }
}

#[test]
fn frame_without_pixels_is_refused() {
    let mut rng = rng(1);
    for size in [(0, 576), (768, 0)] {
        let refused = Recipe::cell()[0]
            .draw(size, &mut rng)
            .expect_err("no pixels");
        assert!(matches!(refused, QuantityError::Value { .. }), "{refused}");
        assert!(Recipe::benchmark()[0].draw(size, &mut rng).is_err());
    }
    // However small the frame, there is one.
    assert_eq!(drawn("many", (1, 1), 1).1.cell.camera.size(), (1, 1));
}

#[test]
fn frames_of_any_shape_are_drawn_and_rendered() {
    for kind in ["clean", "textured"] {
        for size in [(100, 576), (16, 2000), (2000, 16)] {
            let (mut renderer, snapshot) = drawn(kind, size, 1);
            assert_eq!(snapshot.take(&mut renderer).dimensions(), size);
        }
    }
}
