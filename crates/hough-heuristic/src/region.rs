//! The rectangle in which a centre must lie.

use image::GrayImage;

use crate::circle::Circle;
use crate::detect::FrameRefused;
use crate::error::ConfigError;

/// A rectangle of pixels of a frame: the *region of interest* for the centre of a circle.
///
/// Only the centre must lie inside; the outline may leave the region, and the frame. A detector
/// refuses an empty region when it is built ([`ConfigError::Region`]), and frames that its region
/// sticks out of ([`FrameRefused::Region`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Region {
    /// Leftmost column.
    pub left: u32,
    /// Top row.
    pub top: u32,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

impl Region {
    /// Refuses a region without pixels, or beyond the largest frame.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        if self.width > 0 && self.height > 0 && self.fits(u32::MAX, u32::MAX) {
            Ok(())
        } else {
            Err(ConfigError::Region(*self))
        }
    }

    /// Refuses a frame that the region sticks out of.
    pub(crate) fn check_frame(
        &self,
        frame_width: u32,
        frame_height: u32,
    ) -> Result<(), FrameRefused> {
        if self.fits(frame_width, frame_height) {
            return Ok(());
        }
        Err(FrameRefused::Region {
            region: *self,
            frame_width,
            frame_height,
        })
    }

    fn fits(&self, frame_width: u32, frame_height: u32) -> bool {
        let within = |start: u32, length: u32, end: u32| {
            start.checked_add(length).is_some_and(|stop| stop <= end)
        };
        within(self.left, self.width, frame_width) && within(self.top, self.height, frame_height)
    }

    /// Returns `true` if the centre of `circle` lies on one of the region's pixels (half a pixel of
    /// border included).
    pub(crate) fn holds(&self, circle: &Circle) -> bool {
        let within = |value: f64, start: u32, length: u32| {
            let from_edge = value + 0.5 - f64::from(start);
            (0.0..=f64::from(length)).contains(&from_edge)
        };
        within(circle.x, self.left, self.width) && within(circle.y, self.top, self.height)
    }
}

impl Region {
    /// Returns the part of a frame that lies within `reach` pixels of the region.
    pub(crate) fn grown(&self, reach: f64, frame_width: u32, frame_height: u32) -> Self {
        let reach = reach.ceil() as u32;
        let span = |start: u32, length: u32, end: u32| {
            let first = start.saturating_sub(reach);
            (
                first,
                (start + length).saturating_add(reach).min(end) - first,
            )
        };
        let (left, width) = span(self.left, self.width, frame_width);
        let (top, height) = span(self.top, self.height, frame_height);
        Self {
            left,
            top,
            width,
            height,
        }
    }

    /// Copies the pixels of the region, which must lie in the frame, reusing the memory of `into`.
    pub(crate) fn cut(&self, frame: &GrayImage, into: GrayImage) -> GrayImage {
        let mut pixels = into.into_raw();
        pixels.clear();
        let (first, end) = (self.left as usize, (self.left + self.width) as usize);
        let rows = frame.as_raw().chunks_exact(frame.width().max(1) as usize);
        for row in rows.skip(self.top as usize).take(self.height as usize) {
            pixels.extend_from_slice(&row[first..end]);
        }
        GrayImage::from_raw(self.width, self.height, pixels).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region((left, top): (u32, u32), (width, height): (u32, u32)) -> Region {
        Region {
            left,
            top,
            width,
            height,
        }
    }

    #[test]
    fn a_region_has_pixels_and_lies_in_the_frame() {
        for (corner, size) in [((0, 0), (0, 5)), ((1, 2), (5, 0)), ((u32::MAX, 0), (2, 1))] {
            let error = region(corner, size).check().unwrap_err().to_string();
            assert!(
                error.contains(&format!("({}, {})", corner.0, corner.1)),
                "{error}"
            );
        }
        assert!(region((0, 0), (768, 576)).check_frame(768, 576).is_ok());
        for (corner, size) in [((760, 0), (9, 5)), ((0, 576), (1, 1))] {
            let error = region(corner, size).check_frame(768, 576).unwrap_err();
            assert!(error.to_string().contains("768x576"), "{error}");
        }
        let region = region((700, 0), (68, 5));
        let error = region.check_frame(720, 576).unwrap_err().to_string();
        assert!(
            error.contains("68x5 px at (700, 0)") && error.contains("720x576"),
            "{error}"
        );
    }

    #[test]
    fn the_centre_decides() {
        let region = region((10, 20), (5, 5));
        let at = |x, y| Circle { x, y, radius: 50.0 };
        assert!(region.holds(&at(10.0, 20.0)));
        assert!(region.holds(&at(14.4, 24.4)));
        assert!(!region.holds(&at(15.0, 22.0)));
        assert!(!region.holds(&at(f64::NAN, 22.0)));
    }
}
