//! Renders labelled frames of the simulated cell: PNG files, the exact circles they show, and which scene each belongs to.
//!
//! ```text
//! cargo run --release --example render_dataset -- --out out/rendered --frames 20
//! cargo run --release --example render_dataset -- --out out/benchmark --kinds benchmark --size 1920x1080
//! ```
//!
//! writes `out/rendered/KIND_NNN.png`, `truth.csv` (file,cx,cy,r,what,visible) and `frames.csv` (file,scene). (0, 0) is the centre of the
//! top-left pixel. Truth holds every outline that is round to 5 % (axis ratio), at least 60 % visible and at least 5 px in radius (of a
//! frame 768 wide; balls of the benchmark kinds always): the ball (`Target`) and whatever else is round, since a detector that finds the
//! rim of a disc seen from above is right. What is less visible (`--visible`) has no row: a frame whose ball is just below that shows most of
//! a ball, yet looks empty in the truth. Ask for `--visible 0` and judge by the column `visible` where that matters.
//!
//! Kinds are those of `SceneKind` (the arm at work, as hard as it gets there), and those of `BenchmarkKind` (one difficulty at a time), with
//! `cell` and `benchmark` for all of either. A kind's frames depend on the seed and on nothing else, whatever other kinds are drawn.

#![allow(clippy::print_stdout)] // What it measured is what it prints.

use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, Parser};
use image::ImageFormat;
use indicatif::{ProgressBar, ProgressStyle};
use pipeline_sim::{BenchmarkKind, Camera, Renderer, Round, Scene, SceneKind, Sighting, Snapshot};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rustix::time::{ClockId, clock_gettime};

/// Renders labelled frames of the simulated cell.
#[derive(Parser)]
struct Options {
    /// Folder to write to; made if it is not there.
    #[arg(long, default_value = "out/rendered")]
    out: PathBuf,
    /// Frames of each kind.
    #[arg(long, default_value_t = 20)]
    frames: u64,
    /// Kinds of scenes, separated by commas, each once; `cell` and `benchmark` stand for all of theirs.
    #[arg(long, value_delimiter = ',', default_value = "cell")]
    kinds: Vec<Kinds>,
    /// Width and height of the frames, pixels.
    #[arg(long, default_value = "768x576", value_parser = size)]
    size: (u32, u32),
    /// Frames that share a scene (table, lamps, things); ball and pose are new in every frame. Benchmark frames share nothing.
    #[arg(long, default_value_t = 5)]
    per_scene: u64,
    /// Seed: same seed, same files.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Least visible share of an outline in the truth, 0 to 1. A frame whose ball is less visible has no row for it and looks empty; with 0
    /// everything that shows at all is listed.
    #[arg(long, default_value_t = 0.6, value_parser = share)]
    visible: f64,
}

/// A kind of frame.
#[derive(Clone, Copy)]
enum Kind {
    Cell(SceneKind),
    Benchmark(BenchmarkKind),
}

/// One or several kinds, as given on the command line.
#[derive(Clone)]
struct Kinds(Vec<Kind>);

impl FromStr for Kinds {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let all_of_cell = SceneKind::ALL.map(Kind::Cell);
        let all_of_benchmark = BenchmarkKind::ALL.map(Kind::Benchmark);
        Ok(Self(match (name, name.parse(), name.parse()) {
            ("cell", ..) => all_of_cell.to_vec(),
            ("benchmark", ..) => all_of_benchmark.to_vec(),
            (_, Ok(kind), _) => vec![Kind::Cell(kind)],
            (_, _, Ok(kind)) => vec![Kind::Benchmark(kind)],
            (_, Err(of_cell), Err(of_benchmark)) => {
                return Err(format!(
                    "unknown kind; known are cell: {}; benchmark: {}",
                    of_cell.known, of_benchmark.known
                ));
            }
        }))
    }
}

impl Kind {
    fn name(self) -> String {
        match self {
            Self::Cell(kind) => kind.to_string(),
            Self::Benchmark(kind) => kind.to_string(),
        }
    }

    /// A generator that no other kind and no other seed shares.
    fn generator(self, seed: u64) -> Xoshiro256PlusPlus {
        // FNV-1a over the name and the seed.
        let bytes = self.name().into_bytes().into_iter().chain(seed.to_le_bytes());
        let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Xoshiro256PlusPlus::seed_from_u64(hash)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let kinds: Vec<Kind> = options.kinds.iter().flat_map(|k| k.0.clone()).collect();
    if let Some(name) = repeated(&kinds) {
        let message = format!(
            "the kind {name} is asked for more than once (`cell` and `benchmark` stand for all of theirs)"
        );
        Options::command()
            .error(ErrorKind::ValueValidation, message)
            .exit();
    }
    std::fs::create_dir_all(&options.out)?;
    let mut truth = String::from("file,cx,cy,r,what,visible\n");
    let mut frames = String::from("file,scene\n");
    let bar = ProgressBar::new(kinds.len() as u64 * options.frames)
        .with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}")?);
    let (width, height) = options.size;
    for kind in kinds {
        let name = kind.name();
        let mut rng = kind.generator(options.seed);
        let mut shared: Option<Renderer> = None;
        let mut milliseconds = Vec::new();
        for i in 0..options.frames {
            let (mut renderer, snapshot) = match kind {
                Kind::Cell(kind) => {
                    let shared = shared.take().filter(|_| i % options.per_scene.max(1) != 0);
                    let renderer = shared
                        .unwrap_or_else(|| Renderer::new(&Scene::generate(kind, &mut rng), rng.random()));
                    (renderer, Snapshot::draw(kind, &mut rng).resized(width, height)?)
                }
                Kind::Benchmark(kind) => {
                    let (scene, snapshot) = kind.draw(options.size, &mut rng)?;
                    (Renderer::new(&scene, rng.random()), snapshot)
                }
            };
            let file = format!("{name}_{i:03}.png");
            let before = cpu_seconds();
            let frame = snapshot.take(&mut renderer);
            milliseconds.push(1000.0 * (cpu_seconds() - before));
            let mut png = std::io::Cursor::new(Vec::new());
            frame.write_to(&mut png, ImageFormat::Png)?;
            save(&options.out.join(&file), png.get_ref())?;
            writeln!(frames, "{file},{name}")?;
            let sightings = snapshot.truth(&renderer);
            let scale = snapshot.cell.camera.focal_px() / Camera::paper().focal_px();
            let least = match kind {
                Kind::Cell(_) => 5.0 * scale,
                Kind::Benchmark(_) => 0.0,
            };
            for sighting in sightings.iter().filter(|s| counts(s, options.visible, least)) {
                let circle = sighting.ellipse.circle();
                writeln!(
                    truth,
                    "{file},{:.3},{:.3},{:.3},{:?},{:.2}",
                    circle.x, circle.y, circle.radius, sighting.what, sighting.visible
                )?;
            }
            shared = Some(renderer);
            bar.inc(1);
        }
        milliseconds.sort_by(f64::total_cmp);
        if let (Some(least), Some(median)) = (milliseconds.first(), milliseconds.get(milliseconds.len() / 2))
        {
            bar.suspend(|| println!("{name:20} CPU {least:.1} ms a frame at best, {median:.1} ms median"));
        }
    }
    save(&options.out.join("truth.csv"), truth.as_bytes())?;
    save(&options.out.join("frames.csv"), frames.as_bytes())?;
    bar.finish_with_message(format!("in {}", options.out.display()));
    Ok(())
}

/// Whether an outline is one that a detector should find.
fn counts(sighting: &Sighting, visible: f64, least_radius: f64) -> bool {
    let ellipse = &sighting.ellipse;
    let round = matches!(sighting.what, Round::Target | Round::Ball) || ellipse.minor >= 0.95 * ellipse.major;
    round && sighting.visible >= visible && ellipse.circle().radius >= least_radius
}

/// The first kind that is named twice: its files would be written over.
fn repeated(kinds: &[Kind]) -> Option<String> {
    let names: Vec<String> = kinds.iter().map(|kind| kind.name()).collect();
    let again = (1..names.len()).find(|i| names[..*i].contains(&names[*i]));
    again.map(|i| names[i].clone())
}

/// A share of a whole.
fn share(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok().filter(|share| (0.0..=1.0).contains(share));
    number.ok_or_else(|| format!("{text} is not a share from 0 to 1"))
}

/// Width and height, as in `768x576`.
fn size(text: &str) -> Result<(u32, u32), String> {
    let number = |part: &str| part.parse().ok().filter(|n| (16..=8192).contains(n));
    text.split_once('x')
        .and_then(|(width, height)| Some((number(width)?, number(height)?)))
        .ok_or_else(|| format!("{text} is not a size such as 768x576, from 16 to 8192 pixels each"))
}

/// Writes a file as a whole or not at all.
fn save(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let folder = path.parent().unwrap_or_else(|| Path::new("."));
    let mut builder = tempfile::Builder::new();
    // As any new file: the process's mask is applied to it.
    builder.permissions(std::fs::Permissions::from_mode(0o666));
    let mut unfinished = builder.tempfile_in(folder)?;
    unfinished.write_all(bytes)?;
    unfinished.persist(path)?;
    Ok(())
}

/// CPU time of this process.
fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(list: &str) -> Vec<Kind> {
        let kinds = list.split(',').map(|name| name.parse::<Kinds>().expect("known"));
        kinds.flat_map(|k| k.0).collect()
    }

    #[test]
    fn shares_and_kinds_that_make_no_sense_are_refused() {
        for text in ["-0.1", "1.01", "nan", "inf", "much"] {
            let refused = share(text).expect_err("no share");
            assert!(refused.contains(text), "{refused}");
        }
        assert_eq!(share("0"), Ok(0.0));
        assert_eq!(share("1"), Ok(1.0));
        assert_eq!(repeated(&kinds("cell,benchmark")), None);
        assert_eq!(repeated(&kinds("cell,plain")).as_deref(), Some("plain"));
        assert_eq!(repeated(&kinds("clean,many,clean")).as_deref(), Some("clean"));
    }
}
