//! Programs that a signal stops.

use std::fs::File;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use grasp_agent::{Behaviour, BehaviourPair, SavedRun};

use crate::command_line::{example, or_skip, policy_file, wait_for_frames};

/// Passes bytes on between a program that connects to the returned address and `controller`.
/// Returns all that the program sent once it has closed the line.
fn recording_relay(controller: String) -> (String, std::thread::JoinHandle<Vec<u8>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a socket");
    let address = listener.local_addr().expect("its address").to_string();
    let relay = std::thread::spawn(move || {
        let (mut program, _) = listener.accept().expect("the program connects");
        let mut controller = TcpStream::connect(controller).expect("the controller listens");
        let mut answers = controller.try_clone().expect("a second handle");
        let mut back = program.try_clone().expect("a second handle");
        std::thread::spawn(move || std::io::copy(&mut answers, &mut back));
        let (mut heard, mut bytes) = (Vec::new(), [0; 256]);
        while let Ok(count @ 1..) = program.read(&mut bytes) {
            heard.extend(&bytes[..count]);
            controller.write_all(&bytes[..count]).expect("it takes it");
        }
        heard
    });
    (address, relay)
}

#[test]
fn ctrl_c_stops_the_arm_and_keeps_the_results() {
    use puma_val2::{Emulator, EmulatorServer, Profile, PumaParams, ServeConfig};
    let emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
    let config = ServeConfig {
        realtime: true,
        ..ServeConfig::default()
    };
    let server = EmulatorServer::tcp("127.0.0.1:0", emulator, config).expect("a free port");
    let (address, relay) = recording_relay(server.address().to_owned());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (policy, out) = (policy_file(folder.path()), folder.path().join("out"));
    let mut grasp = or_skip!(example("grasp"));
    grasp.args(["--tcp", &address, "--rendered", "--yes", "--speed", "100"]);
    grasp.args(["--policy", &policy, "--out"]);
    grasp.arg(&out).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut grasp = grasp.spawn().expect("grasp starts");
    wait_for_frames(&mut grasp, &out);
    interrupt(&grasp);
    let output = grasp.wait_with_output().expect("grasp ends");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{errors}");
    let said = "run 1 was broken off: stopped by a signal";
    assert!(errors.contains(said), "{errors}");
    let sent = relay.join().expect("the relay ends with the line");
    let stop = sent.windows(5).position(|bytes| bytes == b"PANIC");
    let stop = stop.expect("the controller was told to stop");
    assert!(!sent[stop..].windows(4).any(|bytes| bytes == b"MOVE"));
    let before = server.with_emulator(|emulator| emulator.joints());
    std::thread::sleep(Duration::from_millis(200));
    let after = server.with_emulator(|emulator| emulator.joints());
    assert_eq!(before, after, "the arm still moves");
    let file = std::fs::read_to_string(out.join("failures/run001.json")).expect("the run");
    SavedRun::from_json(&file).expect("a saved run");
    assert!(out.join("summary.json").exists() && out.join("features.csv").exists());
}

/// Sends SIGINT to a program.
fn interrupt(program: &Child) {
    send(program, "INT");
}

/// Sends a signal to a program.
fn send(program: &Child, signal: &str) {
    let mut kill = Command::new("kill");
    kill.args(["-s", signal, &program.id().to_string()]);
    assert!(kill.status().expect("kill is there").success());
}

/// A program in a folder of its own, in which it writes what it says to `said`.
struct Running {
    program: Child,
    folder: tempfile::TempDir,
}

impl Running {
    fn start(name: &str, arguments: &[&str]) -> Option<Self> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let said = File::create(folder.path().join("said")).expect("a file");
        let mut program = example(name)?;
        program.args(arguments).current_dir(folder.path());
        program.stdin(Stdio::null()).stdout(said);
        let program = program.stderr(Stdio::piped()).spawn().expect("it starts");
        Some(Self { program, folder })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn wait_until(&mut self, begun: impl Fn(&Path) -> bool) {
        while !begun(self.folder.path()) && self.program.try_wait().expect("a process").is_none() {
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Interrupts the program and returns what it writes to standard error.
    fn interrupted(&mut self) -> String {
        self.ended_by("INT")
    }

    /// Ends the program by a signal and returns what it writes to standard error.
    fn ended_by(&mut self, signal: &str) -> String {
        /// A second, and what a busy machine adds. To the end of their work they need a minute.
        const SOON: Duration = Duration::from_secs(10);
        send(&self.program, signal);
        let (begin, mut errors) = (Instant::now(), String::new());
        let mut screen = self.program.stderr.take().expect("a pipe");
        screen.read_to_string(&mut errors).expect("text");
        let code = self.program.wait().expect("it ends").code();
        let took = begin.elapsed();
        assert!(took < SOON, "it went on for {took:?}: {errors}");
        assert_eq!(code, Some(130), "{errors}");
        errors
    }
}

fn says(words: &str) -> impl Fn(&Path) -> bool {
    move |folder| {
        std::fs::read_to_string(folder.join("said")).is_ok_and(|said| said.contains(words))
    }
}

fn is_there(file: &str) -> impl Fn(&Path) -> bool {
    move |folder| folder.join(file).exists()
}

#[test]
fn learning_stopped_by_ctrl_c_keeps_what_was_learned() {
    let mut grasp = or_skip!(Running::start("grasp", &["--fine", "--runs", "1"]));
    grasp.wait_until(says("learned centering"));
    let errors = grasp.interrupted();
    assert!(
        errors.contains("of 4000000 actions of approaching"),
        "{errors}"
    );
    let (paper, mut pair) = (BehaviourPair::paper_mended(), BehaviourPair::fine());
    pair.centering.reward = paper.centering.reward;
    pair.approaching.reward = paper.approaching.reward;
    for spec in [pair.centering, pair.approaching] {
        let file = format!("out/grasp/unfinished/{}.policy", spec.name);
        Behaviour::load(&grasp.path(&file), &spec).expect("what was learned");
    }
    let summary = std::fs::read_to_string(grasp.path("out/grasp/summary.json"));
    assert!(summary.expect("the training").contains("\"trained\": true"));
    assert!(grasp.path("out/grasp/learning.svg").exists());
    assert!(!grasp.path("out/grasp/approaching.policy").exists());
}

#[test]
fn no_wait_for_a_camera_or_controller_outlives_ctrl_c() {
    let silent = TcpListener::bind("127.0.0.1:0").expect("a socket");
    let address = silent.local_addr().expect("its address").to_string();
    for more in [&["--camera", "| sleep 9"][..], &["--rendered"]] {
        let line = [&["--tcp", &address, "--yes"], more].concat();
        let mut grasp = or_skip!(Running::start("grasp", &line));
        grasp.wait_until(is_there("out/grasp/.lock"));
        std::thread::sleep(Duration::from_millis(300));
        let errors = grasp.interrupted();
        assert!(errors.contains("stopped by a signal"), "{errors}");
    }
}

#[test]
fn long_programs_end_at_ctrl_c_with_their_results() {
    // A terminal that closes sends HUP, which programs ignore if these tests run by `nohup`.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().any(|line| {
        line.starts_with("SigIgn:") && line.ends_with(['1', '3', '5', '7', '9', 'b', 'd', 'f'])
    });
    let signals = ["INT", "TERM", if ignored { "TERM" } else { "HUP" }];
    for ((name, arguments, sign, result), signal) in [
        (
            "compare_controllers",
            &["--only", "Q 540"][..],
            "out/compare/.lock",
            "out/compare",
        ),
        (
            "compare_controllers",
            &["--only", "fuzzy", "--draws", "999"],
            "out/compare/cells/none-00001.json",
            "out/compare/comparison.svg",
        ),
        ("paper_figures", &[], "out/figures/.lock", "out/figures"),
        ("ellipse_object", &[], "out/egg/.lock", "out/egg"),
        (
            "ellipse_object",
            &[],
            "out/egg/egg001.png",
            "out/egg/egg001.png",
        ),
        (
            "track",
            &["--shortcut", "--runs", "9000"],
            "out/track/.lock",
            "out/track",
        ),
        (
            "track",
            &[],
            "out/track/camera.belief",
            "out/track/track.csv",
        ),
        (
            "render_dataset",
            &["--frames", "900"],
            "out/rendered/frames.csv",
            "out/rendered/truth.csv",
        ),
        (
            "emulated_cell",
            &["--link", "puma", "--video", "film"],
            "film",
            "film",
        ),
    ]
    .into_iter()
    .zip(signals.into_iter().cycle())
    {
        let mut program = or_skip!(Running::start(name, arguments));
        program.wait_until(is_there(sign));
        std::thread::sleep(Duration::from_millis(300));
        let errors = program.ended_by(signal);
        assert!(errors.contains("stopped by a signal"), "{name}: {errors}");
        assert!(program.path(result).exists(), "{name} wrote no {result}");
    }
}

#[test]
fn a_figure_of_the_tables_until_ctrl_c_is_drawn() {
    let arguments = ["--starts", "1", "--learning-only", "--seeds", "2"];
    let mut figures = or_skip!(Running::start("paper_figures", &arguments));
    figures.wait_until(says("exact plane, mended "));
    figures.interrupted();
    assert!(figures.path("out/figures/figure6.svg").exists());
}

#[test]
fn a_second_ctrl_c_ends_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let film = folder.path().join("film");
    let pipe = Command::new("mkfifo").arg(&film).status();
    assert!(pipe.expect("mkfifo is there").success());
    // A reader that never reads holds the program up.
    let reader = File::options()
        .read(true)
        .write(true)
        .open(&film)
        .expect("a pipe");
    let film = film.to_str().expect("plain text");
    let mut cell = or_skip!(Running::start(
        "emulated_cell",
        &["--link", "puma", "--video", film]
    ));
    cell.wait_until(is_there("puma"));
    std::thread::sleep(Duration::from_millis(700));
    interrupt(&cell.program);
    std::thread::sleep(Duration::from_millis(300));
    assert!(cell.program.try_wait().expect("a process").is_none());
    cell.interrupted();
    drop(reader);
}

#[test]
fn detect_circles_stopped_by_ctrl_c_keeps_its_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = folder.path().join("picture.pgm");
    let gray = [&b"P5 2000 2000 255\n"[..], &[90; 4_000_000]].concat();
    std::fs::write(&picture, gray).expect("a file");
    let mut arguments = vec!["--overlay", ".", "--csv", "circles.csv"];
    arguments.resize(2_000, picture.to_str().expect("plain text"));
    let mut detect = or_skip!(Running::start("detect_circles", &arguments));
    detect.wait_until(is_there("picture.png"));
    detect.interrupted();
    assert!(detect.path("circles.csv").exists());
}
