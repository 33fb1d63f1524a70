//! Diagrams of lines as SVG, with a legend where there are several.

use std::error::Error;

use plotters::prelude::*;
use qtable::Record;

/// Named points, joined by a line.
pub type Line = (String, Vec<(f64, f64)>);

/// A diagram: some lines, a band around the first, and the interval of the goal.
#[derive(Clone, Debug)]
pub struct Panel {
    title: String,
    across: String,
    lines: Vec<Line>,
    /// Lines in gray behind the others.
    behind: Vec<Vec<(f64, f64)>>,
    band: Vec<(f64, f64, f64)>,
    goal: Option<(f64, f64)>,
    top: Option<f64>,
}

const COLOURS: [RGBColor; 6] = [
    RGBColor(30, 90, 180),
    RGBColor(190, 70, 40),
    RGBColor(40, 140, 70),
    RGBColor(140, 70, 160),
    RGBColor(200, 150, 0),
    RGBColor(90, 90, 90),
];
const GOAL: RGBColor = RGBColor(120, 190, 120);

impl Panel {
    /// Makes a diagram of `lines` over a quantity named `across`.
    pub fn new(title: &str, across: &str, lines: Vec<Line>) -> Self {
        Self {
            title: title.into(),
            across: across.into(),
            lines,
            behind: Vec::new(),
            band: Vec::new(),
            goal: None,
            top: None,
        }
    }

    /// Adds lines in gray behind the others.
    #[must_use]
    pub fn in_front_of(self, behind: Vec<Vec<(f64, f64)>>) -> Self {
        Self { behind, ..self }
    }

    /// Shades the interval of the goal.
    #[must_use]
    pub fn with_goal(self, low: f64, high: f64) -> Self {
        Self {
            goal: Some((low, high)),
            ..self
        }
    }

    /// Sets the upper end of the axis.
    #[must_use]
    pub fn up_to(self, top: f64) -> Self {
        Self {
            top: Some(top),
            ..self
        }
    }

    /// Makes a diagram of the mean over the seeds, with the 95 % interval as band.
    pub fn of_seeds(
        title: &str,
        seeds: &[Vec<Record>],
        value: impl Fn(&Record) -> Option<f64>,
    ) -> Self {
        let (mut mean_line, mut band) = (Vec::new(), Vec::new());
        for i in 0..seeds.iter().map(Vec::len).min().unwrap_or(0) {
            let values: Vec<f64> = seeds.iter().filter_map(|curve| value(&curve[i])).collect();
            if values.is_empty() {
                continue;
            }
            let (mean, half) = mean_and_interval(&values);
            let x = seeds[0][i].actions as f64;
            mean_line.push((x, mean));
            band.push((x, mean - half, mean + half));
        }
        let line = (String::new(), mean_line);
        Self {
            band,
            ..Self::new(title, "actions", vec![line])
        }
    }

    fn draw(
        &self,
        area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    ) -> Result<(), Box<dyn Error>> {
        let lines = self.lines.iter().map(|(_, line)| line);
        let points = || lines.clone().chain(&self.behind).flatten();
        let right = points().map(|p| p.0).fold(1.0, f64::max);
        let highest = points()
            .map(|p| p.1)
            .chain(self.band.iter().map(|b| b.2))
            .chain(self.goal.map(|(_, high)| high))
            .fold(1.0, f64::max);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 15))
            .margin(8)
            .margin_right(18)
            .x_label_area_size(34)
            .y_label_area_size(46)
            .build_cartesian_2d(0.0..right, 0.0..self.top.unwrap_or(1.05 * highest))?;
        let short = |value: &f64| {
            if *value >= 10_000.0 {
                format!("{:.0}k", value / 1000.0)
            } else {
                format!("{value:.0}")
            }
        };
        chart
            .configure_mesh()
            .x_desc(&self.across)
            .x_labels(7)
            .y_labels(6)
            .x_label_formatter(&short)
            .y_label_formatter(&short)
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(230, 230, 235))
            .draw()?;
        if let Some((low, high)) = self.goal {
            let band = Rectangle::new([(0.0, low), (right, high)], GOAL.mix(0.45).filled());
            chart.draw_series([band])?;
        }
        if !self.band.is_empty() {
            let top = self.top.unwrap_or(f64::INFINITY);
            let edge = self
                .band
                .iter()
                .map(|b| (b.0, b.1.max(0.0)))
                .chain(self.band.iter().rev().map(|b| (b.0, b.2.min(top))));
            chart.draw_series([Polygon::new(edge.collect::<Vec<_>>(), COLOURS[0].mix(0.2))])?;
        }
        const GRAY: RGBColor = RGBColor(200, 200, 205);
        for line in &self.behind {
            let points = line.iter().copied();
            chart.draw_series(LineSeries::new(points, GRAY.stroke_width(2)))?;
        }
        for ((name, line), colour) in self.lines.iter().zip(COLOURS.iter().cycle()) {
            let drawn = chart.draw_series(LineSeries::new(
                line.iter().copied(),
                colour.stroke_width(2),
            ))?;
            if !name.is_empty() {
                drawn.label(name).legend(|(x, y)| {
                    PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2))
                });
            }
            if line.len() < 80 {
                chart.draw_series(line.iter().map(|at| Circle::new(*at, 2, colour.filled())))?;
            }
        }
        if self.lines.iter().any(|(name, _)| !name.is_empty()) {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::LowerRight)
                .background_style(WHITE.mix(0.85))
                .border_style(RGBColor(200, 200, 205))
                .label_font(("sans-serif", 12))
                .draw()?;
        }
        Ok(())
    }
}

/// Returns the mean and half the width of its 95 % interval, by Student's factor.
fn mean_and_interval(values: &[f64]) -> (f64, f64) {
    const FACTORS: [f64; 12] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179,
    ];
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let factor = match values.len() {
        0 | 1 => 0.0,
        count => FACTORS.get(count - 2).copied().unwrap_or(2.1),
    };
    (mean, factor * (variance / n).sqrt())
}

/// Draws panels of `size` pixels each in rows of `columns`, as SVG.
///
/// # Errors
/// Those of plotters.
pub fn drawn(
    panels: &[Panel],
    columns: usize,
    (width, height): (u32, u32),
) -> Result<String, Box<dyn Error>> {
    let columns = columns.max(1);
    let rows = panels.len().div_ceil(columns).max(1);
    let mut svg = String::new();
    {
        let size = (width * columns as u32, height * rows as u32);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        for (area, panel) in root.split_evenly((rows, columns)).iter().zip(panels) {
            panel.draw(area)?;
        }
        root.present()?;
    }
    Ok(svg)
}
