//! A real camera: frames from a pipe, the newest only.

use std::fs::{self, File};
use std::io::{self, BufReader, Read};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use hough_heuristic::image::GrayImage;
use hough_heuristic::{FrameError, FrameSource, FrameStream};

/// A camera whose frames arrive whether or not they are asked for.
///
/// A thread reads all frames and keeps the newest, so that no buffer fills with old ones. A grab
/// waits for a frame that arrives at least [`LiveCamera::delay`] after the call: with a camera that
/// needs no longer than this from exposure to delivery, the frame was exposed after the call, as
/// [`FrameSource`] demands. Setting the flag `stop` ends the wait for a frame with an error.
///
/// ```no_run
/// use std::sync::Arc;
///
/// use puma_grasp::LiveCamera;
/// use puma_grasp::hough_heuristic::{FrameSource, image::GrayImage};
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let command = "| ffmpeg -loglevel error -i /dev/video0 -f yuv4mpegpipe -pix_fmt yuv420p -";
///     let mut camera = LiveCamera::open(command, None, &Arc::default())?;
///     let mut frame = GrayImage::default();
///     camera.grab(&mut frame)?;
///     assert_eq!(frame.dimensions(), camera.dimensions());
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct LiveCamera {
    /// Longest time from the exposure of a frame to its arrival (default 100 ms).
    pub delay: Duration,
    /// Time without a usable frame after which a grab fails (default 5 s).
    pub patience: Duration,
    name: String,
    size: (u32, u32),
    shared: Arc<Shared>,
    stop: Arc<AtomicBool>,
}

/// Longest wait between two looks at the flag.
const LOOK: Duration = Duration::from_millis(20);

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    frame: GrayImage,
    /// Time of arrival of the frame, until it is taken.
    arrived: Option<Instant>,
    /// Reason why no more frames will come.
    ended: Option<String>,
    /// Set for a recording: each frame waits until it is taken.
    in_order: bool,
    /// Set when nobody will ask again.
    closed: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Plain data stays valid when a thread panics.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads frames until they end or nobody wants them.
    fn read(&self, mut source: impl FrameSource) {
        let mut frame = GrayImage::default();
        loop {
            let grabbed = source.grab(&mut frame);
            let mut state = self.lock();
            while state.in_order && state.arrived.is_some() && !state.closed {
                let woken = self.changed.wait(state);
                state = woken.unwrap_or_else(PoisonError::into_inner);
            }
            match grabbed {
                Ok(()) => {
                    std::mem::swap(&mut state.frame, &mut frame);
                    state.arrived = Some(Instant::now());
                }
                Err(FrameError::End) => state.ended = Some("the stream has ended".into()),
                Err(FrameError::Failed { reason, .. }) => state.ended = Some(reason),
                Err(other) => state.ended = Some(other.to_string()),
            }
            self.changed.notify_all();
            if state.closed || state.ended.is_some() {
                return;
            }
        }
    }
}

impl LiveCamera {
    /// Opens `source` and waits for its first frame: `-` for standard input, the path of a named
    /// pipe, or `| COMMAND` for what a command of the shell writes. The frames of an ordinary file,
    /// a recording, are delivered one by one. The stream is Y4M, or 8-bit gray frames of the size
    /// `raw` without any header.
    ///
    /// A path below `/dev/video` or `/dev/v4l/`, or any after `v4l2:`, is that of a camera of Linux
    /// (feature `v4l2`), whose frames have the size `raw` or the one that it is set to.
    ///
    /// # Errors
    /// [`FrameError::Failed`] if the source cannot be opened, is no such stream, or delivers
    /// nothing within 10 s.
    pub fn open(
        source: &str,
        raw: Option<(u32, u32)>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, FrameError> {
        let device = source.strip_prefix("v4l2:");
        let by_name = ["/dev/video", "/dev/v4l/"];
        let by_name = by_name.iter().any(|start| source.starts_with(start));
        if let Some(path) = device.or(by_name.then_some(source)) {
            return Self::of_device(path, raw, stop);
        }
        let (asked, in_order) = (
            source.to_owned(),
            fs::metadata(source).is_ok_and(|file| file.is_file()),
        );
        Self::start(source, in_order, stop, move || {
            let bytes = BufReader::new(opened(&asked).map_err(|error| error.to_string())?);
            match raw {
                None => FrameStream::y4m(bytes).map_err(|error| match error {
                    FrameError::Failed { reason, .. } => reason,
                    other => other.to_string(),
                }),
                Some((width, height)) => {
                    FrameStream::raw(bytes, width, height).map_err(|error| error.to_string())
                }
            }
        })
    }

    #[cfg(feature = "v4l2")]
    fn of_device(
        path: &str,
        size: Option<(u32, u32)>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, FrameError> {
        let device = hough_heuristic::VideoDevice::open(path, size)?;
        Self::over(path, stop, move || Ok(device))
    }

    #[cfg(not(feature = "v4l2"))]
    fn of_device(
        path: &str,
        _: Option<(u32, u32)>,
        _: &Arc<AtomicBool>,
    ) -> Result<Self, FrameError> {
        let built = "this program was built without cameras by name (cargo's --features v4l2)";
        let pipe = format!("'| ffmpeg -i {path} -f yuv4mpegpipe -pix_fmt yuv420p -' does the same");
        Err(FrameError::Failed {
            origin: format!("camera {path}"),
            reason: format!("{built}; {pipe}"),
        })
    }

    /// Reads the frames of a camera of any kind. `open` is called in the thread that reads.
    ///
    /// # Errors
    /// [`FrameError::Failed`] with the reason of `open`, or if no frame comes within 10 s.
    pub fn over<S: FrameSource>(
        name: &str,
        stop: &Arc<AtomicBool>,
        open: impl FnOnce() -> Result<S, String> + Send + 'static,
    ) -> Result<Self, FrameError> {
        Self::start(name, false, stop, open)
    }

    fn start<S: FrameSource>(
        name: &str,
        in_order: bool,
        stop: &Arc<AtomicBool>,
        open: impl FnOnce() -> Result<S, String> + Send + 'static,
    ) -> Result<Self, FrameError> {
        const FIRST: Duration = Duration::from_secs(10);
        let shared = Arc::new(Shared::default());
        shared.lock().in_order = in_order;
        let reader = Arc::clone(&shared);
        thread::spawn(move || match open() {
            Ok(source) => reader.read(source),
            Err(reason) => {
                reader.lock().ended = Some(reason);
                reader.changed.notify_all();
            }
        });
        let mut camera = Self {
            delay: Duration::from_millis(100),
            patience: FIRST,
            name: name.into(),
            size: (0, 0),
            shared,
            stop: Arc::clone(stop),
        };
        let size = camera.newest(None)?.frame.dimensions();
        camera.size = size;
        camera.patience = Duration::from_secs(5);
        Ok(camera)
    }

    /// Returns width and height of the first frame, pixels.
    pub fn dimensions(&self) -> (u32, u32) {
        self.size
    }

    /// Waits for a frame that arrived after `since`.
    fn newest(&self, since: Option<Instant>) -> Result<MutexGuard<'_, State>, FrameError> {
        let failed = |reason: String| FrameError::Failed {
            origin: format!("camera {}", self.name),
            reason,
        };
        let until = since.unwrap_or_else(Instant::now) + self.patience;
        let mut state = self.shared.lock();
        loop {
            let usable = |arrived| state.in_order || since.is_none_or(|since| arrived > since);
            if state.arrived.is_some_and(usable) {
                return Ok(state);
            }
            if let Some(reason) = &state.ended {
                return Err(failed(reason.clone()));
            }
            if self.stop.load(Ordering::Relaxed) {
                return Err(failed("stopped on request".into()));
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let seconds = self.patience.as_secs_f64();
                return Err(failed(format!(
                    "no frame for {seconds} s; check the camera and the program that feeds the pipe"
                )));
            }
            let woken = self.shared.changed.wait_timeout(state, left.min(LOOK));
            state = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl FrameSource for LiveCamera {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let mut state = self.newest(Some(Instant::now() + self.delay))?;
        std::mem::swap(frame, &mut state.frame);
        state.arrived = None;
        self.shared.changed.notify_all();
        if frame.dimensions() == self.size {
            return Ok(());
        }
        let ((now, high), (first, first_high)) = (frame.dimensions(), self.size);
        Err(FrameError::Failed {
            origin: format!("camera {}", self.name),
            reason: format!("its frames were {first}x{first_high} px and are now {now}x{high} px"),
        })
    }
}

impl Drop for LiveCamera {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.changed.notify_all();
    }
}

/// Opens the bytes of a source. A named pipe is waited for until something writes to it.
fn opened(source: &str) -> io::Result<Box<dyn Read>> {
    if source == "-" {
        return Ok(Box::new(io::stdin()));
    }
    let Some(command) = source.strip_prefix('|') else {
        return Ok(Box::new(File::open(source)?));
    };
    let mut shell = Command::new(if cfg!(windows) { "cmd" } else { "sh" });
    shell
        .arg(if cfg!(windows) { "/C" } else { "-c" })
        .arg(command);
    let child = shell.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
    // The command ends when its pipe is closed.
    Ok(child
        .stdout
        .map_or_else(|| Box::new(io::empty()) as _, |out| Box::new(out) as _))
}
