//! Ellipses along edges that hang together, the candidates of the search for ellipses.

use super::level::{EDGE, Level};
use crate::curve::{Ellipse, solve};

/// Length of a step along an edge, pixels.
const STEP: f32 = 2.0;
/// Cosine of the largest change of direction in a step.
const LEAST_STRAIGHT: f32 = 0.75;
/// The fewest and the most points of a chain.
const LEAST_POINTS: usize = 8;
const MOST_POINTS: usize = 2000;
/// Turn of a chain below which it determines no ellipse, radians.
const LEAST_TURN: f32 = 0.7;
/// Turn against the rest of a chain at which it ends, radians.
const BACK: f32 = 0.45;
/// Weight of the direction of an edge against its place, pixels per radian.
const DIRECTION: f64 = 2.0;
/// Rounds of the fit: largest distance of an edge from the ellipse, pixels; number of places along
/// it that are looked at; and the least share of them with an edge. The first is a glance.
const ROUNDS: [(f64, usize, f64); 5] = [
    (3.0, 16, 0.3),
    (3.0, 64, 0.4),
    (2.0, 64, 0.4),
    (1.5, 64, 0.4),
    (1.2, 64, 0.4),
];
/// Share from which on the edges along an ellipse are taken to be its own.
const CLEAR: f64 = 0.7;
/// Cosine of the largest angle between an edge and an ellipse.
const LEAST_PARALLEL: f64 = 0.9;

/// A place on an ellipse, and the normal there.
pub(super) struct Place {
    pub(super) x: f64,
    pub(super) y: f64,
    nx: f64,
    ny: f64,
}

/// Evenly spaced places in the angle from the centre of the circle that is the ellipse's image.
pub(super) fn places(ellipse: &Ellipse, count: usize) -> impl Iterator<Item = Place> {
    let Ellipse {
        x,
        y,
        major,
        minor,
        angle,
    } = *ellipse;
    let (sin, cos) = angle.sin_cos();
    (0..count).map(move |index| {
        let turn = std::f64::consts::TAU * index as f64 / count as f64;
        let (s, c) = turn.sin_cos();
        let (nx, ny) = (c * minor, s * major);
        let length = (nx * nx + ny * ny).sqrt();
        let (nx, ny) = (nx / length, ny / length);
        Place {
            x: x + major * c * cos - minor * s * sin,
            y: y + major * c * sin + minor * s * cos,
            nx: nx * cos - ny * sin,
            ny: nx * sin + ny * cos,
        }
    })
}

/// Lists the ellipses, in pixels of the level, that run along its edges, each with the number of
/// pixels on which it does.
pub(super) fn ellipses(level: &Level, looks: &mut u64) -> Vec<(Ellipse, f64)> {
    let mut found = Vec::new();
    let mut used = vec![false; level.free.len()];
    for start in 0..level.free.len() {
        if used[start] {
            continue;
        }
        let mut chain = Chain::default();
        chain.follow(level, start, -STEP, &mut used);
        chain.points.reverse();
        chain.low = -std::mem::replace(&mut chain.high, -chain.low);
        chain.turn = 0.0;
        chain.points.push(start);
        used[start] = true;
        chain.follow(level, start, STEP, &mut used);
        *looks += chain.points.len() as u64;
        let count = chain.points.len();
        if count < LEAST_POINTS || chain.high - chain.low < LEAST_TURN {
            continue;
        }
        // Where the whole fits no ellipse, a half of it may.
        for points in [
            &chain.points[..],
            &chain.points[..count / 2],
            &chain.points[count / 2..],
        ] {
            let ellipse = fit(level, points).and_then(|ellipse| settle(level, ellipse, looks));
            if let Some((ellipse, share)) = ellipse {
                if share >= CLEAR {
                    take_along(level, &ellipse, &mut used);
                }
                found.push((ellipse, share * (ellipse.major + ellipse.minor)));
                break;
            }
        }
    }
    found
}

/// Marks the points along an ellipse as used, so that no other chain begins there.
fn take_along(level: &Level, ellipse: &Ellipse, used: &mut [bool]) {
    for place in places(ellipse, (6.3 * ellipse.major) as usize) {
        for step in [-1.5, 0.0, 1.5] {
            let (x, y) = (place.x + step * place.nx, place.y + step * place.ny);
            if let Some((mark, pixel)) = level.mark(x as f32, y as f32)
                && mark & EDGE != 0
            {
                used[level.id_at(pixel)] = true;
            }
        }
    }
}

/// Points of an edge, one after the other.
#[derive(Default)]
struct Chain {
    points: Vec<usize>,
    /// Turn since the first point, and its extremes, radians.
    turn: f32,
    high: f32,
    low: f32,
}

impl Chain {
    /// Follows the edge from a point to one side until it ends, bends sharply or bends back.
    fn follow(&mut self, level: &Level, start: usize, side: f32, used: &mut [bool]) {
        let mut id = start;
        let (mut tx, mut ty) = (-side * level.rows.ny[id], side * level.rows.nx[id]);
        while self.points.len() < MOST_POINTS {
            let (x, y) = (level.rows.x[id], level.rows.y[id]);
            let edge_at = |part: f32| {
                let at = level.mark(x + part * tx, y + part * ty);
                at.and_then(|(mark, pixel)| (mark & EDGE != 0).then(|| level.id_at(pixel)))
            };
            let Some(next) = edge_at(1.0) else { return };
            let (nx, ny) = (-level.rows.ny[next], level.rows.nx[next]);
            let along = tx * nx + ty * ny;
            if next == id || along.abs() < STEP * LEAST_STRAIGHT {
                return;
            }
            let length = STEP.copysign(along);
            let (ux, uy) = (length * nx, length * ny);
            self.turn += (tx * uy - ty * ux).atan2(tx * ux + ty * uy);
            self.high = self.high.max(self.turn);
            self.low = self.low.min(self.turn);
            let back = (self.high - self.turn).min(self.turn - self.low);
            if back > BACK || self.high - self.low > std::f32::consts::TAU {
                return;
            }
            for between in [edge_at(0.5), Some(next)].into_iter().flatten() {
                used[between] = true;
            }
            self.points.push(next);
            (id, tx, ty) = (next, ux, uy);
        }
    }
}

/// The ellipse nearest to these points and their directions: the conic `A x^2 + B x y + C y^2 +
/// D x + E y + F = 0` with `A + C = 1` and the least squares.
fn fit(level: &Level, points: &[usize]) -> Option<Ellipse> {
    let rows = &level.rows;
    let n = points.len() as f64;
    let mean = |values: &[f32]| points.iter().map(|&id| f64::from(values[id])).sum::<f64>() / n;
    let (mx, my) = (mean(&rows.x), mean(&rows.y));
    let square = |values: &[f32], mean: f64| {
        let offs = points.iter().map(|&id| f64::from(values[id]) - mean);
        offs.map(|off| off * off).sum::<f64>() / n
    };
    let spread = (square(&rows.x, mx) + square(&rows.y, my)).sqrt().max(1.0);
    let mut sums = [[0.0f64; 6]; 5];
    let mut add = |row: [f64; 6]| {
        for (k, sum) in sums.iter_mut().enumerate() {
            for (sum, value) in sum.iter_mut().zip(row) {
                *sum += row[k] * value;
            }
        }
    };
    let weight = DIRECTION / spread;
    for &id in points {
        let [x, y] = [(rows.x[id], mx), (rows.y[id], my)]
            .map(|(value, mean)| (f64::from(value) - mean) / spread);
        add([x * x - y * y, x * y, x, y, 1.0, -y * y]);
        // The gradient of the conic has no part along the edge.
        let (tx, ty) = (-f64::from(rows.ny[id]), f64::from(rows.nx[id]));
        let slope = [
            2.0 * (x * tx - y * ty),
            y * tx + x * ty,
            tx,
            ty,
            0.0,
            -2.0 * y * ty,
        ];
        add(slope.map(|value| weight * value));
    }
    let [a, b, d, e, f] = solve(sums.map(|row| row.map(|sum| sum / n)))?;
    Ellipse::of_conic(
        [a, b, 1.0 - a, d, e].map(|value| value / f),
        (mx, my),
        spread,
    )
}

/// Fits an ellipse to the edges along it, and returns it with the share of it that lies on edges;
/// none if that is too little.
fn settle(level: &Level, mut ellipse: Ellipse, looks: &mut u64) -> Option<(Ellipse, f64)> {
    let mut share = 0.0;
    for (round, (reach, count, least)) in ROUNDS.into_iter().enumerate() {
        let (width, height) = (level.width as f64, level.height as f64);
        if ellipse.major > width + height || ellipse.minor < 3.0 {
            return None;
        }
        let (mut points, mut visible) = (Vec::new(), 0);
        for place in places(&ellipse, count) {
            let inside = |at: f64, end: f64| at >= 0.5 && at <= end - 1.5;
            if !inside(place.x, width) || !inside(place.y, height) {
                continue;
            }
            visible += 1;
            for step in [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0] {
                *looks += 1;
                let (x, y) = (place.x + step * place.nx, place.y + step * place.ny);
                let Some((mark, pixel)) = level.mark(x as f32, y as f32) else {
                    continue;
                };
                let id = level.id_at(pixel);
                if mark & EDGE == 0 {
                    continue;
                }
                let of = |values: &[f32]| f64::from(values[id]);
                let off = (of(&level.rows.x) - place.x) * place.nx
                    + (of(&level.rows.y) - place.y) * place.ny;
                let parallel = of(&level.rows.nx) * place.nx + of(&level.rows.ny) * place.ny;
                if off.abs() <= reach && parallel.abs() >= LEAST_PARALLEL {
                    points.push(id);
                    break;
                }
            }
        }
        share = points.len() as f64 / visible.max(1) as f64;
        if share < least || 3 * visible < count {
            return None;
        }
        if round > 0 {
            ellipse = fit(level, &points)?;
        }
    }
    Some((ellipse, share))
}
