//! The two ways to the ball's features agree: straight from the geometry, and by rendering a frame
//! and detecting the ball in it.

use hough_heuristic::{Acceptance, CircleDetector, Features, Heuristic, HeuristicConfig};
use pipeline_sim::{Recipe, Renderer, Scene, Snapshot};
use rand::rngs::Xoshiro256PlusPlus;

use crate::rng;

/// Draws a snapshot of a recipe's, without its scene.
fn drawn(name: &str, rng: &mut Xoshiro256PlusPlus) -> Snapshot {
    let recipe = Recipe::named(name).expect("a recipe");
    let snapshot = recipe
        .draw_again((768, 576), rng)
        .expect("a frame of pixels");
    snapshot.expect("scenes are shared")
}

#[test]
fn features_agree_with_rendering_and_detection() {
    let mut rng = rng(1);
    let mut renderer = Renderer::new(&Scene::laboratory(), 1);
    // The laboratory has other round things, and outlines off the axis are ellipses: several
    // circles, some tolerance.
    let config = HeuristicConfig {
        accept: Acceptance {
            min_radius: 18.0,
            max_circles: 8,
            tolerance: 2.0,
            ..Acceptance::default()
        },
        ..HeuristicConfig::default()
    };
    let mut detector = Heuristic::with_canny(config).expect("a sound configuration");
    let (mut centres, mut radii, mut frames) = (Vec::new(), Vec::new(), 0);
    while frames < 20 {
        let Snapshot { cell, joints, .. } = drawn("things", &mut rng);
        let shortcut = cell.features(&joints).expect("snapshots show the ball");
        if cell
            .outline(&joints)
            .expect("in sight")
            .share_inside(768, 576)
            < 1.0
        {
            continue;
        }
        frames += 1;
        let frame = renderer.render(&cell, &joints);
        let found = detector.detect(frame).expect("no region of interest");
        // Of all circles found, the ball: the one nearest to where the shortcut has it.
        let seen = found
            .iter()
            .map(|d| Features::from_circle(&d.circle, 768))
            .min_by(|a, b| {
                let distance = |f: &Features| {
                    (f.x - shortcut.x).hypot(f.y - shortcut.y) + (f.r - shortcut.r).abs()
                };
                distance(a).total_cmp(&distance(b))
            });
        let Some(seen) = seen else { continue };
        let (centre, radius) = (
            (seen.x - shortcut.x).hypot(seen.y - shortcut.y),
            (seen.r - shortcut.r).abs(),
        );
        if centre < 2.0 && radius < 2.0 {
            centres.push(centre);
            radii.push(radius);
        }
    }
    centres.sort_by(f64::total_cmp);
    radii.sort_by(f64::total_cmp);
    let at = |v: &[f64], share: f64| v[((v.len() - 1) as f64 * share) as usize];
    assert!(
        centres.len() * 10 >= frames * 9,
        "{} of {frames}",
        centres.len()
    );
    // A unit is four pixels of the frame.
    assert!(
        at(&centres, 0.5) < 0.15 && at(&centres, 0.9) < 0.5,
        "{centres:?}"
    );
    assert!(at(&radii, 0.5) < 0.20 && at(&radii, 0.9) < 0.5, "{radii:?}");
}
