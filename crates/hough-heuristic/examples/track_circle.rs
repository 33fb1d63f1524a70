//! Follows a moving ball from frame to frame, which costs a fraction of a search of the frame.
//!
//! ```text
//! cargo run --release -p hough-heuristic --example track_circle
//! ```

use std::error::Error;
use std::io::Write;

use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{AContrario, AContrarioConfig, Circle};

/// Pixels that the ball may move, or its radius change, from one frame to the next.
const REACH: f64 = 12.0;

/// Draws frame `number`: a dark ball that rises and comes nearer, before a striped wall.
fn frame(number: u32) -> GrayImage {
    let time = f64::from(number);
    let (x, y, radius) = (120.0 + 9.0 * time, 300.0 - 5.0 * time, 25.0 + time);
    GrayImage::from_fn(640, 480, |column, row| {
        let off = (f64::from(column) - x).hypot(f64::from(row) - y) - radius;
        let wall = if column / 40 % 2 == 0 { 170.0 } else { 200.0 };
        let share = (off + 0.5).clamp(0.0, 1.0);
        Luma([(wall * share + 50.0 * (1.0 - share)) as u8])
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut detector = AContrario::new(AContrarioConfig::default())?;
    let mut out = std::io::stdout().lock();
    // Nothing is known before the first frame, so the first call searches all of it.
    let mut last = Circle {
        x: f64::NAN,
        y: f64::NAN,
        radius: f64::NAN,
    };
    for number in 0..30 {
        let followed = detector.track(&frame(number), &last, REACH)?;
        let effort = detector.effort();
        let Some(best) = detector.measurements().first() else {
            writeln!(out, "{number:2}: lost")?;
            continue;
        };
        last = best.circle;
        writeln!(
            out,
            "{number:2}: {} at ({:.1}, {:.1}), radius {:.1}; {} places looked at",
            if followed { "followed" } else { "found" },
            last.x,
            last.y,
            last.radius,
            effort.looks,
        )?;
    }
    Ok(())
}
