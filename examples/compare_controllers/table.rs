//! What the runs came to: shares with intervals, as a table, a file and a picture.

use std::error::Error;
use std::fmt;

use grasp_agent::Outcome;
use pipeline_sim::ErrorLevel;
use plotters::prelude::*;

/// The runs of one controller at one level of errors.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    /// Successes and runs of each drawn cell.
    draws: Vec<(usize, usize)>,
    cycles: usize,
    losses: usize,
}

impl Tally {
    pub(crate) fn begin_draw(&mut self) {
        self.draws.push((0, 0));
    }

    pub(crate) fn add(&mut self, success: bool, outcome: &Outcome) {
        if let Some((successes, runs)) = self.draws.last_mut() {
            *successes += usize::from(success);
            *runs += 1;
        }
        self.cycles += if success { outcome.cycles } else { 0 };
        self.losses += outcome.losses;
    }

    /// Mean share of successes over the cells and half the width of its 95 % interval, percent.
    fn success(&self) -> (f64, f64) {
        let shares: Vec<f64> = self
            .draws
            .iter()
            .filter(|(_, runs)| *runs > 0)
            .map(|(successes, runs)| 100.0 * *successes as f64 / *runs as f64)
            .collect();
        let n = shares.len() as f64;
        let mean = shares.iter().sum::<f64>() / n;
        let variance = shares.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (
            mean,
            if n > 1.0 {
                student(shares.len() - 1) * (variance / n).sqrt()
            } else {
                f64::NAN
            },
        )
    }
}

/// The 97.5 % point of Student's distribution.
fn student(freedom: usize) -> f64 {
    const TABLE: [f64; 16] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145,
        2.131, 2.120,
    ];
    TABLE.get(freedom.saturating_sub(1)).copied().unwrap_or(2.05)
}

/// A row of the table.
pub(crate) struct Row {
    level: ErrorLevel,
    name: String,
    success: (f64, f64),
    cycles: f64,
    losses: f64,
    runs: usize,
}

impl Row {
    pub(crate) const HEADER: &str =
        "level     controller                       success %     cycles  losses/run  runs";

    pub(crate) fn new(level: ErrorLevel, name: &str, tally: &Tally) -> Self {
        let count = |part: fn(&(usize, usize)) -> usize| tally.draws.iter().map(part).sum::<usize>();
        let (successes, runs) = (count(|draw| draw.0), count(|draw| draw.1));
        Self {
            level,
            name: name.into(),
            success: tally.success(),
            cycles: tally.cycles as f64 / successes as f64,
            losses: tally.losses as f64 / runs as f64,
            runs,
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            level,
            name,
            success: (mean, half),
            cycles,
            losses,
            runs,
        } = self;
        write!(
            f,
            "{:9} {name:30} {mean:6.1} +-{half:5.1} {cycles:9.1} {losses:11.2} {runs:5}",
            level.to_string()
        )
    }
}

pub(crate) fn csv(rows: &[Row]) -> String {
    let mut csv = String::from("level,controller,success_percent,half_interval,cycles,losses_per_run,runs\n");
    for Row {
        level,
        name,
        success: (mean, half),
        cycles,
        losses,
        runs,
    } in rows
    {
        csv += &format!("{level},\"{name}\",{mean:.3},{half:.3},{cycles:.3},{losses:.4},{runs}\n");
    }
    csv
}

/// Success over cycles, a panel a level.
pub(crate) fn plot(rows: &[Row]) -> Result<String, Box<dyn Error>> {
    let mut levels: Vec<ErrorLevel> = rows.iter().map(|row| row.level).collect();
    levels.dedup();
    let mut svg = String::new();
    {
        let root =
            SVGBackend::with_string(&mut svg, (1100, 360 * levels.len().max(1) as u32)).into_drawing_area();
        root.fill(&WHITE)?;
        for (area, level) in root.split_evenly((levels.len().max(1), 1)).iter().zip(&levels) {
            let mut chart = ChartBuilder::on(area)
                .caption(format!("errors: {level}"), ("sans-serif", 18))
                .margin(8)
                .x_label_area_size(36)
                .y_label_area_size(44)
                .build_cartesian_2d(0.0..30.0, 0.0..105.0)?;
            chart
                .configure_mesh()
                .x_desc("moves of a successful run")
                .y_desc("success, %")
                .draw()?;
            for row in rows
                .iter()
                .filter(|row| row.level == *level && row.cycles.is_finite())
            {
                let ours = row.name.starts_with("hybrid");
                let colour = if ours {
                    RGBColor(200, 40, 40)
                } else {
                    RGBColor(60, 90, 160)
                };
                let (x, y, half) = (
                    row.cycles,
                    row.success.0,
                    if row.success.1.is_finite() {
                        row.success.1
                    } else {
                        0.0
                    },
                );
                chart.draw_series([PathElement::new(
                    [(x, (y - half).max(0.0)), (x, (y + half).min(100.0))],
                    colour.stroke_width(1),
                )])?;
                chart.draw_series([Circle::new((x, y), 4, colour.filled())])?;
                chart.draw_series([Text::new(
                    row.name.clone(),
                    (x + 0.25, y - 1.0),
                    ("sans-serif", 11),
                )])?;
            }
        }
        root.present()?;
    }
    Ok(svg)
}
