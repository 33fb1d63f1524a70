//! Where frames come from.

#[cfg(feature = "files")]
mod files;
mod stream;
mod view;

#[cfg(feature = "files")]
pub use files::ImageFiles;
pub use stream::{RawFrames, Y4mFrames};
pub use view::GrayView;

use image::GrayImage;

/// A source of monochrome frames: a camera, a folder of files, a stream, a rendered scene.
pub trait FrameSource {
    /// The next frame.
    ///
    /// # Errors
    /// [`FrameError::End`] after the last frame; otherwise what kept the source from delivering
    /// one.
    fn grab(&mut self) -> Result<GrayImage, FrameError>;
}

/// Why a [`FrameSource`] delivered no frame.
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
        /// What went wrong and, where known, what to do.
        reason: String,
    },
}
