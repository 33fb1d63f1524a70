//! Renders labelled frames of the simulated cell: PNG files, the exact circles they show, and which scene each belongs to.
//!
//! ```text
//! cargo run --release --example render_dataset -- --out out/rendered --frames 20
//! ```
//!
//! writes `out/rendered/KIND_NNN.png`, `truth.csv` (file,cx,cy,r,what,visible) and `frames.csv` (file,scene). (0, 0) is the centre of the
//! top-left pixel. Truth holds every outline that is round to 5 % (axis ratio), at least 60 % visible and at least 5 px in radius:
//! the ball (`Target`) and whatever else is round, since a detector that finds the rim of a disc seen from above is right.

#![allow(clippy::print_stdout)] // What it measured is what it prints.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Parser;
use image::ImageFormat;
use indicatif::{ProgressBar, ProgressStyle};
use pipeline_sim::{Renderer, Round, Scene, SceneKind, Sighting, Snapshot};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
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
    /// Kinds of scenes [default: all].
    #[arg(long, value_delimiter = ',')]
    kinds: Vec<SceneKind>,
    /// Frames that share a scene (table, lamps, things); ball and pose are new in every frame.
    #[arg(long, default_value_t = 5)]
    per_scene: u64,
    /// Seed: same seed, same files.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Least visible share of an outline in the truth.
    #[arg(long, default_value_t = 0.6)]
    visible: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let kinds = if options.kinds.is_empty() {
        SceneKind::ALL.to_vec()
    } else {
        options.kinds.clone()
    };
    std::fs::create_dir_all(&options.out)?;
    let mut truth = String::from("file,cx,cy,r,what,visible\n");
    let mut frames = String::from("file,scene\n");
    let bar = ProgressBar::new(kinds.len() as u64 * options.frames)
        .with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}")?);
    for kind in kinds {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed ^ ((kind as u64 + 1) << 32));
        let mut renderer = None;
        let mut milliseconds = Vec::new();
        for i in 0..options.frames {
            if i % options.per_scene.max(1) == 0 {
                renderer = Some(Renderer::new(
                    &Scene::generate(kind, &mut rng),
                    options.seed.wrapping_add(i),
                ));
            }
            let Some(renderer) = renderer.as_mut() else {
                continue;
            };
            let snapshot = Snapshot::draw(kind, &mut rng);
            let file = format!("{kind}_{i:03}.png");
            let before = cpu_seconds();
            let frame = snapshot.take(renderer);
            milliseconds.push(1000.0 * (cpu_seconds() - before));
            let mut png = std::io::Cursor::new(Vec::new());
            frame.write_to(&mut png, ImageFormat::Png)?;
            save(&options.out.join(&file), png.get_ref())?;
            writeln!(frames, "{file},{kind}")?;
            for sighting in snapshot
                .truth(renderer)
                .iter()
                .filter(|s| counts(s, options.visible))
            {
                let circle = sighting.ellipse.circle();
                writeln!(
                    truth,
                    "{file},{:.3},{:.3},{:.3},{:?},{:.2}",
                    circle.x, circle.y, circle.radius, sighting.what, sighting.visible
                )?;
            }
            bar.inc(1);
        }
        milliseconds.sort_by(f64::total_cmp);
        if let (Some(least), Some(median)) = (milliseconds.first(), milliseconds.get(milliseconds.len() / 2))
        {
            bar.suspend(|| println!("{kind:12} CPU {least:.1} ms a frame at best, {median:.1} ms median"));
        }
    }
    save(&options.out.join("truth.csv"), truth.as_bytes())?;
    save(&options.out.join("frames.csv"), frames.as_bytes())?;
    bar.finish_with_message(format!("in {}", options.out.display()));
    Ok(())
}

/// Whether an outline is one that a detector should find.
fn counts(sighting: &Sighting, visible: f64) -> bool {
    let ellipse = &sighting.ellipse;
    let round = matches!(sighting.what, Round::Target | Round::Ball) || ellipse.minor >= 0.95 * ellipse.major;
    round && sighting.visible >= visible && ellipse.circle().radius >= 5.0
}

/// Writes a file as a whole or not at all.
fn save(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let unfinished = path.with_extension("part");
    std::fs::write(&unfinished, bytes)?;
    std::fs::rename(unfinished, path)
}

/// CPU time of this process.
fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
