//! The emulator behind a lock, and the time it lives in.

use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::emulator::controller::Emulator;
use crate::transport::Transcript;

/// An emulator shared between the thread that serves it and its owner.
#[derive(Clone, Debug)]
pub(super) struct Station(Arc<Mutex<State>>);

struct State {
    emulator: Emulator,
    /// The wall clock's origin and the emulator's time then; `None` for virtual time.
    realtime: Option<(Instant, Duration)>,
    transcript: Option<Transcript<Box<dyn Write + Send>>>,
}

impl std::fmt::Debug for State {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("State")
            .field("emulator", &self.emulator)
            .field("realtime", &self.realtime.is_some())
            .finish_non_exhaustive()
    }
}

impl State {
    fn now(&self) -> Duration {
        match self.realtime {
            Some((origin, start)) => (start + origin.elapsed()).max(self.emulator.now()),
            None => self.emulator.now(),
        }
    }
}

/// Output and next wait of the serving thread.
#[derive(Debug)]
pub(super) struct Turn {
    /// Bytes to write.
    pub(super) output: Vec<u8>,
    /// Time to wait for input before the next turn; `None` waits until some comes.
    pub(super) wait: Option<Duration>,
}

impl Station {
    pub(super) fn new(
        emulator: Emulator,
        realtime: bool,
        transcript: Option<Box<dyn Write + Send>>,
    ) -> Self {
        let realtime = realtime.then(|| (Instant::now(), emulator.now()));
        Self(Arc::new(Mutex::new(State {
            emulator,
            realtime,
            transcript: transcript.map(Transcript::new),
        })))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A panic elsewhere leaves the emulator in a state that is still sound to look at.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hands over input, which may be none, and lets the emulator do its work.
    ///
    /// In virtual time a turn without input jumps to the next thing that happens, unless `blocked`:
    /// output still has to be fetched.
    pub(super) fn turn(&self, input: &[u8], blocked: bool) -> Turn {
        let mut state = self.lock();
        let mut now = state.now();
        let jumps = state.realtime.is_none() && input.is_empty() && !blocked;
        if jumps && let Some(at) = state.emulator.next_deadline() {
            now = now.max(at);
        }
        let output = state.emulator.feed(input, now);
        if let Some(transcript) = &mut state.transcript {
            // A transcript that cannot be written does not stop the line.
            let _ = transcript
                .sent(input)
                .and_then(|()| transcript.received(&output));
        }
        let wait = state
            .emulator
            .next_deadline()
            .map(|at| match state.realtime {
                // Rounded up to what a poll can wait, lest it wakes up too early over and over.
                Some(_) => at
                    .saturating_sub(state.now())
                    .max(Duration::from_micros(200)),
                None => Duration::ZERO,
            });
        Turn { output, wait }
    }

    /// Looks at or changes the emulator, its time brought up to now.
    pub(super) fn with<R>(&self, f: impl FnOnce(&mut Emulator) -> R) -> R {
        let mut state = self.lock();
        let now = state.now();
        state.emulator.advance(now);
        f(&mut state.emulator)
    }
}
