//! Finds an ellipse by the paper's search for curves: draw five edge pixels, solve for the ellipse
//! through them, and count how many of its pixels are edges.
//!
//! ```text
//! cargo run --release -p hough-heuristic --example find_ellipse
//! ```

use std::error::Error;
use std::io::Write;

use hough_heuristic::image::{GrayImage, Luma};
use hough_heuristic::{Canny, CurveSearch, CurveSearchConfig, EdgeDetector, Ellipse};

/// Draws a plate seen at a slant.
fn frame() -> GrayImage {
    let (sin, cos) = 0.5_f64.sin_cos();
    GrayImage::from_fn(320, 240, |column, row| {
        let (dx, dy) = (f64::from(column) - 160.0, f64::from(row) - 110.0);
        let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let inside = (along / 80.0).powi(2) + (across / 45.0).powi(2) < 1.0;
        Luma([if inside { 210 } else { 70 }])
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut canny = Canny::default();
    let edges = canny.detect_edges(&frame());
    let mut search = CurveSearch::new(CurveSearchConfig::default())?;
    let mut out = std::io::stdout().lock();
    for (found, belonging) in search.find::<Ellipse>(edges, |ellipse| ellipse.major < 320.0) {
        let Ellipse {
            x,
            y,
            major,
            minor,
            angle,
        } = found;
        writeln!(
            out,
            "center ({x:.1}, {y:.1}), half-axes {major:.1} and {minor:.1}, turned by {:.1} \
             degrees; {:.0} % of its pixels are edges",
            angle.to_degrees(),
            100.0 * belonging
        )?;
    }
    Ok(())
}
