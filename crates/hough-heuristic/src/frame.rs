//! Sources of frames.

#[cfg(feature = "files")]
mod files;
mod newest;
mod stream;
#[cfg(all(feature = "v4l2", target_os = "linux"))]
mod video;
#[cfg(all(feature = "v4l2", not(target_os = "linux")))]
#[path = "frame/video/none.rs"]
mod video;
mod y4m;

#[cfg(feature = "files")]
pub use files::{Channel, ImageFiles};
pub use stream::FrameStream;
#[cfg(feature = "v4l2")]
pub use video::VideoDevice;
pub use y4m::Y4mWriter;

use image::GrayImage;

/// A source of monochrome frames: a camera, a folder of files, a stream, a rendered scene.
pub trait FrameSource {
    /// Replaces the content of `frame` by the next frame, whose size may differ.
    ///
    /// The frame of a live source is **exposed after this call**: a control loop moves its arm, and
    /// then needs the view from the new pose. A source that buffers frames discards the older ones
    /// first. A recorded source delivers its frames in order. Reuse `frame`, so that nothing is
    /// allocated for it.
    ///
    /// # Errors
    /// [`FrameError::End`] after the last frame; [`FrameError::Failed`] if the source could not
    /// deliver one. The content of `frame` is then unspecified.
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError>;

    /// Returns a source that delivers the newest frame of a camera that queues, as those of V4L2
    /// and of OpenCV do.
    ///
    /// A thread reads the camera without pause. Dropped is each frame that was asked for before the
    /// call of [`FrameSource::grab`] or within `latency` after it: the longest time from the
    /// beginning of an exposure to the delivery of its frame, one or two periods of the camera.
    fn newest_only(self, latency: std::time::Duration) -> impl FrameSource
    where
        Self: Sized + Send + 'static,
    {
        newest::Newest::of(self, latency)
    }
}

/// The reason why a [`FrameSource`] delivered no frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The source has no more frames: the ordinary end.
    #[error("no more frames")]
    End,
    /// The source failed; the text names the source and what went wrong.
    #[error("{origin}: {reason}")]
    Failed {
        /// The file, device or stream.
        origin: String,
        /// The fault and, where known, the remedy.
        reason: String,
    },
}

/// Gives `frame` this size and the pixels that `fill` writes, reusing its memory.
fn refill<T>(
    frame: &mut GrayImage,
    (width, height): (u32, u32),
    fill: impl FnOnce(&mut [u8]) -> T,
) -> T {
    let mut pixels = std::mem::take(frame).into_raw();
    pixels.resize(width as usize * height as usize, 0);
    let result = fill(&mut pixels);
    // There are exactly as many bytes as pixels, so this never falls back.
    *frame = GrayImage::from_raw(width, height, pixels).unwrap_or_default();
    result
}
