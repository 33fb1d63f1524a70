//! CPU time of rendered frames, kind by kind, of frames drawn from seeds: median and best, and the
//! median once each frame has been taken several times and only the least of its times counts.
//!
//! ```text
//! cargo run --release -p pipeline-sim --example frame_cost [-- KIND [FRAMES]]
//! ```
//!
//! Milliseconds for 768x576 pixels. On a busy machine the last column is the figure to compare: it
//! leaves out what other programs took from the processor and its caches, but not that some frames
//! show more than others.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use pipeline_sim::{BenchmarkKind, Renderer, Scene, SceneKind, Snapshot};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// Scenes of each kind.
const SCENES: u64 = 6;
/// Times that each frame is taken.
const TAKES: usize = 4;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let only = arguments.next().filter(|name| name != "all");
    let frames: usize = match arguments.next() {
        None => 9,
        Some(text) => (text.parse().ok().filter(|n| *n > 0)).ok_or_else(|| {
            format!("FRAMES is a whole number from 1 on, not {text:?}: frame_cost [KIND [FRAMES]]")
        })?,
    };
    let names = || {
        let kinds = SceneKind::ALL.iter().map(ToString::to_string);
        kinds.chain(BenchmarkKind::ALL.iter().map(ToString::to_string))
    };
    if let Some(kind) = only
        .as_ref()
        .filter(|only| names().all(|name| name != **only))
    {
        let names: Vec<String> = names().collect();
        return Err(format!("no kind {kind:?}: all, or one of {}", names.join(", ")).into());
    }
    let wanted = |name: &str| only.as_deref().is_none_or(|only| only == name);
    println!("{:20} {:>7} {:>7} {:>7}", "kind", "median", "best", "quiet");
    for kind in SceneKind::ALL {
        report(&kind.to_string(), wanted, |seed| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let scene = Scene::generate(kind, &mut rng);
            let shots = (0..frames).map(|_| Snapshot::draw(kind, &mut rng));
            Ok((Renderer::new(&scene, seed), shots.collect()))
        })?;
    }
    for kind in BenchmarkKind::ALL {
        report(&kind.to_string(), wanted, |seed| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (scene, snapshot) = kind.draw((768, 576), &mut rng)?;
            Ok((Renderer::new(&scene, seed), vec![snapshot; frames]))
        })?;
    }
    Ok(())
}

/// Takes all snapshots of each scene and prints their times, milliseconds.
fn report(
    name: &str,
    wanted: impl Fn(&str) -> bool,
    draw: impl Fn(u64) -> Result<(Renderer, Vec<Snapshot>), Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    if !wanted(name) {
        return Ok(());
    }
    let (mut times, mut quiet) = (Vec::new(), Vec::new());
    for seed in 1..=SCENES {
        let (mut renderer, snapshots) = draw(seed)?;
        // The first frame allocates the buffers.
        for snapshot in snapshots.iter().take(1) {
            snapshot.take(&mut renderer);
        }
        for snapshot in &snapshots {
            let takes: Vec<f64> = (0..TAKES)
                .map(|_| {
                    let before = cpu();
                    snapshot.take(&mut renderer);
                    cpu() - before
                })
                .collect();
            quiet.push(takes.iter().copied().fold(f64::INFINITY, f64::min));
            times.extend(takes);
        }
    }
    for list in [&mut times, &mut quiet] {
        list.sort_by(f64::total_cmp);
    }
    let at = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(f64::NAN);
    println!(
        "{name:20} {:7.2} {:7.2} {:7.2}",
        at(&times, times.len() / 2),
        at(&times, 0),
        at(&quiet, quiet.len() / 2)
    );
    Ok(())
}

/// CPU time of this thread, milliseconds; time on the wall where the system does not tell.
fn cpu() -> f64 {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
    }
    #[cfg(not(unix))]
    {
        static BEGIN: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
        BEGIN
            .get_or_init(std::time::Instant::now)
            .elapsed()
            .as_secs_f64()
            * 1e3
    }
}
