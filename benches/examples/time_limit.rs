//! The CPU time of 208 calls with a time limit: frames of four sizes and three contents, four
//! limits, each cold (a new detector) and warm.
//!
//! cargo run --release -p circle-benches --example time_limit

#![allow(clippy::print_stdout, reason = "what an example is for")]

use circle_benches::least_cpu_time;
use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{AContrario, AContrarioConfig, CircleDetector};

const SIZES: [(u32, u32); 4] = [(320, 240), (768, 576), (1920, 1080), (4000, 3000)];
const LIMITS: [f64; 4] = [2.0, 3.0, 5.0, 10.0];

/// A frame of discs, of texture, or of both, with some noise.
fn draw((width, height): (u32, u32), content: u32) -> GrayImage {
    let mut state = 1u32;
    GrayImage::from_fn(width, height, |x, y| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        let (dx, dy) = (f64::from(x % 80) - 40.0, f64::from(y % 80) - 40.0);
        let disc = if content != 1 && dx.hypot(dy) < 25.0 {
            90
        } else {
            0
        };
        let texture = if content == 0 {
            0
        } else {
            (x / 7 * 31 + y / 5 * 17) % 64
        };
        Luma([(60 + disc + texture + state % 9) as u8])
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut calls, mut late, mut worst) = (0, 0, 0.0f64);
    println!("size, limit ms/MP, allowed ms: CPU ms of each call, circles of the last");
    for size in SIZES {
        let megapixels = f64::from(size.0 * size.1) * 1e-6;
        for content in 0..3 {
            let frame = draw(size, content);
            for limit in LIMITS {
                let allowed = 1.2 * limit * megapixels + 0.2;
                let mut detector = None;
                let mut times = Vec::new();
                let mut found = 0;
                // The first is cold. Four sizes, three contents and four limits: 208 calls.
                for _ in 0..if content == 0 { 5 } else { 4 } {
                    let config = AContrarioConfig {
                        milliseconds_per_megapixel: Some(limit),
                        ..AContrarioConfig::default()
                    };
                    let mut work = || -> Result<usize, Box<dyn std::error::Error>> {
                        let detector = match &mut detector {
                            Some(detector) => detector,
                            none => none.insert(AContrario::new(config.clone())?),
                        };
                        Ok(detector.detect(&frame)?.len())
                    };
                    let mut result = Ok(0);
                    let spent = least_cpu_time(1, || result = work()).as_secs_f64() * 1e3;
                    found = result?;
                    calls += 1;
                    late += usize::from(spent > allowed);
                    worst = worst.max(spent / allowed);
                    times.push(format!("{spent:.2}"));
                }
                let times = times.join(" ");
                println!("{size:?}, {limit}, {allowed:.2}: {times}, {found}");
            }
        }
    }
    println!("{calls} calls, {late} above what is allowed, the worst by {worst:.2} of it");
    Ok(())
}
