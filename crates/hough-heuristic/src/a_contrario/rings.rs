//! The choice among the circles found: about one centre, too near to others, or too many.

use super::AContrario;
use crate::circle::Circle;

/// Choice of the circles that are reported among those about one centre.
///
/// Two circles are about one centre if one lies in the other and their centres are apart by at most
/// a tenth of the larger radius and 1 px.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "program", derive(clap::ValueEnum))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Rings {
    /// All of them: both edges of a washer, every ring of a target.
    #[default]
    All,
    /// Only the largest circle.
    Outer,
    /// Only the smallest circle.
    Inner,
}

impl AContrario {
    /// Returns `true` if the settings ask for a choice among the circles found.
    fn chooses(&self) -> bool {
        let config = &self.config;
        config.rings != Rings::All || config.min_distance > 0.0 || config.min_axis_ratio < 1.0
    }

    /// Returns the number of circles with which the report ends; a choice needs all.
    pub(super) fn most_reported(&self) -> usize {
        if self.chooses() {
            usize::MAX
        } else {
            self.config.max_circles
        }
    }

    /// Keeps the measurements that the settings ask for, best first.
    pub(super) fn choose(&mut self) {
        if !self.chooses() {
            return;
        }
        let rings = self.config.rings;
        if rings != Rings::All {
            self.list();
            let all = &self.found;
            self.measurements.retain(|measurement| {
                let circle = &measurement.circle;
                !all.iter().any(|other| match rings {
                    Rings::Inner => is_about(&other.circle, circle),
                    _ => is_about(circle, &other.circle),
                })
            });
        }
        let least = self.config.min_distance;
        let mut kept = 0;
        for index in 0..self.measurements.len() {
            let this = self.measurements[index];
            let is_apart = |other: &Circle| {
                let (dx, dy) = (this.circle.x - other.x, this.circle.y - other.y);
                dx * dx + dy * dy >= least * least
            };
            if self.measurements[..kept]
                .iter()
                .all(|other| is_apart(&other.circle))
            {
                self.measurements[kept] = this;
                kept += 1;
            }
        }
        if kept > self.config.max_circles {
            kept = self.config.max_circles;
            self.budget.left_out = true;
        }
        self.measurements.truncate(kept);
    }
}

/// Returns `true` if `outer` is a larger circle about the centre of `inner`.
fn is_about(inner: &Circle, outer: &Circle) -> bool {
    let (dx, dy) = (inner.x - outer.x, inner.y - outer.y);
    let off = (dx * dx + dy * dy).sqrt();
    off + inner.radius < outer.radius && off <= 0.1 * outer.radius + 1.0
}
