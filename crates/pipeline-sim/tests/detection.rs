//! The two ways to the ball's features agree: straight from the geometry, and by rendering a frame
//! and detecting the ball in it.
#![allow(clippy::print_stdout)] // Measured differences, shown with --nocapture.

use hough_heuristic::{
    Acceptance, CircleDetector, Features, FrameSource, FrameStream, Heuristic, HeuristicConfig,
};
use pipeline_sim::{Ball, Cell, Renderer, Scene, SceneKind, Snapshot, Workspace, Y4mWriter};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

#[test]
fn the_shortcut_agrees_with_rendering_and_detection() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
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
    while frames < 60 {
        let Snapshot { cell, joints, .. } = Snapshot::draw(SceneKind::Things, &mut rng);
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
    println!(
        "found {} of {frames}; centre {:.3} (median) {:.3} (90 %), radius {:.3} {:.3} units",
        centres.len(),
        at(&centres, 0.5),
        at(&centres, 0.9),
        at(&radii, 0.5),
        at(&radii, 0.9)
    );
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

#[test]
fn a_written_run_is_read_back_frame_by_frame() {
    let cell = Cell::paper(Ball::at(0.60, 0.15, -0.10));
    let mut renderer = Renderer::new(&Scene::plain(), 2);
    let mut video = Y4mWriter::new(Vec::new(), 25, 1).expect("PAL");
    let mut frames = Vec::new();
    for pose in Workspace::paper().search_poses() {
        frames.push(renderer.render(&cell, &pose).clone());
        video
            .write(frames.last().expect("just pushed"))
            .expect("memory");
    }
    let wrong = image::GrayImage::new(4, 4);
    assert!(video.write(&wrong).is_err(), "another size");
    let bytes = video.finish().expect("memory");
    let mut read = image::GrayImage::default();
    let mut back = FrameStream::y4m(bytes.as_slice()).expect("its own stream");
    for frame in &frames {
        back.grab(&mut read).expect("as many as were written");
        assert!(read == *frame);
    }
    assert!(matches!(
        back.grab(&mut read),
        Err(hough_heuristic::FrameError::End)
    ));
    assert!(Y4mWriter::new(Vec::new(), 0, 1).is_err());
}
