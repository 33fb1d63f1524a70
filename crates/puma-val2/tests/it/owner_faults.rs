//! The program `val2` called in every way, killed in mid call, and at wrong ends of the line.

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::owner::{Bench, keyboard};
use crate::program::{emulate, listening};

const GO: &str = ".PROGRAM GO\n MOVE #FAR\n.END\n";

/// One call of each subcommand that ends by itself, in an order in which all succeed.
const CALLS: [&[&str]; 23] = [
    &["calibrate"],
    &["where"],
    &["speed", "20"],
    &["jog", "1", "5"],
    &["move", "ready"],
    &["hand", "open"],
    &["teach", "#FAR"],
    &["put", "go.v2"],
    &["ls"],
    &["get", "GO"],
    &["backup", "all.v2"],
    &["restore", "all.v2", "--dry-run"],
    &["restore", "all.v2"],
    &["run", "GO", "--wait"],
    &["run", "GO"],
    &["stop"],
    &["status"],
    &["io"],
    &["signal", "3", "on"],
    &["send", "LISTL"],
    &["rm", "GO"],
    &["term"],
    &["help"],
];

#[test]
fn every_subcommand_works_as_text_and_as_json() {
    let bench = Bench::new(&[]);
    bench.write("go.v2", GO);
    for json in [false, true] {
        for words in CALLS {
            let mut call = vec!["--yes"];
            call.extend(["--json"].iter().filter(|_| json));
            call.extend(words);
            let said = bench.says(&call);
            assert!(
                !said.is_empty() || words == ["run", "GO", "--wait"],
                "{call:?}"
            );
            if json && !matches!(words[0], "term" | "help") {
                for line in said.lines() {
                    let value: serde_json::Value = serde_json::from_str(line).unwrap();
                    assert!(value.is_object(), "{call:?}: {line}");
                }
            }
        }
    }
    // The emulator is what all of them have talked to.
    let called: BTreeSet<_> = CALLS
        .iter()
        .map(|call| call[0])
        .chain(["emulate"])
        .collect();
    let help = bench.says(&["help"]);
    let (_, help) = help.split_once("Commands:\n").unwrap();
    let listed = help.lines().take_while(|line| !line.is_empty());
    let named = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    let listed = listed
        .filter(named)
        .filter_map(|line| line.split_whitespace().next());
    assert_eq!(called, listed.collect());
}

/// Waits until the arm has left `from`, for some seconds at most.
fn wait_for_motion(bench: &mut Bench, from: &[f64], words: &[&str]) {
    let begun = Instant::now();
    while bench.arm() == from {
        assert!(
            begun.elapsed() < Duration::from_secs(10),
            "{words:?} moves nothing"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The arm stands, and `where` says where.
fn assert_stands(bench: &mut Bench, context: &str) {
    let stands = bench.arm();
    let shown = bench.joints();
    for (a, b) in bench.arm().iter().zip(&stands) {
        assert!((a - b).abs() < 1e-3, "{context}: the arm moves");
    }
    for (a, b) in shown.iter().zip(&stands) {
        assert!((a - b).abs() < 2e-3, "{context}: {shown:?} and {stands:?}");
    }
}

/// Ends a call by a signal, and checks what it says and that the arm can be had again.
fn kill(bench: &mut Bench, mut child: Child, signal: Signal, words: &[&str]) {
    let context = format!("{words:?} ended by {signal:?}");
    kill_process(Pid::from_child(&child), signal).unwrap();
    let mut errors = String::new();
    let status = child.wait().unwrap();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut errors)
        .unwrap();
    if signal != Signal::KILL {
        assert_eq!(status.code(), Some(130), "{context}: {errors}");
        assert_eq!(errors.lines().count(), 1, "{context}: {errors}");
        assert!(
            errors.contains("the arm has been stopped"),
            "{context}: {errors}"
        );
    } else {
        assert_eq!(bench.says(&["stop"]), "stopped\n", "{context}");
    }
    assert_stands(bench, &context);
}

#[test]
fn every_motion_killed_on_its_way_leaves_an_arm_that_stands() {
    let mut bench = Bench::new(&["--realtime"]);
    bench.write("go.v2", GO);
    bench.write("back.v2", ".PROGRAM BACK\n MOVE #NEAR\n.END\n");
    bench.write(
        "points.v2",
        ".LOCATIONS\n#FAR 90,-90,90,0,0,0\n#NEAR -90,-90,90,0,0,0\n.END\n",
    );
    bench.says(&["--yes", "calibrate"]);
    for file in ["go.v2", "back.v2", "points.v2"] {
        bench.says(&["put", file]);
    }
    let calls: [[&[&str]; 2]; 6] = [
        [
            &["jog", "1", "60", "--speed", "40"],
            &["jog", "1", "-60", "--speed", "40"],
        ],
        [
            &["move", "90", "-90", "90", "0", "0", "0", "--speed", "40"],
            &["move", "#NEAR", "--speed", "40"],
        ],
        [
            &[
                "move", "300", "600", "300", "90", "60", "0", "--hand", "--speed", "40",
            ],
            &["move", "ready", "--speed", "20"],
        ],
        [
            &["run", "GO", "--wait", "--speed", "40"],
            &["run", "BACK", "--wait", "--speed", "40"],
        ],
        [
            &["send", "DO DRIVE 1,60,40"],
            &["send", "DO DRIVE 1,-60,40"],
        ],
        [&["calibrate"], &["calibrate"]],
    ];
    for pair in calls {
        for (words, signal) in pair.iter().zip([Signal::INT, Signal::KILL]) {
            let from = bench.arm();
            let mut call = bench.command(&["--yes"]);
            let child = call
                .args(*words)
                .stdout(Stdio::null())
                .stderr(Stdio::piped());
            let child = child.spawn().unwrap();
            wait_for_motion(&mut bench, &from, words);
            kill(&mut bench, child, signal, words);
        }
        bench.says(&["--yes", "calibrate"]);
    }
    // A held key, in small steps that are slow. A terminal that is closed sends HUP, unless these
    // tests run by `nohup`.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().any(|line| {
        line.starts_with("SigIgn:") && line.ends_with(['1', '3', '5', '7', '9', 'b', 'd', 'f'])
    });
    let hangup = if ignored { Signal::TERM } else { Signal::HUP };
    for signal in [Signal::INT, Signal::TERM, hangup, Signal::KILL] {
        let (mut keys, terminal) = keyboard();
        let from = bench.arm();
        let mut call = bench.command(&["--yes", "jog", "--speed", "2"]);
        let call = call
            .stdin(terminal)
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let child = call.spawn().unwrap();
        std::thread::sleep(Duration::from_millis(600));
        for key in [b"]", b"]", b"+"] {
            keys.write_all(key).unwrap();
            std::thread::sleep(Duration::from_millis(50));
        }
        wait_for_motion(&mut bench, &from, &["jog"]);
        kill(&mut bench, child, signal, &["jog"]);
    }
    // The hand does not move the joints. Its call ends in any case, and the controller is free.
    for signal in [Signal::INT, Signal::KILL] {
        let mut call = bench.command(&["--yes", "hand", "close"]);
        let mut child = call
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(350));
        kill_process(Pid::from_child(&child), signal).unwrap();
        child.wait().unwrap();
        assert_stands(&mut bench, "hand");
    }
    // A program in the background has no process that could be killed.
    let from = bench.arm();
    let away = if from[0] > 0.0 { "BACK" } else { "GO" };
    bench.says(&["--yes", "run", away, "--speed", "20"]);
    wait_for_motion(&mut bench, &from, &["run"]);
    assert_eq!(bench.says(&["stop"]), "stopped\n");
    assert_stands(&mut bench, "run in the background");
    bench.says(&["--yes", "jog", "2", "-1"]);
}

#[test]
fn texts_killed_half_way_leave_whole_programs_and_files() {
    let bench = Bench::new(&[]);
    let version = |n: usize| {
        let steps: String = (0..6)
            .map(|step| format!(" TYPE \"{n} {step}\"\n"))
            .collect();
        format!(".PROGRAM GO\n{steps}.END\n")
    };
    bench.write("0.v2", &version(0));
    bench.write("1.v2", &version(1));
    bench.says(&["put", "0.v2"]);
    let mut now = 0;
    for (turn, after) in [500, 700, 900, 1100, 1300, 1500].into_iter().enumerate() {
        let signal = [Signal::INT, Signal::KILL][turn % 2];
        let context = format!("{signal:?} after {after} ms");
        let file = format!("{}.v2", 1 - now);
        let word = ["put", "restore"][turn / 2 % 2];
        let mut call = bench.command(&["--yes", word, &file]);
        let mut child = call
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(after));
        kill_process(Pid::from_child(&child), signal).unwrap();
        child.wait().unwrap();
        let names = bench.says(&["--json", "ls"]);
        let value: serde_json::Value = serde_json::from_str(&names).unwrap();
        let programs = value["programs"].as_array().unwrap();
        let held = ["GO", "PGOLD"]
            .into_iter()
            .find(|name| programs.iter().any(|p| p == name));
        let held = bench
            .says(&["get", held.expect(&context)])
            .replace("PGOLD", "GO");
        assert!(
            held == version(0) || held == version(1),
            "{context}: {held}"
        );
        if signal == Signal::INT {
            assert_eq!(programs.len(), 1, "{context}: {names}");
        }
        // The same call again does the whole work.
        bench.says(&["--yes", word, &file]);
        assert_eq!(bench.says(&["get", "GO"]), version(1 - now), "{context}");
        let names = bench.says(&["ls"]);
        if names.contains("PGOLD") {
            bench.says(&["--yes", "rm", "PGOLD"]);
        }
        assert!(!names.contains("PGN"), "{context}: {names}");
        now = 1 - now;
    }
    bench.says(&["backup", "whole.v2"]);
    for after in [300, 450] {
        let mut child = bench
            .command(&["backup", "part.v2"])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(after));
        child.kill().unwrap();
        child.wait().unwrap();
        if bench.folder.path().join("part.v2").exists() {
            assert_eq!(bench.read("part.v2"), bench.read("whole.v2"));
        }
    }
}

/// A device at the other end of a pseudo-terminal, and the path of its port.
fn device(answer: impl Fn(&[u8]) -> Vec<u8> + Send + 'static) -> (String, std::os::fd::OwnedFd) {
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

    let (mut master, slave) = keyboard();
    let mut raw = tcgetattr(&slave).unwrap();
    raw.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &raw).unwrap();
    let path = rustix::termios::ttyname(&slave, Vec::new()).unwrap();
    std::thread::spawn(move || {
        let mut buffer = [0; 256];
        while let Ok(count) = master.read(&mut buffer) {
            if master.write_all(&answer(&buffer[..count])).is_err() {
                break;
            }
        }
    });
    (path.into_string().unwrap(), slave)
}

#[test]
fn a_controller_of_another_kind_is_named_in_seconds() {
    type Answer = fn(&[u8]) -> Vec<u8>;
    let kinds: [(&str, Answer, i32, &str); 6] = [
        ("nothing", |_| Vec::new(), 4, "no complete answer"),
        ("an echo", <[u8]>::to_vec, 6, "no prompt"),
        (
            "a modem",
            |_| b"\r\nERROR\r\n".to_vec(),
            4,
            "the prompt `.`",
        ),
        ("a shell", |_| b"\r\nlogin: ".to_vec(), 4, "the prompt `.`"),
        (
            "a mill",
            |_| b"error:2\r\nok\r\n".to_vec(),
            4,
            "the prompt `.`",
        ),
        (
            "noise",
            |_| vec![0xf0, 0x81, 0, 0xff, 0x55],
            4,
            "the prompt `.`",
        ),
    ];
    std::thread::scope(|scope| {
        for (kind, answer, code, words) in kinds {
            scope.spawn(move || {
                let (port, _slave) = device(answer);
                let begun = Instant::now();
                let mut call = Command::new(env!("CARGO_BIN_EXE_val2"));
                let call = call.args(["--port", &port, "--yes", "jog", "1", "5"]);
                let output = call.stdin(Stdio::null()).output().unwrap();
                let errors = String::from_utf8_lossy(&output.stderr);
                println!("{kind}, {:?}: {errors}", begun.elapsed());
                assert_eq!(output.status.code(), Some(code), "{kind}: {errors}");
                assert_eq!(errors.lines().count(), 1, "{kind}: {errors}");
                assert!(errors.contains(words), "{kind}: {errors}");
                assert!(begun.elapsed() < Duration::from_secs(9), "{kind}");
            });
        }
    });
}

#[test]
fn a_port_that_vanishes_is_named_in_one_line() {
    for (words, code) in [
        (&["--yes", "jog", "1", "80"][..], 6),
        (&["--yes", "put", "go.v2"], 4),
        (&["where", "--watch"], 4),
    ] {
        let mut bench = Bench::new(&["--realtime"]);
        bench.says(&["--yes", "calibrate"]);
        let steps = " TYPE 1\n".repeat(200);
        bench.write("go.v2", &format!(".PROGRAM GO\n{steps}.END\n"));
        let from = bench.arm();
        let mut call = bench.command(words);
        let call = call.stdout(Stdio::null()).stderr(Stdio::piped());
        let child = call.spawn().unwrap();
        if code == 6 {
            wait_for_motion(&mut bench, &from, words);
        } else {
            std::thread::sleep(Duration::from_millis(800));
        }
        bench.emulator.kill().unwrap();
        bench.emulator.wait().unwrap();
        let begun = Instant::now();
        let output = child.wait_with_output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{words:?}: {errors}");
        assert_eq!(errors.lines().count(), 1, "{words:?}: {errors}");
        assert!(errors.contains("the line failed"), "{words:?}: {errors}");
        assert!(begun.elapsed() < Duration::from_secs(3), "{words:?}");
        assert!(bench.fails(4, &["where"]).contains("cannot be opened"));
    }
}

#[test]
fn a_second_client_on_a_socket_is_told_and_moves_nothing() {
    let (mut emulator, address, _said) = listening(&mut emulate(&["--tcp", "127.0.0.1:0"]));
    let call = |words: &[&str]| {
        let mut call = Command::new(env!("CARGO_BIN_EXE_val2"));
        call.args(["--tcp", &address])
            .args(words)
            .stdin(Stdio::null())
            .output()
            .unwrap()
    };
    assert!(call(&["--yes", "calibrate"]).status.success());
    let first = std::net::TcpStream::connect(&address).unwrap();
    let second = call(&["--yes", "jog", "1", "5"]);
    let errors = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(4), "{errors}");
    assert!(
        errors.lines().count() == 1 && errors.contains("another program"),
        "{errors}"
    );
    drop(first);
    let shown = call(&["--json", "where"]);
    let shown = String::from_utf8_lossy(&shown.stdout);
    assert!(shown.contains("[0.0,-90.0,90.0,0.0,0.0,0.0]"), "{shown}");
    emulator.kill().unwrap();
    emulator.wait().unwrap();
}
