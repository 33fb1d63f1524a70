//! Results of the runs: shares with intervals, as a table, a file and a picture.

use std::error::Error;
use std::fmt;

use grasp_agent::RunOutcome;
use pipeline_sim::ErrorLevel;
use plotters::prelude::*;

use crate::wilson::wilson;

/// The runs of one controller at one level of errors.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Successes and runs of each drawn cell.
    pub draws: Vec<(usize, usize)>,
    cycles: usize,
    losses: usize,
    /// Collisions of the hand; counted through the full chain only.
    pub collisions: Option<usize>,
}

impl Tally {
    /// Begins the runs of another cell.
    pub fn begin_draw(&mut self) {
        self.draws.push((0, 0));
    }

    /// Adds a run.
    pub fn add(&mut self, success: bool, outcome: &RunOutcome) {
        if let Some((successes, runs)) = self.draws.last_mut() {
            *successes += usize::from(success);
            *runs += 1;
        }
        self.cycles += if success { outcome.cycles } else { 0 };
        self.losses += outcome.losses;
    }

    /// Adds a run that was broken off.
    pub fn add_broken_off(&mut self) {
        if let Some((_, runs)) = self.draws.last_mut() {
            *runs += 1;
        }
    }

    /// Returns the mean share of successes over the cells, percent.
    fn success(&self) -> f64 {
        let shares = self.shares();
        100.0 * shares.iter().sum::<f64>() / shares.len() as f64
    }

    /// Returns its 95 % interval by Wilson, percent, with each cell counting as one trial. The
    /// interval holds however alike the runs of a cell are. NaN without cells.
    fn interval(&self) -> [f64; 2] {
        wilson(0.01 * self.success(), self.shares().len() as f64)
    }

    /// Returns the number of cells in which all runs succeeded.
    fn whole_cells(&self) -> usize {
        self.shares().iter().filter(|share| **share >= 1.0).count()
    }

    fn shares(&self) -> Vec<f64> {
        let counted = self.draws.iter().filter(|(_, runs)| *runs > 0);
        counted
            .map(|(successes, runs)| *successes as f64 / *runs as f64)
            .collect()
    }
}

/// A row of the table.
#[derive(Clone, Debug)]
pub struct Row {
    level: ErrorLevel,
    name: String,
    success: f64,
    interval: [f64; 2],
    whole_cells: usize,
    cells: usize,
    cycles: f64,
    losses: f64,
    collisions: Option<usize>,
    runs: usize,
}

impl Row {
    /// Names of the columns.
    pub const HEADER: &str = "level     controller                       success %  95 % interval  \
                              cells without failure  cycles  losses/run  collisions  runs";

    /// Makes the row of controller `name` at a level of errors.
    pub fn new(level: ErrorLevel, name: &str, tally: &Tally) -> Self {
        let count =
            |part: fn(&(usize, usize)) -> usize| tally.draws.iter().map(part).sum::<usize>();
        let (successes, runs) = (count(|draw| draw.0), count(|draw| draw.1));
        Self {
            level,
            name: name.into(),
            success: tally.success(),
            interval: tally.interval(),
            whole_cells: tally.whole_cells(),
            cells: tally.shares().len(),
            cycles: tally.cycles as f64 / successes as f64,
            losses: tally.losses as f64 / runs as f64,
            collisions: tally.collisions,
            runs,
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (level, [low, high]) = (self.level.to_string(), self.interval);
        let interval = number(low, |low| format!("{low:.1}..{high:.1}"));
        let whole = format!("{} of {}", self.whole_cells, self.cells);
        // NaN without a success.
        let cycles = number(self.cycles, |cycles| format!("{cycles:.1}"));
        let collisions = self
            .collisions
            .map_or("-".into(), |count| count.to_string());
        let (name, success, losses, runs) = (&self.name, self.success, self.losses, self.runs);
        write!(
            f,
            "{level:9} {name:32} {success:9.1} {interval:>14} {whole:>22} {cycles:>7} "
        )?;
        write!(f, "{losses:11.2} {collisions:>11} {runs:5}")
    }
}

/// Formats a finite number; empty for any other.
fn number(value: f64, words: impl FnOnce(f64) -> String) -> String {
    if value.is_finite() {
        words(value)
    } else {
        String::new()
    }
}

/// Returns the rows as CSV.
pub fn csv(rows: &[Row]) -> String {
    let mut csv = String::from(
        "level,controller,success_percent,low,high,cells_without_failure,cells,cycles,\
         losses_per_run,collisions,runs\n",
    );
    for row in rows {
        let collisions = row
            .collisions
            .map_or(String::new(), |count| count.to_string());
        let [success, low, high, cycles] =
            [row.success, row.interval[0], row.interval[1], row.cycles]
                .map(|value| number(value, |value| format!("{value:.3}")));
        let (level, name, losses, runs) = (row.level, &row.name, row.losses, row.runs);
        let cells = format!("{},{}", row.whole_cells, row.cells);
        csv += &format!("{level},\"{name}\",{success},{low},{high},{cells},{cycles},");
        csv += &format!("{losses:.4},{collisions},{runs}\n");
    }
    csv
}

/// Draws a bar per controller and level: the share of success, which `success` names, its interval
/// as a line, and the mean number of moves in words.
pub fn plot(rows: &[Row], success: &str) -> Result<String, Box<dyn Error>> {
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
        root.draw(&Text::new(
            format!("% {success} / moves"),
            (10, 14),
            words(13),
        ))?;
        for (level, left) in levels.iter().zip((NAMES..).step_by(COLUMN as usize)) {
            root.draw(&Text::new(
                format!("errors: {level}"),
                (left, 14),
                words(14),
            ))?;
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
            let (mean, [low, high]) = (row.success, row.interval);
            let at =
                |percent: f64| left + (0.01 * f64::from(BAR) * percent.clamp(0.0, 100.0)) as i32;
            let bar = |to: i32, style: ShapeStyle| {
                Rectangle::new([(left, top), (to, top + LINE - 7)], style)
            };
            root.draw(&bar(left + BAR, RGBColor(236, 236, 241).filled()))?;
            root.draw(&bar(at(mean), colour.filled()))?;
            if low < high {
                let middle = top + (LINE - 7) / 2;
                let ends = vec![(at(low), middle), (at(high), middle)];
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
