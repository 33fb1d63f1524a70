//! Counts of the runs.

use std::fmt;

use crate::wilson::wilson;

/// A run that counts.
#[derive(Clone, Copy, Debug)]
pub struct Counted {
    /// Set if all that was due has happened to the ball.
    pub happened: bool,
    /// Set if the ball was grasped.
    pub success: bool,
    /// Moves of the arm.
    pub moves: usize,
    /// Stops by the proximity sensors.
    pub near: usize,
    /// Collisions of the hand; `None` where they are not counted.
    pub collisions: Option<usize>,
}

impl Counted {
    /// Returns whether it is in the denominator: a grasp before anything happened to the ball does
    /// not count, a failure always does.
    fn counts(&self) -> bool {
        self.happened || !self.success
    }
}

/// Runs by cell.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    cells: Vec<Vec<Counted>>,
}

impl Tally {
    /// Begins the runs in another cell.
    pub fn begin_cell(&mut self) {
        self.cells.push(Vec::new());
    }

    /// Adds a run.
    pub fn add(&mut self, run: Counted) {
        if self.cells.is_empty() {
            self.begin_cell();
        }
        if let Some(cell) = self.cells.last_mut() {
            cell.push(run);
        }
    }

    /// Returns the number of runs.
    pub fn runs(&self) -> usize {
        self.cells.iter().map(Vec::len).sum()
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = || self.cells.iter().flatten();
        let (counted, others): (Vec<&Counted>, Vec<&Counted>) = all().partition(|run| run.counts());
        let successes = |runs: &[&Counted]| runs.iter().filter(|run| run.success).count();
        let (grasped, runs) = (successes(&counted), counted.len());
        if self.cells.len() > 1 {
            let by_cell = self.cells.iter().map(|cell| {
                let counted = || cell.iter().filter(|run| run.counts());
                let grasped = counted().filter(|run| run.success).count();
                format!("{grasped}/{}", counted().count())
            });
            writeln!(
                f,
                "grasped by cell: {}",
                by_cell.collect::<Vec<_>>().join(" ")
            )?;
        }
        if runs == 0 {
            write!(f, "no run to count")?;
        } else {
            let [low, high] = wilson(grasped as f64 / runs as f64, runs as f64);
            write!(
                f,
                "{grasped} of {runs} grasped ({:.1} %, 95 % interval {low:.1}..{high:.1}), \
                 {:.1} moves a run, {} stops by the proximity sensors",
                100.0 * grasped as f64 / runs as f64,
                counted.iter().map(|run| run.moves).sum::<usize>() as f64 / runs as f64,
                all().map(|run| run.near).sum::<usize>(),
            )?;
            if let Some(collisions) = all().map(|run| run.collisions).sum::<Option<usize>>() {
                write!(f, ", {collisions} collisions")?;
            }
        }
        if !others.is_empty() {
            write!(
                f,
                "\nnot counted: {} grasps before anything happened to the ball",
                others.len(),
            )?;
        }
        Ok(())
    }
}
