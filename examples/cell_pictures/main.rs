//! Draws the simulated cell: an overview as SVG, and a reach as the camera on the hand sees it, as
//! an animated PNG and as video.
//!
//! ```text
//! cargo run --release --example cell_pictures -- --out out/pictures
//! ```
//!
//! writes and lists `overview.svg`, `search.png`, `goal.png`, `run.png` (animated) and `run.y4m`.

mod overview;

use std::path::PathBuf;

use clap::Parser;
use example_support::files::animated;
use example_support::learning::paper_cell;
use example_support::overlay::Overlay;
use example_support::prelude::*;
use hough_heuristic::Y4mWriter;
use image::RgbImage;
use image::imageops::{FilterType, resize};
use pipeline_sim::{Cell, Renderer, Scene, Workspace};
use puma_val2::{Joint, Joints};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// Draws the simulated cell.
#[derive(Parser)]
struct Options {
    /// Folder for the pictures, created if missing.
    #[arg(long, default_value = "out/pictures")]
    out: PathBuf,
    /// Seed of the ball's place and of the textures.
    #[arg(long, default_value_t = 3)]
    seed: u64,
    /// Frames of the run.
    #[arg(long, default_value_t = 40)]
    frames: u32,
}

fn main() -> ExitCode {
    start(draw)
}

fn draw(options: &Options) -> Outcome {
    let _lock = lock_folder(&options.out)?;
    let out = |name: &str| options.out.join(name);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let workspace = Workspace::paper();
    let (ball, start) = workspace
        .sample_seen_ball(&paper_cell(), &mut rng)
        .ok_or("no search pose sees the workspace")?;
    let cell = Cell::paper(ball);
    let goal = cell.goal_pose(Cell::REACHING_JT5_DEGREES)?;
    let path = reach(&cell, &start, &goal, options.frames.max(4));

    let overview = overview::overview(&cell, &workspace, &path[..=path.len() * 3 / 4])?;
    write_whole(&out("overview.svg"), overview.as_bytes())?;
    let mut renderer = Renderer::new(&Scene::laboratory(), options.seed);
    write_png(&out("search.png"), renderer.render(&cell, &start))?;
    write_png(&out("goal.png"), renderer.render(&cell, &goal))?;
    let mut video = Y4mWriter::new(Vec::new(), 12, 1)?;
    for pose in &path {
        video.write(renderer.render(&cell, pose))?;
    }
    write_whole(&out("run.y4m"), &video.finish()?)?;
    // Without noise the animated picture compresses well.
    let mut quiet = Scene::laboratory();
    (quiet.sensor.read_noise, quiet.sensor.shot_noise) = (0.0, 0.0);
    let mut renderer = Renderer::new(&quiet, options.seed);
    let film = path.iter().map(|pose| {
        let mut overlay = Overlay::new(renderer.render(&cell, pose));
        if let Ok(circle) = cell.circle(pose) {
            overlay.circle(&circle);
        }
        resize(&overlay.into_image(), 384, 288, FilterType::Triangle)
    });
    let frames: Vec<RgbImage> = film.collect();
    write_whole(&out("run.png"), &animated(&frames, (1, 12), (3, 2))?)?;
    for name in [
        "overview.svg",
        "search.png",
        "goal.png",
        "run.y4m",
        "run.png",
    ] {
        say!("{}", out(name).display());
    }
    Ok(())
}

/// Returns the way from the search pose to the goal, slowing down, then the turn of the wrist that
/// brings the gripper to the ball.
fn reach(cell: &Cell, start: &Joints, goal: &Joints, frames: u32) -> Vec<Joints> {
    let mut grip = *goal;
    grip.0[Joint::J5.index()] = cell.grip_angle(goal);
    let between = |a: &Joints, b: &Joints, t: f64| {
        Joints(std::array::from_fn(|i| a.0[i] + t * (b.0[i] - a.0[i])))
    };
    let swing = frames / 4;
    let approach = (0..frames - swing).map(|i| {
        let left = 1.0 - f64::from(i) / f64::from(frames - swing - 1);
        between(start, goal, 1.0 - left * left)
    });
    approach
        .chain((1..=swing).map(|i| between(goal, &grip, f64::from(i) / f64::from(swing))))
        .collect()
}
