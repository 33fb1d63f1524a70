//! Programs that drive a real arm, against an emulated one: processes, a serial line and a pipe as
//! they would be.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use grasp_agent::{EventKind, SavedRun};
use hough_heuristic::image::GrayImage;
use hough_heuristic::{FrameError, FrameSource};
use puma_grasp::LiveCamera;

use crate::command_line::{example, or_skip, output, policy_file};

/// An emulated cell in a process of its own.
struct Cell {
    process: Child,
    panel: ChildStdin,
    answers: BufReader<std::process::ChildStderr>,
    folder: tempfile::TempDir,
}

impl Cell {
    fn start() -> Option<Self> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let pipe = Command::new("mkfifo")
            .arg(folder.path().join("camera"))
            .status();
        assert!(pipe.expect("mkfifo is there").success());
        let mut cell = example("emulated_cell")?;
        cell.current_dir(folder.path())
            .args(["--link", "puma", "--video", "camera"])
            // Small frames: cheap to draw and to search.
            .args(["--size", "384x288"]);
        cell.stdin(Stdio::piped()).stderr(Stdio::piped());
        let mut process = cell.spawn().expect("the cell starts");
        let (panel, answers) = (
            process.stdin.take().expect("a pipe"),
            process.stderr.take().expect("a pipe"),
        );
        let mut cell = Self {
            process,
            panel,
            answers: BufReader::new(answers),
            folder,
        };
        assert!(cell.answer().starts_with("arm on "));
        Some(cell)
    }

    fn answer(&mut self) -> String {
        let mut line = String::new();
        self.answers.read_line(&mut line).expect("the cell answers");
        line
    }

    fn tell(&mut self, order: &str) {
        writeln!(self.panel, "{order}").expect("the cell listens");
        assert_eq!(self.answer().trim(), format!("done: {order}"));
    }

    /// Prepares a program that drives this arm by what its camera sees.
    fn driven_by(&self, name: &str, camera: &str) -> Option<Command> {
        let mut program = example(name)?;
        program.current_dir(self.folder.path());
        program.args([
            "--port", "puma", "--camera", camera, "--speed", "100", "--out", "out",
        ]);
        program.stdin(Stdio::null());
        Some(program)
    }

    fn saved(&self, run: &str) -> SavedRun {
        let file = std::fs::read_to_string(self.folder.path().join(run)).expect("the run");
        SavedRun::from_json(&file).expect("a saved run")
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn said(output: &Output) -> String {
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    text(&output.stdout) + &text(&output.stderr)
}

#[test]
fn a_real_arm_grasps_by_the_frames_of_its_camera() {
    let mut cell = or_skip!(Cell::start());
    cell.tell("ball");
    let mut grasp = or_skip!(cell.driven_by("grasp", "camera"));
    let grasp = grasp.args([
        "--controller",
        "hybrid",
        "--yes",
        "--runs",
        "2",
        "--save-runs",
    ]);
    let (first, errors) = output(grasp);
    assert!(first.status.success(), "{errors}");
    assert!(said(&first).contains("2 of 2 grasped"), "{}", said(&first));
    let run = cell.saved("out/saved/run001.json");
    let events = &run.log().events;
    // Late frames would have been measured here.
    assert!(events.iter().any(|event| event.kind == EventKind::Late(0)));
    assert_eq!(
        events.last().map(|event| &event.kind),
        Some(&EventKind::Grasped)
    );
    assert!(cell.folder.path().join("out/camera.belief").exists());
}

#[test]
fn the_papers_whole_way_is_gone_on_the_arm_itself() {
    let mut cell = or_skip!(Cell::start());
    let mut grasp = or_skip!(cell.driven_by("grasp", "camera"));
    grasp.args([
        "--teach-goal",
        "--sample",
        "27",
        "--simulator",
        "rigid8",
        "--keep-learning",
    ]);
    grasp
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut grasp = grasp.spawn().expect("grasp starts");
    let (mut person, mut screen) = (
        grasp.stdin.take().expect("a terminal"),
        grasp.stdout.take().expect("a terminal"),
    );
    let (mut text, mut byte, mut answered) = (String::new(), [0], 0);
    while screen.read(&mut byte).is_ok_and(|count| count > 0) {
        text.push(char::from(byte[0]));
        let question = &text[answered..];
        if question.ends_with("[y/N] ") {
            writeln!(person, "y").expect("grasp asks");
        } else if question.ends_with("press Enter. ") {
            let jaws = question.contains("between the open jaws");
            cell.tell(if jaws { "jaws" } else { "ball" });
            writeln!(person).expect("grasp asks");
        } else {
            continue;
        }
        answered = text.len();
    }
    let errors = said(&grasp.wait_with_output().expect("grasp ends"));
    assert!(text.contains("goal shown on the arm"), "{text}{errors}");
    assert!(text.contains("learned approaching"), "{text}{errors}");
    assert!(text.contains("run   1: "), "{text}{errors}");
    assert_eq!(text.matches("press Enter").count(), 3, "{text}");
    assert!(cell.folder.path().join("out/approaching.policy").exists());
}

#[test]
fn track_learns_a_real_camera_from_balls_at_rest() {
    let mut cell = or_skip!(Cell::start());
    cell.tell("ball");
    let mut track = or_skip!(cell.driven_by("track", "camera"));
    let (end, errors) = output(track.args(["--yes", "--teach", "1", "--runs", "1"]));
    assert!(end.status.success(), "{errors}");
    assert!(cell.folder.path().join("out/camera.belief").exists());
    let mut pushed = or_skip!(cell.driven_by("track", "camera"));
    let (end, errors) = output(pushed.args(["--ball", "push"]));
    assert!(
        !end.status.success() && errors.contains("--ball"),
        "{errors}"
    );
}

#[test]
fn a_camera_that_dies_stops_the_arm_and_keeps_the_run() {
    for (after, said) in [
        ("true", "the stream has ended"),
        ("echo garbage", "it does not begin with FRAME"),
        ("echo YUV4MPEG2 W4 H4", "a new header begins here"),
    ] {
        let cell = or_skip!(Cell::start());
        let policy = policy_file(cell.folder.path());
        // 15 frames of 384x288 pixels behind a header, then something else.
        let bytes = "YUV4MPEG2 W384 H288 F25:1 Ip A1:1 Cmono\n".len() + 15 * (6 + 384 * 288);
        let camera = format!("| head -c {bytes} camera; {after}");
        let mut grasp = or_skip!(cell.driven_by("grasp", &camera));
        let (end, errors) = output(grasp.args(["--policy", &policy, "--yes"]));
        assert_eq!(end.status.code(), Some(1), "{errors}");
        assert!(errors.contains("run 1 was broken off"), "{errors}");
        assert!(errors.contains(said), "{errors}");
        let run = cell.saved("out/failures/run001.json");
        let last = run.log().events.last().map(|event| event.kind.word());
        assert_eq!(last, Some("failed"));
        assert!(cell.folder.path().join("out/summary.json").exists());
    }
}

#[test]
fn nothing_moves_unasked_or_toward_a_ball_that_is_not_there() {
    for (arguments, said) in [
        (&["--port", "puma"][..], "--rendered"),
        (&["--camera", "-"], "--port or --tcp"),
        (&["--tcp", "127.0.0.1:1", "--rendered"], "nobody answers"),
        (
            &["--controller", "hybrid", "--sample", "40"],
            "--sample is for",
        ),
        (&["--belief", "camera.belief"], "--belief is for"),
        (
            &["--port", "puma", "--camera", "no-such-pipe"],
            "no-such-pipe",
        ),
        (
            &["--port", "puma", "--camera", "| echo RIFF"],
            "not a Y4M stream",
        ),
        (
            &["--port", "puma", "--camera", "| true"],
            "the stream is empty",
        ),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut grasp = or_skip!(example("grasp"));
        grasp.stdin(Stdio::null()).current_dir(folder.path());
        let (end, errors) = output(grasp.args(["--out", "out"]).args(arguments));
        assert_eq!(end.status.code(), Some(1), "{arguments:?}: {errors}");
        assert!(errors.contains(said), "{arguments:?}: {errors}");
    }
}

/// A camera that delivers numbered frames every 10 ms, then stalls.
struct Numbered {
    next: u8,
    last: u8,
    width: fn(u8) -> u32,
}

impl FrameSource for Numbered {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        if self.next > self.last {
            std::thread::sleep(Duration::from_secs(60));
        }
        std::thread::sleep(Duration::from_millis(10));
        *frame = GrayImage::from_pixel((self.width)(self.next), 4, [self.next].into());
        self.next += 1;
        Ok(())
    }
}

fn numbered(last: u8, width: fn(u8) -> u32) -> LiveCamera {
    let open = move || {
        Ok(Numbered {
            next: 0,
            last,
            width,
        })
    };
    let mut camera = LiveCamera::over("test", &Arc::default(), open).expect("a frame");
    camera.delay = Duration::from_millis(50);
    camera
}

#[test]
fn frames_exposed_before_the_look_are_dropped() {
    let (mut camera, mut frame) = (numbered(250, |_| 4), GrayImage::default());
    let mut seen = Vec::new();
    for _ in 0..5 {
        std::thread::sleep(Duration::from_millis(100));
        camera.grab(&mut frame).expect("a frame");
        seen.push(frame.as_raw()[0]);
    }
    // 10 frames arrive while nobody looks, and 5 within the delay.
    assert!(
        seen.windows(2).all(|pair| pair[1] >= pair[0] + 10),
        "{seen:?}"
    );
}

#[test]
fn stalls_and_changes_of_size_are_errors_that_name_the_camera() {
    let (mut camera, mut frame) = (numbered(20, |_| 4), GrayImage::default());
    camera.patience = Duration::from_millis(500);
    let end = loop {
        if let Err(error) = camera.grab(&mut frame) {
            break error.to_string();
        }
    };
    assert!(end.contains("camera test: no frame for 0.5 s"), "{end}");

    let mut camera = numbered(250, |number| 4 + u32::from(number > 20));
    let end = loop {
        if let Err(error) = camera.grab(&mut frame) {
            break error.to_string();
        }
    };
    assert!(end.contains("were 4x4 px and are now 5x4 px"), "{end}");
}

#[test]
fn a_wait_for_a_frame_ends_at_once_on_request() {
    let stop = Arc::new(AtomicBool::new(false));
    let open = || {
        Ok(Numbered {
            next: 0,
            last: 0,
            width: |_| 4,
        })
    };
    let mut camera = LiveCamera::over("test", &stop, open).expect("a frame");
    let begin = Instant::now();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(50));
            stop.store(true, Ordering::Relaxed);
        });
        let end = camera.grab(&mut GrayImage::default()).expect_err("stopped");
        assert!(end.to_string().contains("stopped on request"), "{end}");
    });
    assert!(begin.elapsed() < Duration::from_secs(2));
}

#[test]
fn a_device_by_name_is_a_camera_or_named_as_none() {
    for name in ["v4l2:/dev/null", "/dev/video99"] {
        let camera = LiveCamera::open(name, None, &Arc::default());
        let said = camera.expect_err("no camera").to_string();
        let path = name.trim_start_matches("v4l2:");
        assert!(said.starts_with(&format!("camera {path}: ")), "{said}");
        assert_eq!(
            said.contains("--features v4l2"),
            !cfg!(feature = "v4l2"),
            "{said}"
        );
    }
}

#[test]
fn a_recording_is_delivered_frame_by_frame() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("film.raw");
    let frames: Vec<u8> = (0..30).flat_map(|number| [number; 6]).collect();
    std::fs::write(&path, &frames[..frames.len() - 1]).expect("a file");
    let source = path.to_str().expect("plain text");
    let mut camera = LiveCamera::open(source, Some((3, 2)), &Arc::default()).expect("a recording");
    let mut frame = GrayImage::default();
    for number in 0..29 {
        camera.grab(&mut frame).expect("a frame");
        assert_eq!(frame.as_raw(), &[number; 6]);
    }
    let end = camera.grab(&mut frame).expect_err("it is cut").to_string();
    assert!(end.contains("ends in the middle of frame 30"), "{end}");
    let end = camera
        .grab(&mut frame)
        .expect_err("it stays so")
        .to_string();
    assert!(end.contains("frame 30"), "{end}");
}
