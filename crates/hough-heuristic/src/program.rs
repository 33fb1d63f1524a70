//! The program `detect_circles`, which finds circles in image files (feature `program`).

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a program for the terminal"
)]

mod detector;
mod results;

use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Parser, ValueEnum};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::a_contrario::Rings;
use crate::frame::{Channel, FrameError, ImageFiles};
use crate::region::Region;
use detector::Staged;
use results::{Results, writable_folder};

/// Find circles in images: PNG, JPEG, PGM, BMP or (feature `tiff`) TIFF files, or folders of them.
///
/// Without --csv the circles are printed as a table. Coordinates are pixels of the picture as
/// viewers show it, (0,0) being the centre of the top-left pixel. The exit code is 1 when a file
/// could not be read or used; the others are processed all the same.
#[derive(Parser, Debug)]
#[command(name = "detect_circles")]
struct Options {
    /// Which detector to use
    #[arg(long, value_enum, default_value_t = DetectorName::AContrario)]
    detector: DetectorName,

    /// Smallest radius, pixels [default: 8, or 4 if small circles are seen; 8 for the other
    /// detectors]
    #[arg(long, value_name = "PX")]
    min_radius: Option<f64>,

    /// Largest radius, pixels [default: 0.52 of the shorter side; 280 for the other detectors]
    #[arg(long, value_name = "PX")]
    max_radius: Option<f64>,

    /// Most circles per image [default: all; 32 for the other detectors]
    #[arg(long, value_name = "N")]
    max_circles: Option<usize>,

    /// Least score [default: 0.5; for the other detectors, which call it theta, 0.65]
    #[arg(long, value_name = "S")]
    min_score: Option<f64>,

    /// Least distance between the centres of two circles, pixels [default: 0; 8 for the other
    /// detectors]
    #[arg(long, value_name = "PX")]
    min_distance: Option<f64>,

    /// Pixels in which the centre must lie
    #[arg(long, value_name = "LEFT,TOP,WIDTH,HEIGHT", value_parser = region)]
    region: Option<Region>,

    /// Part of coloured pictures that is searched
    #[arg(long, value_enum, default_value_t = Channel::Auto)]
    channel: Channel,

    /// Circles reported of those about one centre [default: all; a-contrario only]
    #[arg(long, value_enum)]
    rings: Option<Rings>,

    /// Least ratio of the axes: below 1 ellipses are found too [default: 1; a-contrario only]
    #[arg(long, value_name = "RATIO")]
    min_axis_ratio: Option<f64>,

    /// Least contrast of an edge, gray levels [default: 8; a-contrario only]
    #[arg(long, value_name = "LEVELS")]
    contrast: Option<f64>,

    /// Most draws per million pixels [default: 50000; a-contrario only]
    #[arg(long, value_name = "N")]
    draws: Option<u32>,

    /// Time limit, milliseconds per million pixels [default: none; a-contrario only]
    #[arg(long, value_name = "MS")]
    time_limit: Option<f64>,

    /// Detect N times in each image and report the least time
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    repeat: u32,

    /// Seed of the random sampling [default: 1; not for sht and sht-gradient, which draw nothing]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// Write the circles to FILE, a row a circle, best first; `-` is standard output. The columns
    /// are file,cx,cy,r,score and, from a-contrario, covered,visible,axis_ratio,centre_error,
    /// radius_error; with --min-axis-ratio also major,minor,angle,major_error,minor_error,
    /// angle_error: half-axes in pixels, angles in degrees from the x axis toward the y axis
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Write file,cpu_us,edges_us,structure_us,search_us to FILE: CPU time of this thread from gray
    /// image to circles, and the wall time of each stage of that run (not from a-contrario, whose
    /// stages overlap)
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,

    /// Write a picture of each stage (edges, structure D, candidates, accepted circles) to a folder
    /// per image in DIR
    #[arg(long, value_name = "DIR")]
    stages: Option<PathBuf>,

    /// Write every image in its colours with its circles drawn in to DIR, as PNG
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,

    /// Image files and folders
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum DetectorName {
    /// Pairs of edge points at several sizes, each circle proven against chance
    #[value(alias = "trusted")]
    AContrario,
    /// Three random edge pixels, belonging against a threshold (the paper's)
    Heuristic,
    /// The heuristic with all three pixels from the whole image, as the paper samples
    HeuristicAnywhere,
    /// Randomized Hough transform
    Rht,
    /// That transform with all three pixels from the whole image, as Xu and Oja sample
    RhtAnywhere,
    /// Standard Hough transform; takes seconds on large images
    Sht,
    /// Standard Hough transform that votes along the gradient
    ShtGradient,
}

fn region(text: &str) -> Result<Region, String> {
    let numbers: Result<Vec<u32>, _> = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect();
    match numbers.as_deref() {
        Ok(&[left, top, width, height]) => Ok(Region {
            left,
            top,
            width,
            height,
        }),
        _ => Err("give four whole numbers, LEFT,TOP,WIDTH,HEIGHT, such as 100,50,320,240".into()),
    }
}

/// Exit code of a program that a signal has stopped.
const STOPPED: u8 = 130;

/// Runs the program `detect_circles` with a command line, the program's name first, and returns its
/// exit code. It prints its results, and a usage message where the command line has an error. A
/// first SIGINT or SIGTERM ends it with the results so far, a second one at once.
pub fn run_detect_circles(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let options = match Options::try_parse_from(words) {
        Ok(options) => options,
        Err(error) => {
            // Help and version are such errors too; a reader may have gone away.
            let _ = error.print();
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // Without them a signal ends the program, as it does by default.
        let _ = flag::register_conditional_shutdown(signal, STOPPED.into(), Arc::clone(&stop));
        let _ = flag::register(signal, Arc::clone(&stop));
    }
    match process(&options, &stop) {
        _ if stop.load(Ordering::Relaxed) => {
            eprintln!("error: stopped by a signal; later images were not looked at");
            ExitCode::from(STOPPED)
        }
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Processes every image until `stop` is set; false when one could not be read.
fn process(options: &Options, stop: &AtomicBool) -> Result<bool, Box<dyn Error>> {
    let mut detector = options.detector()?;
    if let Some(folder) = &options.overlay {
        writable_folder(folder)?;
    }
    let mut results = Results::new(options);
    let mut all_read = true;
    let mut failed = |error: &dyn Error| {
        eprintln!("error: {error}");
        all_read = false;
    };
    for path in &options.paths {
        let mut files = match ImageFiles::open(path) {
            Ok(files) => files.with_channel(options.channel),
            Err(error) => {
                failed(&error);
                continue;
            }
        };
        while !stop.load(Ordering::Relaxed) {
            match image(&mut files, &mut *detector, &mut results) {
                Ok(()) => {}
                Err(Failure::Image(FrameError::End)) => break,
                Err(Failure::Image(error)) => failed(&error),
                Err(Failure::Output(error)) => return Err(error),
            }
        }
    }
    results.write()?;
    Ok(all_read)
}

/// The reasons why an image has no result: of the image, or of a file to be written.
enum Failure {
    Image(FrameError),
    Output(Box<dyn Error>),
}

/// Processes the next image.
fn image(
    files: &mut ImageFiles,
    detector: &mut dyn Staged,
    results: &mut Results<'_>,
) -> Result<(), Failure> {
    let picture = files.next_picture().map_err(Failure::Image)?;
    let colours = results.needs_colours().then(|| picture.to_rgb8());
    let frame = results.options.channel.gray(picture);
    let path = files.last_path().unwrap_or(Path::new("image"));
    if let Some(bits) = files.last_depth() {
        eprintln!(
            "warning: {}: its values of 16 bits use {bits} only; they are scaled up to white",
            path.display()
        );
    }
    let searched =
        detector::search(&frame, detector, results.options.repeat).map_err(|reason| {
            Failure::Image(FrameError::Failed {
                origin: path.display().to_string(),
                reason,
            })
        })?;
    results
        .add(path, &frame, colours, detector, &searched)
        .map_err(Failure::Output)
}
