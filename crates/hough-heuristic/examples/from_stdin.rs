//! Reads Y4M video from standard input and prints the circles of each frame as one line of JSON.
//!
//! ```text
//! ffmpeg -i balls.mp4 -f yuv4mpegpipe -pix_fmt yuv420p - |
//!     cargo run --release -p hough-heuristic --features serde --example from_stdin
//! ```

#![allow(clippy::print_stderr, reason = "a program for the terminal")]

use std::error::Error;
use std::io::{BufReader, Write, stdin, stdout};
use std::process::ExitCode;

use clap::Parser;
use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Acceptance, CircleDetector, Detection, FrameError, FrameSource, FrameStream, Heuristic,
    HeuristicConfig,
};
use serde::Serialize;

/// Finds circles in Y4M video from standard input; prints JSON lines.
#[derive(Parser)]
struct Options {
    /// Smallest radius, pixels.
    #[arg(long, default_value_t = 15.0)]
    min_radius: f64,
    /// Largest radius, pixels.
    #[arg(long, default_value_t = 300.0)]
    max_radius: f64,
    /// The most circles per frame.
    #[arg(long, default_value_t = 1)]
    max_circles: usize,
}

/// What is printed for a frame.
#[derive(Serialize)]
struct Line<'a> {
    /// Its number in the stream, from 1.
    frame: u64,
    /// Best first.
    circles: &'a [Detection],
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let mut detector = Heuristic::with_canny(HeuristicConfig {
        accept: Acceptance {
            min_radius: options.min_radius,
            max_radius: options.max_radius,
            max_circles: options.max_circles,
            ..Acceptance::default()
        },
        ..HeuristicConfig::default()
    })?;
    let mut frames = FrameStream::y4m(BufReader::new(stdin().lock()))?;
    let mut frame = GrayImage::default();
    for number in 1u64.. {
        match frames.grab(&mut frame) {
            Ok(()) => {}
            Err(FrameError::End) => break,
            Err(error) => return Err(error.into()),
        }
        let line = serde_json::to_string(&Line {
            frame: number,
            circles: detector.detect(&frame)?,
        })?;
        // A reader that has seen enough closes the pipe.
        if writeln!(stdout(), "{line}").is_err() {
            break;
        }
    }
    Ok(())
}
