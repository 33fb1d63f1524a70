//! Results of the compared controllers: shares with intervals, as a table, a file and a picture.

use std::fmt;

use pipeline_sim::ErrorLevel;
use plotters::prelude::*;

use crate::program::Outcome;
use crate::tally::{Tally, wilson};

/// Results of one controller at one level of errors.
#[derive(Clone, Debug)]
pub struct Row {
    level: ErrorLevel,
    name: String,
    /// Mean share of successes over the cells, percent.
    success: f64,
    /// Its 95 % interval, percent, with each cell counting as one trial: it holds however alike the
    /// runs of a cell are. NaN without cells.
    interval: [f64; 2],
    /// Number of cells in which all runs succeeded, of those with runs.
    whole_cells: usize,
    cells: usize,
    /// Moves of a success, NaN without one.
    cycles: f64,
    losses: f64,
    collisions: Option<usize>,
    runs: usize,
}

impl Row {
    /// Names of the columns of the printed table.
    pub const HEADER: &str = "level     controller                       success %  95 % interval  \
                              cells without failure   moves  losses/run  collisions  runs";
    /// Names of the columns of the file.
    pub const CSV_HEADER: &str = "level,controller,success_percent,low,high,\
                                  cells_without_failure,cells,cycles,losses_per_run,collisions,\
                                  runs,free_cells,free_success_percent,free_low,free_high";

    /// Makes the row of controller `name` at a level of errors.
    pub fn new(level: ErrorLevel, name: &str, tally: &Tally) -> Self {
        let cells = tally.by_cell();
        let tried = cells.iter().filter(|(_, runs)| *runs > 0);
        let shares: Vec<f64> = tried
            .map(|(part, runs)| *part as f64 / *runs as f64)
            .collect();
        let success = 100.0 * shares.iter().sum::<f64>() / shares.len() as f64;
        let successes = || tally.runs().filter(|run| run.success);
        let runs = tally.runs().count();
        Self {
            level,
            name: name.into(),
            success,
            interval: wilson(0.01 * success, shares.len() as f64),
            whole_cells: shares.iter().filter(|share| **share >= 1.0).count(),
            cells: shares.len(),
            cycles: successes().map(|run| run.moves).sum::<usize>() as f64
                / successes().count() as f64,
            losses: tally.runs().map(|run| run.losses).sum::<usize>() as f64 / runs as f64,
            collisions: tally.collisions(),
            runs,
        }
    }

    /// Returns the row of the file; `free` is that of the cells whose goal is free of the hand.
    pub fn csv(&self, free: &Self) -> String {
        let of = |row: &Self| [row.success, row.interval[0], row.interval[1]];
        let [success, low, high] = of(self).map(|value| number(value, 3));
        let cycles = number(self.cycles, 3);
        let in_free = of(free).map(|value| number(value, 3)).join(",");
        let collisions = self
            .collisions
            .map_or(String::new(), |count| count.to_string());
        let (level, name, whole, cells) = (self.level, &self.name, self.whole_cells, self.cells);
        let (losses, runs, free) = (self.losses, self.runs, free.cells);
        format!(
            "{level},\"{name}\",{success},{low},{high},{whole},{cells},{cycles},{losses:.4},\
             {collisions},{runs},{free},{in_free}"
        )
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (level, [low, high]) = (
            self.level.to_string(),
            self.interval.map(|end| number(end, 1)),
        );
        let interval = if low.is_empty() {
            low
        } else {
            format!("{low}..{high}")
        };
        let whole = format!("{} of {}", self.whole_cells, self.cells);
        let cycles = number(self.cycles, 1);
        let collisions = self
            .collisions
            .map_or("-".into(), |count| count.to_string());
        let (name, success, losses, runs) = (&self.name, self.success, self.losses, self.runs);
        write!(
            f,
            "{level:9} {name:32} {success:9.1} {interval:>14} {whole:>22} {cycles:>7} \
             {losses:11.2} {collisions:>11} {runs:5}"
        )
    }
}

/// Formats a finite number; empty for any other.
fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() {
        format!("{value:.decimals$}")
    } else {
        String::new()
    }
}

/// Draws a bar per controller and level: the mean number of moves of a success, and beside it in
/// words the share of success, which `success` names.
///
/// # Errors
/// Those of plotters.
pub fn plot(rows: &[Row], success: &str) -> Outcome<String> {
    const NAMES: i32 = 210;
    const COLUMN: i32 = 240;
    const BAR: f64 = 100.0;
    const LINE: i32 = 22;
    const HEAD: i32 = 60;
    let mut levels: Vec<ErrorLevel> = rows.iter().map(|row| row.level).collect();
    levels.dedup();
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.name.as_str()) {
            names.push(&row.name);
        }
    }
    let most = rows.iter().map(|row| row.cycles).fold(1.0, f64::max);
    let size = (
        (NAMES + COLUMN * levels.len() as i32).max(640),
        HEAD + LINE * names.len() as i32 + 12,
    );
    let ink = RGBColor(40, 40, 60);
    let mut svg = String::new();
    {
        let size = (size.0 as u32, size.1 as u32);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let words = |text: String, at: (i32, i32), size: i32| {
            Text::new(text, at, ("sans-serif", size).into_font().color(&ink))
        };
        let title = format!("Bars and numbers: moves of a run that succeeded. Percent: {success}.")
            + " Green: calibrates itself.";
        root.draw(&words(title, (10, 10), 13))?;
        for (level, left) in levels.iter().zip((NAMES..).step_by(COLUMN as usize)) {
            root.draw(&words(format!("errors: {level}"), (left, 34), 14))?;
        }
        for row in rows {
            let of = |found: Option<usize>| found.unwrap_or(0) as i32;
            let left = NAMES + COLUMN * of(levels.iter().position(|level| *level == row.level));
            let top = HEAD + LINE * of(names.iter().position(|name| *name == row.name));
            if left == NAMES {
                root.draw(&words(row.name.clone(), (10, top + 2), 13))?;
            }
            let colour = if row.name.starts_with("hybrid") {
                RGBColor(20, 140, 120)
            } else {
                RGBColor(90, 120, 185)
            };
            let (moves, text) = if row.cycles.is_finite() {
                (
                    row.cycles,
                    format!("{:.1} moves, {:.1} %", row.cycles, row.success),
                )
            } else {
                (0.0, "no success".into())
            };
            let right = left + (BAR * moves / most) as i32;
            let corners = [(left, top), (right, top + LINE - 7)];
            root.draw(&Rectangle::new(corners, colour.filled()))?;
            root.draw(&words(text, (left + BAR as i32 + 6, top + 2), 12))?;
        }
        root.present()?;
    }
    Ok(svg)
}
