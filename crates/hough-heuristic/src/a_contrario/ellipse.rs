//! Hypotheses that compete with a circle: an ellipse, and a polygon of four or five sides.

use super::directions::Rays;
use super::polar::{Polar, Ring};
use super::strongest::{Edges, RAYS};

/// The least second harmonic of an ellipse, in radii: in general, and where the circle is covered.
const OVAL: [f32; 2] = [0.05, 0.09];
/// Rays that it must explain in addition, as a share of those in the frame.
const GAIN: f32 = 0.1;
/// Least slope of an edge that counts, as a fraction of the slope of the outline.
const LEAST_SLOPE: f32 = 0.5;
/// The least fourth or fifth harmonic of a polygon, in radii.
const CORNERS: f32 = 0.043;
/// Least ratio of that harmonic to the second and third.
const LEADS: f32 = 1.5;
/// Largest distance of corners from the circle, in radii.
const CORNER_REACH: f32 = 0.25;
/// Share of the rays in the frame on which the outline of a polygon must be seen.
const CLOSED: f32 = 0.75;
/// Least ratio of the variance that the harmonics explain to the rest, each per degree of freedom.
const LEAST_RATIO: f32 = 4.0;
/// Covered share from which only a clear ellipse competes with a circle.
const MOST_COVERED: f32 = 0.85;

/// Returns `true` if another outline explains clearly more of the edges around the circle.
#[inline(always)]
pub(super) fn fits_better(
    rays: Rays<'_>,
    edges: &Edges,
    polar: &Polar,
    (sign, slope): (f32, f32),
    ring: &Ring,
    tolerance: f32,
    covered: f32,
) -> bool {
    // A ball that darkens towards one side has weak edges inside of its outline there.
    let least = LEAST_SLOPE * slope;
    let own = |ray: usize| {
        polar.visible[ray] > 0.0 && edges.slope[ray] > least && edges.sign[ray] * sign > 0.0
    };
    let own: [bool; RAYS] = std::array::from_fn(own);
    is_polygon(rays, edges, polar, &own, ring)
        || is_oval(
            rays,
            edges,
            polar,
            &own,
            ring,
            tolerance,
            OVAL[usize::from(covered >= MOST_COVERED)],
        )
}

#[inline(always)]
fn is_oval(
    rays: Rays<'_>,
    edges: &Edges,
    polar: &Polar,
    own: &[bool; RAYS],
    ring: &Ring,
    tolerance: f32,
    least: f32,
) -> bool {
    let Some(ellipse) = fit::<5>(rays, edges, own, ring.r) else {
        return false;
    };
    let flattening = (ellipse[3] * ellipse[3] + ellipse[4] * ellipse[4]).sqrt();
    if flattening < least * ring.r {
        return false;
    }
    let Some(circle) = fit::<3>(rays, edges, own, ring.r) else {
        return false;
    };
    let visible: f32 = polar.visible.iter().sum();
    let by_circle = explained(rays, edges, own, &[0.0; 3], tolerance)
        .max(explained(rays, edges, own, &circle, tolerance));
    let by_ellipse = explained(rays, edges, own, &ellipse, tolerance);
    by_ellipse - by_circle > GAIN * visible
}

/// Terms of the distance outside of the circle on a ray of an outline with these harmonics.
#[inline(always)]
fn terms<const N: usize>(rays: Rays<'_>, ray: usize) -> [f32; N] {
    let (x, y) = (rays.x[ray], rays.y[ray]);
    let all = [1.0, x, y, x * x - y * y, 2.0 * x * y];
    std::array::from_fn(|index| all[index])
}

/// The harmonics of the outline that most of the edges lie on.
#[inline(always)]
fn fit<const N: usize>(
    rays: Rays<'_>,
    edges: &Edges,
    own: &[bool; RAYS],
    r: f32,
) -> Option<[f32; N]> {
    let mut model = [0.0; N];
    // From wide to narrow, so that the start matters little.
    for width in [0.2 * r, 0.1 * r, 1.0, 1.0] {
        let width = width.max(1.0);
        let (mut normal, mut right) = ([[0.0f32; N]; N], [0.0f32; N]);
        for ray in (0..RAYS).filter(|&ray| own[ray]) {
            let terms = terms::<N>(rays, ray);
            let off = (edges.distance[ray] - dot(&terms, &model)) / width;
            let weight = 1.0 / (1.0 + off * off);
            for (k, term) in terms.iter().enumerate() {
                for (sum, other) in normal[k].iter_mut().zip(terms) {
                    *sum += weight * term * other;
                }
                right[k] += weight * term * edges.distance[ray];
            }
        }
        model = solve(normal, right)?;
    }
    Some(model)
}

/// Number of rays whose edge lies on the outline with these harmonics.
#[inline(always)]
fn explained<const N: usize>(
    rays: Rays<'_>,
    edges: &Edges,
    own: &[bool; RAYS],
    model: &[f32; N],
    tolerance: f32,
) -> f32 {
    let is_on = |ray: usize| {
        let off = edges.distance[ray] - dot(&terms(rays, ray), model);
        own[ray] && off.abs() <= tolerance
    };
    (0..RAYS).filter(|&ray| is_on(ray)).count() as f32
}

#[inline(always)]
fn is_polygon(
    rays: Rays<'_>,
    edges: &Edges,
    polar: &Polar,
    own: &[bool; RAYS],
    ring: &Ring,
) -> bool {
    let seen = |ray: usize| own[ray] && edges.distance[ray].abs() <= CORNER_REACH * ring.r;
    let count = (0..RAYS).filter(|&ray| seen(ray)).count();
    let visible = polar.visible.iter().sum::<f32>();
    if (count as f32) <= CLOSED * visible || visible < 0.9 * RAYS as f32 {
        return false;
    }
    // Gaps are bridged by straight lines.
    let Some(first) = (0..RAYS).find(|&ray| seen(ray)) else {
        return false;
    };
    let mut off = [0.0f32; RAYS];
    let mut from = first;
    for at in first..=first + RAYS {
        if !seen(at % RAYS) {
            continue;
        }
        let (start, end) = (edges.distance[from % RAYS], edges.distance[at % RAYS]);
        for between in from + 1..=at {
            let part = (between - from) as f32 / (at - from) as f32;
            off[between % RAYS] = start + (end - start) * part;
        }
        from = at;
    }
    let mut power = [0.0f32; 6];
    let mut sums = [[0.0f32; 2]; 6];
    let mut squares = 0.0;
    for (ray, &off) in off.iter().enumerate() {
        let (x, y) = (rays.x[ray], rays.y[ray]);
        let (mut cos, mut sin) = (1.0, 0.0);
        for sum in &mut sums {
            sum[0] += off * cos;
            sum[1] += off * sin;
            (cos, sin) = (cos * x - sin * y, cos * y + sin * x);
        }
        squares += off * off;
    }
    let n = RAYS as f32;
    for (power, sum) in power.iter_mut().zip(sums) {
        *power = (sum[0] * sum[0] + sum[1] * sum[1]) * 4.0 / (n * n);
    }
    let corners = power[4].max(power[5]);
    let others = power[2].max(power[3]);
    let explained = 0.5 * n * (power[2] + power[3] + power[4] + power[5]);
    let rest = (squares - 0.25 * n * power[0] - 0.5 * n * power[1] - explained).max(1e-3);
    corners > (CORNERS * ring.r) * (CORNERS * ring.r)
        && corners >= LEADS * LEADS * others
        && explained / 8.0 > LEAST_RATIO * rest / (count as f32 - 11.0).max(1.0)
}

#[inline(always)]
fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The solution of normal equations; None if they determine none.
#[inline(always)]
fn solve<const N: usize>(mut lines: [[f32; N]; N], mut right: [f32; N]) -> Option<[f32; N]> {
    let least = 1e-3 * lines[0][0];
    for k in 0..N {
        let pivot = lines[k];
        if pivot[k].is_nan() || pivot[k] <= least {
            return None;
        }
        for below in k + 1..N {
            let factor = lines[below][k] / pivot[k];
            for (value, above) in lines[below].iter_mut().zip(pivot) {
                *value -= factor * above;
            }
            right[below] -= factor * right[k];
        }
    }
    for k in (0..N).rev() {
        let known: f32 = (k + 1..N).map(|j| lines[k][j] * right[j]).sum();
        right[k] = (right[k] - known) / lines[k][k];
    }
    Some(right)
}
