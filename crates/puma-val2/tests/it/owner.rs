//! The program `val2` as its owner calls it, against `val2 emulate` on a pseudo-terminal.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::fd::OwnedFd;
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::{Duration, Instant};

use puma_val2::SerialLine;
use rustix::process::{Pid, Signal, kill_process};

use crate::program::{emulate, listening};

/// An emulated controller, served by the program itself.
pub(crate) struct Bench {
    pub(crate) emulator: Child,
    said: BufReader<ChildStdout>,
    pub(crate) port: String,
    pub(crate) folder: tempfile::TempDir,
}

impl Bench {
    pub(crate) fn new(options: &[&str]) -> Self {
        let (emulator, port, said) = listening(&mut emulate(options));
        let folder = tempfile::tempdir().unwrap();
        Self {
            emulator,
            said,
            port,
            folder,
        }
    }

    /// The joint angles of the arm itself, by the panel.
    pub(crate) fn arm(&mut self) -> Vec<f64> {
        let mut panel = self.emulator.stdin.as_ref().unwrap();
        panel.write_all(b"joints\n").unwrap();
        let mut line = String::new();
        self.said.read_line(&mut line).unwrap();
        let angles = line.trim_start_matches('(').split(')').next().unwrap();
        angles
            .split(", ")
            .map(|angle| angle.parse().unwrap())
            .collect()
    }

    pub(crate) fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_val2"));
        let command_line = command.args(["--port", &self.port]).args(words);
        command_line.current_dir(&self.folder).stdin(Stdio::null());
        command
    }

    pub(crate) fn output(&self, words: &[&str]) -> Output {
        self.command(words).output().unwrap()
    }

    /// The standard output of a command that succeeds.
    pub(crate) fn says(&self, words: &[&str]) -> String {
        let output = self.output(words);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{words:?}: {errors}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// The standard error of a command that ends with this exit code.
    pub(crate) fn fails(&self, code: i32, words: &[&str]) -> String {
        let output = self.output(words);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{words:?}: {errors}");
        assert_eq!(errors.trim_end().lines().count(), 1, "{errors}");
        errors
    }

    pub(crate) fn joints(&self) -> Vec<f64> {
        let value: serde_json::Value =
            serde_json::from_str(&self.says(&["--json", "where"])).unwrap();
        assert_eq!(value["xyzoat"].as_array().unwrap().len(), 6);
        let joints = value["joints_deg"].as_array().unwrap();
        joints.iter().map(|v| v.as_f64().unwrap()).collect()
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.folder.path().join(name), text).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.folder.path().join(name)).unwrap()
    }

    /// A long motion of the waist that has begun.
    fn moving(&self) -> Child {
        let mut command = self.command(&["--yes", "jog", "1", "80"]);
        let child = command.stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        child
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

const PROGRAM: &str = ".PROGRAM GO\n MOVE #SPOT\n TYPE \"hello\"\n 10 SIGNAL 3\n.END\n";

#[test]
fn the_arm_is_calibrated_moved_and_taught() {
    let bench = Bench::new(&[]);
    assert!(bench.says(&["where"]).contains("hand   X -20.32 Y 149.09"));
    bench.says(&["--yes", "calibrate"]);
    bench.says(&["jog", "2", "-5.5", "--yes"]);
    assert_eq!(bench.joints(), [0.0, -95.5, 90.0, 0.0, 0.0, 0.0]);
    assert!(bench.says(&["status"]).contains("MONITOR SPEED 10"));
    bench.says(&[
        "--yes", "move", "10", "-80", "95", "0", "20", "-5", "--speed", "60",
    ]);
    assert!(
        bench
            .says(&["teach", "#SPOT"])
            .starts_with("#SPOT = 10, -80, 95, 0, 20, -5")
    );
    bench.says(&["teach", "spot"]);
    bench.says(&["--yes", "move", "ready", "--speed", "60"]);
    bench.says(&["--yes", "move", "#SPOT", "--speed", "60"]);
    assert_eq!(bench.joints(), [10.0, -80.0, 95.0, 0.0, 20.0, -5.0]);
    bench.says(&[
        "--yes", "move", "600", "150", "100", "90", "60", "0", "--hand", "--speed", "60",
    ]);
    assert!(
        bench
            .says(&["where"])
            .contains("X 600.00 Y 150.00 Z 100.00")
    );
    bench.says(&["--yes", "hand", "close"]);
    assert_eq!(bench.says(&["speed", "40"]), "speed 40 %\n");
    assert!(bench.says(&["status"]).contains("MONITOR SPEED 40"));
    assert_eq!(bench.says(&["signal", "5", "on"]), "5 on\n");
    assert_eq!(bench.says(&["signal", "1001"]), "1001 off\n");
    assert!(bench.says(&["io"]).contains("1-32   00001000"));
    assert!(bench.says(&["send", "LISTL", "SPOT"]).contains("X/JT1"));
}

#[test]
fn a_backup_brings_everything_back_after_a_wipe() {
    let bench = Bench::new(&[]);
    bench.says(&["--yes", "calibrate"]);
    bench.says(&["teach", "#SPOT"]);
    bench.says(&["teach", "SPOT"]);
    bench.says(&["--yes", "send", "DO", "N=3"]);
    bench.write("prog.v2", PROGRAM);
    assert_eq!(bench.says(&["put", "prog.v2"]), "store program GO\n");
    assert_eq!(bench.says(&["put", "prog.v2"]), "keep program GO\n");
    assert_eq!(bench.says(&["get", "go"]), PROGRAM);
    let all = "programs   GO\nlocations  #SPOT SPOT\nreals      N\n";
    assert_eq!(bench.says(&["ls"]), all);
    let lists = |bench: &Bench| ["LISTP", "LISTL", "LISTR"].map(|list| bench.says(&["send", list]));
    let before = lists(&bench);
    bench.says(&["backup", "one.v2"]);
    bench.says(&["backup", "two.v2"]);
    assert_eq!(bench.read("one.v2"), bench.read("two.v2"));
    for name in ["GO", "#SPOT", "SPOT", "N"] {
        bench.fails(5, &["rm", name]);
        bench.says(&["rm", name, "--yes"]);
    }
    bench.fails(3, &["rm", "GO", "--yes"]);
    let plan = bench.says(&["restore", "one.v2", "--dry-run"]);
    assert_eq!(plan.matches("store ").count(), 4);
    assert_eq!(bench.says(&["ls"]), "programs\nlocations\nreals\n");
    assert_eq!(bench.says(&["restore", "one.v2"]), plan);
    assert_eq!(lists(&bench), before);

    // Other contents under the same name, an unknown word, a text of another kind.
    bench.write(
        "other.v2",
        ".PROGRAM GO\n MOVE #SPOT\n.END\n.REALS\nM 4\n.END\n",
    );
    assert!(
        bench
            .fails(5, &["restore", "other.v2"])
            .contains("program GO")
    );
    bench.write(
        "bad.v2",
        ".PROGRAM A\n MOVE #SPOT\n.END\n.PROGRAM B\n FROB 1\n.END\n",
    );
    let refused = bench.fails(3, &["put", "bad.v2"]);
    let named = ["bad.v2: ", "line 5", "at `FROB`"].map(|word| refused.contains(word));
    assert_eq!(named, [true; 3], "{refused}");
    bench.write("vplus.v2", ".PROGRAM belt(1)\n.END\n");
    assert!(bench.fails(1, &["put", "vplus.v2"]).contains("line 1"));
    assert!(bench.fails(1, &["put", "none.v2"]).contains("none.v2"));
    assert_eq!(lists(&bench), before);
    bench.says(&["restore", "other.v2", "--yes"]);
    assert_eq!(
        bench.says(&["get", "GO"]),
        ".PROGRAM GO\n MOVE #SPOT\n.END\n"
    );
}

#[test]
fn programs_run_in_the_background_or_to_their_end() {
    let bench = Bench::new(&[]);
    bench.says(&["--yes", "calibrate"]);
    bench.says(&["teach", "#SPOT"]);
    bench.write("prog.v2", PROGRAM);
    bench.says(&["put", "prog.v2"]);
    let output = bench.says(&["--yes", "run", "GO", "--wait"]);
    assert_eq!(output, "hello\nProgram completed\n");
    assert_eq!(bench.says(&["signal", "3"]), "3 on\n");
    bench.write(
        "wait.v2",
        ".PROGRAM ENDLESS\n 10 WAIT SIG(1001)\n GOTO 10\n.END\n",
    );
    bench.says(&["put", "wait.v2"]);
    bench.says(&["--yes", "run", "ENDLESS", "--cycles", "-1"]);
    assert!(bench.says(&["status"]).contains("PROGRAM ENDLESS"));
    assert!(bench.says(&["where"]).contains("joints"));
    assert!(
        bench
            .fails(3, &["--yes", "jog", "1", "5"])
            .contains("Program executing")
    );
    assert_eq!(bench.says(&["stop"]), "stopped\n");
    assert!(bench.says(&["status"]).contains("NO PROGRAM EXECUTING"));
    assert!(
        bench
            .fails(3, &["--yes", "run", "NOBODY"])
            .contains("Undefined program")
    );
}

#[test]
fn a_terminal_waits_for_the_prompt_between_the_lines_of_a_file() {
    let bench = Bench::new(&["--profile", "val2_hardware"]);
    let mut term = bench
        .command(&["--yes", "term"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let term = term.as_mut().unwrap();
    let lines =
        "N\nN\nCAL\nY\nDO DRIVE 1,30,100\nDO TYPE \"a long line of text, once more\"\nWHERE\n";
    term.stdin
        .take()
        .unwrap()
        .write_all(lines.as_bytes())
        .unwrap();
    let mut said = String::new();
    term.stdout
        .take()
        .unwrap()
        .read_to_string(&mut said)
        .unwrap();
    assert!(term.wait().unwrap().success());
    assert!(
        said.contains("once more\n") && said.contains("   30.00"),
        "{said}"
    );
}

#[test]
fn signals_that_end_a_program_stop_the_arm_in_mid_move() {
    let bench = Bench::new(&["--realtime"]);
    bench.says(&["--yes", "calibrate"]);
    for signal in [Signal::INT, Signal::QUIT] {
        let from = bench.joints()[0];
        let child = bench.moving();
        kill_process(Pid::from_child(&child), signal).unwrap();
        let output = child.wait_with_output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{errors}");
        assert!(errors.contains("the arm has been stopped"), "{errors}");
        let stands = bench.joints();
        assert!((1.0..40.0).contains(&(stands[0] - from)), "{stands:?}");
        assert_eq!(bench.joints(), stands);
    }
    bench.says(&["--yes", "jog", "1", "-1"]);
}

const ASKING: &str = ".PROGRAM ASK\n PROMPT \"HOW FAR? \",X\n DRIVE 1,X+10,50\n.END\n";

#[test]
fn a_terminal_answers_no_question_of_a_program() {
    for profile in ["val2", "val2_strict_miz"] {
        let mut bench = Bench::new(&["--profile", profile]);
        let call = |bench: &Bench, code, words: &[&str]| {
            let mut all = vec!["--profile", profile, "--yes"];
            all.extend(words);
            bench.fails(code, &all)
        };
        bench.says(&["--profile", profile, "--yes", "calibrate"]);
        bench.write("ask.v2", ASKING);
        bench.says(&["--profile", profile, "put", "ask.v2"]);
        let errors = call(&bench, 3, &["run", "ASK"]);
        assert!(errors.contains("asks \"HOW FAR?\""), "{errors}");
        bench.says(&["--profile", profile, "--yes", "term"]);
        call(&bench, 3, &["where"]);
        assert!(bench.arm()[0].abs() < 0.01);
        if profile == "val2" {
            assert_eq!(bench.says(&["stop"]), "stopped\n");
        } else {
            // Without Ctrl-C the question stays.
            let errors = call(&bench, 3, &["stop"]);
            assert!(errors.contains("a program asks"), "{errors}");
        }
        assert!(bench.arm()[0].abs() < 0.01);
    }
}

#[test]
fn lines_of_a_pipe_need_a_yes() {
    let bench = Bench::new(&[]);
    assert!(bench.fails(5, &["term"]).contains("say --yes"));
    assert!(
        bench
            .fails(5, &["send", "PROCEED;on"])
            .contains("say --yes")
    );
}

#[test]
fn stop_reaches_an_arm_whose_program_was_killed() {
    for (profile, code) in [("val2", 0), ("val2_strict_miz", 6)] {
        let bench = Bench::new(&["--realtime", "--profile", profile]);
        bench.says(&["--profile", profile, "--yes", "calibrate"]);
        let mut child = bench.moving();
        let begun = Instant::now();
        let held = bench.fails(6, &["--profile", profile, "stop"]);
        assert!(held.contains("`val2` (process"), "{held}");
        child.kill().unwrap();
        child.wait().unwrap();
        if code == 0 {
            assert_eq!(bench.says(&["stop"]), "stopped\n");
            let stands = bench.joints();
            assert!((1.0..60.0).contains(&stands[0]), "{stands:?}");
            assert_eq!(bench.joints(), stands);
        } else {
            let errors = bench.fails(code, &["--profile", profile, "stop"]);
            assert!(errors.contains("press the emergency stop"), "{errors}");
        }
        assert!(begun.elapsed() < Duration::from_secs(4));
    }
}

#[test]
fn wrong_calls_say_so_in_one_line_and_move_nothing() {
    let bench = Bench::new(&[]);
    bench.fails(5, &["jog", "1", "5"]);
    bench.fails(5, &["calibrate"]);
    bench.fails(5, &["send", "DO READY"]);
    assert!(bench.fails(5, &["send", "ZERO"]).contains("Are you sure"));
    bench.fails(3, &["--yes", "jog", "1", "5"]);
    bench.fails(2, &["--yes", "jog", "1", "500"]);
    bench.fails(2, &["--yes", "move", "1", "2", "3"]);
    bench.fails(2, &["--yes", "move", "1", "2", "3", "4", "5", "six"]);
    bench.fails(2, &["speed", "0"]);
    bench.fails(2, &["--profile", "nobody", "where"]);
    bench.fails(3, &["--yes", "move", "NOWHERE"]);
    assert!(
        bench
            .fails(2, &["emulate"])
            .contains("--port is not for `emulate`")
    );
    assert!(
        bench
            .fails(2, &["--json", "speed", "0"])
            .contains("exit_code")
    );
    assert_eq!(bench.joints(), [0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    let held = SerialLine::open(&bench.port, 9600).unwrap();
    assert!(bench.fails(4, &["where"]).contains("holds the port"));
    drop(held);
    bench.says(&["where"]);
}

/// A terminal of its own for a program that reads keys.
pub(crate) fn keyboard() -> (fs::File, OwnedFd) {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let path = ptsname(&master, Vec::new()).unwrap();
    let flags = rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NOCTTY;
    let slave = rustix::fs::open(path.as_c_str(), flags, rustix::fs::Mode::empty()).unwrap();
    (fs::File::from(master), slave)
}

#[test]
fn keys_move_the_arm_only_while_they_come() {
    let bench = Bench::new(&["--realtime"]);
    bench.says(&["--yes", "calibrate"]);
    let (mut keys, terminal) = keyboard();
    let mut jog = bench.command(&["--yes", "jog", "--speed", "100"]);
    let mut child = jog.stdin(terminal).stdout(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(800));
    for key in [&b"2"[..], b"++++++++", b"]", b"-"] {
        keys.write_all(key).unwrap();
        std::thread::sleep(Duration::from_millis(1200));
    }
    keys.write_all(b"q").unwrap();
    assert!(child.wait().unwrap().success());
    // Of the eight keys that came at once only one step was made, then one of two degrees back.
    assert_eq!(bench.joints(), [0.0, -91.0, 90.0, 0.0, 0.0, 0.0]);
}

#[test]
fn ctrl_c_at_a_question_ends_the_call_and_changes_nothing() {
    let bench = Bench::new(&[]);
    // A file of DOS.
    bench.write("go.v2", &format!("{}\x1a", PROGRAM.replace('\n', "\r\n")));
    bench.says(&["put", "go.v2"]);
    bench.write("other.v2", &PROGRAM.replace("hello", "bye"));
    for words in [&["put", "other.v2"][..], &["rm", "GO"]] {
        let (_keys, terminal) = keyboard();
        let mut call = bench.command(words);
        let mut child = call.stdin(terminal).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        kill_process(Pid::from_child(&child), Signal::INT).unwrap();
        std::thread::sleep(Duration::from_millis(300));
        let ended = child.try_wait().unwrap();
        let _ = child.kill();
        let _ = child.wait();
        assert!(
            ended.is_some_and(|status| status.code().is_none()),
            "{ended:?}"
        );
    }
    assert!(bench.says(&["get", "GO"]).contains("hello"));
}

#[test]
fn output_that_nobody_reads_ends_the_program_quietly() {
    let bench = Bench::new(&[]);
    let mut watch = bench.command(&["where", "--watch"]);
    let mut child = watch
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap())
        .read_line(&mut first)
        .unwrap();
    assert!(first.starts_with("joints"));
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(141));
    assert!(output.stderr.is_empty());
}
