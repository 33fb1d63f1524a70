//! The program `detect_circles`, which finds circles in image files (feature `cli`).

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a program for the terminal"
)]

use std::collections::HashSet;
use std::error::Error;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use image::GrayImage;

use crate::a_contrario::{AContrario, AContrarioConfig};
use crate::acceptance::Acceptance;
use crate::circle::Circle;
use crate::detect::{CircleDetector, Detection};
use crate::edges::{Canny, EdgeDetector};
use crate::frame::{FrameError, FrameSource, ImageFiles};
use crate::output::{write_png, write_whole};
use crate::stages::{Stages, with_circles};
use crate::transforms::{
    Heuristic, HeuristicConfig, RandomizedHough, RandomizedHoughConfig, StandardHough,
    StandardHoughConfig,
};

/// Find circles in images: PNG, JPEG or PGM files, color turned to luma, or folders of them.
///
/// Without --csv the circles are printed as a table. Coordinates are pixels, (0,0) being the centre
/// of the top-left pixel. The exit code is 1 when a file could not be read or used; the others are
/// processed all the same.
#[derive(Parser, Debug)]
struct Options {
    /// Which detector to use
    #[arg(long, value_enum, default_value_t = DetectorName::AContrario)]
    detector: DetectorName,

    /// Smallest radius, pixels
    #[arg(long, value_name = "PX", default_value_t = 8.0)]
    min_radius: f64,

    /// Largest radius, pixels
    #[arg(long, value_name = "PX", default_value_t = 280.0)]
    max_radius: f64,

    /// Most circles per image
    #[arg(long, value_name = "N", default_value_t = 32)]
    max_circles: usize,

    /// Detect N times in each image and report the least time
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    repeat: u32,

    /// Seed of the random sampling
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Write file,cx,cy,r,score to FILE, a row a circle, best first; `-` is standard output
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Write file,cpu_us,edges_us,structure_us,search_us to FILE: CPU time of this thread from gray
    /// image to circles, and the wall time of each stage of that run
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,

    /// Write a picture of each stage (edges, structure D, candidates, accepted circles) to a folder
    /// per image in DIR
    #[arg(long, value_name = "DIR")]
    stages: Option<PathBuf>,

    /// Write every image with its circles drawn in to DIR, as PNG
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,

    /// Image files and folders
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
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

/// Runs the program `detect_circles` with a command line, the program's name first, and returns its
/// exit code. It prints its results, and a usage message where the command line has an error.
pub fn run(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let options = match Options::try_parse_from(words) {
        Ok(options) => options,
        Err(error) => {
            // Help and version are such errors too; a reader may have gone away.
            let _ = error.print();
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    match process(&options) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Processes every image; false when one could not be read.
fn process(options: &Options) -> Result<bool, Box<dyn Error>> {
    let mut detector = detector(options)?;
    if let Some(folder) = &options.overlay {
        writable_folder(folder)?;
    }
    let mut results = Results::default();
    let (mut all_read, mut frame) = (true, GrayImage::default());
    for path in &options.paths {
        let mut files = match ImageFiles::open(path) {
            Ok(files) => files,
            Err(error) => {
                eprintln!("error: {error}");
                all_read = false;
                continue;
            }
        };
        loop {
            match files.grab(&mut frame) {
                Ok(()) => {
                    let path = files.last_path().unwrap_or(path);
                    match search(&frame, &mut *detector, options.repeat) {
                        Ok(searched) => results.add(path, &frame, &*detector, searched, options)?,
                        Err(reason) => {
                            eprintln!("error: {}: {reason}", path.display());
                            all_read = false;
                        }
                    }
                }
                Err(FrameError::End) => break,
                Err(error) => {
                    eprintln!("error: {error}");
                    all_read = false;
                }
            }
        }
    }
    results.write(options)?;
    Ok(all_read)
}

/// A detector that may show the stages of its last frame.
trait Staged: CircleDetector {
    fn stages(&self) -> Option<Stages<'_>> {
        None
    }

    fn keep_candidates(&mut self, _keep: bool) {}
}

impl Staged for AContrario {}

macro_rules! staged {
    ($($detector:ident)*) => {$(
        impl<E: EdgeDetector> Staged for $detector<E> {
            fn stages(&self) -> Option<Stages<'_>> {
                Some(self.stages())
            }

            fn keep_candidates(&mut self, keep: bool) {
                self.keep_candidates(keep);
            }
        }
    )*};
}

staged!(Heuristic RandomizedHough StandardHough);

/// The circles of one frame.
struct Searched {
    found: Vec<Detection>,
    cpu: Duration,
    /// Times of the edges, of the structure and of the search, where the detector shows them.
    stages: Option<[Duration; 3]>,
}

/// Searches a frame `repeat` times and takes the least time.
fn search(frame: &GrayImage, detector: &mut dyn Staged, repeat: u32) -> Result<Searched, String> {
    if frame.is_empty() {
        return Err("the image has no pixels".into());
    }
    let mut searched = Searched {
        found: Vec::new(),
        cpu: Duration::MAX,
        stages: None,
    };
    for _ in 0..repeat {
        let before = cpu_time();
        let found = detector.detect(frame).map_err(|error| error.to_string())?;
        let spent = cpu_time().saturating_sub(before);
        if spent < searched.cpu {
            searched.found = found.to_vec();
            searched.cpu = spent;
            searched.stages = detector.stages().map(|stages| {
                let Stages {
                    edge_time,
                    structure_time,
                    search_time,
                    ..
                } = stages;
                [edge_time, structure_time, search_time]
            });
        }
    }
    Ok(searched)
}

/// The results so far.
#[derive(Default)]
struct Results {
    csv: String,
    times: String,
    overlays: HashSet<String>,
    stages: HashSet<String>,
}

impl Results {
    /// Finds the circles of one frame.
    fn add(
        &mut self,
        path: &Path,
        frame: &GrayImage,
        detector: &dyn Staged,
        searched: Searched,
        options: &Options,
    ) -> Result<(), Box<dyn Error>> {
        let Searched { found, cpu, stages } = searched;
        let name = path.display().to_string();
        for Detection { circle, score } in &found {
            let Circle { x, y, radius } = circle;
            writeln!(
                self.csv,
                "{},{x:.3},{y:.3},{radius:.3},{score:.4}",
                quoted(&name)
            )?;
        }
        let micros = |time: Duration| format!("{:.1}", time.as_secs_f64() * 1e6);
        let [edges, structure, search] =
            stages.map_or_else(Default::default, |times| times.map(micros));
        writeln!(
            self.times,
            "{},{},{edges},{structure},{search}",
            quoted(&name),
            micros(cpu)
        )?;
        if options.csv.is_none() {
            print_table(&name, &found, cpu, stages);
        }
        if let Some(folder) = &options.stages {
            let folder = folder.join(unused_name(path, "", &mut self.stages));
            writable_folder(&folder)?;
            let stages = detector
                .stages()
                .ok_or("this detector does not show its stages")?;
            stages.write(&folder, frame, &found)?;
        }
        if let Some(folder) = &options.overlay {
            let name = unused_name(path, ".png", &mut self.overlays);
            write_png(&folder.join(name), &with_circles(frame, &found))?;
        }
        Ok(())
    }

    /// Writes the files that were asked for.
    fn write(&self, options: &Options) -> Result<(), Box<dyn Error>> {
        let csv = format!("file,cx,cy,r,score\n{}", self.csv);
        match &options.csv {
            Some(path) if path.as_os_str() == "-" => print_out(&csv),
            Some(path) => write_whole(path, csv.as_bytes())?,
            None => {}
        }
        if let Some(path) = &options.times {
            let header = "file,cpu_us,edges_us,structure_us,search_us";
            write_whole(path, format!("{header}\n{}", self.times).as_bytes())?;
        }
        Ok(())
    }
}

fn detector(options: &Options) -> Result<Box<dyn Staged>, Box<dyn Error>> {
    let accept = Acceptance {
        min_radius: options.min_radius,
        max_radius: options.max_radius,
        max_circles: options.max_circles,
        ..Acceptance::default()
    };
    let heuristic = |anywhere| {
        Heuristic::with_canny(HeuristicConfig {
            accept,
            seed: options.seed,
            anywhere,
            ..HeuristicConfig::default()
        })
    };
    let randomized = |anywhere| {
        let config = RandomizedHoughConfig {
            accept,
            seed: options.seed,
            anywhere,
            ..RandomizedHoughConfig::default()
        };
        RandomizedHough::new(config, Canny::default())
    };
    let standard = |gradient| {
        let config = StandardHoughConfig {
            accept,
            gradient,
            ..StandardHoughConfig::default()
        };
        StandardHough::new(config, Canny::default())
    };
    let mut detector: Box<dyn Staged> = match options.detector {
        DetectorName::AContrario => Box::new(AContrario::new(AContrarioConfig {
            min_radius: accept.min_radius,
            max_radius: accept.max_radius,
            max_circles: accept.max_circles,
            seed: options.seed,
            ..AContrarioConfig::default()
        })?),
        DetectorName::Heuristic => Box::new(heuristic(false)?),
        DetectorName::HeuristicAnywhere => Box::new(heuristic(true)?),
        DetectorName::Rht => Box::new(randomized(false)?),
        DetectorName::RhtAnywhere => Box::new(randomized(true)?),
        DetectorName::Sht => Box::new(standard(false)?),
        DetectorName::ShtGradient => Box::new(standard(true)?),
    };
    detector.keep_candidates(options.stages.is_some());
    Ok(detector)
}

fn print_table(name: &str, found: &[Detection], cpu: Duration, stages: Option<[Duration; 3]>) {
    let millis = |time: Duration| time.as_secs_f64() * 1e3;
    let mut table = format!("{name}: {} circles, {:.2} ms", found.len(), millis(cpu));
    if let Some([edges, structure, search]) = stages {
        table.push_str(&format!(
            " (edges {:.2}, structure {:.2}, search {:.2})",
            millis(edges),
            millis(structure),
            millis(search)
        ));
    }
    table.push('\n');
    for Detection {
        circle: Circle { x, y, radius },
        score,
    } in found
    {
        table.push_str(&format!(
            "  x {x:8.2}  y {y:8.2}  r {radius:7.2}  score {score:.3}\n"
        ));
    }
    print_out(&table);
}

/// Prints; a reader who has gone away is no reason to stop.
fn print_out(text: &str) {
    let _ = std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes());
}

/// Creates the folder if need be, and checks that files can be written into it.
fn writable_folder(folder: &Path) -> Result<(), String> {
    let probe = folder.join(".writable.part");
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&probe, b""))
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| format!("{}: cannot be written to: {error}", folder.display()))
}

/// A CSV field: in quotes where the name has a comma, a quote or a line break in it.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

/// A name for what belongs to the image `path` that nothing of this run has yet.
fn unused_name(path: &Path, ending: &str, taken: &mut HashSet<String>) -> String {
    let stem = path
        .file_stem()
        .map_or("image".into(), |stem| stem.to_string_lossy().into_owned());
    let mut name = format!("{stem}{ending}");
    let mut number = 2;
    while !taken.insert(name.clone()) {
        name = format!("{stem}-{number}{ending}");
        number += 1;
    }
    name
}

/// CPU time of this thread.
#[cfg(unix)]
fn cpu_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Time on the wall where the system's CPU time is not at hand.
#[cfg(not(unix))]
fn cpu_time() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}
