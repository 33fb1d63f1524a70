//! Records of the runs: a row per event, a picture per frame.

use grasp_agent::{EventKind, RunEvent, SavedRun};
use hough_heuristic::Features;
use image::RgbImage;
use image::imageops::{FilterType, resize};
use pipeline_sim::Cell;
use serde::Serialize;

use example_support::overlay::Overlay;
use example_support::trial::Trial;

/// Record of one run.
pub(crate) struct RunRecord {
    /// Number of the run, from 1.
    pub(crate) run: usize,
    /// The run in `summary.json`.
    pub(crate) summary: RunSummary,
    /// The run for the example `replay`.
    pub(crate) saved: SavedRun,
    /// Features at every step from the first sighting on, as in Fig. 7 of the paper.
    pub(crate) track: Vec<(usize, Features)>,
    /// The steps of the track after which the ball was lost.
    pub(crate) lost: Vec<(usize, Features)>,
    /// Number of frames.
    frames: usize,
    /// Set while the jaws are closed, when sightings do not count.
    gripped: bool,
}

/// A run in `summary.json`.
#[derive(Default, Serialize)]
pub(crate) struct RunSummary {
    /// The ball's centre in the arm's world frame; nobody knows that of a real ball.
    pub(crate) ball_mm: Option<[f64; 3]>,
    /// Set if the jaws hold the ball and the agent reports it; of a real ball only the latter.
    pub(crate) grasped: bool,
    pub(crate) cycles: usize,
    pub(crate) losses: usize,
    /// Number of collisions with ball, holder or table.
    pub(crate) collisions: usize,
    #[serde(rename = "final")]
    pub(crate) last_seen: Option<Features>,
    /// Distance of the gripper from the ball's centre when the jaws closed.
    pub(crate) miss_mm: Option<f64>,
    /// Reason why the agent gave up, or the fault that ended the run.
    pub(crate) reason: Option<String>,
    /// Set for a run that a fault or a signal ended, which does not count.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(crate) broken_off: bool,
}

/// A frame at half size with the detected circle drawn in.
pub(crate) struct Picture {
    pub(crate) run: usize,
    /// Number of the frame, from 1 in each run.
    pub(crate) number: usize,
    pub(crate) step: usize,
    /// Set if the ball was found, or the jaws are closed.
    pub(crate) shown: bool,
    /// Set if the jaws are closed.
    pub(crate) gripped: bool,
    pub(crate) image: RgbImage,
    pub(crate) words: String,
}

fn rounded(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

impl RunRecord {
    pub(crate) fn new(run: usize, ball_mm: Option<[f64; 3]>, saved: SavedRun) -> Self {
        let summary = RunSummary {
            ball_mm: ball_mm.map(|mm| mm.map(rounded)),
            ..RunSummary::default()
        };
        Self {
            run,
            summary,
            saved,
            track: Vec::new(),
            lost: Vec::new(),
            frames: 0,
            gripped: false,
        }
    }

    /// Records an event in `cell`. Returns its row of `features.csv`, and the picture of its frame
    /// if there is one.
    pub(crate) fn note(&mut self, event: &RunEvent<'_>, cell: &Cell) -> (String, Option<Picture>) {
        self.saved.note(event);
        let (mut features, mut action) = (None, ",,".to_owned());
        match event.kind {
            EventKind::Gripping(_) if self.summary.ball_mm.is_some() => {
                self.summary.miss_mm = Some(rounded(1000.0 * cell.grip_miss(&event.joints)));
            }
            EventKind::Gripped => self.gripped = true,
            EventKind::Missed => self.gripped = false,
            EventKind::Lost => self.lost.extend(self.track.last()),
            EventKind::Seen(sighting) if !self.gripped => features = Some(sighting.features),
            EventKind::Moved(delta) => {
                let [d1, d2, d3, ..] = delta.degrees();
                action = format!("{d1:.3},{d2:.3},{d3:.3}");
            }
            _ => {}
        }
        if let Some(features) = features {
            // The last of several sightings without a move between counts.
            self.track.pop_if(|(step, _)| *step == event.cycle);
            self.track.push((event.cycle, features));
        }
        let xyr = features.map_or(",,".into(), |f| format!("{:.3},{:.3},{:.3}", f.x, f.y, f.r));
        let joints = event
            .joints
            .degrees()
            .map(|degrees| format!("{degrees:.3}"));
        let (run, step, joints) = (self.run, event.cycle, joints.join(","));
        let row = format!("{run},{step},{xyr},{joints},{action},{}", event.kind.word());
        (row, self.picture(event, features))
    }

    fn picture(&mut self, event: &RunEvent<'_>, features: Option<Features>) -> Option<Picture> {
        let frame = event.frame?;
        self.frames += 1;
        let mut overlay = Overlay::new(frame);
        let mut found = match self.gripped {
            true => "jaws closed".into(),
            false => "no ball".into(),
        };
        if let Some(f) = features {
            overlay.circle(&f.to_circle(frame.width()));
            found = format!("x {:.1} y {:.1} r {:.1}", f.x, f.y, f.r);
        }
        let (width, height) = (frame.width() / 2, frame.height() / 2);
        Some(Picture {
            run: self.run,
            number: self.frames,
            step: event.cycle,
            shown: features.is_some() || self.gripped,
            gripped: self.gripped,
            image: resize(&overlay.into_image(), width, height, FilterType::Triangle),
            words: format!("run {} move {}  {found}", self.run, event.cycle),
        })
    }

    /// Records the end of the run.
    pub(crate) fn ended(&mut self, trial: &Trial) {
        let outcome = &trial.outcome;
        self.summary = RunSummary {
            ball_mm: self.summary.ball_mm,
            grasped: outcome.gave_up.is_none() && trial.held,
            cycles: outcome.cycles,
            losses: outcome.losses,
            collisions: trial.collisions.unwrap_or(0),
            last_seen: outcome.last_seen.map(|sighting| {
                let Features { x, y, r } = sighting.features;
                let [x, y, r] = [x, y, r].map(rounded);
                Features { x, y, r }
            }),
            miss_mm: self.summary.miss_mm,
            reason: outcome.gave_up.map(|reason| reason.to_string()),
            broken_off: false,
        };
    }
}

impl RunSummary {
    /// Returns the result in words.
    pub(crate) fn result(&self) -> String {
        match &self.reason {
            _ if self.grasped => "grasped".into(),
            Some(reason) if self.broken_off => format!("broken off: {reason}"),
            Some(reason) => format!("not grasped: {reason}"),
            None => "not grasped: the jaws hold no ball, and none is seen".into(),
        }
    }
}
