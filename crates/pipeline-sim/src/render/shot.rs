//! Exposures that take time, of one field or two.

use hough_heuristic::image::GrayImage;
use puma_val2::Joints;

use crate::cell::geometry::Cell;
use crate::render::blur::soften;
use crate::render::renderer::Renderer;

/// The exposure of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shot {
    /// Time the shutter is open, seconds, up to [`Shot::LONGEST`]. 0 freezes all motion.
    pub exposure: f64,
    /// Sharp frames that are drawn, spread evenly over the exposure of each field, and averaged; 1
    /// freezes all motion. One for every two pixels of motion is enough, and each costs a frame's
    /// time. 1 to [`Shot::MOST_MOMENTS`]; [`Renderer::take`] clamps it to that range.
    pub moments: usize,
    /// Delay of the odd rows of an interlaced frame after the even ones, seconds, at most
    /// [`Shot::LONGEST`].
    pub interlace: Option<f64>,
}

impl Shot {
    /// Greatest number of moments of a field.
    pub const MOST_MOMENTS: usize = 64;

    /// Longest exposure, and longest time between two fields, seconds.
    pub const LONGEST: f64 = 60.0;

    /// Returns an instantaneous frame.
    pub fn still() -> Self {
        Self {
            exposure: 0.0,
            moments: 1,
            interlace: None,
        }
    }

    /// Returns the two fields of PAL, 20 ms apart (the paper's grabber delivers 768x576 pixels at
    /// 50 Hz, which are fields), each exposed for `exposure` seconds.
    pub fn pal(exposure: f64, moments: usize) -> Self {
        Self {
            exposure,
            moments,
            interlace: Some(0.020),
        }
    }

    /// Returns the middle of the exposure, seconds after the shutter opened.
    pub(crate) fn middle(&self) -> f64 {
        0.5 * (self.exposure + self.interlace.unwrap_or(0.0))
    }
}

impl Default for Shot {
    fn default() -> Self {
        Self::still()
    }
}

impl Renderer {
    /// Draws a frame while cell and joints change: `moment(t)` returns both, t seconds after the
    /// shutter opened.
    ///
    /// [`Renderer::truth`] of such a frame is that of the middle of its exposure.
    pub fn take(
        &mut self,
        shot: &Shot,
        mut moment: impl FnMut(f64) -> (Cell, Joints),
    ) -> &GrayImage {
        let count = shot.moments.clamp(1, Shot::MOST_MOMENTS);
        if count == 1 && shot.interlace.is_none() {
            let (cell, joints) = moment(0.5 * shot.exposure);
            return self.render(&cell, &joints);
        }
        self.expose(0.0, (shot.exposure, count), &mut moment);
        if let Some(later) = shot.interlace {
            // Lens and sensor blur each field on its own; only then are the rows woven.
            let sigma = self.scene.sensor.blur;
            soften(&mut self.exposed, self.canvas.width, sigma, &mut self.spare);
            std::mem::swap(&mut self.first_field, &mut self.exposed);
            self.expose(later, (shot.exposure, count), &mut moment);
            let width = self.canvas.width;
            soften(&mut self.exposed, width, sigma, &mut self.spare);
            let rows = self.exposed.chunks_exact_mut(width.max(1));
            let first = self.first_field.chunks_exact(width.max(1));
            for (row, first) in rows.zip(first).step_by(2) {
                row.copy_from_slice(first);
            }
        }
        std::mem::swap(&mut self.canvas.light, &mut self.exposed);
        self.exposure.blurred = shot.interlace.is_some();
        let (cell, _) = moment(shot.interlace.unwrap_or(0.0));
        self.develop(&cell)
    }

    /// Averages `count` sharp frames over `exposure` seconds from `opened` on, into `exposed`.
    fn expose(
        &mut self,
        opened: f64,
        (exposure, count): (f64, usize),
        moment: &mut impl FnMut(f64) -> (Cell, Joints),
    ) {
        self.exposed.clear();
        for k in 0..count {
            let (cell, joints) = moment(opened + exposure * (k as f64 + 0.5) / count as f64);
            self.illuminate(&cell, &joints);
            let light = &self.canvas.light;
            if self.exposed.len() == light.len() {
                let sums = self.exposed.iter_mut().zip(light);
                sums.for_each(|(sum, light)| *sum += light);
            } else {
                // The first frame, or one of another size.
                self.exposed.clear();
                self.exposed.extend_from_slice(light);
            }
        }
        let share = 1.0 / count as f32;
        self.exposed.iter_mut().for_each(|sum| *sum *= share);
    }
}
