//! Small closed outlines, which tell whether the next larger size is worth a search.

use std::time::Instant;

use super::level::Level;
use super::partners::{LEAST_ALONG, PARTNERS};
use super::polar::Ring;
use super::search::Outline;
use crate::clock;
use crate::edges::{Vectorized, widest};

/// Radii of outlines that are small at a size, pixels.
const SMALL_RADII: (f32, f32) = (1.8, 4.2);
/// Share of a small outline that must lie on edges.
const SMALL_SHARE: f32 = 0.8;
/// Number of pairs of points on small outlines that are worth a search of the next larger size, and
/// one in so many of the edge points: texture has some by chance.
const SEEN: usize = 4;
const SEEN_SHARE: usize = 40;

/// Returns `true` if a size shows so many small closed outlines that the next larger is worth a
/// search; `false` if the deadline passes before.
pub(super) fn shows_small(
    outline: &Outline,
    level: &Level,
    mirror_slack: f32,
    deadline: Option<Instant>,
) -> bool {
    widest(Small {
        outline,
        level,
        mirror_slack,
        deadline,
    })
}

/// The count of small closed outlines.
struct Small<'a> {
    outline: &'a Outline,
    level: &'a Level,
    mirror_slack: f32,
    deadline: Option<Instant>,
}

impl Vectorized for Small<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let (level, lines) = (self.level, &self.level.rows);
        let mut rings = [Ring::default(); PARTNERS];
        let enough = SEEN.max(level.free.len() / SEEN_SHARE);
        let (mut seen, mut looks) = (0, 0);
        for line in 0..level.height {
            if clock::is_past(self.deadline) {
                return false;
            }
            let points = level.line(false, line);
            let end = points.end;
            for at in points.filter(|&at| lines.nx[at].abs() >= LEAST_ALONG) {
                let (radii, slack) = (SMALL_RADII, self.mirror_slack);
                let count =
                    lines.partners((at, end), radii, slack, &level.free, &mut rings, &mut looks);
                for ring in &rings[..count] {
                    let support = self.outline.support(level, ring, SMALL_SHARE, &mut looks);
                    seen += usize::from(support.is_some());
                }
                if seen >= enough {
                    return true;
                }
            }
        }
        false
    }
}
