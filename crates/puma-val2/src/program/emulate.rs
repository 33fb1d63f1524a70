//! `val2 emulate`: an emulated controller for terminal programs, scripts and clients.

use std::error::Error;
use std::fs::File;
use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use clap::Args;

use crate::emulator::controller::Emulator;
use crate::emulator::profile::Profile;
use crate::kinematics::params::PumaParams;
use crate::program::floppy::Floppy;
use crate::serve::{EmulatorServer, ServeConfig};

/// Options of `emulate`.
#[derive(Debug, Args)]
pub(super) struct Options {
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
    /// Arm: 260, 560 or 762. Lengths and ranges of the 260 and 762 are those of public models; the
    /// speeds of all are those of the 560.
    #[arg(long, value_name = "NUMBER", default_value = "560", value_parser = ["260", "560", "762"])]
    arm: String,
    /// Behaviour of the controller: val2, val2_strict_miz, val2_hardware, val (of 1980).
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

pub(super) fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let mut profile = Profile::named(&options.profile).ok_or_else(|| {
        let names = Profile::all().map(|p| p.name).join(", ");
        format!("no profile `{}`: there are {names}", options.profile)
    })?;
    if let Some(baud) = options.baud {
        profile.baud = Some(baud);
    }
    let arm = PumaParams::numbered(&options.arm).unwrap_or_else(PumaParams::unimation);
    profile.banner = profile.banner.replace("560", &options.arm);
    // The pose of NEST is an assumption for the 560; another arm folds as far as it can.
    for (angle, range) in profile.nest.0.iter_mut().zip(arm.ranges) {
        *angle = angle.clamp(range.min, range.max);
    }
    let mut emulator = Emulator::new(arm, profile);
    let floppy = match &options.floppy {
        Some(folder) => Some(Floppy::insert(folder, &mut emulator)?),
        None => None,
    };
    let config = ServeConfig {
        realtime: options.realtime || options.baud.is_some(),
        link: options.link.clone(),
        transcript: match &options.transcript {
            Some(path) => Some(Box::new(
                File::create(path).map_err(|e| format!("{}: {e}", path.display()))?,
            )),
            None => None,
        },
    };
    let server = serve(options, emulator, config)?;
    println!("listening on {}", server.address());
    io::stdout().flush()?;
    attend(&server, floppy)
}

#[cfg(unix)]
fn serve(
    options: &Options,
    emulator: Emulator,
    config: ServeConfig,
) -> Result<EmulatorServer, Box<dyn Error>> {
    match &options.tcp {
        Some(address) => on_socket(address, emulator, config),
        None => Ok(EmulatorServer::pty(emulator, config)?),
    }
}

#[cfg(not(unix))]
fn serve(
    options: &Options,
    emulator: Emulator,
    config: ServeConfig,
) -> Result<EmulatorServer, Box<dyn Error>> {
    on_socket(
        options.tcp.as_deref().unwrap_or("127.0.0.1:5600"),
        emulator,
        config,
    )
}

fn on_socket(
    address: &str,
    emulator: Emulator,
    config: ServeConfig,
) -> Result<EmulatorServer, Box<dyn Error>> {
    EmulatorServer::tcp(address, emulator, config)
        .map_err(|problem| format!("{address} cannot be listened at: {problem}").into())
}

/// Carries out the lines of the panel and keeps the floppy disk's folder up to date until `quit`.
/// With a closed standard input there is no panel, and the program serves until it is killed.
fn attend(server: &EmulatorServer, mut floppy: Option<Floppy>) -> Result<(), Box<dyn Error>> {
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
            let problem = server
                .with_emulator(|emulator| floppy.changed(emulator))
                .and_then(|now| floppy.follow(now).err())
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

fn panel(server: &EmulatorServer, line: &str) -> Result<(), String> {
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
            server.with_emulator(|e| e.set_arm_power(on));
        }
        ["signal", number, word] => {
            let number: u16 = number
                .parse()
                .map_err(|_| format!("`{number}` is no signal"))?;
            let on = state(word)?;
            server
                .with_emulator(|e| e.set_signal(number, on))
                .map_err(|fault| fault.to_string())?;
        }
        ["joints"] => println!(
            "{} {:?}",
            server.with_emulator(|e| e.joints()),
            server.with_emulator(|e| e.gripper())
        ),
        ["restart"] => server.with_emulator(Emulator::restart),
        _ => return Err("power on|off, signal NUMBER on|off, joints, restart, quit".into()),
    }
    Ok(())
}
