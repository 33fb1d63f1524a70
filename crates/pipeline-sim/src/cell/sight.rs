//! The rule by which a ball counts as seen.

use hough_heuristic::{Circle, Features};
use nalgebra::Point2;

use crate::cell::ellipse::ProjectedEllipse;
use crate::error::{SightError, finite};

/// Conditions under which a ball counts as seen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SightRule {
    /// Smallest radius, feature units.
    pub min_radius: f64,
    /// Greatest radius, feature units.
    pub max_radius: f64,
    /// Least fraction of the outline inside the frame, 0..=1.
    pub min_share: f64,
}

impl Default for SightRule {
    /// Returns the rule of the reaching task: radius 5 to 68 units, at least 60 % of the outline
    /// inside the frame. The centre must always be inside.
    fn default() -> Self {
        Self {
            min_radius: 5.0,
            max_radius: 68.0,
            min_share: 0.6,
        }
    }
}

impl SightRule {
    /// Checks that a ball with this outline counts as seen in a frame of `size` pixels.
    ///
    /// # Errors
    /// [`SightError::LargerThanView`], [`SightError::Radius`], [`SightError::CentreOutside`] or
    /// [`SightError::CutOff`] names the condition that fails; [`SightError::Quantity`] is for a
    /// rule that holds a NaN.
    pub(crate) fn check(
        &self,
        outline: &ProjectedEllipse,
        size: (u32, u32),
    ) -> Result<(), SightError> {
        let Self {
            min_radius,
            max_radius,
            min_share,
        } = *self;
        for (quantity, value) in [
            ("the smallest radius seen (units)", min_radius),
            ("the greatest radius seen (units)", max_radius),
            (
                "the least fraction of the outline inside the frame",
                min_share,
            ),
        ] {
            // Infinite bounds do no harm.
            if value.is_nan() {
                finite(quantity, value)?;
            }
        }
        let circle = outline.circle();
        let Features { r, .. } = Features::from_circle(&circle, size.0);
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        let (w, h) = outline.half_extent();
        // A ball that cannot fit into the frame fails the other conditions for that reason.
        let why = |error| {
            if (2.0 * w > width || 2.0 * h > height) && r >= self.min_radius {
                SightError::LargerThanView {
                    width_px: 2.0 * w,
                    height_px: 2.0 * h,
                    frame_width: size.0,
                    frame_height: size.1,
                }
            } else {
                error
            }
        };
        if !(self.min_radius..=self.max_radius).contains(&r) {
            return Err(why(SightError::Radius {
                r,
                least: self.min_radius,
                greatest: self.max_radius,
            }));
        }
        let inside =
            (-0.5..=width - 0.5).contains(&circle.x) && (-0.5..=height - 0.5).contains(&circle.y);
        if !inside {
            return Err(why(SightError::CentreOutside {
                x: circle.x,
                y: circle.y,
            }));
        }
        let share = outline.share_inside(size.0, size.1);
        if share >= self.min_share {
            return Ok(());
        }
        Err(why(SightError::CutOff {
            share,
            least: self.min_share,
        }))
    }

    /// Returns `true` if a round outline with these features counts as seen in the paper's frame of
    /// 192x144 units.
    pub fn sees_features(&self, features: &Features) -> bool {
        let Circle { x, y, radius } = features.to_circle(768);
        let finite = [x, y, radius].iter().all(|v| v.is_finite());
        let outline = ProjectedEllipse {
            centre: Point2::new(x, y),
            major: radius,
            minor: radius,
            angle: 0.0,
        };
        finite && self.check(&outline, (768, 576)).is_ok()
    }
}
