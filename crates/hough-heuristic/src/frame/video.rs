//! Cameras of Linux by name.

mod device;

use image::{GrayImage, ImageFormat};

use super::{FrameError, FrameSource, refill};
use device::Device;

/// A camera of Linux (V4L2) by the path of its device: `/dev/video0`, or a link in
/// `/dev/v4l/by-id`.
///
/// Of the formats that the camera has, the first of these is taken: `GREY`, the luma of `YUYV`,
/// `UYVY`, `NV12` or `YU12`, and decoded `MJPG`. The driver queues four frames:
/// [`FrameSource::newest_only`] drops the old ones. Rate, exposure and the like are set by other
/// programs, such as `v4l2-ctl`, and stay.
///
/// On other systems than Linux, opening fails with an error that says so.
#[derive(Debug)]
pub struct VideoDevice {
    path: String,
    device: Device,
    layout: Layout,
}

/// Arrangement of a frame in memory.
#[derive(Clone, Copy, Debug)]
struct Layout {
    pixels: Pixels,
    width: u32,
    height: u32,
    /// Bytes from one row to the next; 0 for a compressed format.
    stride: u32,
}

/// Format of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pixels {
    /// Bytes from one luma to the next, and that of the first.
    Luma(usize, usize),
    Jpeg,
}

/// Formats in the order in which they are tried.
const FORMATS: [(&[u8; 4], Pixels); 6] = [
    (b"GREY", Pixels::Luma(1, 0)),
    (b"YUYV", Pixels::Luma(2, 0)),
    (b"UYVY", Pixels::Luma(2, 1)),
    (b"NV12", Pixels::Luma(1, 0)),
    (b"YU12", Pixels::Luma(1, 0)),
    (b"MJPG", Pixels::Jpeg),
];

impl VideoDevice {
    /// Opens a camera. Its frames have the given `size`, or the one that it is set to.
    ///
    /// # Errors
    /// [`FrameError::Failed`] for a path that is no camera, a camera that another program uses, and
    /// one without such a format or size.
    pub fn open(path: &str, size: Option<(u32, u32)>) -> Result<Self, FrameError> {
        let (device, layout) = Device::open(path, size).map_err(|error| failed(path, &error))?;
        Ok(Self {
            path: path.into(),
            device,
            layout,
        })
    }
}

impl FrameSource for VideoDevice {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        /// Frames in a row that may be damaged, as the first ones of a camera often are.
        const DAMAGED: usize = 30;
        let mut last = String::new();
        for _ in 0..DAMAGED {
            let taken = self.device.next(|bytes| self.layout.take(bytes, frame));
            match taken.map_err(|error| failed(&self.path, &error))? {
                Ok(()) => return Ok(()),
                Err(fault) => last = fault,
            }
        }
        Err(failed(&self.path, &last))
    }
}

fn failed(path: &str, reason: &impl ToString) -> FrameError {
    FrameError::Failed {
        origin: format!("camera {path}"),
        reason: reason.to_string(),
    }
}

impl Layout {
    /// Copies the luma of a frame.
    fn take(&self, bytes: &[u8], frame: &mut GrayImage) -> Result<(), String> {
        let (width, height) = (self.width as usize, self.height as usize);
        let Pixels::Luma(step, first) = self.pixels else {
            let picture = image::load_from_memory_with_format(bytes, ImageFormat::Jpeg);
            *frame = picture
                .map_err(|error| format!("a damaged frame: {error}"))?
                .into_luma8();
            return Ok(());
        };
        let stride = (self.stride as usize).max(width * step);
        let needed = stride * (height - 1) + width * step;
        if bytes.len() < needed {
            let count = bytes.len();
            return Err(format!(
                "a frame of {count} bytes, of {needed} that it needs"
            ));
        }
        refill(frame, (self.width, self.height), |pixels| {
            for (row, from) in pixels.chunks_exact_mut(width).zip(bytes.chunks(stride)) {
                let luma = from[first..].iter().step_by(step);
                row.iter_mut().zip(luma).for_each(|(to, from)| *to = *from);
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(pixels: Pixels, stride: u32, bytes: &[u8]) -> Result<GrayImage, String> {
        let layout = Layout {
            pixels,
            width: 4,
            height: 2,
            stride,
        };
        let mut frame = GrayImage::default();
        layout.take(bytes, &mut frame).map(|()| frame)
    }

    #[test]
    fn luma_is_taken_from_every_format_and_padded_rows() {
        let ramp: Vec<u8> = (0..32).collect();
        for ((name, pixels), expected) in FORMATS.into_iter().zip([
            [0, 1, 2, 3, 6, 7, 8, 9],
            [0, 2, 4, 6, 10, 12, 14, 16],
            [1, 3, 5, 7, 11, 13, 15, 17],
            [0, 1, 2, 3, 6, 7, 8, 9],
            [0, 1, 2, 3, 6, 7, 8, 9],
        ]) {
            let stride = if pixels == Pixels::Luma(1, 0) { 6 } else { 10 };
            let frame = taken(pixels, stride, &ramp).expect("enough bytes");
            assert_eq!(frame.as_raw(), &expected, "{name:?}");
        }
        // A driver may say nothing of the stride; the last row needs no padding.
        let frame = taken(Pixels::Luma(1, 0), 0, &ramp[..8]).expect("enough bytes");
        assert_eq!(frame.as_raw(), &[0, 1, 2, 3, 4, 5, 6, 7]);
        assert!(taken(Pixels::Luma(1, 0), 6, &ramp[..10]).is_ok());
        assert!(taken(Pixels::Luma(1, 0), 6, &ramp[..9]).is_err());
    }

    #[test]
    fn jpeg_frames_are_decoded_and_damaged_ones_refused() {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let picture = GrayImage::from_pixel(16, 8, [130].into());
        picture
            .write_to(&mut bytes, ImageFormat::Jpeg)
            .expect("a picture");
        let bytes = bytes.into_inner();
        let frame = taken(Pixels::Jpeg, 0, &bytes).expect("a picture");
        assert_eq!(frame.dimensions(), (16, 8));
        assert!(frame.pixels().all(|pixel| pixel.0[0].abs_diff(130) < 3));
        let damaged = taken(Pixels::Jpeg, 0, &bytes[..40]).expect_err("cut");
        assert!(damaged.contains("damaged"), "{damaged}");
    }

    #[test]
    fn what_is_no_camera_is_named_with_the_reason() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("video0");
        std::fs::write(&file, "no device").expect("a file");
        let file = file.to_str().expect("plain text");
        for (path, reason) in [
            ("/dev/no-such-video", "No such file"),
            (file, "no video device"),
            ("/dev/null", "no video device"),
        ] {
            let said = VideoDevice::open(path, None).expect_err(path).to_string();
            assert!(said.starts_with(&format!("camera {path}: ")), "{said}");
            assert!(said.contains(reason), "{said}");
        }
    }
}
