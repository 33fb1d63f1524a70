//! Counts the instructions of one frame under valgrind's callgrind: unlike seconds, they do not
//! depend on what else the machine is doing. Where valgrind is not installed it says so and
//! succeeds.

#![allow(missing_docs)]
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "its counts are for reading"
)]

use std::hint::black_box;
use std::process::{Command, ExitCode};

use circle_scenes::contest;
use circle_scenes::staged::TRANSFORMS;
use hough_heuristic::image::GrayImage;
use hough_heuristic::{AContrario, AContrarioConfig, Canny, CircleDetector, EdgeDetector};

const SCENES: [&str; 3] = ["1 ball", "+20 distractors", "192x144, 1 ball"];
/// The standard transform takes minutes under callgrind on a large frame.
const SMALL_ONLY: &str = "SHT";
const EDGES: &str = "edges";
/// The a contrario detector, which finds edges of its own: all of its work is counted, with its
/// default settings.
const A_CONTRARIO: &str = "a contrario, edges included";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments[..] {
        [flag, scene, case] if flag == "--case" => {
            run(scene, case);
            ExitCode::SUCCESS
        }
        _ if !arguments.iter().any(|argument| argument == "--bench") => ExitCode::SUCCESS,
        _ => count_all(),
    }
}

fn count_all() -> ExitCode {
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("skipped: valgrind is not installed, so no instructions are counted");
        return ExitCode::SUCCESS;
    }
    println!("{:18} {:28} {:>12}", "scene", "what", "instructions");
    for scene in SCENES {
        for case in [EDGES, A_CONTRARIO].into_iter().chain(TRANSFORMS) {
            if case == SMALL_ONLY && !scene.starts_with("192x144") {
                continue;
            }
            match count(scene, case) {
                Ok(count) => println!("{scene:18} {case:28} {count:>12}"),
                Err(error) => {
                    eprintln!("{scene}, {case}: {error}");
                    return ExitCode::FAILURE;
                }
            }
        }
    }
    ExitCode::SUCCESS
}

/// Runs this program on one case under callgrind, which counts inside of [`measured`] alone.
fn count(scene: &str, case: &str) -> Result<u64, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .args([
            "--tool=callgrind",
            "--callgrind-out-file=/dev/null",
            "--toggle-collect=*measured*",
        ])
        .arg(program)
        .args(["--case", scene, case])
        .output()
        .map_err(|error| error.to_string())?;
    let report = String::from_utf8_lossy(&output.stderr);
    let collected = report
        .lines()
        .find_map(|line| line.split_once("Collected :"));
    let number = collected.and_then(|(_, number)| number.trim().parse().ok());
    number
        .filter(|_| output.status.success())
        .ok_or_else(|| format!("callgrind failed: {report}"))
}

/// One frame to fill the buffers, and a second one that counts.
fn run(scene: &str, case: &str) {
    let Some(contest::Round { scene, .. }) = contest::rounds()
        .into_iter()
        .find(|round| round.name == scene)
    else {
        return;
    };
    let (frame, _) = scene.render();
    let mut canny = Canny::default();
    let edges = canny.detect_edges(&frame).clone();
    if case == EDGES {
        measured(&frame, |frame| canny.detect_edges(frame).pixels().len());
    } else if case == A_CONTRARIO {
        count_circles(
            &mut AContrario::new(AContrarioConfig::default()).expect("usable settings"),
            &frame,
        );
    } else {
        count_circles(
            &mut *contest::detector(case, &scene, contest::Found(edges)).expect("usable settings"),
            &frame,
        );
    }
}

fn count_circles(detector: &mut (impl CircleDetector + ?Sized), frame: &GrayImage) {
    let mut count = |frame: &GrayImage| detector.detect(frame).map_or(0, <[_]>::len);
    count(frame);
    measured(frame, count);
}

#[inline(never)]
fn measured(frame: &GrayImage, work: impl FnOnce(&GrayImage) -> usize) {
    black_box(work(black_box(frame)));
}
