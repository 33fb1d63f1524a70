//! The program `val2 emulate`: its floppy disk, a folder, and what it cannot serve on.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;

/// The program with these options.
pub(crate) fn emulate(options: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_val2"));
    command.arg("emulate").args(options);
    command
}

/// Starts an emulator and returns it with the address that its first line names.
pub(crate) fn listening(command: &mut Command) -> (Child, String, BufReader<ChildStdout>) {
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut emulator = command.spawn().unwrap();
    let mut first = String::new();
    let mut out = BufReader::new(emulator.stdout.take().unwrap());
    out.read_line(&mut first).unwrap();
    let address = first.trim().strip_prefix("listening on ").unwrap();
    (emulator, address.to_owned(), out)
}

/// The program on any free socket, with this folder as its floppy disk.
fn serving(folder: &Path) -> Command {
    emulate(&["--tcp", "127.0.0.1:0", "--floppy", folder.to_str().unwrap()])
}

/// A terminal at an emulator that the program serves on a socket.
#[derive(Debug)]
struct Terminal {
    emulator: Child,
    line: TcpStream,
}

impl Terminal {
    /// Starts the emulator with this folder as its floppy disk.
    fn with_floppy(folder: &Path) -> Self {
        let (emulator, address, _) = listening(&mut serving(folder));
        let line = TcpStream::connect(address).unwrap();
        line.set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        let mut terminal = Self { emulator, line };
        terminal.read_until("? ");
        terminal.say("N", "? ");
        terminal.say("N", "\r\n.");
        terminal
    }

    fn say(&mut self, line: &str, until: &str) -> String {
        self.line.write_all(format!("{line}\r").as_bytes()).unwrap();
        self.read_until(until)
    }

    fn read_until(&mut self, end: &str) -> String {
        let mut said = Vec::new();
        let mut byte = [0];
        while !said.ends_with(end.as_bytes()) {
            self.line.read_exact(&mut byte).unwrap();
            said.push(byte[0]);
        }
        String::from_utf8_lossy(&said).into_owned()
    }

    /// Quits, and waits until it has.
    fn quit(mut self) {
        let mut panel = self.emulator.stdin.take().unwrap();
        panel.write_all(b"quit\n").unwrap();
        assert!(self.emulator.wait().unwrap().success());
    }
}

impl Drop for Terminal {
    /// A test that fails leaves no emulator behind.
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn the_floppy_folder_holds_what_the_disk_does() {
    let folder = tempfile::tempdir().unwrap();
    let disk = folder.path();
    fs::write(disk.join("old.v2"), ".REALS\nN 3\n.END\n").unwrap();
    fs::write(disk.join("notes.txt"), "not a file of VAL's").unwrap();
    let mut terminal = Terminal::with_floppy(disk);
    // Names with a point in them are names of their own.
    terminal.say("LOAD OLD", "\r\n.");
    terminal.say("STORE CELL.A", "\r\n.");
    terminal.say("DO M = 4", "\r\n.");
    terminal.say("STORE CELL.B", "\r\n.");
    terminal.say("STORE OLD", "\r\n.");
    terminal.quit();
    assert_eq!(
        names(disk),
        ["CELL.A.v2", "CELL.B.v2", "notes.txt", "old.v2"]
    );
    let text = |name| fs::read_to_string(disk.join(name)).unwrap();
    assert_eq!(text("CELL.A.v2"), ".REALS\nN 3\n.END\n");
    assert_eq!(text("CELL.B.v2"), ".REALS\nM 4\nN 3\n.END\n");
    assert_eq!(text("old.v2"), text("CELL.B.v2"));

    // Put in again it has them all, and what is deleted is gone from the folder too.
    let mut terminal = Terminal::with_floppy(disk);
    let listed = terminal.say("FDIRECTORY", "\r\n.");
    assert!(listed.contains("CELL.A\r\nCELL.B\r\nOLD\r\n"), "{listed}");
    terminal.say("FDELETE CELL.A", "? ");
    terminal.say("Y", "\r\n.");
    terminal.quit();
    assert_eq!(names(disk), ["CELL.B.v2", "notes.txt", "old.v2"]);
    let mut terminal = Terminal::with_floppy(disk);
    terminal.say("FORMAT", "? ");
    terminal.say("Y", "\r\n.");
    terminal.quit();
    assert_eq!(names(disk), ["notes.txt"]);

    // Two files that VAL could not tell apart.
    fs::write(disk.join("A.v2"), "").unwrap();
    fs::write(disk.join("a.v2"), "").unwrap();
    if names(disk).len() == 3 {
        let output = serving(disk).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(
            !output.status.success() && errors.contains("are both the file A"),
            "{errors}"
        );
    }
}

#[test]
fn what_cannot_be_served_on_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let link = folder.path().join("none/arm").display().to_string();
    let mut cases = vec![
        (["--tcp", &address], address.as_str()),
        (["--tcp", "nonsense"], "nonsense"),
        (["--profile", "nobody"], "val2_strict_miz"),
    ];
    if cfg!(unix) {
        cases.push((["--link", &link], &link));
    }
    for (options, named) in cases {
        let output = emulate(&options).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{options:?}: {errors}");
        assert!(
            errors.starts_with("error: ") && errors.contains(named),
            "{options:?}: {errors}"
        );
    }
}

#[test]
fn the_arm_can_be_chosen() {
    for (number, reach) in [("260", 469.9), ("560", 921.12), ("762", 1250.0)] {
        let mut command = emulate(&["--tcp", "127.0.0.1:0", "--arm", number]);
        let (emulator, address, _) = listening(&mut command);
        let line = TcpStream::connect(address).unwrap();
        line.set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        let mut terminal = Terminal { emulator, line };
        terminal.read_until("? ");
        terminal.say("N", "? ");
        assert!(
            terminal
                .say("N", "\r\n.")
                .contains(&format!("PUMA {number}"))
        );
        // Straight up, the hand is as high as the arm is long.
        assert!(
            terminal
                .say("WHERE", "\r\n.")
                .contains(&format!("{reach:9.2}")),
            "{number}"
        );
        terminal.say("CAL", "? ");
        terminal.say("Y", "\r\n.");
        assert!(!terminal.say("DO NEST", "\r\n.").contains('*'), "{number}");
        terminal.quit();
    }
    let outcome = emulate(&["--arm", "761"]).output().unwrap();
    assert!(String::from_utf8_lossy(&outcome.stderr).contains("possible values: 260, 560, 762"));
}
