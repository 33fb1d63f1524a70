//! The comparison of docs/BENCHMARKS.md: every detector on every scene, over many seeds, as CSV and
//! as a picture.
//!
//! cargo run --release -p circle-benches --example compare -- --seeds 20 --csv scenes.csv --svg
//! scenes.svg

#![allow(clippy::print_stdout, reason = "what an example is for")]

use std::error::Error;
use std::path::PathBuf;

use circle_benches::least_cpu_time;
use circle_scenes::contest;
use circle_scenes::scene::{Scene, same};
use circle_scenes::staged::TRANSFORMS;
use clap::Parser;
use hough_heuristic::EdgeDetector;
use plotters::prelude::*;

/// Compares the circle detectors on rendered scenes.
#[derive(Parser)]
struct Options {
    /// Frames per scene.
    #[arg(long, default_value_t = 20)]
    seeds: u64,
    /// The standard Hough transform takes about a second per frame, so it gets fewer.
    #[arg(long, default_value_t = 5)]
    slow_seeds: u64,
    /// File for the table.
    #[arg(long)]
    csv: Option<PathBuf>,
    /// File for the diagram of the times.
    #[arg(long)]
    svg: Option<PathBuf>,
}

/// Result of a detector on the frames of a scene.
struct Row {
    scene: &'static str,
    detector: &'static str,
    frames: u64,
    edges: usize,
    /// CPU time of the circle search, milliseconds.
    median: f64,
    most: f64,
    truths: usize,
    found: usize,
    matched: usize,
    centre: f64,
    memory: usize,
}

/// The row of the edges alone, which has no column but the median of the times.
const EDGES: &str = "edges";

const HEADER: &str = "scene,detector,frames,mean_edge_pixels,search_cpu_ms_median,\
search_cpu_ms_max,truths,found,matched_2px,recall,precision,centre_error_px_median,memory_bytes";

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let mut rows = Vec::new();
    for round in contest::rounds() {
        for detector in TRANSFORMS.into_iter().chain([EDGES]) {
            let seeds = if detector == "SHT" {
                options.slow_seeds
            } else {
                options.seeds
            };
            let row = measure(&round, detector, seeds)?;
            println!("{}", row.to_csv());
            rows.push(row);
        }
    }
    if let Some(path) = &options.csv {
        let lines: Vec<String> = rows.iter().map(Row::to_csv).collect();
        std::fs::write(path, format!("{HEADER}\n{}\n", lines.join("\n")))?;
    }
    if let Some(path) = &options.svg {
        draw(path, &rows)?;
    }
    Ok(())
}

fn measure(
    round: &contest::Round,
    detector_name: &'static str,
    seeds: u64,
) -> Result<Row, Box<dyn Error>> {
    let (mut times, mut errors) = (Vec::new(), Vec::new());
    let mut row = Row::new(round, detector_name, seeds);
    for seed in 0..seeds {
        let scene = Scene {
            seed: 100 + seed,
            ..round.scene
        };
        let (frame, balls) = scene.render();
        let mut canny = round.canny();
        let edges = canny.detect_edges(&frame).clone();
        if detector_name == EDGES {
            times.push(least_millis(5, || {
                canny.detect_edges(&frame);
            }));
            continue;
        }
        row.edges += edges.pixels().len();
        let mut detector = contest::detector(detector_name, &scene, contest::Found(edges))?;
        // Slow ones need no repetition to be timed.
        let found = detector.detect(&frame)?.to_vec();
        let reps = if detector_name == "SHT" { 1 } else { 3 };
        times.push(least_millis(reps, || {
            let _ = detector.detect(&frame);
        }));
        row.memory = row.memory.max(detector.stages().memory);
        row.truths += balls.len();
        row.found += found.len();
        for ball in &balls {
            if let Some(hit) = found.iter().find(|f| same(&f.circle, ball, 2.0)) {
                row.matched += 1;
                errors.push((hit.circle.x - ball.x).hypot(hit.circle.y - ball.y));
            }
        }
    }
    row.edges /= seeds.max(1) as usize;
    if detector_name != EDGES {
        row.most = times.iter().copied().fold(0.0, f64::max);
    }
    row.median = median(&mut times);
    row.centre = median(&mut errors);
    Ok(row)
}

impl Row {
    fn new(round: &contest::Round, detector: &'static str, frames: u64) -> Self {
        Self {
            scene: round.name,
            detector,
            frames,
            edges: 0,
            median: 0.0,
            most: 0.0,
            truths: 0,
            found: 0,
            matched: 0,
            centre: f64::NAN,
            memory: 0,
        }
    }

    fn to_csv(&self) -> String {
        let share = |of: usize| self.matched as f64 / of as f64;
        format!(
            "\"{}\",\"{}\",{},{},{:.3},{:.3},{},{},{},{:.3},{:.3},{:.3},{}",
            self.scene,
            self.detector,
            self.frames,
            self.edges,
            self.median,
            self.most,
            self.truths,
            self.found,
            self.matched,
            share(self.truths),
            share(self.found),
            self.centre,
            self.memory
        )
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn least_millis(repetitions: u32, work: impl FnMut()) -> f64 {
    1e3 * least_cpu_time(repetitions, work).as_secs_f64()
}

/// The median time of each detector (a colour) on each scene (a column), on a logarithmic scale.
fn draw(path: &std::path::Path, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let names: Vec<&str> = contest::rounds()
        .into_iter()
        .map(|round| round.name)
        .collect();
    let area = SVGBackend::new(path, (1000, 560)).into_drawing_area();
    area.fill(&WHITE)?;
    let columns = names.len() as f64;
    let mut chart = ChartBuilder::on(&area)
        .caption(
            "CPU time of the circle search per frame, ms (edges not included)",
            ("sans-serif", 18),
        )
        .margin(12)
        .x_label_area_size(10)
        .y_label_area_size(50)
        .build_cartesian_2d(-0.5..columns - 0.5, (0.02f64..20_000.0).log_scale())?;
    chart.configure_mesh().disable_x_mesh().x_labels(0).draw()?;
    for (index, detector) in TRANSFORMS.into_iter().enumerate() {
        let colour = Palette99::pick(index).to_rgba();
        let points = rows
            .iter()
            .filter(|row| row.detector == detector)
            .filter_map(|row| {
                let column = names.iter().position(|name| *name == row.scene)? as f64;
                Some((column, row.median.max(0.02)))
            });
        let points: Vec<_> = points.collect();
        chart
            .draw_series(LineSeries::new(points.clone(), colour.stroke_width(2)))?
            .label(detector)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(3)));
        chart.draw_series(
            points
                .into_iter()
                .map(|point| Circle::new(point, 3, colour.filled())),
        )?;
    }
    for (column, name) in names.iter().enumerate() {
        let place = (
            column as f64 - 0.4,
            if column % 2 == 0 { 0.024 } else { 0.034 },
        );
        chart.draw_series([Text::new(*name, place, ("sans-serif", 12))])?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}
