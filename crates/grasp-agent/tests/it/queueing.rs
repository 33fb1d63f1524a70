//! Cameras that queue their frames, as those of V4L2 do, before an agent that moves.

use std::sync::mpsc::{Receiver, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use grasp_agent::hough_heuristic::image::GrayImage;
use grasp_agent::hough_heuristic::{Features, FrameError, FrameSource};
use grasp_agent::{Agent, EventLog, Eye, Hybrid, Sighting};

use crate::cell::{config, hybrid};
use crate::plant::{MODERATE, Odd, Plant};

/// Bytes of `x`, `y` and `r` as pixels: a frame in which the ball needs no search.
fn frame_of(seen: Option<Features>) -> GrayImage {
    let numbers = seen.map_or([f64::NAN; 3], |f| [f.x, f.y, f.r]);
    GrayImage::from_raw(24, 1, numbers.map(f64::to_le_bytes).concat()).unwrap()
}

/// A driver that exposes a frame every 2 ms, keeps the oldest ones and loses the others.
struct Queueing(Receiver<GrayImage>);

impl Queueing {
    fn showing(scene: Arc<Mutex<Option<Features>>>, frames: usize) -> Self {
        let (queue, frames) = sync_channel(frames);
        std::thread::spawn(move || {
            loop {
                let frame = frame_of(*scene.lock().unwrap());
                if let Err(TrySendError::Disconnected(_)) = queue.try_send(frame) {
                    return;
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        Self(frames)
    }
}

impl FrameSource for Queueing {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        *frame = self.0.recv().map_err(|_| FrameError::End)?;
        Ok(())
    }
}

/// What the plant shows, through a camera.
struct Through<S> {
    plant: Plant,
    scene: Arc<Mutex<Option<Features>>>,
    source: S,
}

impl<S: FrameSource> Eye for Through<S> {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let seen = self.plant.look()?.map(|ball| ball.features);
        // The arm was moving, and the queue has filled.
        std::thread::sleep(Duration::from_millis(8));
        *self.scene.lock().unwrap() = seen;
        let mut frame = GrayImage::default();
        self.source.grab(&mut frame)?;
        let number =
            |i: usize| f64::from_le_bytes(frame.as_raw()[8 * i..][..8].try_into().unwrap());
        let seen = Features::new(number(0), number(1), number(2));
        Ok((!seen.x.is_nan()).then_some(Sighting::new(seen)))
    }
}

/// Balls held of so many in each of these cells.
fn held<S: FrameSource>(
    cells: u64,
    balls: u64,
    camera: impl Fn(Arc<Mutex<Option<Features>>>) -> S,
) -> usize {
    let mut held = 0;
    for cell in 0..cells {
        let plant = Plant::new(MODERATE, Odd::default(), 5 + cell);
        let goal = plant.taught().unwrap();
        let config = config().with_taught_goal(&goal);
        let mut agent: Agent<Hybrid> =
            Agent::with_controller(config, hybrid().shown(&goal)).unwrap();
        let scene = Arc::new(Mutex::new(None));
        let source = camera(scene.clone());
        let mut eye = Through {
            plant: plant.clone(),
            scene,
            source,
        };
        for ball in 0..balls {
            let log = &mut EventLog::default();
            held += usize::from(plant.run_seen_by(&mut eye, &mut agent, ball, log).1);
        }
    }
    held
}

/// `GRASP_CELLS=8 cargo test --release -p grasp-agent --test it -- newest --nocapture` plays 20
/// balls in each of 8 cells.
#[test]
fn the_newest_frames_of_a_queue_are_enough() {
    let cells = std::env::var("GRASP_CELLS").ok();
    let balls = if cells.is_some() { 20 } else { 2 };
    let cells: u64 = cells.map_or(1, |cells| cells.parse().unwrap());
    let all = (cells * balls) as usize;
    for frames in [1, 3] {
        let newest = held(cells, balls, |scene| {
            Queueing::showing(scene, frames).newest_only(Duration::from_millis(20))
        });
        println!("queue of {frames}: {newest} of {all} held");
        assert!(
            newest * 100 >= 99 * all,
            "queue of {frames}: {newest} of {all}"
        );
        if cells > 1 {
            let plain = held(cells, 5, |scene| Queueing::showing(scene, frames));
            println!("queue of {frames} as it is: {plain} of {} held", 5 * cells);
        }
    }
}
