//! The newest frame of a camera that queues.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

use image::GrayImage;

use crate::frame::{FrameError, FrameSource};

/// Moment at which the source was asked, and its answer.
type Answer = (Instant, Result<GrayImage, FrameError>);

/// A source that a thread reads without pause; see [`FrameSource::newest_only`].
pub(crate) struct Newest {
    answers: Receiver<Answer>,
    latency: Duration,
}

impl Newest {
    pub(crate) fn of(source: impl FrameSource + Send + 'static, latency: Duration) -> Self {
        let (answer, answers) = sync_channel(1);
        std::thread::spawn(move || read(source, &answer));
        Self { answers, latency }
    }
}

/// Empties the queue of `source` until it fails or nobody listens.
fn read(mut source: impl FrameSource, answers: &SyncSender<Answer>) {
    let mut spare = GrayImage::default();
    loop {
        let asked = Instant::now();
        if let Err(error) = source.grab(&mut spare) {
            // An error is kept until somebody hears it.
            let _heard = answers.send((asked, Err(error)));
            return;
        }
        match answers.try_send((asked, Ok(std::mem::take(&mut spare)))) {
            // An older frame waits; it is dropped by its time.
            Err(TrySendError::Full((_, frame))) => spare = frame.unwrap_or_default(),
            Err(TrySendError::Disconnected(_)) => return,
            Ok(()) => {}
        }
    }
}

impl FrameSource for Newest {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let called = Instant::now() + self.latency;
        loop {
            match self.answers.recv() {
                Ok((asked, Ok(image))) if asked >= called => {
                    *frame = image;
                    return Ok(());
                }
                Ok((_, Ok(_))) => {}
                Ok((_, Err(error))) => return Err(error),
                Err(_) => return Err(FrameError::End),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU8, Ordering};
    use std::sync::{Arc, Mutex};

    /// A driver that exposes a frame every 5 ms, keeps the four oldest and then loses frames.
    struct Queueing(Receiver<GrayImage>);

    impl Queueing {
        fn showing(scene: Arc<AtomicU8>, frames: usize) -> Self {
            let (queue, frames_out) = sync_channel(4);
            std::thread::spawn(move || {
                for _ in 0..frames {
                    let gray = scene.load(Ordering::SeqCst);
                    let image = GrayImage::from_pixel(2, 2, image::Luma([gray]));
                    if let Err(TrySendError::Disconnected(_)) = queue.try_send(image) {
                        return;
                    }
                    std::thread::sleep(Duration::from_millis(5));
                }
            });
            Self(frames_out)
        }
    }

    impl FrameSource for Queueing {
        fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
            *frame = self.0.recv().map_err(|_| FrameError::End)?;
            Ok(())
        }
    }

    /// Number of frames that show the scene from before the call.
    fn late(source: &mut dyn FrameSource, scene: &AtomicU8) -> usize {
        let mut frame = GrayImage::default();
        let mut is_late = |gray: &u8| {
            scene.store(*gray, Ordering::SeqCst);
            source.grab(&mut frame).unwrap();
            let late = frame.as_raw()[0] != *gray;
            // The arm moves, and the queue fills.
            std::thread::sleep(Duration::from_millis(30));
            late
        };
        (1..=10).filter(&mut is_late).count()
    }

    #[test]
    fn a_queueing_camera_shows_what_is_now() {
        let scene = Arc::new(AtomicU8::new(0));
        let mut plain = Queueing::showing(scene.clone(), 10_000);
        assert!(late(&mut plain, &scene) >= 9);
        let mut newest = plain.newest_only(Duration::from_millis(60));
        assert_eq!(late(&mut newest, &scene), 0);
    }

    #[test]
    fn the_end_of_a_source_is_told_again_and_again() {
        let scene = Arc::new(AtomicU8::new(0));
        let mut newest = Queueing::showing(scene, 3).newest_only(Duration::from_secs(5));
        for _ in 0..3 {
            let end = newest.grab(&mut GrayImage::default());
            assert!(matches!(end, Err(FrameError::End)), "{end:?}");
        }
    }

    #[test]
    fn a_source_that_nobody_listens_to_is_let_go() {
        struct Held {
            _kept: Arc<Mutex<()>>,
        }
        impl FrameSource for Held {
            fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
                std::thread::sleep(Duration::from_millis(1));
                *frame = GrayImage::new(1, 1);
                Ok(())
            }
        }
        let held = Arc::new(Mutex::new(()));
        let source = Held {
            _kept: held.clone(),
        };
        drop(source.newest_only(Duration::ZERO));
        let gone = (0..2000).any(|_| {
            std::thread::sleep(Duration::from_millis(5));
            Arc::strong_count(&held) == 1
        });
        assert!(gone);
    }
}
