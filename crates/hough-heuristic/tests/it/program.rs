//! The program `detect_circles`: its answers to good, broken and too large files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hough_heuristic::image::{GrayImage, Luma, Rgb, RgbImage, open};

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
    ball(images.join("c_ball.tif"));
    let missing = folder.path().join("missing.png");
    let (code, errors) = detect_circles(&["--csv", csv.to_str().unwrap()], &[&missing, &images]);
    assert_eq!(code, Some(1), "{errors}");
    for name in ["missing.png", "a_broken.png", "b_empty.pgm"] {
        assert!(errors.contains(name), "{name} is not named in: {errors}");
    }
    let rows = fs::read_to_string(csv).unwrap();
    let mut rows = rows.lines();
    let columns = "file,cx,cy,r,score,covered,visible,axis_ratio,centre_error,radius_error";
    assert_eq!(rows.next(), Some(columns));
    let found: Vec<&str> = rows.next().unwrap().split(',').collect();
    assert!(found[0].ends_with("c_ball.tif"));
    let expected = [90.0, 80.0, 40.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0];
    for (field, value) in found[1..].iter().zip(expected) {
        let off = field.parse::<f64>().unwrap() - value;
        assert!(off.abs() < 1.0, "{found:?}");
    }
    assert_eq!(found.len(), 10);
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
        "a-contrario",
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
            let told = micros.parse::<f64>().is_ok_and(|micros| micros > 0.0);
            assert!(told || detector == "a-contrario", "{detector}: {rows}");
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

#[test]
fn options_reach_the_detector_and_wrong_ones_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let (ball, csv) = (
        ball(folder.path().join("ball.png")),
        folder.path().join("circles.csv"),
    );
    let csv_path = csv.to_str().unwrap();
    let rows = |options: &[&str]| {
        let all = [options, &["--csv", csv_path]].concat();
        let (code, errors) = detect_circles(&all, &[&ball]);
        assert_eq!(code, Some(0), "{options:?}: {errors}");
        (
            fs::read_to_string(&csv).unwrap().lines().count() - 1,
            errors,
        )
    };
    for (options, count) in [
        (&["--rings", "outer", "--min-distance", "20"][..], 1),
        (&["--region", "80,70,20,20"], 1),
        (&["--region", "0,0,20,20"], 0),
        (&["--max-radius", "30"], 0),
        (&["--contrast", "128"], 1),
        (&["--min-score", "1"], 0),
        (&["--detector", "rht", "--max-radius", "30"], 0),
        (&["--detector", "rht", "--channel", "red", "--seed", "2"], 1),
        (&["--min-axis-ratio", "0.5"], 1),
    ] {
        assert_eq!(rows(options).0, count, "{options:?}");
    }
    let table = fs::read_to_string(&csv).unwrap();
    let columns: Vec<_> = table.lines().map(|line| line.split(',').count()).collect();
    assert_eq!(columns, [16, 16], "{table}");
    let (_, note) = rows(&["--time-limit", "0.000001"]);
    assert!(
        note.contains("ball.png") && note.contains("--time-limit"),
        "{note}"
    );
    for (options, named) in [
        (&["--detector", "sht", "--rings", "outer"][..], "--rings"),
        (
            &["--detector", "rht", "--min-axis-ratio", "0.5"],
            "--min-axis-ratio",
        ),
        (&["--detector", "sht-gradient", "--seed", "2"], "--seed"),
        (&["--min-axis-ratio", "0.2"], "min_axis_ratio"),
        (&["--region", "1,2,3"], "LEFT,TOP,WIDTH,HEIGHT"),
        (&["--time-limit", "0"], "milliseconds_per_megapixel"),
        (&["--region", "190,0,20,20"], "200x160"),
    ] {
        let (code, errors) = detect_circles(options, &[&ball]);
        assert_ne!(code, Some(0), "{options:?}");
        assert!(errors.contains(named), "{options:?}: {errors}");
    }
}

#[test]
fn overlays_keep_colours_and_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("red.png");
    // A red ball on green of the same luma, which only the components tell apart.
    let inside = |x: u32, y: u32| (f64::from(x) - 90.0).hypot(f64::from(y) - 80.0) < 40.0;
    let rgb = |x, y| {
        Rgb(if inside(x, y) {
            [200, 30, 20]
        } else {
            [20, 84, 20]
        })
    };
    RgbImage::from_fn(200, 160, rgb).save(&path).unwrap();
    let out = folder.path().join("out");
    for channel in ["red", "strongest"] {
        let options = ["--channel", channel, "--overlay", out.to_str().unwrap()];
        assert_eq!(detect_circles(&options, &[&path]).0, Some(0));
        let overlay = open(out.join("red.png")).unwrap().to_rgb8();
        fs::remove_file(out.join("red.png")).unwrap();
        assert_eq!(overlay.dimensions(), (200, 160));
        assert_eq!(overlay.get_pixel(5, 5), &Rgb([20, 84, 20]));
        assert_eq!(overlay.get_pixel(90, 100), &Rgb([200, 30, 20]));
        let is_drawn = |x: u32| overlay.get_pixel(x, 80) == &Rgb([60, 255, 60]);
        assert!((129..=131).any(is_drawn) && is_drawn(90), "{channel}");
    }
}
