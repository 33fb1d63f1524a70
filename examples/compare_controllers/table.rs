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
    /// How often the hand ran into something; counted through the full chain only.
    pub(crate) collisions: Option<usize>,
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

    /// A run that was broken off.
    pub(crate) fn add_broken_off(&mut self) {
        if let Some((_, runs)) = self.draws.last_mut() {
            *runs += 1;
        }
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
                (student(shares.len() - 1) * (variance / n).sqrt()).min(100.0)
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
    collisions: Option<usize>,
    runs: usize,
}

impl Row {
    pub(crate) const HEADER: &str =
        "level     controller                         success %     cycles  losses/run  collisions  runs";

    pub(crate) fn new(level: ErrorLevel, name: &str, tally: &Tally) -> Self {
        let count = |part: fn(&(usize, usize)) -> usize| tally.draws.iter().map(part).sum::<usize>();
        let (successes, runs) = (count(|draw| draw.0), count(|draw| draw.1));
        Self {
            level,
            name: name.into(),
            success: tally.success(),
            cycles: tally.cycles as f64 / successes as f64,
            losses: tally.losses as f64 / runs as f64,
            collisions: tally.collisions,
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
            collisions,
            runs,
        } = self;
        // One cell has no interval, and no success no moves.
        let interval = number(*half, |half| format!("+-{half:5.1}"));
        let cycles = number(*cycles, |cycles| format!("{cycles:.1}"));
        let collisions = collisions.map_or("-".into(), |count| count.to_string());
        write!(
            f,
            "{:9} {name:32} {mean:6.1} {interval:7} {cycles:>9} {losses:11.2} {collisions:>11} {runs:5}",
            level.to_string()
        )
    }
}

/// A number in words, none for what is none.
fn number(value: f64, words: impl FnOnce(f64) -> String) -> String {
    if value.is_finite() {
        words(value)
    } else {
        String::new()
    }
}

pub(crate) fn csv(rows: &[Row]) -> String {
    let mut csv = String::from(
        "level,controller,success_percent,half_interval,cycles,losses_per_run,collisions,runs\n",
    );
    for Row {
        level,
        name,
        success: (mean, half),
        cycles,
        losses,
        collisions,
        runs,
    } in rows
    {
        let collisions = collisions.map_or(String::new(), |count| count.to_string());
        let [half, cycles] = [*half, *cycles].map(|value| number(value, |value| format!("{value:.3}")));
        csv += &format!("{level},\"{name}\",{mean:.3},{half},{cycles},{losses:.4},{collisions},{runs}\n");
    }
    csv
}

/// A bar for each controller and level: how long it is says how often the goal was reached, a line across its end how sure that is, and
/// words how many moves it took.
pub(crate) fn plot(rows: &[Row]) -> Result<String, Box<dyn Error>> {
    const NAMES: i32 = 210;
    const COLUMN: i32 = 190;
    const BAR: i32 = 100;
    const LINE: i32 = 22;
    const HEAD: i32 = 40;
    let mut levels: Vec<ErrorLevel> = Vec::new();
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !levels.contains(&row.level) {
            levels.push(row.level);
        }
        if !names.contains(&row.name.as_str()) {
            names.push(&row.name);
        }
    }
    let size = (
        (NAMES + COLUMN * levels.len() as i32) as u32,
        (HEAD + LINE * names.len() as i32 + 12) as u32,
    );
    let ink = RGBColor(40, 40, 60);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let words = |size: i32| ("sans-serif", size).into_font().color(&ink);
        root.draw(&Text::new("% at the goal / moves", (10, 14), words(13)))?;
        for (level, left) in levels.iter().zip((NAMES..).step_by(COLUMN as usize)) {
            root.draw(&Text::new(format!("errors: {level}"), (left, 14), words(14)))?;
        }
        for row in rows {
            let of = |found: Option<usize>| found.unwrap_or(0) as i32;
            let left = NAMES + COLUMN * of(levels.iter().position(|level| *level == row.level));
            let line = of(names.iter().position(|name| *name == row.name));
            let top = HEAD + LINE * line;
            if left == NAMES {
                root.draw(&Text::new(row.name.clone(), (10, top + 2), words(13)))?;
            }
            let colour = if row.name.starts_with("hybrid") {
                RGBColor(200, 60, 50)
            } else {
                RGBColor(90, 120, 185)
            };
            let (mean, half) = row.success;
            let at = |percent: f64| left + (0.01 * f64::from(BAR) * percent.clamp(0.0, 100.0)) as i32;
            let bar = |to: i32, style: ShapeStyle| Rectangle::new([(left, top), (to, top + LINE - 7)], style);
            root.draw(&bar(left + BAR, RGBColor(236, 236, 241).filled()))?;
            root.draw(&bar(at(mean), colour.filled()))?;
            if half > 0.0 {
                let middle = top + (LINE - 7) / 2;
                let ends = vec![(at(mean - half), middle), (at(mean + half), middle)];
                root.draw(&PathElement::new(ends, ink.stroke_width(1)))?;
            }
            let moves = if row.cycles.is_finite() {
                format!("{mean:.1} / {:.1}", row.cycles)
            } else {
                format!("{mean:.1} / -")
            };
            root.draw(&Text::new(moves, (left + BAR + 6, top + 2), words(12)))?;
        }
        root.present()?;
    }
    Ok(svg)
}
