//! Runs a detector over the images of a folder and writes what it finds, and the CPU time of every frame, as CSV.
//!
//! cargo run --release -p hough-heuristic --example measure -- frames/ --detections found.csv --times times.csv

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Acceptance, Canny, CannyConfig, CircleDetector, EdgeDetector, FrameError, FrameSource, Heuristic,
    HeuristicConfig, ImageFiles, ImageprocCanny, RandomizedHough, RandomizedHoughConfig, Sampling,
    StandardHough, StandardHoughConfig,
};

/// Measures a circle detector, or an edge detector alone, on image files.
#[derive(Parser)]
struct Options {
    /// Folder of images, or one image.
    frames: PathBuf,
    #[arg(long, value_enum, default_value = "heuristic")]
    detector: Kind,
    /// Where to write the circles: file,cx,cy,r,score.
    #[arg(long)]
    detections: Option<PathBuf>,
    /// Where to write the CPU times: file,cpu_us, the least of the repetitions.
    #[arg(long)]
    times: Option<PathBuf>,
    /// Folder to write edge images to, for the edge detectors.
    #[arg(long)]
    edges: Option<PathBuf>,
    #[arg(long, default_value_t = 5)]
    reps: u32,
    #[arg(long, default_value_t = 8.0)]
    min_radius: f64,
    #[arg(long, default_value_t = 280.0)]
    max_radius: f64,
}

#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    Canny,
    ImageprocCanny,
    Heuristic,
    /// The paper's own sampling, from the whole frame.
    HeuristicAnywhere,
    Rht,
    RhtAnywhere,
    Sht,
    ShtGradient,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let canny = Canny::new(CannyConfig::default())?;
    let accept = Acceptance {
        min_radius: options.min_radius,
        max_radius: options.max_radius,
        max_circles: 32,
        ..Acceptance::default()
    };
    let heuristic = |sampling| HeuristicConfig {
        min_radius: accept.min_radius,
        max_radius: accept.max_radius,
        max_circles: accept.max_circles,
        sampling,
        ..HeuristicConfig::default()
    };
    let rht = |sampling| RandomizedHoughConfig {
        accept,
        sampling,
        ..RandomizedHoughConfig::default()
    };
    let sht = |gradient| StandardHoughConfig {
        accept,
        gradient,
        ..StandardHoughConfig::default()
    };
    match options.detector {
        Kind::Canny => edges(&options, canny),
        Kind::ImageprocCanny => edges(&options, ImageprocCanny::new(30.0, 70.0)?),
        Kind::Heuristic => circles(&options, Heuristic::new(heuristic(Sampling::Near), canny)?),
        Kind::HeuristicAnywhere => circles(&options, Heuristic::new(heuristic(Sampling::Anywhere), canny)?),
        Kind::Rht => circles(&options, RandomizedHough::new(rht(Sampling::Near), canny)?),
        Kind::RhtAnywhere => circles(&options, RandomizedHough::new(rht(Sampling::Anywhere), canny)?),
        Kind::Sht => circles(&options, StandardHough::new(sht(false), canny)?),
        Kind::ShtGradient => circles(&options, StandardHough::new(sht(true), canny)?),
    }
}

fn edges(options: &Options, mut detector: impl EdgeDetector) -> Result<(), Box<dyn Error>> {
    let folder = options.edges.clone();
    each_frame(options, |name, frame, reps| {
        let micros = least_micros(reps, || {
            detector.detect_edges(frame);
        });
        if let Some(folder) = &folder {
            let file = PathBuf::from(name).with_extension("png");
            detector.edges().image().save(folder.join(file))?;
        }
        Ok(micros)
    })
}

fn circles(options: &Options, mut detector: impl CircleDetector) -> Result<(), Box<dyn Error>> {
    let mut detections = options
        .detections
        .as_ref()
        .map(File::create)
        .transpose()?
        .map(BufWriter::new);
    if let Some(file) = &mut detections {
        writeln!(file, "file,cx,cy,r,score")?;
    }
    let mut found = Vec::new();
    each_frame(options, |name, frame, reps| {
        let micros = least_micros(reps, || detector.detect_into(frame, &mut found));
        if let Some(file) = &mut detections {
            for detection in &found {
                let c = detection.circle;
                writeln!(
                    file,
                    "{name},{:.4},{:.4},{:.4},{:.4}",
                    c.x, c.y, c.radius, detection.score
                )?;
            }
        }
        Ok(micros)
    })
}

fn each_frame(
    options: &Options,
    mut measure: impl FnMut(&str, &GrayImage, u32) -> Result<f64, Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let mut times = options
        .times
        .as_ref()
        .map(File::create)
        .transpose()?
        .map(BufWriter::new);
    if let Some(file) = &mut times {
        writeln!(file, "file,cpu_us")?;
    }
    let mut files = ImageFiles::open(&options.frames)?;
    let mut all = Vec::new();
    loop {
        let frame = match files.grab() {
            Ok(frame) => frame,
            Err(FrameError::End) => break,
            Err(error) => {
                eprintln!("skipped: {error}");
                continue;
            }
        };
        let name = files
            .last_path()
            .and_then(|path| path.file_name())
            .unwrap_or_default();
        let name = name.to_string_lossy();
        let micros = measure(&name, &frame, options.reps)?;
        all.push(micros);
        if let Some(file) = &mut times {
            writeln!(file, "{name},{micros:.1}")?;
        }
    }
    all.sort_by(f64::total_cmp);
    let at = |share: f64| {
        all.get(((all.len() - 1) as f64 * share) as usize)
            .copied()
            .unwrap_or_default()
    };
    println!(
        "{} frames, CPU us: median {:.0}, 95 % {:.0}, most {:.0}",
        all.len(),
        at(0.5),
        at(0.95),
        at(1.0)
    );
    Ok(())
}

/// CPU time of this process, the least over the repetitions, microseconds.
fn least_micros(reps: u32, mut work: impl FnMut()) -> f64 {
    let now = || {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
    };
    (0..reps.max(1))
        .map(|_| {
            let start = now();
            work();
            now() - start
        })
        .fold(f64::INFINITY, f64::min)
}
