//! A sweep over cells: the part of it that a process does, and its results in files.

use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

use pipeline_sim::ErrorLevel;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::comparison::{self, Row};
use crate::files::writable_folder;
use crate::prelude::*;
use crate::tally::{Counted, Tally};

/// One part of a sweep, of several equal ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shard {
    part: usize,
    of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text:?} is no part: write I/N with I in 1..=N, 2/8 for example");
        let (part, of) = text.split_once('/').ok_or_else(wrong)?;
        let (part, of) = (part.parse(), of.parse());
        match (part, of) {
            (Ok(part), Ok(of)) if (1..=of).contains(&part) => Ok(Self { part, of }),
            _ => Err(wrong()),
        }
    }
}

impl Shard {
    /// Returns `true` if a cell of the sweep belongs to the part.
    pub(crate) fn has(self, cell: usize) -> bool {
        cell % self.of + 1 == self.part
    }
}

/// Settings on which the result of a cell depends, and the names of the compared controllers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Settings {
    pub(crate) version: String,
    pub(crate) seed: u64,
    pub(crate) draws: usize,
    pub(crate) starts: usize,
    pub(crate) moves: usize,
    pub(crate) levels: Vec<String>,
    pub(crate) odd: Vec<String>,
    pub(crate) arm: String,
    pub(crate) grip: bool,
    pub(crate) taught_goal: bool,
    pub(crate) full_chain: bool,
    pub(crate) detector: String,
    pub(crate) controllers: Vec<String>,
}

impl Settings {
    /// Returns the name of the first setting that differs.
    fn difference(&self, other: &Self) -> Outcome<Option<String>> {
        let (Value::Object(mine), other) =
            (serde_json::to_value(self)?, serde_json::to_value(other)?)
        else {
            return Ok(None);
        };
        let differs = |(name, value): &(String, Value)| other.get(name) != Some(value);
        Ok(mine.into_iter().find(differs).map(|(name, _)| name))
    }
}

/// One run of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Run {
    success: bool,
    moves: usize,
    losses: usize,
    collisions: Option<usize>,
}

/// The runs in one cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct CellRuns {
    /// Runs of each controller, in the order of the settings.
    runs: Vec<Vec<Run>>,
    /// `true` if the goal could not be shown in the cell.
    pub(crate) unshown: bool,
    /// `true` if the sensors respond to the ball wherever it shows in the goal.
    forbidden: bool,
    /// Time that the cell took.
    seconds: f64,
}

impl CellRuns {
    /// Takes the runs of a cell that was begun at a time.
    pub(crate) fn new(
        runs: &[Vec<Counted>],
        [unshown, forbidden]: [bool; 2],
        begun: Instant,
    ) -> Self {
        let run = |counted: &Counted| Run {
            success: counted.success,
            moves: counted.moves,
            losses: counted.losses,
            collisions: counted.collisions,
        };
        let of_controller = |runs: &Vec<Counted>| runs.iter().map(run).collect();
        Self {
            runs: runs.iter().map(of_controller).collect(),
            unshown,
            forbidden,
            seconds: begun.elapsed().as_secs_f64(),
        }
    }

    fn counted(&self, controller: usize) -> Vec<Counted> {
        let counted = |run: &Run| Counted {
            success: run.success,
            moves: run.moves,
            losses: run.losses,
            collisions: run.collisions,
            ..Counted::default()
        };
        self.runs[controller].iter().map(counted).collect()
    }
}

/// The results of a sweep in a folder: a file for each finished cell.
pub(crate) struct Sweep {
    folder: PathBuf,
    pub(crate) settings: Settings,
}

impl Sweep {
    /// Begins a sweep in a folder, or goes on with the one that is there.
    ///
    /// # Errors
    /// A folder that cannot be written to, or one with results of other settings.
    pub(crate) fn begin(folder: &Path, settings: Settings, resume: bool) -> Outcome<Self> {
        let sweep = Self {
            folder: folder.to_owned(),
            settings,
        };
        let cells = sweep.folder.join("cells");
        if !resume && cells.exists() {
            fs::remove_dir_all(&cells).map_err(|error| failed(&cells, &error))?;
        }
        writable_folder(&cells)?;
        let file = sweep.folder.join("settings.json");
        if resume && file.exists() {
            let there = Self::open(folder)?;
            sweep.same_as(&there)?;
        }
        write_whole(
            &file,
            serde_json::to_string_pretty(&sweep.settings)?.as_bytes(),
        )?;
        Ok(sweep)
    }

    /// Opens the results in a folder.
    ///
    /// # Errors
    /// A folder without the settings of a sweep, or with those of another version.
    pub(crate) fn open(folder: &Path) -> Outcome<Self> {
        let file = folder.join("settings.json");
        let text = fs::read_to_string(&file)
            .map_err(|error| failed(&file, &format!("no results of a sweep: {error}")))?;
        let damaged = |error| failed(&file, &format!("damaged: {error}"));
        let settings: Value = serde_json::from_str(&text).map_err(damaged)?;
        let (made_by, this) = (&settings["version"], env!("CARGO_PKG_VERSION"));
        if made_by.as_str().is_some_and(|made_by| made_by != this) {
            let reason = format!("made by version {made_by}, this is {this}: use one version");
            return Err(failed(&file, &reason));
        }
        Ok(Self {
            folder: folder.to_owned(),
            settings: serde_json::from_value(settings).map_err(damaged)?,
        })
    }

    fn same_as(&self, other: &Self) -> Outcome {
        match self.settings.difference(&other.settings)? {
            None => Ok(()),
            Some(setting) => Err(format!(
                "{}: results of another sweep: the setting `{setting}` differs; choose another \
                 folder",
                other.folder.display()
            )
            .into()),
        }
    }

    fn file(&self, level: ErrorLevel, draw: usize) -> PathBuf {
        self.folder
            .join("cells")
            .join(format!("{level}-{draw:05}.json"))
    }

    /// Returns the finished runs of a cell, if they are there.
    ///
    /// # Errors
    /// A file that cannot be read or does not hold runs of these controllers.
    pub(crate) fn finished(&self, level: ErrorLevel, draw: usize) -> Outcome<Option<CellRuns>> {
        let file = self.file(level, draw);
        if !file.exists() {
            return Ok(None);
        }
        let text = fs::read_to_string(&file).map_err(|error| failed(&file, &error))?;
        let damaged = |reason: &dyn Display| {
            let remedy = "delete it, and run its shard again with --resume";
            failed(&file, &format!("damaged: {reason}; {remedy}"))
        };
        let cell: CellRuns = serde_json::from_str(&text).map_err(|error| damaged(&error))?;
        if cell.runs.len() != self.settings.controllers.len() {
            return Err(damaged(&"it holds runs of other controllers"));
        }
        Ok(Some(cell))
    }

    /// Keeps the runs of a cell, in a file that is whole or not there.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn keep(&self, level: ErrorLevel, draw: usize, cell: &CellRuns) -> Outcome {
        write_whole(
            &self.file(level, draw),
            serde_json::to_string(cell)?.as_bytes(),
        )
    }

    /// Merges the results of several folders of one sweep into a new one.
    ///
    /// # Errors
    /// Folders of different sweeps, a cell that is missing in all of them, or one whose runs differ
    /// between two of them.
    pub(crate) fn merge(folders: &[PathBuf], out: &Path) -> Outcome<Self> {
        let parts = folders.iter().map(|folder| Self::open(folder));
        let parts = parts.collect::<Outcome<Vec<_>>>()?;
        let first = parts.first().ok_or("--merge needs at least one folder")?;
        let same = |folder: &PathBuf| fs::canonicalize(folder).ok() == fs::canonicalize(out).ok();
        if let Some(folder) = folders.iter().find(|folder| same(folder)) {
            return Err(failed(
                folder,
                &"is merged, so it cannot be the --out folder too",
            ));
        }
        for other in &parts {
            first.same_as(other)?;
        }
        let merged = Self::begin(out, first.settings.clone(), false)?;
        let mut missing = Vec::new();
        for level in merged.levels()? {
            for draw in 0..merged.settings.draws {
                let mut found: Option<CellRuns> = None;
                for part in &parts {
                    let Some(cell) = part.finished(level, draw)? else {
                        continue;
                    };
                    if found.as_ref().is_some_and(|found| found.runs != cell.runs) {
                        let file = part.file(level, draw);
                        return Err(failed(&file, &"its runs differ from those of another part"));
                    }
                    found = Some(cell);
                }
                match found {
                    Some(cell) => merged.keep(level, draw, &cell)?,
                    None => missing.push(format!("{level} {draw}")),
                }
            }
        }
        if let Some(first) = missing.first() {
            let (count, all) = (missing.len(), merged.settings.levels.len());
            let all = all * merged.settings.draws;
            return Err(format!(
                "{count} of {all} cells are missing, the first is {first}: run the shards that \
                 lack them again with --resume"
            )
            .into());
        }
        Ok(merged)
    }

    /// Returns the levels of errors.
    ///
    /// # Errors
    /// The name of a level that does not exist.
    pub(crate) fn levels(&self) -> Outcome<Vec<ErrorLevel>> {
        let parse = |name: &String| Ok(name.parse::<ErrorLevel>()?);
        self.settings.levels.iter().map(parse).collect()
    }
}

fn failed(file: &Path, reason: &dyn Display) -> Box<dyn std::error::Error> {
    format!("{}: {reason}", file.display()).into()
}

/// The tables of a sweep, written level by level.
pub(crate) struct Tables<'a> {
    sweep: &'a Sweep,
    runs: Table,
    times: Table,
    comparison: Table,
    rows: Vec<Row>,
}

impl<'a> Tables<'a> {
    /// Creates the files.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn create(sweep: &'a Sweep) -> Outcome<Self> {
        let table = |name: &str, columns| Table::create(sweep.folder.join(name), columns);
        Ok(Self {
            sweep,
            runs: table(
                "runs.csv",
                "level,cell,controller,run,success,moves,losses,collisions,goal_forbidden",
            )?,
            times: table("times.csv", "level,cell,seconds")?,
            comparison: table("comparison.csv", Row::CSV_HEADER)?,
            rows: Vec::new(),
        })
    }

    /// Writes the rows of a level, of the cells that are given, and prints those of the comparison.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn level(&mut self, level: ErrorLevel, cells: &[(usize, CellRuns)]) -> Outcome {
        let controllers = &self.sweep.settings.controllers;
        for (draw, cell) in cells {
            for (name, runs) in controllers.iter().zip(&cell.runs) {
                for (number, run) in runs.iter().enumerate() {
                    let collisions = run.collisions.map_or(String::new(), |n| n.to_string());
                    let (success, moves, losses) = (u8::from(run.success), run.moves, run.losses);
                    let forbidden = u8::from(cell.forbidden);
                    self.runs.row(format_args!(
                        "{level},{draw},\"{name}\",{number},{success},{moves},{losses},\
                         {collisions},{forbidden}"
                    ))?;
                }
            }
            self.times
                .row(format_args!("{level},{draw},{:.3}", cell.seconds))?;
        }
        let (forbidden, free): (Vec<_>, Vec<_>) =
            cells.iter().partition(|(_, cell)| cell.forbidden);
        let row = |cells: &mut dyn Iterator<Item = &CellRuns>, controller: usize| {
            let cells = cells.map(|cell| cell.counted(controller)).collect();
            Row::new(level, &controllers[controller], &Tally { cells })
        };
        for controller in 0..controllers.len() {
            let all = row(&mut cells.iter().map(|(_, cell)| cell), controller);
            let free = row(&mut free.iter().map(|(_, cell)| cell), controller);
            say!("{all}");
            self.comparison.row(all.csv(&free))?;
            self.rows.push(all);
        }
        if !forbidden.is_empty() {
            let numbers: Vec<_> = forbidden.iter().map(|(draw, _)| draw.to_string()).collect();
            say!(
                "{level}: {} of {} cells: the sensors forbid the goal, which lies within the hand \
                 (cell {}); without them:",
                numbers.len(),
                cells.len(),
                numbers.join(", "),
            );
            for controller in 0..controllers.len() {
                say!(
                    "{}",
                    row(&mut free.iter().map(|(_, cell)| cell), controller)
                );
            }
        }
        Ok(())
    }

    /// Draws the comparison.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn plot(&self) -> Outcome {
        let success = match self.sweep.settings.grip {
            true => "grasped",
            false => "at the goal",
        };
        let svg = comparison::plot(&self.rows, success)?;
        write_whole(&self.sweep.folder.join("comparison.svg"), svg.as_bytes())
    }
}
