//! What the runs came to.

use std::fmt;

/// A run that counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counted {
    /// Whether what was to happen to the ball has.
    pub(crate) happened: bool,
    pub(crate) success: bool,
    pub(crate) moves: usize,
    /// Stops by the proximity sensors.
    pub(crate) near: usize,
    pub(crate) collisions: usize,
}

/// All of them, by cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    cells: Vec<Vec<Counted>>,
}

impl Tally {
    pub(crate) fn begin_cell(&mut self) {
        self.cells.push(Vec::new());
    }

    pub(crate) fn add(&mut self, run: Counted) {
        if self.cells.is_empty() {
            self.begin_cell();
        }
        if let Some(cell) = self.cells.last_mut() {
            cell.push(run);
        }
    }

    pub(crate) fn runs(&self) -> usize {
        self.cells.iter().map(Vec::len).sum()
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = || self.cells.iter().flatten();
        let (counted, others): (Vec<&Counted>, Vec<&Counted>) = all().partition(|run| run.happened);
        let successes = |runs: &[&Counted]| runs.iter().filter(|run| run.success).count();
        let sum = |part: fn(&Counted) -> usize| all().map(part).sum::<usize>();
        let (grasped, runs) = (successes(&counted), counted.len());
        if self.cells.len() > 1 {
            let by_cell = self.cells.iter().map(|cell| {
                let grasped = cell.iter().filter(|run| run.success).count();
                format!("{grasped}/{}", cell.len())
            });
            writeln!(f, "grasped by cell: {}", by_cell.collect::<Vec<_>>().join(" "))?;
        }
        let (low, high) = interval(grasped, runs);
        write!(
            f,
            "{grasped} of {runs} grasped ({:.1} %, 95 % interval {low:.1}..{high:.1}), {:.1} moves a run, {} stops by the proximity sensors, \
             {} collisions",
            100.0 * grasped as f64 / runs.max(1) as f64,
            counted.iter().map(|run| run.moves).sum::<usize>() as f64 / runs.max(1) as f64,
            sum(|run| run.near),
            sum(|run| run.collisions),
        )?;
        if !others.is_empty() {
            write!(
                f,
                "\nnot counted: {} runs in which what was to happen to the ball did not; {} of them grasped",
                others.len(),
                successes(&others)
            )?;
        }
        Ok(())
    }
}

/// Wilson's interval of a share, percent.
fn interval(successes: usize, runs: usize) -> (f64, f64) {
    const Z: f64 = 1.96;
    let runs = runs.max(1);
    let (n, share) = (runs as f64, successes as f64 / runs as f64);
    let middle = share + 0.5 * Z * Z / n;
    let half = Z * (share * (1.0 - share) / n + 0.25 * Z * Z / (n * n)).sqrt();
    let scale = 100.0 / (1.0 + Z * Z / n);
    (scale * (middle - half), scale * (middle + half))
}
