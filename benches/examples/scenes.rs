//! Renders the scenes on which circle detectors are compared: PNG files, the circles they show, and
//! what kind each is of.
//!
//! ```text
//! cargo run --release -p circle-benches --example scenes -- \
//!     --out out/scenes --frames 20 --seed 1 --size 768x576
//! ```
//!
//! writes `out/scenes/KIND_NNN.png`, `truth.csv` (file,cx,cy,r; (0, 0) is the centre of the
//! top-left pixel) and `frames.csv` (file,scene). A frame depends on its kind, its number, the seed
//! and the size. Lengths scale with the size; the smallest radius does down to 6 px.

#![allow(clippy::print_stderr, reason = "what an example is for")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use circle_scenes::patterns;
use circle_scenes::simple::{KINDS, Kind};
use clap::Parser;
use hough_heuristic::Circle;
use hough_heuristic::image::GrayImage;

/// Renders scenes with one difficulty each.
#[derive(Parser)]
struct Options {
    /// Folder to write to; made if it is not there.
    #[arg(long)]
    out: PathBuf,
    /// Frames of each kind.
    #[arg(long, default_value_t = 20)]
    frames: u64,
    /// Same seed, same files.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Width and height, pixels.
    #[arg(long, default_value = "768x576", value_parser = size)]
    size: (u32, u32),
    /// Kinds of scenes, separated by commas; all unless told otherwise.
    #[arg(long, value_delimiter = ',', value_parser = kind)]
    kinds: Vec<Kind>,
    /// Instead patterns that wear out detectors, one frame each: noise, texture, stripes, rings,
    /// which hold no circle that counts.
    #[arg(long)]
    patterns: bool,
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
    std::fs::create_dir_all(&options.out)?;
    let mut truth = String::from("file,cx,cy,r\n");
    let mut frames = String::from("file,scene\n");
    let kinds = if options.kinds.is_empty() {
        &KINDS[..]
    } else {
        &options.kinds
    };
    let failed = |file: &str, error: &dyn Error| {
        format!(
            "{}: cannot be written: {error}",
            options.out.join(file).display()
        )
    };
    let save = |file: &str, frame: &GrayImage| {
        let saved = frame.save(options.out.join(file));
        saved.map_err(|error| failed(file, &error))
    };
    for kind in kinds.iter().filter(|_| !options.patterns) {
        for number in 0..options.frames {
            let (frame, balls) = kind.render(options.size, options.seed, number);
            let file = format!("{}_{number:03}.png", kind.name);
            save(&file, &frame)?;
            writeln!(frames, "{file},{}", kind.name)?;
            for Circle { x, y, radius } in balls {
                writeln!(truth, "{file},{x:.4},{y:.4},{radius:.4}")?;
            }
        }
    }
    if options.patterns {
        let (width, height) = options.size;
        for (name, frame) in patterns::patterns(width, height) {
            save(&format!("{name}.png"), &frame)?;
            writeln!(frames, "{name}.png,patterns")?;
        }
    }
    for (file, table) in [("truth.csv", truth), ("frames.csv", frames)] {
        let written = std::fs::write(options.out.join(file), table);
        written.map_err(|error| failed(file, &error))?;
    }
    Ok(())
}

/// Width and height, as in `768x576`.
fn size(text: &str) -> Result<(u32, u32), String> {
    let number = |part: &str| part.parse().ok().filter(|n| (32..=8192).contains(n));
    text.split_once('x')
        .and_then(|(width, height)| Some((number(width)?, number(height)?)))
        .ok_or_else(|| format!("{text} is not a size such as 768x576, of 32 to 8192 pixels each"))
}

fn kind(name: &str) -> Result<Kind, String> {
    KINDS
        .into_iter()
        .find(|kind| kind.name == name)
        .ok_or_else(|| {
            let names = KINDS.map(|kind| kind.name).join(", ");
            format!("no such kind; there are {names}")
        })
}
