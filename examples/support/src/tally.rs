//! Counts of the runs, with confidence intervals.

use std::fmt;

/// A run that counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counted {
    /// Set if the run ended before anything happened to the ball that is to be moved.
    pub too_early: bool,
    /// Set if the goal was reached or the ball was grasped.
    pub success: bool,
    /// Moves of the arm.
    pub moves: usize,
    /// Losses of the ball.
    pub losses: usize,
    /// Stops by the proximity sensors.
    pub near: usize,
    /// Collisions of the hand; `None` where they are not counted.
    pub collisions: Option<usize>,
}

/// Runs by cell.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Runs of each cell.
    pub cells: Vec<Vec<Counted>>,
}

impl Tally {
    /// Returns the runs of all cells.
    pub fn runs(&self) -> impl Iterator<Item = &Counted> {
        self.cells.iter().flatten()
    }

    /// Returns successes and runs of each cell. A success that came too early is in neither, a
    /// failure always counts.
    pub fn by_cell(&self) -> Vec<(usize, usize)> {
        let count = |cell: &Vec<Counted>| {
            let grasped = |run: &&Counted| run.success && !run.too_early;
            let failures = cell.iter().filter(|run| !run.success).count();
            let grasped = cell.iter().filter(grasped).count();
            (grasped, grasped + failures)
        };
        self.cells.iter().map(count).collect()
    }

    /// Returns the collisions of the runs in which they were counted.
    pub fn collisions(&self) -> Option<usize> {
        let counted = self.runs().filter_map(|run| run.collisions);
        counted.reduce(|sum, more| sum + more)
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cells = self.by_cell();
        let (grasped, runs) = cells
            .iter()
            .fold((0, 0), |sum, cell| (sum.0 + cell.0, sum.1 + cell.1));
        if cells.len() > 1 {
            let cells = cells.iter().map(|(part, whole)| format!("{part}/{whole}"));
            writeln!(
                f,
                "grasped by cell: {}",
                cells.collect::<Vec<_>>().join(" ")
            )?;
        }
        let early = |run: &&Counted| run.success && run.too_early;
        if runs == 0 {
            write!(f, "no run to count")?;
        } else {
            let counted = self.runs().filter(|run| !early(run));
            let [low, high] = wilson(grasped as f64 / runs as f64, runs as f64);
            write!(
                f,
                "{grasped} of {runs} grasped ({:.1} %, 95 % interval {low:.1}..{high:.1}), \
                 {:.1} moves a run, {} stops by the proximity sensors",
                100.0 * grasped as f64 / runs as f64,
                counted.map(|run| run.moves).sum::<usize>() as f64 / runs as f64,
                self.runs().map(|run| run.near).sum::<usize>(),
            )?;
            if let Some(collisions) = self.collisions() {
                write!(f, ", {collisions} collisions")?;
            }
        }
        match self.runs().filter(early).count() {
            0 => Ok(()),
            count => write!(
                f,
                "\nnot counted: {count} grasps before anything happened to the ball"
            ),
        }
    }
}

/// Returns Wilson's 95 % interval, percent, of a share (0..=1) of `n` trials. It has a width even
/// where all trials succeed, or none; it is NaN without trials.
pub fn wilson(share: f64, n: f64) -> [f64; 2] {
    const Z: f64 = 1.96;
    let middle = share + 0.5 * Z * Z / n;
    let half = Z * (share * (1.0 - share) / n + 0.25 * Z * Z / (n * n)).sqrt();
    let scale = 100.0 / (1.0 + Z * Z / n);
    // Rounding must not lead beyond a possible share.
    [middle - half, middle + half].map(|end| (scale * end).clamp(0.0, 100.0).abs())
}
