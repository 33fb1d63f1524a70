//! Finds the circles of a photograph and prints how sure each is.
//!
//! ```text
//! cargo run --release -p hough-heuristic --example find_circles [PICTURE]
//! ```

use std::error::Error;
use std::io::Write;
use std::path::PathBuf;

use hough_heuristic::image;
use hough_heuristic::{AContrario, AContrarioConfig, CircleDetector};

fn main() -> Result<(), Box<dyn Error>> {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/balls.jpg");
    let path = std::env::args_os()
        .nth(1)
        .map_or_else(|| example.into(), PathBuf::from);
    let picture = image::open(&path)?.to_luma8();

    // There is no threshold to tune: a circle is reported if chance would hardly make it.
    let mut detector = AContrario::new(AContrarioConfig::default())?;
    let circles = detector.detect(&picture)?.len();

    let mut out = std::io::stdout().lock();
    writeln!(out, "{circles} circles in {}", path.display())?;
    for found in detector.measurements() {
        let circle = found.circle;
        writeln!(
            out,
            "x {:.2}±{:.2}  y {:.2}±{:.2}  radius {:.2}±{:.2}  score {:.2} (10^{:.0} false alarms)",
            circle.x,
            found.centre_error,
            circle.y,
            found.centre_error,
            circle.radius,
            found.radius_error,
            found.score,
            found.log_false_alarms,
        )?;
    }
    if detector.effort().ended_by_budget {
        writeln!(
            out,
            "The search reached its limit of draws: there may be more circles."
        )?;
    }
    Ok(())
}
