//! Following a circle from frame to frame.

use image::GrayImage;

use super::{AContrario, LEAST_SIDE, Measurement};
use crate::circle::Circle;
use crate::detect::{CircleDetector, FrameRefused};

impl AContrario {
    /// Searches for the circle `last`, whose centre and radius may have changed by `reach` pixels,
    /// and searches the whole frame only if it is not there. Returns `true` if it was.
    ///
    /// [`measurements`](Self::measurements) then holds the one circle followed, or else all circles
    /// of the frame. The number of false alarms counts the circles in the part that was searched.
    /// A `last` or a `reach` that is not finite, or has no radius, is never there.
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
        let radii = (
            (last.radius - reach).max(self.config.min_radius),
            (last.radius + reach).min(self.config.max_radius),
        );
        let usable = [last.x, last.y, last.radius, reach]
            .iter()
            .all(|value| value.is_finite());
        if !usable || reach < 0.0 || radii.0 > radii.1 {
            return None;
        }
        // The window holds the outline wherever it may be, and the rays beyond it.
        let extent = last.radius + 2.0 * reach + MARGIN;
        let clip = |value: f64, end: u32| value.clamp(0.0, f64::from(end)) as u32;
        let (left, right) = (
            clip(last.x - extent, frame.width()),
            clip(last.x + extent + 1.0, frame.width()),
        );
        let (top, bottom) = (
            clip(last.y - extent, frame.height()),
            clip(last.y + extent + 1.0, frame.height()),
        );
        let (width, height) = (right - left, bottom - top);
        if width < LEAST_SIDE || height < LEAST_SIDE {
            return None;
        }
        let mut pixels = std::mem::take(&mut self.window).into_raw();
        pixels.clear();
        for row in frame
            .as_raw()
            .chunks_exact(frame.width() as usize)
            .take(bottom as usize)
            .skip(top as usize)
        {
            pixels.extend_from_slice(&row[left as usize..right as usize]);
        }
        let window = GrayImage::from_raw(width, height, pixels).unwrap_or_default();
        let region = self.config.region.take();
        self.find(&window, radii);
        self.config.region = region;
        self.window = window;
        let moved = |measurement: &Measurement| {
            let circle = Circle {
                x: measurement.circle.x + f64::from(left),
                y: measurement.circle.y + f64::from(top),
                ..measurement.circle
            };
            Measurement {
                circle,
                ..*measurement
            }
        };
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

/// Pixels beyond the outline, at its farthest, that are looked at.
const MARGIN: f64 = 16.0;
