//! Answers of the example programs to bad input.
//!
//! `cargo test` builds the examples beside the tests. A test whose example is missing prints a note
//! and is skipped.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use grasp_agent::{
    AgentConfig, Behaviour, BehaviourPair, BehaviourSpec, CameraModel, EventKind, GoalInterval,
    Learned, SavedRun,
};
use pipeline_sim::Workspace;
use qtable::QTable;

/// Ends the test, as skipped, where an example has not been built.
macro_rules! or_skip {
    ($built:expr) => {
        match $built {
            Some(built) => built,
            None => return,
        }
    };
}
pub(crate) use or_skip;

pub(crate) fn example(name: &str) -> Option<Command> {
    let tests = std::env::current_exe().ok()?;
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let path: PathBuf = tests.parent()?.parent()?.join("examples").join(file);
    if !path.exists() {
        println!("skipped: the example {name} has not been built");
        return None;
    }
    Some(Command::new(path))
}

pub(crate) fn output(command: &mut Command) -> (Output, String) {
    let output = command.output().expect("the example starts");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!errors.contains("panicked"), "{errors}");
    (output, errors)
}

/// Runs `grasp` with arguments that must make it fail. Returns its error output.
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
fn grasp_that_cannot_begin_keeps_earlier_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let kept = folder.path().join("out/failures/run001.json");
    std::fs::create_dir_all(folder.path().join("out/failures")).expect("a folder");
    std::fs::write(&kept, "a run").expect("a file");
    for [option, wrong] in [
        ["--policy", "no-such-policy"],
        ["--port", "/dev/no-such-port"],
    ] {
        let line: &[&str] = if option == "--port" {
            &["--rendered", "--yes"]
        } else {
            &[]
        };
        let arguments = [&[option, wrong], line].concat();
        let errors = or_skip!(grasp_fails(folder.path(), &arguments));
        assert!(errors.contains(wrong) && kept.exists(), "{errors}");
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
        let arguments = ["--tcp", &address, "--rendered", "--yes"];
        let errors = or_skip!(grasp_fails(folder.path(), &arguments));
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
    let errors = or_skip!(grasp_fails(folder.path(), &[]));
    assert!(errors.contains("cannot be written"), "{errors}");
}

#[test]
fn grasp_refuses_missing_and_corrupt_policies() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let policies = folder.path().join("policies");
    std::fs::create_dir(&policies).expect("a folder");
    let argument = policies.to_str().expect("a plain path").to_owned();
    let errors = or_skip!(grasp_fails(folder.path(), &["--policy", &argument]));
    assert!(errors.contains("centering.policy"), "{errors}");
    for name in ["centering.policy", "approaching.policy"] {
        std::fs::write(policies.join(name), b"this is no policy at all").expect("a file");
    }
    let errors = or_skip!(grasp_fails(folder.path(), &["--policy", &argument]));
    assert!(errors.contains("centering.policy"), "{errors}");
}

/// A policy that has learned nothing, as `--export` writes it.
fn blank_policy(pair: BehaviourPair) -> String {
    let blank = |spec: BehaviourSpec| {
        let table = QTable::new(spec.states(), spec.actions()).expect("a table");
        Behaviour::new(spec, table).expect("a table of its size")
    };
    let config = AgentConfig::paper(Workspace::paper().search_poses());
    let learned = Learned::new(blank(pair.centering), blank(pair.approaching));
    learned.to_json(&config, &CameraModel::paper(), "a test")
}

/// Writes a policy that has learned nothing. Returns its path.
pub(crate) fn policy_file(folder: &Path) -> String {
    let path = folder.join("policy.json");
    std::fs::write(&path, blank_policy(BehaviourPair::paper_mended())).expect("a file");
    path.to_str().expect("a plain path").to_owned()
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
        let errors = or_skip!(grasp_fails(folder.path(), &["--policy", &argument]));
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
    let errors = or_skip!(grasp_fails(folder.path(), &["--policy", &argument]));
    assert!(
        errors.contains("approaching.policy") && errors.contains("differs"),
        "{errors}"
    );
}

#[test]
fn options_that_would_have_no_effect_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = policy_file(folder.path());
    for more in ["--fine", "--reward=mended"] {
        let errors = or_skip!(grasp_fails(folder.path(), &["--policy", &file, more]));
        assert!(errors.contains("--fine and --reward"), "{errors}");
    }
    for (program, options) in [
        ("grasp", ["--policy", &file, "--simulator=linear"]),
        ("track", ["--shortcut", "--noise", "3"]),
        ("track", ["--shortcut", "--detector", "rht"]),
        ("track", ["--shortcut", "--belief", &file]),
        ("compare_controllers", ["--grip", "--detector", "rht"]),
    ] {
        let mut program = or_skip!(example(program));
        let (output, errors) = output(program.args(options).current_dir(folder.path()));
        assert_eq!(output.status.code(), Some(2), "{options:?}: {errors}");
        assert!(errors.contains("--"), "{errors}");
    }
}

/// Waits until the arm has looked around for a while.
pub(crate) fn wait_for_frames(grasp: &mut Child, out: &Path) {
    let frames = || std::fs::read_dir(out.join("frames")).map_or(0, Iterator::count);
    while frames() < 4 && grasp.try_wait().expect("a process").is_none() {
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[cfg(all(unix, feature = "serial"))]
#[test]
fn grasp_keeps_what_it_has_when_the_controller_dies() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (link, out) = (folder.path().join("puma"), folder.path().join("out"));
    let mut emulator = or_skip!(example("val2_emulator"));
    let mut grasp = or_skip!(example("grasp"));
    emulator.arg("--link").arg(&link);
    emulator.stdin(Stdio::null()).stdout(Stdio::null());
    let mut emulator = emulator.spawn().expect("the emulator starts");
    while !link.exists() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let policy = policy_file(folder.path());
    grasp
        .current_dir(folder.path())
        .args(["--quiet", "--keep-learning"]);
    grasp.args([
        "--port",
        "puma",
        "--rendered",
        "--yes",
        "--speed",
        "100",
        "--policy",
        &policy,
        "--export",
        "learned.json",
        "--out",
        "out",
    ]);
    grasp.stdout(Stdio::null()).stderr(Stdio::piped());
    let mut grasp = grasp.spawn().expect("grasp starts");
    wait_for_frames(&mut grasp, &out);
    let killed = emulator.kill().and_then(|()| emulator.wait());
    killed.expect("the emulator ends");
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

/// Replays a run in which the arm failed from its file alone, then a changed and a broken copy.
fn replays(file: &Path, text: &str) {
    let replayed = |files: &[&Path]| {
        let (again, errors) = output(example("replay")?.args(files));
        let said = String::from_utf8_lossy(&again.stdout).into_owned();
        Some((again.status.code(), said, errors))
    };
    let (code, said, errors) = or_skip!(replayed(&[file]));
    assert_eq!(code, Some(0), "{said}{errors}");
    assert!(
        said.contains("the same") && said.contains("the arm failed"),
        "{said}"
    );

    let other = file.with_file_name("other.json");
    let changed = text.replacen("\"AtSearchPose\":", "\"Recovering\":", 1);
    std::fs::write(&other, changed).expect("a file");
    let (code, said, errors) = or_skip!(replayed(&[&other, Path::new("--events")]));
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("another course from event 2 on"), "{said}");
    assert!(errors.starts_with("error: 1 of 1 runs"), "{errors}");

    std::fs::write(&other, &text[..text.len() / 2]).expect("a file");
    let whole = file.to_str().expect("plain text");
    let (code, said, errors) = or_skip!(replayed(&[&other, file]));
    assert_eq!(code, Some(1), "{errors}");
    assert!(said.contains(whole) && said.contains("the same"), "{said}");
    assert!(errors.contains("error: 0 of 2 runs"), "{errors}");
    assert!(
        errors.contains("other.json") && errors.contains("no saved run"),
        "{errors}"
    );
}

#[test]
fn pictures_are_written_for_a_reader_who_has_left() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = or_skip!(example("cell_pictures"));
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
    let mut track = or_skip!(example("track"));
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
        "gain-scheduled, gain 0.7",
        "look-ahead",
        "hybrid, untaught",
    ];
    for only in names {
        let mut compare = or_skip!(example("compare_controllers"));
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
        let mut render = or_skip!(example("render_dataset"));
        let out = folder.path().join("out");
        let (output, errors) = output(render.args([option, value, "--out"]).arg(&out));
        assert_eq!(output.status.code(), Some(2), "{value}: {errors}");
        assert!(errors.contains(said) && !out.exists(), "{value}: {errors}");
    }
}
