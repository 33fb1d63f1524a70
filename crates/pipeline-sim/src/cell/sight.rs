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
        let (least, greatest, least_share) = (self.min_radius, self.max_radius, self.min_share);
        for (quantity, value) in [
            ("the smallest radius seen (units)", least),
            ("the greatest radius seen (units)", greatest),
            ("the least fraction of the outline", least_share),
        ] {
            // Infinite bounds do no harm.
            if value.is_nan() {
                finite(quantity, value)?;
            }
        }
        let Circle { x, y, .. } = outline.circle();
        let Features { r, .. } = Features::from_circle(&outline.circle(), size.0);
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        let inside = (-0.5..=width - 0.5).contains(&x) && (-0.5..=height - 0.5).contains(&y);
        let share = outline.share_inside(size.0, size.1);
        let fails = if !(least..=greatest).contains(&r) {
            SightError::Radius { r, least, greatest }
        } else if !inside {
            SightError::CentreOutside { x, y }
        } else if share < least_share {
            let least = least_share;
            SightError::CutOff { share, least }
        } else {
            return Ok(());
        };
        // A ball that cannot fit into the frame fails the other conditions for that reason.
        let (w, h) = outline.half_extent();
        let (outline, frame) = ((2.0 * w, 2.0 * h), size);
        if (outline.0 > width || outline.1 > height) && r >= least {
            return Err(SightError::LargerThanView { outline, frame });
        }
        Err(fails)
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
