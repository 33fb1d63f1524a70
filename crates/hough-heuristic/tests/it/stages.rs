use hough_heuristic::image;
use hough_heuristic::{CircleDetector, Heuristic, HeuristicConfig, write_stages};

use crate::scenes::Scene;

#[test]
fn each_stage_has_its_picture() {
    let (frame, _) = Scene {
        width: 192,
        height: 144,
        ..Scene::default()
    }
    .render();
    let mut detector = Heuristic::with_canny(HeuristicConfig::default()).unwrap();
    detector.keep_candidates(true);
    let found = detector.detect(&frame);
    assert!(!found.is_empty() && !detector.candidates().is_empty());

    let folder = tempfile::tempdir().unwrap();
    let paths = write_stages(
        folder.path(),
        &frame,
        detector.edges(),
        detector.candidates(),
        &found,
    )
    .unwrap();
    for path in &paths {
        assert_eq!(image::open(path).unwrap().to_rgb8().dimensions(), (192, 144));
    }
    assert_eq!(
        image::open(&paths[0]).unwrap().to_luma8(),
        *detector.edges().image()
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);

    let nowhere = folder.path().join("missing");
    let error = write_stages(&nowhere, &frame, detector.edges(), &[], &[]).unwrap_err();
    assert!(error.to_string().contains("1_edges.png"), "{error}");
}
