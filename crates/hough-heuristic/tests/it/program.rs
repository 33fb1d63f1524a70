//! The program `detect_circles`: its answers to good, broken and too large files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hough_heuristic::image::{GrayImage, Luma};

/// Runs the program. Returns its exit code and its error output.
fn detect_circles(options: &[&str], files: &[&Path]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_detect_circles"));
    let output = command.args(options).args(files).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!errors.contains("panicked"), "{errors}");
    (output.status.code(), errors)
}

/// Writes an image of a ball at (90, 80) with a radius of 40 pixels.
fn ball(path: PathBuf) -> PathBuf {
    let bright = |x: u32, y: u32| (f64::from(x) - 90.0).hypot(f64::from(y) - 80.0) < 40.0;
    let gray = |x, y| Luma([if bright(x, y) { 220 } else { 40 }]);
    GrayImage::from_fn(200, 160, gray).save(&path).unwrap();
    path
}

#[test]
fn files_that_cannot_be_read_are_named_and_the_rest_detected() {
    let folder = tempfile::tempdir().unwrap();
    let (images, csv) = (
        folder.path().join("images"),
        folder.path().join("circles.csv"),
    );
    fs::create_dir(&images).unwrap();
    fs::write(images.join("a_broken.png"), b"\x89PNG\r\n\x1a\nnothing").unwrap();
    fs::write(images.join("b_empty.pgm"), b"P5\n0 0\n255\n").unwrap();
    ball(images.join("c_ball.png"));
    let missing = folder.path().join("missing.png");
    let (code, errors) = detect_circles(&["--csv", csv.to_str().unwrap()], &[&missing, &images]);
    assert_eq!(code, Some(1), "{errors}");
    for name in ["missing.png", "a_broken.png", "b_empty.pgm"] {
        assert!(errors.contains(name), "{name} is not named in: {errors}");
    }
    let rows = fs::read_to_string(csv).unwrap();
    let mut rows = rows.lines();
    assert_eq!(rows.next(), Some("file,cx,cy,r,score"));
    let found: Vec<&str> = rows.next().unwrap().split(',').collect();
    assert!(found[0].ends_with("c_ball.png"));
    for (field, value) in found[1..4].iter().zip([90.0, 80.0, 40.0]) {
        let off = field.parse::<f64>().unwrap() - value;
        assert!(off.abs() < 1.0, "{found:?}");
    }
}

#[test]
fn stages_and_times_are_written_for_every_detector() {
    let folder = tempfile::tempdir().unwrap();
    let (ball, times) = (
        ball(folder.path().join("ball.png")),
        folder.path().join("times.csv"),
    );
    let times_path = times.to_str().unwrap();
    for detector in [
        "heuristic",
        "heuristic-anywhere",
        "rht",
        "rht-anywhere",
        "sht",
        "sht-gradient",
    ] {
        let stages = folder.path().join(detector);
        let stages_path = stages.to_str().unwrap();
        let options = [
            "--detector",
            detector,
            "--stages",
            stages_path,
            "--times",
            times_path,
        ];
        // A file that is named twice gets two folders.
        let (code, errors) = detect_circles(&options, &[&ball, &ball]);
        assert_eq!(code, Some(0), "{detector}: {errors}");
        for name in ["ball", "ball-2"] {
            assert_eq!(
                fs::read_dir(stages.join(name)).unwrap().count(),
                4,
                "{detector}"
            );
        }
        let times = fs::read_to_string(&times).unwrap();
        let (head, rows) = times.split_once('\n').unwrap();
        assert_eq!(head, "file,cpu_us,edges_us,structure_us,search_us");
        for micros in rows.lines().flat_map(|row| row.rsplit(',').take(4)) {
            assert!(micros.parse::<f64>().unwrap() > 0.0, "{detector}: {rows}");
        }
    }
}

#[test]
fn a_frame_that_is_too_large_is_named_and_the_rest_detected() {
    let folder = tempfile::tempdir().unwrap();
    let (large, small) = (
        folder.path().join("large.pgm"),
        folder.path().join("small.pgm"),
    );
    GrayImage::new(3840, 2160).save(&large).unwrap();
    GrayImage::new(160, 120).save(&small).unwrap();
    let (code, errors) = detect_circles(&["--detector", "sht", "--csv", "-"], &[&large, &small]);
    assert_eq!(code, Some(1), "{errors}");
    assert!(
        errors.contains("large.pgm") && errors.contains("max_memory"),
        "{errors}"
    );
    assert!(!errors.contains("small.pgm"), "{errors}");
}
