//! Writes the edge images of a folder of frames, and the CPU time of every frame as CSV.
//!
//! ```text
//! cargo run --release -p circle-benches --features imageproc --example edges -- \
//!     frames/ --edges edges/ --times times.csv
//! ```

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "what an example is for"
)]

use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use circle_benches::least_cpu_time;
use clap::{Parser, ValueEnum};
use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Canny, CannyConfig, EdgeDetector, FrameError, FrameSource, ImageFiles, ImageprocCanny,
};

/// Finds the edges of image files.
#[derive(Parser)]
struct Options {
    /// Folder of images, or one image.
    frames: PathBuf,
    #[arg(long, value_enum, default_value = "canny")]
    operator: Operator,
    /// Folder, which must exist, to write the edge images to.
    #[arg(long)]
    edges: Option<PathBuf>,
    /// File for file,cpu_us,low,high: the least CPU time of the repetitions, and the
    /// thresholds of the frame.
    #[arg(long)]
    times: Option<PathBuf>,
    #[arg(long, default_value_t = 5)]
    reps: u32,
    /// Lower threshold of the gradient.
    #[arg(long, default_value_t = 30.0)]
    low: f32,
    /// Upper threshold of the gradient.
    #[arg(long, default_value_t = 70.0)]
    high: f32,
    /// Factor by which the frame's noise raises the thresholds; 0 keeps them.
    #[arg(long, default_value_t = 5.0)]
    noise_factor: f32,
}

#[derive(Clone, Copy, ValueEnum)]
enum Operator {
    /// The crate's own.
    Canny,
    /// That of the crate imageproc.
    Imageproc,
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
    let &Options {
        low,
        high,
        noise_factor,
        ..
    } = options;
    let config = CannyConfig {
        low,
        high,
        noise_factor,
        ..CannyConfig::default()
    };
    let (mut own, mut other) = (Canny::new(config)?, ImageprocCanny::new(low, high)?);
    let mut files = ImageFiles::open(&options.frames)?;
    let (mut table, mut all) = (String::from("file,cpu_us,low,high\n"), Vec::new());
    let mut frame = GrayImage::default();
    loop {
        match files.grab(&mut frame) {
            Ok(()) => {}
            Err(FrameError::End) => break,
            Err(error) => {
                eprintln!("skipped: {error}");
                continue;
            }
        }
        let name = files.last_path().and_then(|path| path.file_name());
        let name = PathBuf::from(name.unwrap_or_default());
        let detector: &mut dyn EdgeDetector = match options.operator {
            Operator::Canny => &mut own,
            Operator::Imageproc => &mut other,
        };
        let time = least_cpu_time(options.reps, || {
            detector.detect_edges(&frame);
        });
        let micros = 1e6 * time.as_secs_f64();
        all.push(micros);
        if let Some(folder) = &options.edges {
            let path = folder.join(name.with_extension("png"));
            detector.edges().image().save(path)?;
        }
        let (low, high) = match options.operator {
            Operator::Canny => own.thresholds(),
            Operator::Imageproc => (low, high),
        };
        writeln!(table, "{},{micros:.1},{low:.2},{high:.2}", name.display())?;
    }
    if let Some(path) = &options.times {
        std::fs::write(path, table)?;
    }
    all.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = all.get((all.len() as f64 * share) as usize);
        place.or(all.last()).copied().unwrap_or_default()
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
