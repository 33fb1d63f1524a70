use image::GrayImage;

use crate::error::ConfigError;

/// A monochrome frame in a caller's memory, row by row, each row `stride` bytes after the one
/// before.
///
/// Cameras and video frameworks pad their rows. Detectors take a [`GrayImage`], whose rows follow
/// one another; copy each frame into one that is reused:
///
/// ```
/// use hough_heuristic::GrayView;
/// use hough_heuristic::image::GrayImage;
///
/// let buffer = vec![7u8; 640 * 480]; // Rows of 640 bytes, of which 600 are picture.
/// let mut frame = GrayImage::default();
/// GrayView::new(&buffer, 600, 480, 640)?.copy_into(&mut frame);
/// assert_eq!(frame.dimensions(), (600, 480));
/// # Ok::<(), hough_heuristic::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct GrayView<'a> {
    bytes: &'a [u8],
    width: u32,
    height: u32,
    stride: usize,
}

impl<'a> GrayView<'a> {
    /// The frame of `width` x `height` pixels that begins with the first of `bytes`.
    ///
    /// # Errors
    /// [`ConfigError::Stride`] if `stride` is below `width`, [`ConfigError::Buffer`] if the bytes
    /// end before the last row.
    pub fn new(
        bytes: &'a [u8],
        width: u32,
        height: u32,
        stride: usize,
    ) -> Result<Self, ConfigError> {
        if stride < width as usize {
            return Err(ConfigError::Stride { stride, width });
        }
        // The last row need not be padded.
        let rows = (height as usize).saturating_sub(1).saturating_mul(stride);
        let needed = if height == 0 {
            0
        } else {
            rows.saturating_add(width as usize)
        };
        if bytes.len() < needed {
            return Err(ConfigError::Buffer {
                given: bytes.len(),
                needed,
            });
        }
        Ok(Self {
            bytes,
            width,
            height,
            stride,
        })
    }

    /// Makes `frame` this frame, reusing its memory.
    pub fn copy_into(&self, frame: &mut GrayImage) {
        let mut pixels = std::mem::take(frame).into_raw();
        pixels.clear();
        if self.width > 0 {
            for row in self.bytes.chunks(self.stride).take(self.height as usize) {
                pixels.extend_from_slice(&row[..self.width as usize]);
            }
        }
        // There are exactly as many bytes as pixels, so this never falls back.
        *frame = GrayImage::from_raw(self.width, self.height, pixels).unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_taken_at_their_stride() {
        let bytes: Vec<u8> = (0..23).collect();
        let mut frame = GrayImage::new(50, 50);
        GrayView::new(&bytes, 3, 3, 10)
            .unwrap()
            .copy_into(&mut frame);
        assert_eq!(frame.dimensions(), (3, 3));
        assert_eq!(frame.as_raw(), &[0, 1, 2, 10, 11, 12, 20, 21, 22]);
        for (width, height) in [(0, 0), (0, 5), (5, 0)] {
            GrayView::new(&bytes, width, height, 5)
                .unwrap()
                .copy_into(&mut frame);
            assert_eq!(frame.dimensions(), (width, height));
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_with_its_numbers() {
        let error = GrayView::new(&[0; 100], 11, 3, 10).unwrap_err().to_string();
        assert!(error.contains("10") && error.contains("11"), "{error}");
        let error = GrayView::new(&[0; 22], 3, 3, 10).unwrap_err().to_string();
        assert!(error.contains("22") && error.contains("23"), "{error}");
        assert!(GrayView::new(&[0; 22], u32::MAX, u32::MAX, usize::MAX).is_err());
    }
}
