//! Diagrams of lines as SVG, with a legend where there are several.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use qtable::Record;

use crate::files::write_whole;
use crate::program::Outcome;

/// Named points, joined by a line.
pub type Line = (String, Vec<(f64, f64)>);

/// A diagram: some lines, a band around the first, and the interval of the goal.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Words above the diagram.
    pub title: String,
    /// Quantity of the horizontal axis.
    pub across: String,
    /// Quantity of the vertical axis.
    pub up: String,
    /// Lines, each in a colour of its own.
    pub lines: Vec<Line>,
    /// Lines in gray behind the others, each of another run.
    pub behind: Vec<Vec<(f64, f64)>>,
    /// Place, lower and upper end of the band.
    pub band: Vec<(f64, f64, f64)>,
    /// Points at which the ball was lost, marked by a cross.
    pub lost: Vec<(f64, f64)>,
    /// Interval that is shaded.
    pub goal: Option<(f64, f64)>,
    /// Upper end of the vertical axis, by default a little above the highest point.
    pub top: Option<f64>,
}

const COLOURS: [RGBColor; 6] = [
    RGBColor(30, 90, 180),
    RGBColor(190, 70, 40),
    RGBColor(140, 70, 160),
    RGBColor(200, 150, 0),
    RGBColor(90, 90, 90),
    RGBColor(0, 140, 150),
];
const GOAL: RGBColor = RGBColor(120, 190, 120);
const GRAY: RGBColor = RGBColor(200, 200, 205);

/// Quantity drawn as a learning curve: its name, its value in a record, and the end of its axis.
pub type Curve = (&'static str, fn(&Record) -> Option<f64>, Option<f64>);

/// Success and error of learning, over the actions.
pub const CURVES: [Curve; 2] = [
    (
        "episodes that reach the goal, %",
        |record| Some(100.0 * record.success_share?),
        Some(105.0),
    ),
    (
        "mean error of Q, grows with its values",
        |record| record.mean_td_error,
        None,
    ),
];

impl Panel {
    /// Makes a diagram of the mean over several learning curves, with its 95 % interval as band.
    pub fn of_learning(title: &str, (up, value, top): Curve, seeds: &[Vec<Record>]) -> Self {
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
        Self {
            title: title.into(),
            across: "actions".into(),
            up: up.into(),
            lines: vec![(String::new(), mean_line)],
            band: if seeds.len() > 1 { band } else { Vec::new() },
            top,
            ..Self::default()
        }
    }

    fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Outcome {
        let lines = self.lines.iter().map(|(_, line)| line);
        let points = || lines.clone().chain(&self.behind).flatten();
        let right = points().map(|p| p.0).fold(1.0, f64::max);
        let highest = points()
            .map(|p| p.1)
            .chain(self.band.iter().map(|b| b.2))
            .chain(self.goal.map(|(_, high)| high))
            .fold(1.0, f64::max);
        let top = self.top.unwrap_or(1.05 * highest);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 15))
            .margin(8)
            .margin_right(18)
            .x_label_area_size(34)
            .y_label_area_size(46)
            .build_cartesian_2d(0.0..right, 0.0..top)?;
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
            .y_desc(&self.up)
            .x_labels(7)
            .y_labels(6)
            .x_label_formatter(&short)
            .y_label_formatter(&short)
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(230, 230, 235))
            .draw()?;
        if let Some((low, high)) = self.goal {
            let band = Rectangle::new([(0.0, low), (right, high)], GOAL.mix(0.45).filled());
            chart.draw_series([band])?.label("goal").legend(|(x, y)| {
                Rectangle::new([(x, y - 5), (x + 16, y + 5)], GOAL.mix(0.45).filled())
            });
        }
        if !self.band.is_empty() {
            let lower = self.band.iter().map(|b| (b.0, b.1.max(0.0)));
            let upper = self.band.iter().rev().map(|b| (b.0, b.2.min(top)));
            let edge: Vec<_> = lower.chain(upper).collect();
            let colour = COLOURS[0].mix(0.2);
            chart
                .draw_series([Polygon::new(edge, colour)])?
                .label("95 % interval of the mean")
                .legend(move |(x, y)| {
                    Rectangle::new([(x, y - 5), (x + 16, y + 5)], colour.filled())
                });
        }
        for (number, line) in self.behind.iter().enumerate() {
            let style = GRAY.stroke_width(2);
            let drawn = chart.draw_series(LineSeries::new(line.iter().copied(), style))?;
            if number == 0 {
                drawn
                    .label("other runs")
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
            }
        }
        for ((name, line), colour) in self.lines.iter().zip(COLOURS.iter().cycle()) {
            let style = colour.stroke_width(2);
            let drawn = chart.draw_series(LineSeries::new(line.iter().copied(), style))?;
            if !name.is_empty() {
                drawn
                    .label(name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
            }
            if (3..80).contains(&line.len()) {
                chart.draw_series(line.iter().map(|at| Circle::new(*at, 2, colour.filled())))?;
            }
        }
        if !self.lost.is_empty() {
            let cross = |at: (f64, f64)| Cross::new(at, 5, BLACK.stroke_width(2));
            chart
                .draw_series(self.lost.iter().map(|at| cross(*at)))?
                .label("lost after this move")
                .legend(|(x, y)| Cross::new((x + 8, y), 5, BLACK.stroke_width(2)));
        }
        let named = self.lines.iter().any(|(name, _)| !name.is_empty());
        if named || self.goal.is_some() || !self.band.is_empty() || !self.lost.is_empty() {
            chart
                .configure_series_labels()
                .position(self.free_corner(right, top))
                .background_style(WHITE.mix(0.85))
                .border_style(GRAY)
                .label_font(("sans-serif", 12))
                .draw()?;
        }
        Ok(())
    }

    /// Returns the corner for the legend that the lines pass through least.
    fn free_corner(&self, right: f64, top: f64) -> SeriesLabelPosition {
        /// Share of the diagram that a legend takes at most.
        const SIZE: (f64, f64) = (0.42, 0.35);
        let along = |ends: &[(f64, f64)]| {
            let [(x0, y0), (x1, y1)] = [ends[0], ends[1]];
            (0..=20).map(move |i| {
                let t = f64::from(i) / 20.0;
                ((x0 + t * (x1 - x0)) / right, (y0 + t * (y1 - y0)) / top)
            })
        };
        let lines = || self.lines.iter().map(|(_, line)| line).chain(&self.behind);
        let points = || lines().flat_map(|line| line.windows(2).flat_map(along));
        let corners = [
            (SeriesLabelPosition::LowerRight, false, true),
            (SeriesLabelPosition::UpperRight, true, true),
            (SeriesLabelPosition::LowerLeft, false, false),
            (SeriesLabelPosition::UpperLeft, true, false),
        ];
        let inside = |upper: bool, at_right: bool| {
            let beyond = |place: f64, far: bool, size: f64| match far {
                true => place > 1.0 - size,
                false => place < size,
            };
            let hidden =
                |(x, y): &(f64, f64)| beyond(*x, at_right, SIZE.0) && beyond(*y, upper, SIZE.1);
            points().filter(hidden).count()
        };
        let least = corners
            .into_iter()
            .min_by_key(|(_, upper, at_right)| inside(*upper, *at_right));
        least.map_or(SeriesLabelPosition::LowerRight, |(corner, ..)| corner)
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

/// Writes panels of `size` pixels each, in rows of `columns`, as SVG.
///
/// # Errors
/// Those of plotters, and a file that cannot be written.
pub fn write_svg(path: &Path, panels: &[Panel], columns: usize, size: (u32, u32)) -> Outcome {
    let rows = panels.len().div_ceil(columns).max(1);
    let mut svg = String::new();
    {
        let size = (size.0 * columns as u32, size.1 * rows as u32);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        for (area, panel) in root.split_evenly((rows, columns)).iter().zip(panels) {
            panel.draw(area)?;
        }
        root.present()?;
    }
    write_whole(path, svg.as_bytes())
}
