//! Prints the CPU time of frames of each recipe: median and best, milliseconds for 768x576 pixels.
//!
//! ```text
//! cargo run --release -p pipeline-sim --example frame_cost
//! ```
//!
//! An argument is the number of frames of each recipe (default 12).

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use pipeline_sim::Recipe;
use pipeline_sim::rand::SeedableRng;
use pipeline_sim::rand::rngs::Xoshiro256PlusPlus;

fn main() -> Result<(), Box<dyn Error>> {
    let frames: u64 = std::env::args()
        .nth(1)
        .map_or(Ok(12), |frames| frames.parse())?;
    println!("{:20} {:>7} {:>7}", "recipe", "median", "best");
    for recipe in Recipe::cell().iter().chain(Recipe::benchmark()) {
        let mut times = Vec::new();
        for seed in 0..frames.max(1) {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (mut renderer, snapshot) = recipe.draw((768, 576), &mut rng)?;
            // The first frame allocates.
            snapshot.take(&mut renderer);
            let before = milliseconds();
            snapshot.take(&mut renderer);
            times.push(milliseconds() - before);
        }
        times.sort_by(f64::total_cmp);
        println!(
            "{:20} {:7.2} {:7.2}",
            recipe.name(),
            times[times.len() / 2],
            times[0]
        );
    }
    Ok(())
}

/// Returns the CPU time of this process, milliseconds.
#[cfg(unix)]
fn milliseconds() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ProcessCPUTime);
    1e3 * time.tv_sec as f64 + 1e-6 * time.tv_nsec as f64
}

/// Returns the wall time since the first call, milliseconds.
#[cfg(not(unix))]
fn milliseconds() -> f64 {
    use std::{sync::OnceLock, time::Instant};
    static START: OnceLock<Instant> = OnceLock::new();
    1e3 * START.get_or_init(Instant::now).elapsed().as_secs_f64()
}
