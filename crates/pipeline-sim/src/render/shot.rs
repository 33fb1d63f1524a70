//! Frames that take time: motion during the exposure, and the two fields of an interlaced frame.

use hough_heuristic::image::GrayImage;
use puma_val2::Joints;

use crate::cell::geometry::Cell;
use crate::render::lens::soften;
use crate::render::moving::Exposed;
use crate::render::renderer::Renderer;

/// How a frame is taken while things move.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shot {
    /// Time the shutter is open, seconds, up to [`Shot::LONGEST`]. 0 freezes all motion.
    pub exposure: f64,
    /// 1 freezes all motion. With more, the frame is drawn once, in the middle of its exposure, and
    /// each part of it is averaged along the way it takes, as long as arm, ball and holder move
    /// evenly and not far (48 pixels either way). Otherwise, and for two frozen fields, this many
    /// moments, spread evenly over the exposure of each field, are drawn and averaged at the cost
    /// of a frame each: one for every two pixels of motion is enough. 1 to [`Shot::MOST_MOMENTS`];
    /// [`Renderer::take`] takes what is beyond for the nearer of both.
    pub moments: usize,
    /// `Some(seconds)`: interlaced, the odd rows taken that much after the even ones, at most
    /// [`Shot::LONGEST`].
    pub interlace: Option<f64>,
}

impl Shot {
    /// The most moments of a field.
    pub const MOST_MOMENTS: usize = 64;

    /// The longest exposure, and the longest time between two fields, seconds.
    pub const LONGEST: f64 = 60.0;

    /// All at once.
    pub fn still() -> Self {
        Self {
            exposure: 0.0,
            moments: 1,
            interlace: None,
        }
    }

    /// The two fields of PAL, 20 ms apart (the paper's grabber delivers 768x576 pixels at 50 Hz,
    /// which are fields), each exposed for `exposure` seconds.
    pub fn pal(exposure: f64, moments: usize) -> Self {
        Self {
            exposure,
            moments,
            interlace: Some(0.020),
        }
    }
}

impl Default for Shot {
    fn default() -> Self {
        Self::still()
    }
}

impl Renderer {
    /// Takes a frame while cell and joints change: `moment(t)` tells what they are t seconds after
    /// the shutter opened.
    ///
    /// The truth of such a frame is that of the middle of its exposure.
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
        let opened: &[f64] = match shot.interlace {
            Some(later) => &[0.0, later],
            None => &[0.0],
        };
        let last = opened[opened.len() - 1];
        // Frozen fields would only lose by being drawn from the middle between them.
        let drawn = count > 1 && {
            let exposed = Exposed {
                middle: moment(0.5 * (last + shot.exposure)),
                fields: opened
                    .iter()
                    .map(|t| [0.0, 0.5, 1.0].map(|part| moment(t + part * shot.exposure)))
                    .collect(),
            };
            self.illuminate_moving(&exposed)
        };
        if !drawn {
            self.illuminate_moments(opened, (shot.exposure, count), &mut moment);
        }
        let (cell, _) = moment(last);
        self.exposure.blurred = shot.interlace.is_some();
        self.develop(&cell)
    }

    /// As [`Renderer::take`], every moment drawn on its own.
    #[cfg(test)]
    pub(super) fn take_exactly(
        &mut self,
        shot: &Shot,
        mut moment: impl FnMut(f64) -> (Cell, Joints),
    ) -> &GrayImage {
        let opened: &[f64] = match shot.interlace {
            Some(later) => &[0.0, later],
            None => &[0.0],
        };
        self.illuminate_moments(opened, (shot.exposure, shot.moments), &mut moment);
        let (cell, _) = moment(opened[opened.len() - 1]);
        self.exposure.blurred = shot.interlace.is_some();
        self.develop(&cell)
    }

    /// Draws every moment of every field on its own.
    fn illuminate_moments(
        &mut self,
        opened: &[f64],
        (exposure, count): (f64, usize),
        moment: &mut impl FnMut(f64) -> (Cell, Joints),
    ) {
        let mut total = std::mem::take(&mut self.exposed);
        let mut woven = std::mem::take(&mut self.woven);
        let interlaced = opened.len() > 1;
        for (field, opened) in opened.iter().enumerate() {
            for k in 0..count {
                let t = opened + exposure * (k as f64 + 0.5) / count as f64;
                let (cell, joints) = moment(t);
                self.illuminate(&cell, &joints);
                if k == 0 {
                    total.clear();
                    total.extend_from_slice(&self.canvas.light);
                } else if total.len() == self.canvas.light.len() {
                    total
                        .iter_mut()
                        .zip(&self.canvas.light)
                        .for_each(|(sum, light)| *sum += light);
                }
            }
            let share = 1.0 / count as f32;
            total.iter_mut().for_each(|sum| *sum *= share);
            if interlaced && total.len() == self.canvas.light.len() {
                // Lens and sensor blur what they see of each field; only then are the rows woven.
                std::mem::swap(&mut self.canvas.light, &mut total);
                let whole = self.canvas.whole();
                soften(
                    &mut self.canvas,
                    whole,
                    self.scene.sensor.blur,
                    &mut self.spare,
                );
                std::mem::swap(&mut self.canvas.light, &mut total);
            }
            if field == 0 {
                std::mem::swap(&mut woven, &mut total);
            } else {
                let width = self.canvas.width.max(1);
                let rows = woven.chunks_exact_mut(width).zip(total.chunks_exact(width));
                rows.skip(1)
                    .step_by(2)
                    .for_each(|(row, later)| row.copy_from_slice(later));
            }
        }
        if woven.len() == self.canvas.light.len() {
            self.canvas.light.copy_from_slice(&woven);
        }
        (self.exposed, self.woven) = (total, woven);
    }
}
