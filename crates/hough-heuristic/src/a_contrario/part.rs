//! The search of a part of the frame: of what the region needs.

use image::GrayImage;

use super::AContrario;
use crate::detect::FrameRefused;
use crate::region::Region;

/// Pixels beyond the outline, at its farthest, that are looked at.
pub(super) const MARGIN: f64 = 16.0;

impl AContrario {
    /// Finds the circles of a frame with the radii of the settings, in the part of it that the
    /// region needs.
    pub(super) fn find_in_region(&mut self, frame: &GrayImage) -> Result<(), FrameRefused> {
        let (width, height) = frame.dimensions();
        let radii = self.config.radii(width, height);
        let first = self.config.first_radius();
        let whole = Region {
            left: 0,
            top: 0,
            width,
            height,
        };
        let region = self.config.region.unwrap_or(whole);
        region.check_frame(width, height)?;
        let part = region.grown(radii.1 + MARGIN, width, height);
        if part == whole {
            self.find(frame, radii, first);
            self.show(frame, part);
            return Ok(());
        }
        let window = part.cut(frame, std::mem::take(&mut self.window));
        let (left, top) = (region.left - part.left, region.top - part.top);
        self.config.region = Some(Region {
            left,
            top,
            ..region
        });
        self.find(&window, radii, first);
        self.config.region = Some(region);
        self.window = window;
        self.show(frame, part);
        for measurement in &mut self.measurements {
            *measurement = measurement.moved(part.left.into(), part.top.into());
        }
        Ok(())
    }
}
