//! Following a circle from frame to frame.

use image::GrayImage;

use super::part::MARGIN;
use super::{AContrario, LEAST_SIDE, Measurement};
use crate::circle::Circle;
use crate::detect::{CircleDetector, FrameRefused};
use crate::region::Region;

impl AContrario {
    /// Searches for the circle `last`, whose centre and radius may have changed by `reach` pixels.
    /// Only if it is not found is the whole frame searched. Returns `true` if it was found.
    ///
    /// [`measurements`](Self::measurements) then holds the one circle followed, or else all circles
    /// of the frame. The number of false alarms counts the circles in the part that was searched.
    /// A `last` that is not finite or has no radius is never found, nor is any with a `reach` that
    /// is not finite.
    ///
    /// # Errors
    /// [`FrameRefused`] if the whole frame is to be searched and the configuration does not suit
    /// it.
    pub fn track(
        &mut self,
        frame: &GrayImage,
        last: &Circle,
        reach: f64,
    ) -> Result<bool, FrameRefused> {
        let followed = self.follow(frame, last, reach);
        if let Some(measurement) = followed {
            self.measurements.clear();
            self.measurements.push(measurement);
        } else {
            self.detect(frame)?;
        }
        Ok(followed.is_some())
    }

    /// The best circle near the last one.
    fn follow(&mut self, frame: &GrayImage, last: &Circle, reach: f64) -> Option<Measurement> {
        let (min, max) = self.config.radii(frame.width(), frame.height());
        let radii = (
            (last.radius - reach).max(min),
            (last.radius + reach).min(max),
        );
        let usable = [last.x, last.y, last.radius, reach]
            .iter()
            .all(|value| value.is_finite());
        if !usable || reach < 0.0 || radii.0 > radii.1 {
            return None;
        }
        // The window holds the outline wherever it may be, and the rays beyond it.
        let extent = last.radius + 2.0 * reach + MARGIN;
        let span = |middle: f64, end: u32| {
            let clip = |value: f64| value.clamp(0.0, f64::from(end)) as u32;
            let first = clip(middle - extent);
            (first, clip(middle + extent + 1.0) - first)
        };
        let (left, width) = span(last.x, frame.width());
        let (top, height) = span(last.y, frame.height());
        if width < LEAST_SIDE || height < LEAST_SIDE {
            return None;
        }
        let part = Region {
            left,
            top,
            width,
            height,
        };
        let window = part.cut(frame, std::mem::take(&mut self.window));
        let region = self.config.region.take();
        self.find(&window, radii, radii.0);
        self.config.region = region;
        self.window = window;
        let moved = |measurement: &Measurement| measurement.moved(left.into(), top.into());
        self.measurements.iter().map(moved).find(|measurement| {
            let circle = &measurement.circle;
            let off = ((circle.x - last.x).powi(2) + (circle.y - last.y).powi(2)).sqrt();
            let placed = self
                .config
                .region
                .as_ref()
                .is_none_or(|region| region.holds(circle));
            off <= reach && placed
        })
    }
}
