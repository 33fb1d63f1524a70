//! The floppy disk of the emulator that `val2_emulator` serves: a folder.
//!
//! `cargo test` builds the example beside the tests; where it is not there, the test says so and is
//! skipped.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// The example on any free socket, with this folder as its floppy disk.
fn serving(folder: &Path) -> Option<Command> {
    let own = std::env::current_exe().expect("a path of its own");
    let built = own
        .ancestors()
        .nth(2)
        .expect("a target folder")
        .join("examples");
    let mut command = Command::new(
        built
            .join("val2_emulator")
            .with_extension(std::env::consts::EXE_EXTENSION),
    );
    if !Path::new(command.get_program()).exists() {
        println!("skipped: val2_emulator has not been built");
        return None;
    }
    command
        .args(["--tcp", "127.0.0.1:0", "--floppy"])
        .arg(folder);
    Some(command)
}

/// A terminal at an emulator that the example serves on a socket.
#[derive(Debug)]
struct Terminal {
    emulator: Child,
    line: TcpStream,
}

impl Terminal {
    /// Starts the emulator with this folder as its floppy disk.
    fn with_floppy(folder: &Path) -> Option<Self> {
        let mut emulator = serving(folder)?
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the emulator starts");
        let mut first = String::new();
        let out = emulator.stdout.take().expect("its output");
        BufReader::new(out)
            .read_line(&mut first)
            .expect("its first line");
        let address = first
            .trim()
            .strip_prefix("listening on ")
            .expect("where it listens");
        let line = TcpStream::connect(address).expect("a socket that listens");
        line.set_read_timeout(Some(Duration::from_secs(20)))
            .expect("a time-out");
        let mut terminal = Self { emulator, line };
        terminal.read_until("? ");
        terminal.say("N", "? ");
        terminal.say("N", "\r\n.");
        Some(terminal)
    }

    fn say(&mut self, line: &str, until: &str) -> String {
        self.line
            .write_all(format!("{line}\r").as_bytes())
            .expect("a line that takes it");
        self.read_until(until)
    }

    fn read_until(&mut self, end: &str) -> String {
        let mut said = Vec::new();
        let mut byte = [0];
        while !said.ends_with(end.as_bytes()) {
            self.line.read_exact(&mut byte).expect("something to read");
            said.push(byte[0]);
        }
        String::from_utf8_lossy(&said).into_owned()
    }

    /// Quits, and waits until it has.
    fn quit(mut self) {
        let mut panel = self.emulator.stdin.take().expect("its panel");
        panel.write_all(b"quit\n").expect("a panel that listens");
        assert!(self.emulator.wait().expect("its end").success());
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
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

#[test]
fn the_floppy_folder_holds_what_the_disk_does() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let disk = folder.path();
    std::fs::write(disk.join("old.v2"), ".REALS\nN 3\n.END\n").expect("a file");
    std::fs::write(disk.join("notes.txt"), "not a file of VAL's").expect("a file");
    let Some(mut terminal) = Terminal::with_floppy(disk) else {
        return;
    };
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
    let text = |name| std::fs::read_to_string(disk.join(name)).expect("a file");
    assert_eq!(text("CELL.A.v2"), ".REALS\nN 3\n.END\n");
    assert_eq!(text("CELL.B.v2"), ".REALS\nM 4\nN 3\n.END\n");
    assert_eq!(text("old.v2"), text("CELL.B.v2"));

    // Put in again it has them all, and what is deleted is gone from the folder too.
    let mut terminal = Terminal::with_floppy(disk).expect("built a moment ago");
    let listed = terminal.say("FDIRECTORY", "\r\n.");
    assert!(listed.contains("CELL.A\r\nCELL.B\r\nOLD\r\n"), "{listed}");
    terminal.say("FDELETE CELL.A", "? ");
    terminal.say("Y", "\r\n.");
    terminal.quit();
    assert_eq!(names(disk), ["CELL.B.v2", "notes.txt", "old.v2"]);
    let mut terminal = Terminal::with_floppy(disk).expect("built a moment ago");
    terminal.say("FORMAT", "? ");
    terminal.say("Y", "\r\n.");
    terminal.quit();
    assert_eq!(names(disk), ["notes.txt"]);

    // Two files that VAL could not tell apart.
    std::fs::write(disk.join("A.v2"), "").expect("a file");
    std::fs::write(disk.join("a.v2"), "").expect("a file");
    if names(disk).len() == 3 {
        let output = serving(disk).expect("built a moment ago").output();
        let output = output.expect("it starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(
            !output.status.success() && errors.contains("are both the file A"),
            "{errors}"
        );
    }
}
