//! Renders labelled frames of the simulated cell: PNG files, the exact circles they show, and which
//! scene each belongs to.
//!
//! ```text
//! cargo run --release --example render_dataset -- --out out/rendered --frames 20
//! cargo run --release --example render_dataset -- --kinds benchmark --size 1920x1080
//! ```
//!
//! writes `out/rendered/KIND_NNN.png`, `truth.csv` (file,cx,cy,r,what,visible) and `frames.csv`
//! (file,scene). (0, 0) is the centre of the top-left pixel. The truth lists every outline that is
//! round to 5 % (axis ratio), at least 60 % visible (`--visible`) and at least 5 px in radius for a
//! frame 768 wide (balls of the benchmark kinds have no least radius): the ball (`Target`) and all
//! other round outlines, such as the rim of a disc seen from above. A frame with a less visible
//! ball has no row for it; use `--visible 0` and the column `visible` where that matters.
//!
//! Kinds are the recipes of `Recipe::cell` (the arm at work) and of `Recipe::benchmark` (one
//! difficulty at a time); `cell` and `benchmark` stand for all of either. The frames of a kind
//! depend on the seed only, not on the other kinds drawn.

mod kinds;

use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, Parser};
use example_support::prelude::*;
use example_support::stages::cpu_time;
use kinds::{Kind, Kinds, repeated, share, size};
use pipeline_sim::{Camera, Renderer, Round, RoundOutline};

/// Renders labelled frames of the simulated cell.
#[derive(Parser)]
struct Options {
    /// Folder for the frames, created if missing.
    #[arg(long, default_value = "out/rendered")]
    out: PathBuf,
    /// Frames of each kind.
    #[arg(long, default_value_t = 20)]
    frames: u64,
    /// Kinds of scenes, separated by commas; `cell` and `benchmark` stand for all of either group.
    #[arg(long, value_delimiter = ',', default_value = "cell")]
    kinds: Vec<Kinds>,
    /// Width and height of the frames, pixels.
    #[arg(long, default_value = "768x576", value_parser = size)]
    size: (u32, u32),
    /// Frames that share a scene (table, lamps, objects). Ball and pose are new in every frame;
    /// benchmark frames share nothing.
    #[arg(long, default_value_t = 5)]
    per_scene: u64,
    /// Seed; the same seed gives the same files.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Least visible share of an outline in the truth, 0 to 1; 0 lists all that show at all.
    #[arg(long, default_value_t = 0.6, value_parser = share)]
    visible: f64,
}

fn main() -> ExitCode {
    start(render)
}

fn render(options: &Options) -> Outcome {
    let kinds: Vec<Kind> = options.kinds.iter().flat_map(|k| k.0.clone()).collect();
    if let Some(name) = repeated(&kinds) {
        let message = format!(
            "the kind {name} is named more than once (`cell` and `benchmark` name all of theirs)"
        );
        Options::command()
            .error(ErrorKind::ValueValidation, message)
            .exit();
    }
    let _lock = lock_folder(&options.out)?;
    let mut truth = Table::create(options.out.join("truth.csv"), "file,cx,cy,r,what,visible")?;
    let mut frames = Table::create(options.out.join("frames.csv"), "file,scene")?;
    let bar = progress_bar(kinds.len() as u64 * options.frames, "frames", false);
    for kind in kinds {
        let name = kind.recipe.name();
        let mut rng = kind.generator(options.seed);
        let mut shared: Option<Renderer> = None;
        let mut milliseconds = Vec::new();
        for i in 0..options.frames {
            go_on()?;
            let again = shared.take().filter(|_| i % options.per_scene.max(1) != 0);
            let mut drawn = None;
            if let Some(renderer) = again {
                let snapshot = kind.recipe.draw_again(options.size, &mut rng)?;
                drawn = snapshot.map(|snapshot| (renderer, snapshot));
            }
            let (mut renderer, snapshot) = match drawn {
                Some(drawn) => drawn,
                None => kind.recipe.draw(options.size, &mut rng)?,
            };
            let file = format!("{name}_{i:03}.png");
            let before = cpu_time();
            let frame = snapshot.take(&mut renderer);
            milliseconds.push(1e3 * cpu_time().saturating_sub(before).as_secs_f64());
            write_png(&options.out.join(&file), frame)?;
            frames.row(format_args!("{file},{name}"))?;
            let sightings = snapshot.truth(&renderer);
            let scale = snapshot.cell.camera.focal_px() / Camera::paper().focal_px();
            let least = kind.least_radius * scale;
            let counted = |sighting: &&RoundOutline| counts(sighting, options.visible, least);
            for sighting in sightings.iter().filter(counted) {
                let circle = sighting.ellipse.circle();
                truth.row(format_args!(
                    "{file},{:.3},{:.3},{:.3},{:?},{:.2}",
                    circle.x, circle.y, circle.radius, sighting.what, sighting.visible
                ))?;
            }
            shared = Some(renderer);
            bar.inc(1);
        }
        milliseconds.sort_by(f64::total_cmp);
        let middle = milliseconds.len() / 2;
        if let (Some(least), Some(median)) = (milliseconds.first(), milliseconds.get(middle)) {
            let row = format!("{name:20} CPU, ms a frame: {least:.1} least, {median:.1} median");
            bar.suspend(|| say!("{row}"));
        }
    }
    bar.finish_and_clear();
    say!("results: {}", options.out.display());
    Ok(())
}

/// Returns whether a detector should find the outline.
fn counts(sighting: &RoundOutline, visible: f64, least_radius: f64) -> bool {
    let ellipse = &sighting.ellipse;
    let round = matches!(sighting.what, Round::Target | Round::Ball)
        || ellipse.minor >= 0.95 * ellipse.major;
    round && sighting.visible >= visible && ellipse.circle().radius >= least_radius
}
