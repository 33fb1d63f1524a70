//! Records of the runs: a row per event, a picture per frame.

use grasp_agent::{EventKind, RunEvent, RunOutcome, SavedRun};
use hough_heuristic::Features;
use image::RgbImage;
use image::imageops::{FilterType, resize};
use puma_val2::{JointDelta, Joints};

use example_support::overlay::Overlay;
use example_support::trial::Trial;

/// Record of one run.
pub(crate) struct RunRecord {
    /// The ball's centre, millimetres in the arm's world frame.
    pub(crate) ball_mm: [f64; 3],
    pub(crate) rows: Vec<Row>,
    /// The run for the example `replay`.
    pub(crate) saved: SavedRun,
    /// Number of frames.
    frames: usize,
    /// Set while the jaws are closed, when sightings do not count.
    gripped: bool,
    pub(crate) outcome: Option<RunOutcome>,
    /// Fault that ended the run.
    pub(crate) fault: Option<String>,
    /// Set if the jaws hold the ball and the agent reports it.
    pub(crate) grasped: bool,
    /// Number of collisions of the hand.
    pub(crate) collisions: usize,
    /// Distance of the gripper from the ball's centre when the jaws closed, millimetres.
    pub(crate) miss_mm: Option<f64>,
}

/// One event.
pub(crate) struct Row {
    pub(crate) step: usize,
    pub(crate) event: &'static str,
    pub(crate) features: Option<Features>,
    pub(crate) joints: Joints,
    pub(crate) action: Option<JointDelta>,
}

/// A frame at half size with the detected circle drawn in.
pub(crate) struct Picture {
    pub(crate) run: usize,
    /// Number of the frame, from 1 in each run.
    pub(crate) number: usize,
    pub(crate) step: usize,
    /// Set if the ball was found.
    pub(crate) seen: bool,
    pub(crate) image: RgbImage,
    words: String,
}

impl Picture {
    /// Returns the picture below a caption.
    pub(crate) fn captioned(&self) -> RgbImage {
        Overlay::from(self.image.clone())
            .captioned(&self.words)
            .into_image()
    }
}

impl RunRecord {
    pub(crate) fn new(ball_mm: [f64; 3], saved: SavedRun) -> Self {
        Self {
            ball_mm,
            rows: Vec::new(),
            saved,
            frames: 0,
            gripped: false,
            outcome: None,
            fault: None,
            grasped: false,
            collisions: 0,
            miss_mm: None,
        }
    }

    /// Records an event. Returns the picture of its frame if there is one.
    pub(crate) fn note(&mut self, run: usize, event: &RunEvent<'_>) -> Option<Picture> {
        self.saved.note(event);
        match event.kind {
            EventKind::Gripped => self.gripped = true,
            EventKind::Missed => self.gripped = false,
            _ => {}
        }
        let (sighting, action) = match event.kind {
            EventKind::Seen(sighting) if !self.gripped => (Some(sighting), None),
            EventKind::Moved(delta) => (None, Some(delta)),
            _ => (None, None),
        };
        let features = sighting.map(|sighting| sighting.features);
        self.rows.push(Row {
            step: event.cycle,
            event: event.kind.word(),
            features,
            joints: event.joints,
            action,
        });

        let mut overlay = Overlay::new(event.frame?);
        self.frames += 1;
        if let Some(sighting) = sighting {
            overlay.circle(&sighting.features.to_circle(event.frame?.width()));
        }
        let full = overlay.into_image();
        let half = resize(
            &full,
            full.width() / 2,
            full.height() / 2,
            FilterType::Triangle,
        );
        let found = features.map_or("no ball".into(), |f| {
            format!("x {:.1} y {:.1} r {:.1}", f.x, f.y, f.r)
        });
        let (step, seen) = (event.cycle, features.is_some());
        Some(Picture {
            run,
            number: self.frames,
            step,
            seen,
            image: half,
            words: format!("run {run} step {step}  {found}"),
        })
    }

    /// Records that the jaws close `miss` metres from the ball's centre.
    pub(crate) fn gripped_at(&mut self, miss: f64) {
        self.miss_mm = Some(miss * 1000.0);
    }

    /// Records the end of the run.
    pub(crate) fn ended(&mut self, trial: &Trial, collisions: usize) {
        self.grasped = trial.outcome.gave_up.is_none() && trial.held;
        self.collisions = collisions;
        self.outcome = Some(trial.outcome);
    }

    /// Returns the features at every step from the first sighting on, as in Fig. 7 of the paper.
    pub(crate) fn track(&self) -> Vec<(usize, Features)> {
        let mut track: Vec<(usize, Features)> = Vec::new();
        for row in &self.rows {
            if let Some(features) = row.features {
                // The last of several sightings without a move between counts.
                if track.last().is_some_and(|(step, _)| *step == row.step) {
                    track.pop();
                }
                track.push((row.step, features));
            }
        }
        track
    }
}
