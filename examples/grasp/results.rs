//! The result files and the final table.

use std::fmt::Write as _;

use image::imageops::{FilterType, replace, resize};
use image::{Rgb, RgbImage};
use serde::Serialize;

use crate::record::{Picture, RunRecord};
use example_support::overlay::{CAPTION, Overlay};

/// Content of `summary.json`.
#[derive(Serialize)]
pub(crate) struct Summary {
    pub(crate) seed: u64,
    pub(crate) training: TrainingSummary,
    pub(crate) runs: Vec<RunSummary>,
    pub(crate) success_rate: f64,
    pub(crate) mean_cycles: Option<f64>,
}

#[derive(Serialize)]
pub(crate) struct TrainingSummary {
    /// False if the policies were read from files.
    pub(crate) trained: bool,
    pub(crate) actions: u64,
    pub(crate) seconds: f64,
    /// Name of the output, e.g. `centering dx`, and its R².
    pub(crate) r2: std::collections::BTreeMap<String, f64>,
}

#[derive(Serialize)]
pub(crate) struct RunSummary {
    pub(crate) ball_mm: [f64; 3],
    pub(crate) grasped: bool,
    pub(crate) cycles: usize,
    pub(crate) losses: usize,
    /// Number of collisions with ball, holder or table.
    pub(crate) collisions: usize,
    #[serde(rename = "final")]
    pub(crate) last_seen: Option<FinalFeatures>,
    pub(crate) miss_mm: Option<f64>,
    pub(crate) reason: Option<String>,
}

#[derive(Serialize)]
pub(crate) struct FinalFeatures {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) r: f64,
}

impl Summary {
    pub(crate) fn new(seed: u64, training: TrainingSummary, records: &[RunRecord]) -> Self {
        let runs: Vec<RunSummary> = records.iter().map(RunSummary::new).collect();
        let grasped: Vec<&RunSummary> = runs.iter().filter(|run| run.grasped).collect();
        let share = |part: usize, whole: usize| {
            if whole == 0 {
                0.0
            } else {
                part as f64 / whole as f64
            }
        };
        let cycles: usize = grasped.iter().map(|run| run.cycles).sum();
        Self {
            seed,
            training,
            success_rate: share(grasped.len(), runs.len()),
            mean_cycles: (!grasped.is_empty()).then(|| share(cycles, grasped.len())),
            runs,
        }
    }

    /// Returns the table that the program prints at the end.
    pub(crate) fn table(&self) -> String {
        let mut table = String::from(
            "\n run   ball x,y,z (mm)          cycles  lost   final x, y, r            miss (mm)  \
             result\n",
        );
        for (index, run) in self.runs.iter().enumerate() {
            let [x, y, z] = run.ball_mm;
            let ball = format!("{x:6.0} {y:6.0} {z:6.0}");
            let last = run.last_seen.as_ref().map_or("-".into(), |f| {
                format!("{:6.1} {:6.1} {:6.1}", f.x, f.y, f.r)
            });
            let miss = run.miss_mm.map_or("-".into(), |miss| format!("{miss:.1}"));
            let result = match (&run.reason, run.grasped) {
                (_, true) => "grasped".into(),
                (Some(reason), false) => format!("not grasped: {reason}"),
                (None, false) => "not grasped: the jaws hold no ball, and none is seen".into(),
            };
            let _ = writeln!(
                table,
                "{:4}   {ball:<24}  {:6}  {:4}   {last:<24} {miss:>9}  {result}",
                index + 1,
                run.cycles,
                run.losses
            );
        }
        let grasped = self.runs.iter().filter(|run| run.grasped).count();
        let _ = write!(
            table,
            "\n{grasped} of {} grasped ({:.1} %)",
            self.runs.len(),
            100.0 * self.success_rate
        );
        let collisions: usize = self.runs.iter().map(|run| run.collisions).sum();
        if collisions > 0 {
            let _ = write!(table, ", {collisions} collisions of the hand");
        }
        if let Some(mean) = self.mean_cycles {
            let _ = write!(
                table,
                ", {mean:.1} moves on average from the first sighting to the grip"
            );
        }
        table
    }
}

impl RunSummary {
    fn new(record: &RunRecord) -> Self {
        let outcome = record.outcome.as_ref();
        let rounded = |value: f64| (value * 100.0).round() / 100.0;
        Self {
            ball_mm: record.ball_mm.map(rounded),
            grasped: record.grasped,
            cycles: outcome.map_or(0, |o| o.cycles),
            losses: outcome.map_or(0, |o| o.losses),
            collisions: record.collisions,
            last_seen: outcome.and_then(|o| o.last_seen).map(|sighting| {
                let f = sighting.features;
                FinalFeatures {
                    x: rounded(f.x),
                    y: rounded(f.y),
                    r: rounded(f.r),
                }
            }),
            miss_mm: record.miss_mm.map(rounded),
            reason: outcome
                .and_then(|o| o.gave_up)
                .map(|reason| reason.to_string())
                .or_else(|| record.fault.clone()),
        }
    }
}

/// Returns `features.csv`: a row per event.
pub(crate) fn features_csv(records: &[RunRecord]) -> String {
    let mut csv = String::from("run,step,x,y,r,jt1,jt2,jt3,jt4,jt5,jt6,d1,d2,d3,event\n");
    for (run, record) in records.iter().enumerate() {
        for row in &record.rows {
            let xyr = row
                .features
                .map_or(",,".into(), |f| format!("{:.3},{:.3},{:.3}", f.x, f.y, f.r));
            let joints = row
                .joints
                .degrees()
                .map(|degrees| format!("{degrees:.3}"))
                .join(",");
            let action = row.action.map_or(",,".into(), |delta| {
                let [d1, d2, d3, ..] = delta.degrees();
                format!("{d1:.3},{d2:.3},{d3:.3}")
            });
            let _ = writeln!(
                csv,
                "{},{},{xyr},{joints},{action},{}",
                run + 1,
                row.step,
                row.event
            );
        }
    }
    csv
}

/// Contact sheet of the frames in which the ball was seen; each run begins a new row.
#[derive(Default)]
pub(crate) struct ContactSheet(Vec<Tile>);

struct Tile {
    run: usize,
    image: RgbImage,
}

/// Size of a frame in a tile, pixels.
const SMALL: (u32, u32) = (156, 117);
/// Size of a tile with its caption and its border.
const TILE: (u32, u32) = (SMALL.0 + 4, SMALL.1 + CAPTION + 4);
/// Number of runs that are shown.
const RUNS_SHOWN: usize = 20;

impl ContactSheet {
    pub(crate) fn add(&mut self, picture: &Picture) {
        if !picture.seen || picture.run > RUNS_SHOWN {
            return;
        }
        let small = resize(&picture.image, SMALL.0, SMALL.1, FilterType::Triangle);
        let tile =
            Overlay::from(small).captioned(&format!("run {} step {}", picture.run, picture.step));
        self.0.push(Tile {
            run: picture.run,
            image: tile.into_image(),
        });
    }

    /// Draws the sheet with `columns` tiles per row.
    pub(crate) fn drawn(&self, columns: u32) -> RgbImage {
        let mut places: Vec<(&Tile, u32, u32)> = Vec::new();
        for tile in &self.0 {
            let (row, column) = match places.last() {
                None => (0, 0),
                Some((before, row, column)) if before.run == tile.run && column + 1 < columns => {
                    (*row, column + 1)
                }
                Some((_, row, _)) => (row + 1, 0),
            };
            places.push((tile, row, column));
        }
        let rows = places.last().map_or(1, |(_, row, _)| row + 1);
        let mut sheet = RgbImage::from_pixel(columns * TILE.0, rows * TILE.1, Rgb([245, 245, 248]));
        for (tile, row, column) in places {
            replace(
                &mut sheet,
                &tile.image,
                i64::from(column * TILE.0 + 2),
                i64::from(row * TILE.1 + 2),
            );
        }
        sheet
    }
}
