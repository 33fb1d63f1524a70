//! A PUMA 560 controller to talk to with any terminal program.
//!
//! ```text
//! cargo run --example val2_emulator -- --link /tmp/puma
//! screen /tmp/puma 9600
//! ```
//!
//! The first line printed is `listening on PATH`. Lines typed here are the controller's panel:
//! `power on`, `power off`, `signal 1001 on`, `joints`, `restart`, `quit`.
#![allow(clippy::print_stdout, clippy::print_stderr)] // A program's output.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs::{self, File};
use std::io::{self, BufRead, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use clap::Parser;
#[cfg(unix)]
use puma_val2::PtyServer;
use puma_val2::{Emulator, Profile, PumaParams, ServeConfig, TcpServer, char_time};

use example_support::files::write_whole;
use example_support::program::ended;

/// An emulated VAL II controller with a PUMA 560.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// Serve on this address (127.0.0.1:5600, or port 0 for any free one) instead of a
    /// pseudo-terminal.
    #[arg(long, value_name = "ADDR", conflicts_with = "pty")]
    tcp: Option<String>,
    /// Serve on a pseudo-terminal (the default).
    #[arg(long)]
    pty: bool,
    /// Make this symbolic link to the pseudo-terminal.
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    link: Option<PathBuf>,
    /// What the controller is like: val2, val2_strict_miz, val2_hardware.
    #[arg(long, value_name = "NAME", default_value = "val2")]
    profile: String,
    /// Let motions take their time. Otherwise the controller's clock jumps ahead whenever it waits
    /// for nothing else.
    #[arg(long)]
    realtime: bool,
    /// Pace characters as a line of this speed does; implies --realtime.
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(50..))]
    baud: Option<u32>,
    /// Write what passes on the line to this file.
    #[arg(long, value_name = "FILE")]
    transcript: Option<PathBuf>,
    /// The floppy disk: text files (NAME.v2) of this folder can be loaded, stored files are written
    /// to it, deleted ones removed.
    #[arg(long, value_name = "FOLDER")]
    floppy: Option<PathBuf>,
}

/// Either way of serving.
enum Server {
    #[cfg(unix)]
    Pty(PtyServer),
    Tcp(TcpServer),
}

impl Server {
    fn place(&self) -> String {
        match self {
            #[cfg(unix)]
            Self::Pty(server) => server.path().display().to_string(),
            Self::Tcp(server) => server.address().to_string(),
        }
    }

    fn with<R>(&self, f: impl FnOnce(&mut Emulator) -> R) -> R {
        match self {
            #[cfg(unix)]
            Self::Pty(server) => server.with_emulator(f),
            Self::Tcp(server) => server.with_emulator(f),
        }
    }
}

fn main() -> ExitCode {
    ended(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut profile = Profile::named(&arguments.profile).ok_or_else(|| {
        let names = Profile::all().map(|p| p.name).join(", ");
        format!("no profile `{}`: there are {names}", arguments.profile)
    })?;
    if let Some(baud) = arguments.baud {
        profile.char_time = Some(char_time(baud));
    }
    let mut emulator = Emulator::new(PumaParams::unimation(), profile);
    let floppy = match &arguments.floppy {
        Some(folder) => Some(Floppy::insert(folder, &mut emulator)?),
        None => None,
    };
    let config = ServeConfig {
        realtime: arguments.realtime || arguments.baud.is_some(),
        link: arguments.link.clone(),
        transcript: match &arguments.transcript {
            Some(path) => Some(Box::new(
                File::create(path).map_err(|e| format!("{}: {e}", path.display()))?,
            )),
            None => None,
        },
    };
    let server = serve(arguments, emulator, config)?;
    println!("listening on {}", server.place());
    io::stdout().flush()?;
    attend(&server, floppy)
}

#[cfg(unix)]
fn serve(
    arguments: &Arguments,
    emulator: Emulator,
    config: ServeConfig,
) -> Result<Server, Box<dyn Error>> {
    match &arguments.tcp {
        Some(address) => on_socket(address, emulator, config),
        None => Ok(Server::Pty(PtyServer::spawn(emulator, config)?)),
    }
}

#[cfg(not(unix))]
fn serve(
    arguments: &Arguments,
    emulator: Emulator,
    config: ServeConfig,
) -> Result<Server, Box<dyn Error>> {
    on_socket(
        arguments.tcp.as_deref().unwrap_or("127.0.0.1:5600"),
        emulator,
        config,
    )
}

fn on_socket(
    address: &str,
    emulator: Emulator,
    config: ServeConfig,
) -> Result<Server, Box<dyn Error>> {
    match TcpServer::spawn(address, emulator, config) {
        Ok(server) => Ok(Server::Tcp(server)),
        Err(problem) => Err(format!("{address} cannot be listened at: {problem}").into()),
    }
}

/// The floppy disk: a folder of text files, each named as in VAL with `.v2` behind it.
struct Floppy {
    folder: PathBuf,
    /// The file that each name of the disk is kept in; VAL knows upper case only, a file system may
    /// not.
    paths: BTreeMap<String, PathBuf>,
    /// What the folder holds.
    kept: BTreeMap<String, String>,
}

impl Floppy {
    /// Puts the text files of a folder, which is made if need be, on the disk of `emulator`.
    fn insert(folder: &Path, emulator: &mut Emulator) -> Result<Self, Box<dyn Error>> {
        let at = |path: &Path, problem: io::Error| format!("{}: {problem}", path.display());
        fs::create_dir_all(folder).map_err(|e| at(folder, e))?;
        let mut paths: BTreeMap<String, PathBuf> = BTreeMap::new();
        for entry in fs::read_dir(folder).map_err(|e| at(folder, e))? {
            let path = entry.map_err(|e| at(folder, e))?.path();
            let Some(name) = path
                .file_name()
                .and_then(|name| name.to_str())
                .and_then(|name| name.strip_suffix(".v2"))
            else {
                continue;
            };
            let name = name.to_ascii_uppercase();
            let text = fs::read_to_string(&path).map_err(|e| at(&path, e))?;
            emulator.insert_file(&name, text);
            if let Some(other) = paths.insert(name.clone(), path.clone()) {
                let (one, two) = (other.display(), path.display());
                return Err(format!("{one} and {two} are both the file {name}").into());
            }
        }
        Ok(Self {
            folder: folder.to_owned(),
            paths,
            kept: emulator.floppy().clone(),
        })
    }

    /// Makes the folder hold what the disk does: writes what was stored, removes what was deleted.
    fn follow(&mut self, server: &Server) -> Result<(), Box<dyn Error>> {
        let Some(now) = server.with(|e| (*e.floppy() != self.kept).then(|| e.floppy().clone()))
        else {
            return Ok(());
        };
        for (name, text) in &now {
            if self.kept.get(name) == Some(text) {
                continue;
            }
            let path = self
                .paths
                .entry(name.clone())
                .or_insert_with(|| self.folder.join(format!("{name}.v2")));
            write_whole(path, text.as_bytes())?;
        }
        for name in self.kept.keys().filter(|name| !now.contains_key(*name)) {
            if let Some(path) = self.paths.remove(name) {
                fs::remove_file(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            }
        }
        self.kept = now;
        Ok(())
    }
}

/// Follows the panel's lines and the disk until told to quit. Without a panel (input closed) it
/// serves until it is killed.
fn attend(server: &Server, mut floppy: Option<Floppy>) -> Result<(), Box<dyn Error>> {
    let (sender, lines) = mpsc::channel();
    std::thread::spawn(move || {
        io::stdin()
            .lock()
            .lines()
            .map_while(Result::ok)
            .try_for_each(|line| sender.send(line))
    });
    let mut trouble = None;
    loop {
        let line = match lines.recv_timeout(Duration::from_millis(200)) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => String::new(),
            Err(RecvTimeoutError::Disconnected) => {
                std::thread::sleep(Duration::from_millis(200));
                String::new()
            }
        };
        if let Some(floppy) = &mut floppy {
            let problem = floppy
                .follow(server)
                .err()
                .map(|problem| problem.to_string());
            if let Some(problem) = problem.as_ref().filter(|_| problem != trouble) {
                println!("the floppy disk cannot be written: {problem}");
            }
            trouble = problem;
        }
        if line.trim() == "quit" {
            return Ok(());
        }
        if let Err(problem) = panel(server, &line) {
            println!("{problem}");
        }
    }
}

fn panel(server: &Server, line: &str) -> Result<(), String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let state = |word: &str| match word {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(format!("`{word}` is neither on nor off")),
    };
    match words[..] {
        [] => {}
        ["power", word] => {
            let on = state(word)?;
            server.with(|e| e.set_arm_power(on));
        }
        ["signal", number, word] => {
            let number: u16 = number
                .parse()
                .map_err(|_| format!("`{number}` is no signal"))?;
            let on = state(word)?;
            server
                .with(|e| e.set_signal(number, on))
                .map_err(|fault| fault.to_string())?;
        }
        ["joints"] => println!(
            "{} {:?}",
            server.with(|e| e.joints()),
            server.with(|e| e.gripper())
        ),
        ["restart"] => server.with(Emulator::restart),
        _ => return Err("power on|off, signal NUMBER on|off, joints, restart, quit".into()),
    }
    Ok(())
}
