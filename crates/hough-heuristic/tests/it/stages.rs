use std::time::Duration;

use hough_heuristic::{
    AContrario, AContrarioConfig, Acceptance, CannyConfig, Circle, Detection, EdgeMap, EdgePixel,
    Stages, image,
};

use crate::detectors;
use circle_scenes::scene::Scene;

#[test]
fn each_stage_of_each_detector_has_its_picture() {
    let (frame, _) = Scene {
        width: 192,
        height: 144,
        ..Scene::default()
    }
    .render();
    let mut all = detectors::all_on(Acceptance::default(), CannyConfig::default());
    let config = AContrarioConfig::default();
    all.push(("a contrario", Box::new(AContrario::new(config).unwrap())));
    for (name, mut detector) in all {
        detector.keep_candidates(true);
        let found = detector.detect(&frame).unwrap().to_vec();
        assert!(!found.is_empty(), "{name}");
        let stages = detector.stages();
        assert!(!stages.edges.pixels().is_empty(), "{name}");
        let near = |circle: &Circle| {
            let best = found[0].circle;
            (circle.x - best.x).hypot(circle.y - best.y) < 8.0
                && (circle.radius - best.radius).abs() < 8.0
        };
        assert!(
            stages.candidates.iter().any(near),
            "{name}: {:?}",
            stages.candidates
        );
        let times = stages.search_time.min(stages.edge_time);
        assert!(times.as_nanos() > 0 || name == "a contrario", "{name}");

        let folder = tempfile::tempdir().unwrap();
        let paths = stages.write(folder.path(), &frame, &found).unwrap();
        for path in &paths {
            assert_eq!(
                image::open(path).unwrap().to_rgb8().dimensions(),
                (192, 144)
            );
        }
        assert_eq!(
            image::open(&paths[0]).unwrap().to_luma8(),
            *stages.edges.image(),
            "{name}"
        );
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);

        let nowhere = folder.path().join("missing");
        let error = stages.write(&nowhere, &frame, &[]).unwrap_err();
        assert!(error.to_string().contains("1_edges.png"), "{error}");

        // The next frame has its own candidates, and without the wish for them there are none.
        detector.detect(&image::GrayImage::new(64, 64)).unwrap();
        assert_eq!(detector.stages().candidates, [], "{name}");
        detector.keep_candidates(false);
        detector.detect(&frame).unwrap();
        assert_eq!(detector.stages().candidates, [], "{name}");
    }
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_replaced_by_a_picture() {
    use std::os::unix::fs::{FileTypeExt, symlink};

    let (frame, _) = Scene::default().render();
    let mut detector = detectors::all_on(Acceptance::default(), CannyConfig::default())
        .remove(0)
        .1;
    let found = detector.detect(&frame).unwrap().to_vec();
    let stages = detector.stages();
    let folder = tempfile::tempdir().unwrap();
    // A link stays a link.
    let (elsewhere, link) = (
        folder.path().join("elsewhere.png"),
        folder.path().join("4_accepted.png"),
    );
    std::fs::write(&elsewhere, b"older").unwrap();
    symlink(&elsewhere, &link).unwrap();
    stages.write(folder.path(), &frame, &found).unwrap();
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(image::open(&elsewhere).is_ok());
    // A socket cannot be written to, and stays what it is.
    let socket = folder.path().join("1_edges.png");
    std::fs::remove_file(&socket).unwrap();
    let _listening = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    let error = stages.write(folder.path(), &frame, &found).unwrap_err();
    assert!(error.to_string().contains("1_edges.png"), "{error}");
    assert!(std::fs::metadata(&socket).unwrap().file_type().is_socket());
    let parts = std::fs::read_dir(folder.path()).unwrap();
    let unfinished =
        |entry: &std::fs::DirEntry| entry.file_name().to_string_lossy().ends_with(".part");
    assert!(!parts.map(Result::unwrap).any(|entry| unfinished(&entry)));
}

/// The picture of `D` shows as explained what an accepted circle takes out of `D`: a band that
/// widens with the tolerance and with the radius.
#[test]
fn the_picture_explains_what_the_detectors_explain() {
    let circle = Circle {
        x: 10.0,
        y: 10.0,
        radius: 200.0,
    };
    // Edge pixels at 0, 1, .. 9 px beyond the outline, along the row of the centre.
    let edges = EdgeMap::from_image(&image::GrayImage::from_fn(240, 20, |x, y| {
        image::Luma([if y == 10 && (210..220).contains(&x) {
            255
        } else {
            0
        }])
    }));
    let found = [Detection { circle, score: 0.9 }];
    let frame = image::GrayImage::new(240, 20);
    // tolerance + 1.5 px + 1 % of the radius
    for (tolerance, last) in [(0.0, 213), (1.0, 214), (4.0, 217)] {
        let stages = Stages {
            edges: &edges,
            candidates: &[],
            tolerance,
            memory: 0,
            edge_time: Duration::ZERO,
            structure_time: Duration::ZERO,
            search_time: Duration::ZERO,
        };
        let folder = tempfile::tempdir().unwrap();
        let [_, structure, ..] = stages.write(folder.path(), &frame, &found).unwrap();
        let picture = image::open(structure).unwrap().to_rgb8();
        for x in 210..220 {
            let explained = x <= last;
            assert_eq!(
                stages.explains(&circle, EdgePixel { x, y: 10 }),
                explained,
                "{tolerance} {x}"
            );
            // Blue is explained, yellow is not.
            let [red, _, blue] = picture.get_pixel(x, 10).0;
            assert_eq!(blue > red, explained, "{tolerance} {x}");
        }
    }
}
