//! Draws figure 3 of the paper for a rendered scene: the original, its edges, the structure D with
//! a draw of three pixels and the circle they estimate, and the circle that is found.
//!
//! ```text
//! cargo run --release --example paper_figure_3
//! ```

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Parser;
use hough_heuristic::image::{GenericImage, GrayImage, Luma, Rgb, RgbImage};
use hough_heuristic::{
    Acceptance, Circle, CircleDetector, Curve, EdgeMap, EdgePixel, Features, Heuristic,
    HeuristicConfig,
};
use pipeline_sim::{Ball, Cell, Renderer, Scene, Workspace};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use example_support::files::writable_folder;
use example_support::overlay::Overlay;
use example_support::prelude::*;

/// Draws original, edges, structure D and the detected circle of a rendered scene.
#[derive(Parser, Debug)]
struct Options {
    /// Picture to write, PNG
    #[arg(value_name = "FILE", default_value = "out/figure_3.png")]
    picture: PathBuf,
    /// Seed of the scene and of the draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Radii of a ball in reach, pixels.
const RADII: Range<f64> = 20.0..250.0;

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    let frame = render(options.seed)?;
    let mut detector = Heuristic::with_canny(HeuristicConfig {
        seed: options.seed,
        accept: Acceptance {
            min_radius: RADII.start,
            max_radius: RADII.end,
            ..Acceptance::default()
        },
        ..HeuristicConfig::default()
    })?;
    let found = detector.detect(&frame)?.to_vec();

    let edges = detector.stages().edges;
    let edge_words = format!("Canny edges: {} pixels", edges.pixels().len());
    let mut result = Overlay::new(&frame);
    for detection in &found {
        result.circle(&detection.circle);
    }
    let result_words = found.first().map_or("No circle".into(), |best| {
        let Features { x, y, r } = Features::from_circle(&best.circle, frame.width());
        format!(
            "Found: beta {:.2}, x {x:.1}  y {y:.1}  r {r:.1} units",
            best.score
        )
    });
    let panels = [
        Overlay::new(&frame).captioned("Original"),
        Overlay::new(edges.image()).captioned(&edge_words),
        structure(&frame, edges, options.seed),
        result.captioned(&result_words),
    ];
    if let Some(folder) = options.picture.parent() {
        writable_folder(&Path::new(".").join(folder))?;
    }
    write_png(&options.picture, &sheet(&panels)?)?;
    say!("{}", options.picture.display());
    Ok(())
}

/// Renders the first search pose that has the ball in full view.
fn render(seed: u64) -> Outcome<GrayImage> {
    let cell = Cell::paper(Ball::at(0.6, 0.15, -0.1));
    let inside = |circle: &Circle| {
        let margin = circle.radius + 5.0;
        (margin..768.0 - margin).contains(&circle.x) && (margin..576.0 - margin).contains(&circle.y)
    };
    let poses = Workspace::paper().search_poses();
    let pose = poses
        .iter()
        .find(|pose| cell.circle(pose).as_ref().is_ok_and(inside));
    let pose = pose.ok_or("the ball is in view from none of the search poses")?;
    Ok(Renderer::new(&Scene::laboratory(), seed)
        .render(&cell, pose)
        .clone())
}

/// Draws `D` over a dark ground, and the first draw of three pixels whose circle has a radius of 20
/// to 250 px. Like most draws it is not yet the circle that is found.
fn structure(frame: &GrayImage, edges: &EdgeMap, seed: u64) -> RgbImage {
    let ground = GrayImage::from_fn(frame.width(), frame.height(), |x, y| {
        Luma([frame.get_pixel(x, y).0[0] / 4])
    });
    let mut picture = Overlay::new(&ground).into_image();
    for pixel in edges.pixels() {
        picture.put_pixel(pixel.x, pixel.y, Rgb([255, 255, 255]));
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let all = edges.pixels();
    let mut draws = (0..10_000).filter(|_| !all.is_empty()).filter_map(|_| {
        let pixels: [EdgePixel; 3] = std::array::from_fn(|_| all[rng.random_range(0..all.len())]);
        let circle = Circle::through(&pixels)?;
        RADII.contains(&circle.radius).then_some((pixels, circle))
    });
    let Some((pixels, circle)) = draws.next() else {
        let words = "D: no three of its pixels make a circle of such a radius";
        return Overlay::from(picture).captioned(words);
    };
    let mut plot = |x: i32, y: i32, colour| {
        // Below zero no pixel is found.
        if let Some(pixel) = picture.get_pixel_mut_checked(x as u32, y as u32) {
            *pixel = Rgb(colour);
        }
    };
    circle.outline(frame.width(), frame.height(), |x, y| {
        plot(x, y, [255, 140, 0]);
        plot(x + 1, y, [255, 140, 0]);
        true
    });
    for pixel in pixels {
        for (dx, dy) in (-5..=5).flat_map(|dy| (-5..=5).map(move |dx| (dx, dy))) {
            plot(pixel.x as i32 + dx, pixel.y as i32 + dy, [255, 60, 60]);
        }
    }
    let beta = matched(edges, &circle);
    let words = format!("D, three of its pixels, their circle: beta {beta:.2}");
    Overlay::from(picture).captioned(&words)
}

/// Returns the belonging of a circle at the default tolerance of one pixel, counted pixel by pixel.
fn matched(edges: &EdgeMap, circle: &Circle) -> f64 {
    let lit = |x: i32, y: i32| {
        // Below zero no pixel is found.
        let pixel = edges.image().get_pixel_checked(x as u32, y as u32);
        pixel.is_some_and(|pixel| pixel.0[0] != 0)
    };
    let (mut pixels, mut matched) = (0u32, 0u32);
    circle.outline(edges.width(), edges.height(), |x, y| {
        let cross = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)];
        pixels += 1;
        matched += u32::from(cross.iter().any(|(dx, dy)| lit(x + dx, y + dy)));
        true
    });
    f64::from(matched) / f64::from(pixels)
}

/// Lays out four panels of one size, two by two.
fn sheet(panels: &[RgbImage; 4]) -> Outcome<RgbImage> {
    const GAP: u32 = 6;
    let (width, height) = panels[0].dimensions();
    let mut sheet = RgbImage::from_pixel(2 * width + GAP, 2 * height + GAP, Rgb([255, 255, 255]));
    for (place, panel) in (0..).zip(panels) {
        let (x, y) = ((place % 2) * (width + GAP), (place / 2) * (height + GAP));
        sheet.copy_from(panel, x, y)?;
    }
    Ok(sheet)
}
