//! Programs that a signal stops.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use grasp_agent::SavedRun;

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
    let mut kill = Command::new("kill");
    kill.args(["-INT", &program.id().to_string()]);
    assert!(kill.status().expect("kill is there").success());
}

#[test]
fn a_second_ctrl_c_ends_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut grasp = or_skip!(example("grasp"));
    // Learning goes on after the first one.
    grasp
        .args(["--fine", "--runs", "1", "--out"])
        .arg(folder.path().join("out"));
    grasp.stdout(Stdio::piped()).stderr(Stdio::null());
    let mut grasp = grasp.spawn().expect("grasp starts");
    let mut said = BufReader::new(grasp.stdout.take().expect("its output")).lines();
    said.find(|line| {
        line.as_ref()
            .is_ok_and(|line| line.contains("learned centering"))
    });
    interrupt(&grasp);
    std::thread::sleep(Duration::from_millis(200));
    assert!(
        grasp.try_wait().expect("a process").is_none(),
        "the first one has ended it"
    );
    interrupt(&grasp);
    let begin = std::time::Instant::now();
    assert_eq!(grasp.wait().expect("grasp ends").code(), Some(130));
    assert!(begin.elapsed() < Duration::from_secs(1));
}

#[test]
fn detect_circles_stopped_by_ctrl_c_keeps_its_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = folder.path().join("picture.pgm");
    std::fs::write(
        &picture,
        [&b"P5 2000 2000 255\n"[..], &[90; 4_000_000]].concat(),
    )
    .expect("a file");
    let csv = folder.path().join("circles.csv");
    let mut detect = or_skip!(example("detect_circles"));
    detect
        .arg("--overlay")
        .arg(folder.path())
        .arg("--csv")
        .arg(&csv);
    let mut detect = detect
        .args(vec![&picture; 2000])
        .spawn()
        .expect("it starts");
    while !folder.path().join("picture.png").exists()
        && detect.try_wait().expect("a process").is_none()
    {
        std::thread::sleep(Duration::from_millis(20));
    }
    interrupt(&detect);
    assert_eq!(detect.wait().expect("it ends").code(), Some(130));
    assert!(csv.exists());
}
