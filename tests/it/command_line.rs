//! The examples as their users meet them: what bad input gets.
//!
//! `cargo test` builds the examples beside the tests; where one is not there, its test says so and
//! is skipped.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use grasp_agent::{
    Behaviour, BehaviourPair, BehaviourSpec, EventKind, GoalInterval, JointLimits, Learned,
    SavedRun,
};
use qtable::QTable;

fn example(name: &str) -> Option<Command> {
    let tests = std::env::current_exe().ok()?;
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let path: PathBuf = tests.parent()?.parent()?.join("examples").join(file);
    if !path.exists() {
        println!("skipped: the example {name} has not been built");
        return None;
    }
    Some(Command::new(path))
}

fn output(command: &mut Command) -> (Output, String) {
    let output = command.output().expect("the example starts");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!errors.contains("panicked"), "{errors}");
    (output, errors)
}

/// Runs `grasp` with arguments that must make it fail, and gives what it says.
fn grasp_fails(folder: &Path, arguments: &[&str]) -> Option<String> {
    let mut command = example("grasp")?;
    command
        .args(["--quiet", "--runs", "1", "--out"])
        .arg(folder.join("out"))
        .args(arguments);
    let (output, errors) = output(&mut command);
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.starts_with("error: "), "{errors}");
    Some(errors)
}

#[test]
fn grasp_names_a_port_that_does_not_exist() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(errors) = grasp_fails(folder.path(), &["--port", "/dev/no-such-port"]) else {
        return;
    };
    assert!(errors.contains("/dev/no-such-port"), "{errors}");
}

#[test]
fn grasp_that_cannot_begin_keeps_earlier_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let kept = folder.path().join("out/failures/run001.json");
    std::fs::create_dir_all(folder.path().join("out/failures")).expect("a folder");
    std::fs::write(&kept, "a run").expect("a file");
    for wrong in [
        ["--policy", "no-such-policy"],
        ["--port", "/dev/no-such-port"],
    ] {
        if grasp_fails(folder.path(), &wrong).is_none() {
            return;
        }
        assert!(kept.exists(), "{wrong:?}");
    }
}

#[test]
fn grasp_names_a_socket_that_is_silent_or_talks_nonsense() {
    for nonsense in [&b""[..], b"\x00\xff220 mail ready\r\n"] {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a socket");
        let address = listener.local_addr().expect("its address").to_string();
        let server = std::thread::spawn(move || {
            let Ok((mut stream, _)) = listener.accept() else {
                return;
            };
            let mut heard = [0; 256];
            while stream.read(&mut heard).is_ok_and(|count| count > 0) {
                if stream.write_all(nonsense).is_err() {
                    break;
                }
            }
        });
        let folder = tempfile::tempdir().expect("a temporary folder");
        let Some(errors) = grasp_fails(folder.path(), &["--tcp", &address]) else {
            return;
        };
        assert!(
            errors.contains(&address) && errors.contains("expected"),
            "{errors}"
        );
        server.join().expect("the server ends with the connection");
    }
}

#[test]
fn grasp_refuses_an_output_folder_that_is_a_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("out"), b"in the way").expect("a file");
    let Some(errors) = grasp_fails(folder.path(), &[]) else {
        return;
    };
    assert!(errors.contains("cannot be written"), "{errors}");
}

#[test]
fn grasp_refuses_missing_and_corrupt_policies() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let policies = folder.path().join("policies");
    std::fs::create_dir(&policies).expect("a folder");
    let argument = policies.to_str().expect("a plain path").to_owned();
    let Some(errors) = grasp_fails(folder.path(), &["--policy", &argument]) else {
        return;
    };
    assert!(errors.contains("centering.policy"), "{errors}");
    for name in ["centering.policy", "approaching.policy"] {
        std::fs::write(policies.join(name), b"this is no policy at all").expect("a file");
    }
    let Some(errors) = grasp_fails(folder.path(), &["--policy", &argument]) else {
        return;
    };
    assert!(errors.contains("centering.policy"), "{errors}");
}

/// A policy that has learned nothing, as `--export` writes it.
fn blank_policy(pair: BehaviourPair) -> String {
    let blank = |spec: BehaviourSpec| {
        let table = QTable::new(spec.states(), spec.actions()).expect("a table");
        Behaviour::new(spec, table).expect("a table of its size")
    };
    Learned::new(blank(pair.centering), blank(pair.approaching)).to_json(&JointLimits::paper())
}

#[test]
fn grasp_refuses_policies_it_cannot_run_and_says_why() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("policy.json");
    let argument = path.to_str().expect("a plain path").to_owned();
    let paper = blank_policy(BehaviourPair::paper_mended());
    let wide = BehaviourPair::paper_mended()
        .with_y_goal(GoalInterval::Y_SECTION_4)
        .expect("it fits");
    let cases = [
        ("this is no policy".to_owned(), "expected"),
        (paper[..paper.len() / 2].to_owned(), "line"),
        (paper.replace("\"J3\"", "\"J2\""), "JT2 is moved twice"),
        (blank_policy(wide), "--y-goal"),
    ];
    for (text, said) in cases {
        std::fs::write(&path, text).expect("a file");
        let Some(errors) = grasp_fails(folder.path(), &["--policy", &argument]) else {
            return;
        };
        assert!(
            errors.contains(&argument) && errors.contains(said),
            "{errors} does not say {said}"
        );
    }

    // Saved for other states than those that are asked for.
    let fine = BehaviourPair::fine();
    for spec in [fine.centering, BehaviourSpec::approaching_fine()] {
        let table = QTable::new(spec.states(), spec.actions()).expect("a table");
        let name = spec.name.trim_end_matches("_fine");
        let path = folder.path().join(format!("{name}.policy"));
        let behaviour = Behaviour::new(spec, table).expect("a table of its size");
        behaviour.save(&path).expect("a file");
    }
    let argument = folder.path().to_str().expect("a plain path").to_owned();
    let Some(errors) = grasp_fails(folder.path(), &["--policy", &argument]) else {
        return;
    };
    assert!(
        errors.contains("approaching.policy") && errors.contains("differs"),
        "{errors}"
    );
}

#[test]
fn options_that_would_have_no_effect_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("policy.json");
    std::fs::write(&path, blank_policy(BehaviourPair::paper_mended())).expect("a file");
    let argument = path.to_str().expect("a plain path").to_owned();
    for more in [&["--fine"][..], &["--reward", "mended"]] {
        let Some(errors) = grasp_fails(folder.path(), &[&["--policy", &argument], more].concat())
        else {
            return;
        };
        assert!(errors.contains("--fine and --reward"), "{errors}");
    }
    for (program, options) in [
        (
            "grasp",
            &["--policy", &argument, "--simulator", "linear"][..],
        ),
        ("track", &["--shortcut", "--noise", "3"]),
        ("track", &["--shortcut", "--detector", "rht"]),
        ("track", &["--shortcut", "--belief", &argument]),
        ("compare_controllers", &["--detector", "rht"]),
    ] {
        let Some(mut program) = example(program) else {
            return;
        };
        let out = folder.path().join("out");
        let output = program.arg("--out").arg(&out).args(options).output();
        let output = output.expect("the program runs");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.code() == Some(2) && errors.contains("--"),
            "{options:?}: {errors}"
        );
    }
}

#[cfg(all(unix, feature = "serial"))]
#[test]
fn grasp_keeps_what_it_has_when_the_controller_dies() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (link, out) = (folder.path().join("puma"), folder.path().join("out"));
    let policy = folder.path().join("policy.json");
    std::fs::write(&policy, blank_policy(BehaviourPair::paper_mended())).expect("a file");
    let (Some(mut emulator), Some(mut grasp)) = (example("val2_emulator"), example("grasp")) else {
        return;
    };
    let emulator = emulator.arg("--link").arg(&link).stdin(Stdio::null());
    let mut emulator = emulator
        .stdout(Stdio::null())
        .spawn()
        .expect("the emulator starts");
    while !link.exists() {
        std::thread::sleep(Duration::from_millis(20));
    }
    grasp
        .args(["--quiet", "--keep-learning", "--port"])
        .arg(&link);
    grasp
        .arg("--policy")
        .arg(&policy)
        .arg("--export")
        .arg(folder.path().join("learned.json"));
    let mut grasp = grasp
        .arg("--out")
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("grasp starts");
    // Killed when the arm has looked around for a while.
    let frames = || std::fs::read_dir(out.join("frames")).map_or(0, Iterator::count);
    while frames() < 4 && grasp.try_wait().expect("a process").is_none() {
        std::thread::sleep(Duration::from_millis(20));
    }
    emulator
        .kill()
        .and_then(|()| emulator.wait())
        .expect("the emulator ends");
    let output = grasp.wait_with_output().expect("grasp ends");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(
        errors.contains("run 1 was broken off: the arm failed"),
        "{errors}"
    );
    let file = out.join("failures/run001.json");
    let text = std::fs::read_to_string(&file).expect("the run");
    let saved = SavedRun::from_json(&text).expect("a saved run");
    let last = &saved.log().events.last().expect("an event").kind;
    assert!(
        matches!(last, EventKind::Failed(cause) if errors.contains(cause.as_str())),
        "{last:?}"
    );
    for (name, spec) in [
        ("centering.policy", BehaviourSpec::centering()),
        ("approaching.policy", BehaviourSpec::approaching()),
    ] {
        Behaviour::load(&out.join(name), &spec).expect("what was learned");
    }
    let learned = std::fs::read_to_string(folder.path().join("learned.json")).expect("the export");
    Learned::from_json(&learned).expect("a policy");
    assert!(out.join("summary.json").exists());
    replays(&file, &text);
}

/// Another program makes a run of which the arm failed again from the file alone, and sees whether
/// something is changed in it.
fn replays(file: &Path, text: &str) {
    let replayed = |file: &Path, options: &[&str]| {
        let (again, errors) = output(example("replay")?.args(options).arg(file));
        Some((
            again.status.code(),
            String::from_utf8_lossy(&again.stdout).into_owned(),
            errors,
        ))
    };
    let Some((code, said, errors)) = replayed(file, &[]) else {
        return;
    };
    assert_eq!(code, Some(0), "{said}{errors}");
    assert!(
        said.contains("the same") && said.contains("the arm failed"),
        "{said}"
    );

    let other = file.with_file_name("other.json");
    std::fs::write(
        &other,
        text.replacen("\"AtSearchPose\":", "\"Recovering\":", 1),
    )
    .expect("a file");
    let (code, said, errors) = replayed(&other, &["--events"]).expect("it was there");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("another course from event 2 on"), "{said}");
    assert!(errors.starts_with("error: 1 of 1 runs"), "{errors}");

    std::fs::write(&other, &text[..text.len() / 2]).expect("a file");
    let whole = file.to_str().expect("plain text");
    let (again, errors) = output(
        example("replay")
            .expect("it was there")
            .arg(&other)
            .arg(whole),
    );
    assert_eq!(again.status.code(), Some(1), "{errors}");
    let said = String::from_utf8_lossy(&again.stdout);
    assert!(said.contains(whole) && said.contains("the same"), "{said}");
    assert!(errors.contains("error: 1 of 2 runs"), "{errors}");
    assert!(
        errors.contains("other.json") && errors.contains("no saved run"),
        "{errors}"
    );
}

#[test]
fn detect_circles_names_what_it_cannot_read_and_goes_on() {
    let Some(mut command) = example("detect_circles") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let images = folder.path().join("images");
    std::fs::create_dir(&images).expect("a folder");
    std::fs::write(images.join("a_broken.png"), b"\x89PNG\r\n\x1a\nnothing").expect("a file");
    std::fs::write(images.join("b_empty.pgm"), b"P5\n0 0\n255\n").expect("a file");
    let bright = |x: u32, y: u32| (f64::from(x) - 90.0).hypot(f64::from(y) - 80.0) < 40.0;
    image::GrayImage::from_fn(200, 160, |x, y| {
        image::Luma([if bright(x, y) { 220 } else { 40 }])
    })
    .save(images.join("c_ball.png"))
    .expect("a file");
    let csv = folder.path().join("circles.csv");
    let missing = folder.path().join("missing.png");
    let (output, errors) = output(command.arg("--csv").arg(&csv).arg(&missing).arg(&images));
    assert_eq!(output.status.code(), Some(1), "{errors}");
    for name in ["missing.png", "a_broken.png", "b_empty.pgm"] {
        assert!(errors.contains(name), "{name} is not named in: {errors}");
    }
    let rows = std::fs::read_to_string(csv).expect("the CSV is written all the same");
    let mut rows = rows.lines();
    assert_eq!(rows.next(), Some("file,cx,cy,r,score"));
    let ball: Vec<&str> = rows.next().expect("the ball is found").split(',').collect();
    assert!(ball[0].ends_with("c_ball.png"));
    let near =
        |field: &str, value: f64| (field.parse::<f64>().expect("a number") - value).abs() < 1.0;
    assert!(
        near(ball[1], 90.0) && near(ball[2], 80.0) && near(ball[3], 40.0),
        "{ball:?}"
    );
}

#[test]
fn detect_circles_shows_the_stages_of_every_detector() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let ball = folder.path().join("ball.png");
    let bright = |x: u32, y: u32| (f64::from(x) - 90.0).hypot(f64::from(y) - 80.0) < 40.0;
    image::GrayImage::from_fn(200, 160, |x, y| {
        image::Luma([if bright(x, y) { 220 } else { 40 }])
    })
    .save(&ball)
    .expect("a file");
    for detector in [
        "heuristic",
        "heuristic-anywhere",
        "rht",
        "rht-anywhere",
        "sht",
        "sht-gradient",
    ] {
        let Some(mut command) = example("detect_circles") else {
            return;
        };
        let (stages, times) = (
            folder.path().join(detector),
            folder.path().join("times.csv"),
        );
        command
            .args(["--detector", detector])
            .arg("--stages")
            .arg(&stages);
        // The same image twice: the second gets a folder of its own.
        let (output, errors) = output(command.arg("--times").arg(&times).args([&ball, &ball]));
        assert!(output.status.success(), "{detector}: {errors}");
        for name in ["ball", "ball-2"] {
            let pictures = std::fs::read_dir(stages.join(name)).expect("a folder for the image");
            assert_eq!(pictures.count(), 4, "{detector}");
        }
        let times = std::fs::read_to_string(times).expect("the times are written");
        assert!(
            times.starts_with("file,cpu_us,edges_us,structure_us,search_us\n"),
            "{times}"
        );
        for row in times.lines().skip(1) {
            let fields: Vec<&str> = row.rsplit(',').collect();
            let micros = fields[..4].iter().map(|field| field.parse::<f64>());
            assert!(
                micros.clone().all(|time| time.is_ok_and(|time| time > 0.0)),
                "{detector}: {row}"
            );
        }
    }
}

#[test]
fn detect_circles_names_a_frame_that_is_too_large_and_goes_on() {
    let Some(mut command) = example("detect_circles") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (large, small) = (
        folder.path().join("large.pgm"),
        folder.path().join("small.pgm"),
    );
    for (path, width, height) in [(&large, 3840, 2160), (&small, 160, 120)] {
        image::GrayImage::new(width, height)
            .save(path)
            .expect("a file");
    }
    let (output, errors) = output(
        command
            .args(["--detector", "sht", "--csv", "-"])
            .args([&large, &small]),
    );
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(
        errors.contains("large.pgm") && errors.contains("max_memory"),
        "{errors}"
    );
    assert!(!errors.contains("small.pgm"), "{errors}");
}

#[test]
fn the_emulator_names_what_it_cannot_serve_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let taken = TcpListener::bind("127.0.0.1:0").expect("a socket");
    let address = taken.local_addr().expect("its address").to_string();
    let mut cases = vec![
        (["--tcp", address.as_str()], address.as_str()),
        (["--tcp", "nonsense"], "nonsense"),
        (["--profile", "nobody"], "val2_strict_miz"),
    ];
    let link = folder.path().join("none/arm").display().to_string();
    if cfg!(unix) {
        cases.push((["--link", link.as_str()], link.as_str()));
    }
    for (arguments, named) in cases {
        let Some(mut command) = example("val2_emulator") else {
            return;
        };
        let (output, errors) = output(command.args(arguments));
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {errors}");
        assert!(
            errors.starts_with("error: ") && errors.contains(named),
            "{arguments:?}: {errors}"
        );
    }
}

#[test]
fn pictures_are_written_for_a_reader_who_has_left() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(mut command) = example("cell_pictures") else {
        return;
    };
    let mut running = command
        .args(["--frames", "4", "--out"])
        .arg(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the example starts");
    drop(running.stdout.take());
    let output = running.wait_with_output().expect("the example ends");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.is_empty(), "{errors}");
    for name in [
        "overview.svg",
        "search.png",
        "goal.png",
        "run.png",
        "run.y4m",
    ] {
        assert!(folder.path().join(name).exists(), "{name}");
    }
}

#[test]
fn track_keeps_earlier_results_when_the_belief_is_missing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let earlier = folder.path().join("track.csv");
    std::fs::write(&earlier, "an earlier run").expect("a file");
    let Some(mut track) = example("track") else {
        return;
    };
    track.args(["--belief", "no-such-belief", "--out"]);
    let (output, errors) = output(track.arg(folder.path()));
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains("no-such-belief"), "{errors}");
    let left = std::fs::read_to_string(&earlier).expect("still there");
    assert_eq!(left, "an earlier run");
}

#[test]
fn kept_runs_of_every_controller_replay_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let names = [
        "position-based, gain 1",
        "goal J, gain 0.5",
        "current J, gain 1",
        "fuzzy, gain 0.7",
        "look-ahead",
        "hybrid, untaught",
    ];
    for only in names {
        let Some(mut compare) = example("compare_controllers") else {
            return;
        };
        compare
            .args(["--draws", "1", "--starts", "1", "--levels", "extreme"])
            .args(["--grip", "--logs", "--only", only, "--out"]);
        let (output, errors) = output(compare.arg(folder.path()));
        assert!(output.status.success(), "{errors}");
    }
    // None of them grasps with such a camera.
    let failures = std::fs::read_dir(folder.path().join("failures")).expect("they failed");
    let files: Vec<PathBuf> = failures.map(|file| file.expect("a file").path()).collect();
    assert_eq!(files.len(), names.len());
    let (again, errors) = output(example("replay").expect("built too").args(&files));
    assert!(again.status.success(), "{errors}");
}

#[test]
fn render_dataset_refuses_shares_sizes_and_kinds_without_sense() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for [option, value, said] in [
        ["--visible", "1.01", "1.01"],
        ["--visible", "nan", "nan"],
        ["--size", "768x", "768x"],
        ["--size", "100x8193", "100x8193"],
        ["--kinds", "cell,plain", "plain"],
        ["--kinds", "round", "camouflage"],
    ] {
        let Some(mut render) = example("render_dataset") else {
            return;
        };
        let out = folder.path().join("out");
        let (output, errors) = output(render.args([option, value, "--out"]).arg(&out));
        assert_eq!(output.status.code(), Some(2), "{value}: {errors}");
        assert!(errors.contains(said) && !out.exists(), "{value}: {errors}");
    }
}
