//! Draws the simulated cell: an overview as SVG, and a reach as the camera on the hand sees it, as
//! an animated PNG and as video.
//!
//! ```text
//! cargo run --release --example cell_pictures -- --out out/pictures
//! ```
//!
//! writes and lists `overview.svg`, `search.png`, `goal.png`, `run.png` (animated) and `run.y4m`.

mod overview;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use example_support::files::{animated, writable_folder, write_whole};
use example_support::program::ended;
use example_support::say;
use hough_heuristic::Y4mWriter;
use image::imageops::{FilterType, resize};
use image::{GrayImage, ImageFormat};
use pipeline_sim::{Cell, Renderer, Scene, Sensor, Workspace};
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
    ended(draw(&Options::parse()))
}

fn draw(options: &Options) -> Result<(), Box<dyn Error>> {
    writable_folder(&options.out)?;
    let save = |name: &str, bytes: &[u8]| {
        let path = options.out.join(name);
        write_whole(&path, bytes)?;
        say!("{}", path.display());
        Ok::<(), Box<dyn Error>>(())
    };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let workspace = Workspace::paper();
    let nominal = Cell::paper(pipeline_sim::Ball::at(0.6, 0.0, -0.1));
    let (ball, start) = workspace
        .sample_seen_ball(&nominal, &mut rng)
        .ok_or("no search pose sees the workspace")?;
    let cell = Cell::paper(ball);
    let goal = cell.goal_pose(Cell::REACHING_JT5_DEGREES)?;
    let path = reach(&cell, &start, &goal, options.frames.max(4));

    let overview = overview::overview(&cell, &workspace, &path[..=path.len() * 3 / 4])?;
    save("overview.svg", overview.as_bytes())?;
    let mut renderer = Renderer::new(&Scene::laboratory(), options.seed);
    for (name, pose) in [("search.png", &start), ("goal.png", &goal)] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        renderer
            .render(&cell, pose)
            .write_to(&mut bytes, ImageFormat::Png)?;
        save(name, bytes.get_ref())?;
    }
    let mut video = Y4mWriter::new(Vec::new(), 12, 1)?;
    for pose in &path {
        video.write(renderer.render(&cell, pose))?;
    }
    save("run.y4m", &video.finish()?)?;
    // Without noise the animated picture compresses well.
    let quiet = Sensor {
        read_noise: 0.0,
        shot_noise: 0.0,
        ..Sensor::default()
    };
    let mut renderer = Renderer::new(
        &Scene {
            sensor: quiet,
            ..Scene::laboratory()
        },
        options.seed,
    );
    let frames: Vec<GrayImage> = path
        .iter()
        .map(|pose| resize(renderer.render(&cell, pose), 384, 288, FilterType::Triangle))
        .collect();
    save("run.png", &animated(&frames, (1, 12), (3, 2))?)?;
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
