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
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use circle_scenes::patterns;
use circle_scenes::simple::{KINDS, Kind};
use clap::Parser;
use hough_heuristic::Circle;
use hough_heuristic::image::{GrayImage, ImageFormat};

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
    for kind in kinds.iter().filter(|_| !options.patterns) {
        for number in 0..options.frames {
            let (frame, balls) = kind.render(options.size, options.seed, number);
            let file = format!("{}_{number:03}.png", kind.name);
            save_png(&options.out.join(&file), &frame)?;
            writeln!(frames, "{file},{}", kind.name)?;
            for Circle { x, y, radius } in balls {
                writeln!(truth, "{file},{x:.4},{y:.4},{radius:.4}")?;
            }
        }
    }
    if options.patterns {
        let (width, height) = options.size;
        for (name, frame) in patterns::patterns(width, height) {
            let file = format!("{name}.png");
            save_png(&options.out.join(&file), &frame)?;
            writeln!(frames, "{file},patterns")?;
        }
    }
    save(&options.out.join("truth.csv"), truth.as_bytes())?;
    save(&options.out.join("frames.csv"), frames.as_bytes())?;
    Ok(())
}

fn save_png(path: &Path, frame: &GrayImage) -> Result<(), Box<dyn Error>> {
    let mut png = Cursor::new(Vec::new());
    frame.write_to(&mut png, ImageFormat::Png)?;
    save(path, png.get_ref())
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

/// Writes a file as a whole or not at all; what is there and is no regular file is written to as it
/// is.
fn save(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    let failed = |error| format!("{}: cannot be written: {error}", path.display());
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return Ok(std::fs::write(path, bytes).map_err(failed)?);
    }
    let unfinished = path.with_extension("part");
    let written =
        std::fs::write(&unfinished, bytes).and_then(|()| std::fs::rename(&unfinished, path));
    Ok(written.map_err(failed)?)
}
