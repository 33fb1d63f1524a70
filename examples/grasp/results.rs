//! The summary, its table, and the contact sheet.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use grasp_agent::GoalInterval;
use image::imageops::{FilterType, replace, resize};
use image::{Rgb, RgbImage};
use serde::Serialize;

use crate::record::{Picture, RunRecord, RunSummary};
use example_support::overlay::Overlay;
use example_support::prelude::*;
use example_support::trial::{FEATURES, goal_of};

/// Content of `summary.json`.
#[derive(Serialize)]
pub(crate) struct Summary<'a> {
    pub(crate) seed: u64,
    pub(crate) training: &'a TrainingSummary,
    pub(crate) runs: Vec<&'a RunSummary>,
    pub(crate) success_rate: f64,
    pub(crate) mean_cycles: Option<f64>,
    /// Goal interval of x, y and r.
    #[serde(skip)]
    goal: [(f64, f64); 3],
}

#[derive(Serialize)]
pub(crate) struct TrainingSummary {
    /// False if the policies were read from files.
    pub(crate) trained: bool,
    pub(crate) actions: u64,
    pub(crate) seconds: f64,
    /// Name of the output, e.g. `centering dx`, and its R².
    pub(crate) r2: BTreeMap<String, f64>,
}

impl<'a> Summary<'a> {
    pub(crate) fn new(
        seed: u64,
        training: &'a TrainingSummary,
        records: &'a [RunRecord],
        goal: &[GoalInterval],
    ) -> Self {
        let runs: Vec<&RunSummary> = records.iter().map(|record| &record.summary).collect();
        let counted = runs.iter().filter(|run| !run.broken_off).count();
        let grasped = || runs.iter().filter(|run| run.grasped);
        let (count, cycles) = (
            grasped().count(),
            grasped().map(|run| run.cycles).sum::<usize>(),
        );
        Self {
            seed,
            training,
            success_rate: count as f64 / counted.max(1) as f64,
            mean_cycles: (count > 0).then(|| cycles as f64 / count as f64),
            runs,
            goal: goal_of(goal),
        }
    }

    /// Writes the file.
    pub(crate) fn write(&self, path: &Path) -> Outcome {
        write_whole(path, &serde_json::to_vec_pretty(self)?)
    }

    fn goal_words(&self) -> String {
        let short = |value: f64| format!("{value:.1}").trim_end_matches(".0").to_owned();
        let features = FEATURES.iter().zip(self.goal);
        let words = features
            .map(|((name, ..), (low, high))| format!("{name} {}..{}", short(low), short(high)));
        words.collect::<Vec<_>>().join(", ")
    }

    /// Returns the result of all runs in a line.
    pub(crate) fn in_words(&self) -> String {
        let broken_off = self.runs.iter().filter(|run| run.broken_off).count();
        let (all, share) = (self.runs.len() - broken_off, 100.0 * self.success_rate);
        let grasped = self.runs.iter().filter(|run| run.grasped).count();
        let mut words = format!("{grasped} of {all} grasped ({share:.1} %)");
        if broken_off > 0 {
            words += &format!(", {broken_off} broken off");
        }
        let collisions: usize = self.runs.iter().map(|run| run.collisions).sum();
        if collisions > 0 {
            words += &format!(", {collisions} collisions of the hand");
        }
        if let Some(mean) = self.mean_cycles {
            words += &format!(", {mean:.1} moves on average from the first sighting to the grip");
        }
        words
    }
}

/// The table that the program prints at the end.
impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n run   ball x,y,z (mm)           moves  lost   final x, y, r            miss (mm)  \
             result"
        )?;
        for (run, number) in self.runs.iter().zip(1..) {
            let ball = run.ball_mm.map_or("     -".into(), |[x, y, z]| {
                format!("{x:6.0} {y:6.0} {z:6.0}")
            });
            let last = run.last_seen.as_ref().map_or("-".into(), |f| {
                format!("{:6.1} {:6.1} {:6.1}", f.x, f.y, f.r)
            });
            let miss = run.miss_mm.map_or("-".into(), |miss| format!("{miss:.1}"));
            let (moves, lost, result) = (run.cycles, run.losses, run.result());
            writeln!(
                f,
                "{number:4}   {ball:<24}  {moves:6}  {lost:4}   {last:<24} {miss:>9}  {result}"
            )?;
        }
        write!(
            f,
            "\nx, y, r: the last sighting, feature units; goal {}; miss: from the ball's centre to \
             the gripper when it closed",
            self.goal_words()
        )?;
        write!(f, "\n\n{}", self.in_words())
    }
}

/// Contact sheet that fits a screen: a row of views for each of the first runs, the last one with
/// the jaws closed.
#[derive(Default)]
pub(crate) struct ContactSheet(Vec<Vec<RgbImage>>);

/// Size of a view, pixels, and the space that it takes.
const SMALL: (u32, u32) = (128, 96);
const PLACE: (u32, u32) = (132, 100);
/// Most views of a run, most runs below each other, and most runs in all.
const VIEWS: usize = 7;
const ROWS: usize = 10;
const RUNS: usize = 20;

impl ContactSheet {
    /// Adds a view to its run.
    pub(crate) fn add(&mut self, picture: &Picture) {
        if !picture.shown || picture.run > RUNS {
            return;
        }
        self.0.resize_with(picture.run, Vec::new);
        let small = resize(&picture.image, SMALL.0, SMALL.1, FilterType::Triangle);
        let mut view = Overlay::from(small);
        let words = match picture.gripped {
            true => "jaws closed".into(),
            false => format!("move {}", picture.step),
        };
        view.label(&format!("run {} {words}", picture.run));
        self.0[picture.run - 1].push(view.into_image());
    }

    /// Draws the sheet.
    pub(crate) fn drawn(&self) -> RgbImage {
        let block = PLACE.0 * VIEWS as u32 + 16;
        let (blocks, rows) = (
            self.0.len().div_ceil(ROWS).max(1),
            self.0.len().clamp(1, ROWS),
        );
        let size = (blocks as u32 * block, rows as u32 * PLACE.1);
        let mut sheet = RgbImage::from_pixel(size.0, size.1, Rgb([245, 245, 248]));
        for (run, views) in self.0.iter().enumerate() {
            let (left, top) = ((run / ROWS) as u32 * block, (run % ROWS) as u32 * PLACE.1);
            // The first, the last, and some evenly between.
            let last = views.len().saturating_sub(1);
            let count = views.len().min(VIEWS);
            for place in 0..count {
                let view = &views[place * last / (count - 1).max(1)];
                let x = left + place as u32 * PLACE.0 + 2;
                replace(&mut sheet, view, x.into(), (top + 2).into());
            }
        }
        sheet
    }
}
