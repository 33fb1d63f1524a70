//! The learning curves (Fig. 6 of the paper) and the features per step (Fig. 7), as SVG.

use std::error::Error;
use std::ops::Range;

use hough_heuristic::Features;
use plotters::prelude::*;
use qtable::{Record, TrainReport};

use crate::record::RunRecord;

const INK: RGBColor = RGBColor(40, 40, 60);
const GOAL: RGBColor = RGBColor(120, 190, 120);

type Drawn = Result<String, Box<dyn Error>>;

/// Share of episodes that reached the goal and mean size of the error of Q, over the actions made
/// so far.
pub(crate) fn learning_curves(curves: &[(&str, &TrainReport)]) -> Drawn {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (1000, 360 * curves.len() as u32))
            .into_drawing_area();
        root.fill(&WHITE)?;
        for (area, (name, report)) in root.split_evenly((curves.len(), 1)).iter().zip(curves) {
            let columns = area.split_evenly((1, 2));
            let end = report
                .curve
                .last()
                .map_or(1.0, |record| record.actions as f64);
            let success = curve(report, |record| Some(100.0 * record.success_share?));
            panel(
                &columns[0],
                &format!("{name}: goal reached, % of episodes"),
                "actions",
                0.0..end,
                0.0..100.0,
                None,
                &[(success, RGBColor(30, 90, 180))],
            )?;
            let errors = curve(report, |record| record.mean_td_error);
            let top = errors.iter().map(|(_, error)| *error).fold(1.0, f64::max);
            panel(
                &columns[1],
                &format!("{name}: mean error of Q"),
                "actions",
                0.0..end,
                0.0..top * 1.05,
                None,
                &[(errors, RGBColor(180, 60, 40))],
            )?;
        }
        root.present()?;
    }
    Ok(svg)
}

/// One quantity of a learning curve over the actions made, where it is known.
fn curve(report: &TrainReport, pick: impl Fn(&Record) -> Option<f64>) -> Vec<(f64, f64)> {
    report
        .curve
        .iter()
        .filter_map(|record| Some((record.actions as f64, pick(record)?)))
        .collect()
}

/// x, y and r at every step of every run, with the goal interval shaded; three runs from far,
/// middle and near stand out.
pub(crate) fn features_per_step(runs: &[RunRecord]) -> Drawn {
    let mut tracks: Vec<Vec<(usize, Features)>> = runs
        .iter()
        .map(RunRecord::track)
        .filter(|t| !t.is_empty())
        .collect();
    tracks.sort_by(|a, b| a[0].1.r.total_cmp(&b[0].1.r));
    let steps = tracks
        .iter()
        .flat_map(|t| t.last())
        .map(|(step, _)| *step)
        .max()
        .unwrap_or(1)
        .max(1) as f64;
    let distinct = [
        (0, RGBColor(30, 90, 180), "the farthest start"),
        (
            tracks.len() / 2,
            RGBColor(180, 60, 40),
            "a start in between",
        ),
        (
            tracks.len().saturating_sub(1),
            RGBColor(200, 140, 0),
            "the nearest start",
        ),
    ];
    const OTHERS: RGBColor = RGBColor(200, 200, 205);
    let colour = |index: usize| {
        distinct
            .iter()
            .find(|(i, ..)| *i == index)
            .map_or(OTHERS, |(_, colour, _)| *colour)
    };
    // Gray lines first, so that the coloured ones lie on top.
    let mut order: Vec<usize> = (0..tracks.len()).collect();
    order.sort_by_key(|index| distinct.iter().any(|(i, ..)| i == index));

    type Pick = fn(&Features) -> f64;
    let panels: [(&str, Range<f64>, Range<f64>, Pick); 3] = [
        ("x", 0.0..192.0, 99.0..108.0, |f| f.x),
        ("y", 0.0..144.0, 74.0..82.0, |f| f.y),
        ("r", 0.0..68.0, 32.0..34.0, |f| f.r),
    ];
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (900, 930)).into_drawing_area();
        root.fill(&WHITE)?;
        let (top, below) = root.split_vertically(30);
        let goal_key = ("goal", GOAL.mix(0.5));
        let keys = distinct
            .iter()
            .map(|(_, colour, words)| (*words, colour.mix(1.0)));
        legend(
            &top,
            keys.chain([("other runs", OTHERS.mix(1.0)), goal_key]),
        )?;
        for (area, (name, range, goal, pick)) in below.split_evenly((3, 1)).iter().zip(panels) {
            let lines: Vec<Line> = order
                .iter()
                .map(|&i| {
                    (
                        tracks[i]
                            .iter()
                            .map(|(step, f)| (*step as f64, pick(f)))
                            .collect(),
                        colour(i),
                    )
                })
                .collect();
            panel(
                area,
                &format!("{name} (feature units)"),
                "step",
                0.0..steps,
                range,
                Some(goal),
                &lines,
            )?;
        }
        root.present()?;
    }
    Ok(svg)
}

/// What the colours mean, in a row.
fn legend<'a>(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    keys: impl Iterator<Item = (&'a str, RGBAColor)>,
) -> Result<(), Box<dyn Error>> {
    let words = ("sans-serif", 14).into_font().color(&INK);
    for ((text, colour), x) in keys.zip((70..).step_by(165)) {
        area.draw(&Rectangle::new([(x, 13), (x + 22, 19)], colour.filled()))?;
        area.draw(&Text::new(text, (x + 28, 9), words.clone()))?;
    }
    Ok(())
}

type Line = (Vec<(f64, f64)>, RGBColor);

fn panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    title: &str,
    x_label: &str,
    x: Range<f64>,
    y: Range<f64>,
    goal: Option<Range<f64>>,
    lines: &[Line],
) -> Result<(), Box<dyn Error>> {
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 17).into_font().color(&INK))
        .margin(12)
        .margin_right(28)
        .x_label_area_size(38)
        .y_label_area_size(52)
        .build_cartesian_2d(x.clone(), y)?;
    chart
        .configure_mesh()
        .x_desc(x_label)
        .x_labels(7)
        .x_label_formatter(&|value| {
            if *value >= 1000.0 {
                format!("{:.0}k", value / 1000.0)
            } else {
                format!("{value:.0}")
            }
        })
        .y_label_formatter(&|value| format!("{value:.0}"))
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(230, 230, 235))
        .draw()?;
    if let Some(goal) = goal {
        let band = Rectangle::new(
            [(x.start, goal.start), (x.end, goal.end)],
            GOAL.mix(0.5).filled(),
        );
        chart.draw_series([band])?;
    }
    for (points, colour) in lines {
        chart.draw_series(LineSeries::new(
            points.iter().copied(),
            colour.stroke_width(2),
        ))?;
        if lines.len() > 1 {
            chart.draw_series(points.iter().map(|at| Circle::new(*at, 2, colour.filled())))?;
        }
    }
    Ok(())
}
