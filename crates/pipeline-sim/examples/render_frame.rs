//! Renders a labelled frame and prints the circles in it.
//!
//! ```text
//! cargo run --release -p pipeline-sim --example render_frame -- frame.pgm
//! ```

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::io::Write as _;

use pipeline_sim::{Ball, Cell, Renderer, Scene, Workspace};

fn main() -> Result<(), Box<dyn Error>> {
    let cell = Cell::paper(Ball::at(0.6, 0.15, -0.1));
    let pose = Workspace::paper().search_poses()[3];
    let mut renderer = Renderer::new(&Scene::laboratory(), 1);
    for outline in renderer.truth(&cell, &pose) {
        let circle = outline.ellipse.circle();
        println!(
            "{:?} at ({:.1}, {:.1}), radius {:.1} px, {:.0} % visible",
            outline.what,
            circle.x,
            circle.y,
            circle.radius,
            100.0 * outline.visible
        );
    }
    let frame = renderer.render(&cell, &pose);
    if let Some(path) = std::env::args().nth(1) {
        let mut file = std::fs::File::create(&path)?;
        writeln!(file, "P5 {} {} 255", frame.width(), frame.height())?;
        file.write_all(frame.as_raw())?;
        println!("frame written to {path}");
    }
    Ok(())
}
