//! A robust start of the proof: the circle that most of the edges around a candidate agree on.
//!
//! A least-squares fit is drawn to steep edges of other things and ends between two outlines. Three
//! edges determine a circle, as in RANSAC (Fischler and Bolles, 1981); the circle on which most
//! edges lie is the start. The triples are equally spaced rays, the same in every frame.

use super::directions::Rays;
use super::polar::{LANES, Ring};
use super::strongest::{Edges, RAYS};

/// Rays between the edges of a triple.
const SPANS: [usize; 3] = [5, 10, 18];
/// Rays between the first edges of two triples.
const EVERY: usize = 3;
/// Largest distance from the circle of an edge that agrees with it, pixels.
const TOLERANCE: f32 = 0.6;
/// Largest displacement from the candidate, pixels.
const FARTHEST: f32 = 8.0;

/// Number of edges that lie on the circle displaced by `shift`.
#[inline(always)]
pub(super) fn count(rays: Rays<'_>, edges: &Edges, shift: &Ring) -> f32 {
    let mut count = [0.0f32; LANES];
    for block in 0..RAYS / LANES {
        let ux = &rays.x.as_chunks::<LANES>().0[block];
        let uy = &rays.y.as_chunks::<LANES>().0[block];
        let distance = &edges.distance.as_chunks::<LANES>().0[block];
        let slope = &edges.slope.as_chunks::<LANES>().0[block];
        for lane in 0..LANES {
            let off = distance[lane] - shift.r - shift.x * ux[lane] - shift.y * uy[lane];
            count[lane] += f32::from(u8::from(slope[lane] > 0.0 && off.abs() <= TOLERANCE));
        }
    }
    count.iter().sum()
}

/// The displacement of the circle that most of the edges lie on, and their number.
#[inline(always)]
pub(super) fn of(rays: Rays<'_>, edges: &Edges) -> (Ring, f32) {
    let mut best = (Ring::default(), 0.0);
    for span in SPANS {
        for first in (0..RAYS).step_by(EVERY) {
            let Some(shift) = through(
                rays,
                edges,
                [0, span, 2 * span].map(|ray| (first + ray) % RAYS),
            ) else {
                continue;
            };
            let count = count(rays, edges, &shift);
            if count > best.1 {
                best = (shift, count);
            }
        }
    }
    best
}

/// The displacement of the circle through the edges of three rays; `None` if one has no edge or
/// the circle lies far from the candidate.
#[inline(always)]
fn through(rays: Rays<'_>, edges: &Edges, at: [usize; 3]) -> Option<Ring> {
    if at.iter().any(|&ray| edges.slope[ray] <= 0.0) {
        return None;
    }
    let [d, d1, d2] = at.map(|ray| edges.distance[ray]);
    let [ux, x1, x2] = at.map(|ray| rays.x[ray]);
    let [uy, y1, y2] = at.map(|ray| rays.y[ray]);
    let (ax, ay, ad) = (x1 - ux, y1 - uy, d1 - d);
    let (bx, by, bd) = (x2 - ux, y2 - uy, d2 - d);
    let determinant = ax * by - ay * bx;
    let x = (ad * by - ay * bd) / determinant;
    let y = (ax * bd - ad * bx) / determinant;
    let shift = Ring {
        x,
        y,
        r: d - x * ux - y * uy,
    };
    (x.abs() + y.abs() + shift.r.abs() < FARTHEST).then_some(shift)
}

#[cfg(test)]
mod tests {
    use super::super::directions::UnitCircle;
    use super::*;

    #[test]
    fn half_of_an_outline_beside_another_edge_is_found() {
        let circle = UnitCircle::new();
        let rays = circle.rays(RAYS);
        for turn in 0..RAYS {
            let shift = Ring {
                x: 1.5 * rays.x[turn],
                y: 1.5 * rays.y[turn],
                r: -1.0,
            };
            // The other half of the rays meets a straight edge farther off.
            let distance = std::array::from_fn(|ray| {
                let (ux, uy) = (rays.x[ray], rays.y[ray]);
                let after = (ray + RAYS - turn) % RAYS;
                if after < RAYS / 2 {
                    shift.r + shift.x * ux + shift.y * uy
                } else {
                    4.0 + 0.2 * (after - RAYS / 2) as f32 % 3.0
                }
            });
            let (found, count) = of(rays, &Edges::at_distances(distance));
            assert!(
                count >= 32.0 && found.apart(&shift) < 0.3,
                "{turn}: {found:?}"
            );
        }
    }
}
