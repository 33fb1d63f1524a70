//! Renders the scenes on which circle detectors are compared: PNG files, the circles they show, and what kind each is of.
//!
//! ```text
//! cargo run --release -p hough-heuristic --example scenes -- --out out/scenes --frames 20 --seed 1 --size 768x576
//! ```
//!
//! writes `out/scenes/KIND_NNN.png`, `truth.csv` (file,cx,cy,r; (0, 0) is the centre of the top-left pixel) and `frames.csv` (file,scene). A frame
//! depends on its kind, its number, the seed and the size. Lengths scale with the size; the smallest radius does down to 6 px.

#![allow(clippy::print_stderr, reason = "what an example is for")]

#[path = "../scenes/scenes.rs"]
mod scenes;
#[path = "../scenes/simple.rs"]
mod simple;

use std::error::Error;
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use hough_heuristic::Circle;
use hough_heuristic::image::ImageFormat;

use simple::{KINDS, Kind};

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
    for kind in kinds {
        for number in 0..options.frames {
            let (frame, balls) = kind.render(options.size, options.seed, number);
            let file = format!("{}_{number:03}.png", kind.name);
            let mut png = Cursor::new(Vec::new());
            frame.write_to(&mut png, ImageFormat::Png)?;
            save(&options.out.join(&file), png.get_ref())?;
            writeln!(frames, "{file},{}", kind.name)?;
            for Circle { x, y, radius } in balls {
                writeln!(truth, "{file},{x:.4},{y:.4},{radius:.4}")?;
            }
        }
    }
    save(&options.out.join("truth.csv"), truth.as_bytes())?;
    save(&options.out.join("frames.csv"), frames.as_bytes())?;
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
    KINDS.into_iter().find(|kind| kind.name == name).ok_or_else(|| {
        let names = KINDS.map(|kind| kind.name).join(", ");
        format!("no such kind; there are {names}")
    })
}

/// Writes a file as a whole or not at all.
fn save(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let unfinished = path.with_extension("part");
    std::fs::write(&unfinished, bytes)?;
    std::fs::rename(unfinished, path)
}
