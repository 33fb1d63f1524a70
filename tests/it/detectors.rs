//! The detectors that command lines name.

use hough_heuristic::Features;
use pipeline_sim::{Ball, Cell, Renderer, Scene, Workspace};
use puma_grasp::BallDetector;

#[test]
fn every_detector_goes_by_its_name_and_finds_the_ball() {
    let cell = Cell::paper(Ball::at(0.6, 0.15, -0.1));
    let pose = Workspace::paper().search_poses()[3];
    let truth = cell.features(&pose).expect("the ball is in view");
    let mut renderer = Renderer::new(&Scene::bright_ball(), 1);
    let frame = renderer.render(&cell, &pose);
    for kind in BallDetector::ALL {
        assert_eq!(kind.to_string().parse::<BallDetector>().ok(), Some(kind));
        let mut detector = kind.build(1).expect("valid settings");
        let found = detector.detect(frame).expect("no region of interest");
        let seen = Features::from_circle(&found[0].circle, frame.width());
        let off = (seen.x - truth.x).hypot(seen.y - truth.y) + (seen.r - truth.r).abs();
        assert!(off < 0.5, "{kind}: {seen:?} for {truth:?}");
    }
    let unknown = "houhg"
        .parse::<BallDetector>()
        .expect_err("no such detector");
    assert!(unknown.to_string().contains("rht"), "{unknown}");
}
