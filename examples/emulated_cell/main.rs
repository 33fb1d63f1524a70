//! An emulated arm on a line, and the frames of its camera on a pipe: a cell for programs that
//! drive a real one.
//!
//! ```text
//! mkfifo /tmp/camera
//! cargo run --release --example emulated_cell -- --link /tmp/puma --video /tmp/camera
//! cargo run --release --example grasp -- --port /tmp/puma --camera /tmp/camera
//! ```

use std::fs::File;
use std::io::{self, BufRead, BufWriter, ErrorKind, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use example_support::learning::paper_cell;
use example_support::prelude::*;
use example_support::program::stopped;
use example_support::real::size;
use example_support::trial::ball_in_view;
use hough_heuristic::image::GrayImage;
use hough_heuristic::{FrameSource, Y4mWriter};
use pipeline_sim::{CellCamera, ErrorLevel, Renderer, Scene, SharedCell};
use puma_val2::{Emulator, EmulatorServer, Gripper, Profile, PumaParams, ServeConfig};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
#[cfg(unix)]
use rustix::fs::OFlags;

/// Serves an emulated PUMA 560 with VAL II on a pseudo-terminal or a socket, and writes what the
/// camera on its hand sees as Y4M in real time.
///
/// Lines on standard input act on the ball: `ball` puts it on a stand at another place in view,
/// `jaws` between the open jaws, `away` out of the cell; `quit` ends the program. A ball that the
/// jaws let go is put on a stand again. The frames go to one reader after the other.
#[derive(Parser, Debug)]
struct Options {
    /// Symbolic link to make to the pseudo-terminal
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    link: Option<PathBuf>,
    /// Serve on this address instead, such as 127.0.0.1:5600
    #[arg(long, value_name = "ADDR")]
    tcp: Option<String>,
    /// File or named pipe for the frames [default: standard output]
    #[arg(long, value_name = "PATH")]
    video: Option<PathBuf>,
    /// Frames per second
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = rate)]
    fps: u32,
    /// Size of the frames
    #[arg(long, value_name = "WxH", default_value = "768x576", value_parser = size)]
    size: (u32, u32),
    /// Let the arm move at the speed of a real one, otherwise in no time
    #[arg(long)]
    realtime: bool,
    /// Errors of the camera: none, moderate, heavy, extreme
    #[arg(long, value_name = "LEVEL", default_value_t = ErrorLevel::None)]
    level: ErrorLevel,
    /// Radius of the ball, millimetres
    #[arg(long, value_name = "MM", default_value_t = 20.0)]
    ball_radius: f64,
    /// Seed of places, errors and noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

fn rate(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(rate @ 1..=100) => Ok(rate),
        _ => Err("give 1 to 100".into()),
    }
}

/// Flag that the order `quit` sets.
static QUIT: AtomicBool = AtomicBool::new(false);

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let errors = options.level.draw(&mut rng);
    let mut cell = errors.apply(&paper_cell())?;
    cell.ball.radius = options.ball_radius / 1000.0;
    cell.camera = cell.camera.resized(options.size.0, options.size.1)?;
    let cell = SharedCell::new(cell);
    cell.set_errors(&errors)?;
    let mut emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
    let around = cell.clone();
    emulator
        .attach_sensor(1001, move |joints| around.move_hand(&around.links(joints)))
        .map_err(|fault| fault.to_string())?;
    let server = Arc::new(served(options, emulator)?);
    notice(&format!("arm on {}", server.address()));

    let (panel, shown) = (Arc::clone(&server), cell.clone());
    thread::spawn(move || attend(&panel, &shown, &mut rng));

    let (arm, links) = (Arc::clone(&server), cell.clone());
    let pose = move || links.links(&arm.with_emulator(|emulator| emulator.joints()));
    let mut camera = CellCamera::new(
        cell.clone(),
        Renderer::new(&Scene::bright_ball(), options.seed),
        pose.clone(),
    );
    let (mut frame, mut jaws) = (GrayImage::default(), Gripper::Open);
    let mut next_place = Xoshiro256PlusPlus::seed_from_u64(options.seed ^ 1);
    let (period, mut due) = (Duration::from_secs(1) / options.fps, Instant::now());
    let mut video = None;
    while !stopped() && !QUIT.load(Ordering::Relaxed) {
        let asked = server.with_emulator(|emulator| emulator.gripper());
        if asked != jaws {
            let let_go = asked == Gripper::Open && cell.get().held.is_some();
            jaws = asked;
            cell.set_gripper(jaws, &pose());
            if let_go {
                put_in_view(&cell, &pose(), &mut next_place)?;
            }
        }
        if video.is_none() {
            let out = opened(options)?.map(BufWriter::new);
            video = out
                .map(|out| Y4mWriter::new(out, options.fps, 1))
                .transpose()?;
        }
        if let Some(out) = &mut video {
            camera.grab(&mut frame)?;
            match out.write(&frame) {
                // Another reader may come; the arm is served all the while.
                Err(error) if error.kind() == ErrorKind::BrokenPipe => video = None,
                written => written?,
            }
        }
        due = (due + period).max(Instant::now());
        thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    go_on()
}

/// Opens the output of the frames; `None` for a named pipe that nobody reads.
fn opened(options: &Options) -> Outcome<Option<Box<dyn Write>>> {
    let Some(path) = &options.video else {
        return Ok(Some(Box::new(io::stdout())));
    };
    let mut how = File::options();
    how.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut how, OFlags::NONBLOCK.bits() as i32);
    match how.open(path) {
        Ok(file) => {
            #[cfg(unix)]
            rustix::fs::fcntl_setfl(&file, OFlags::empty())?;
            Ok(Some(Box::new(file)))
        }
        #[cfg(unix)]
        Err(error) if error.raw_os_error() == Some(rustix::io::Errno::NXIO.raw_os_error()) => {
            Ok(None)
        }
        Err(error) => Err(format!("{}: {error}", path.display()).into()),
    }
}

/// Prints a line beside the frames, which may have standard output.
#[allow(clippy::print_stderr, reason = "standard output carries the frames")]
fn notice(words: &str) {
    eprintln!("{words}");
}

fn served(options: &Options, emulator: Emulator) -> Outcome<EmulatorServer> {
    let config = ServeConfig {
        realtime: options.realtime,
        link: options.link.clone(),
        ..ServeConfig::default()
    };
    match &options.tcp {
        Some(address) => Ok(EmulatorServer::tcp(address, emulator, config)
            .map_err(|error| format!("{address} cannot be listened at: {error}"))?),
        #[cfg(unix)]
        None => Ok(EmulatorServer::pty(emulator, config)?),
        #[cfg(not(unix))]
        None => Err("this system has no pseudo-terminals; give --tcp".into()),
    }
}

/// Puts the ball on a stand at a place that a search pose sees.
fn put_in_view(
    cell: &SharedCell,
    stands: &puma_val2::Joints,
    rng: &mut Xoshiro256PlusPlus,
) -> Outcome {
    for _ in 0..100 {
        if cell.place_ball(ball_in_view(cell, rng)?.centre, stands) {
            return Ok(());
        }
    }
    Err("the hand is everywhere in the way of a ball".into())
}

/// Carries out the lines on standard input.
fn attend(server: &EmulatorServer, cell: &SharedCell, rng: &mut Xoshiro256PlusPlus) {
    for line in io::stdin().lock().lines().map_while(Result::ok) {
        let joints = server.with_emulator(|emulator| emulator.joints());
        let links = cell.links(&joints);
        match line.trim() {
            "ball" => {
                if let Err(error) = put_in_view(cell, &links, rng) {
                    notice(&error.to_string());
                    continue;
                }
            }
            "jaws" => cell.with(|cell| cell.place_ball(cell.tool_point(&links))),
            "away" => cell.remove_ball(),
            "quit" => return QUIT.store(true, Ordering::Relaxed),
            "" => continue,
            other => {
                notice(&format!("{other}: unknown; ball, jaws, away or quit"));
                continue;
            }
        }
        notice(&format!("done: {}", line.trim()));
    }
}
