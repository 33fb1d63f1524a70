//! No cameras by name: the system is not Linux.

use std::convert::Infallible;

use image::GrayImage;

use crate::frame::{FrameError, FrameSource};

/// A camera of Linux (V4L2) by the path of its device, which does not exist on this system.
#[derive(Debug)]
pub struct VideoDevice(Infallible);

impl VideoDevice {
    /// Returns an error: this system has no such devices.
    ///
    /// # Errors
    /// [`FrameError::Failed`], always.
    pub fn open(path: &str, _: Option<(u32, u32)>) -> Result<Self, FrameError> {
        Err(FrameError::Failed {
            origin: format!("camera {path}"),
            reason: "devices by name (V4L2) are Linux's; take a program's frames through a pipe"
                .into(),
        })
    }
}

impl FrameSource for VideoDevice {
    fn grab(&mut self, _: &mut GrayImage) -> Result<(), FrameError> {
        match self.0 {}
    }
}
