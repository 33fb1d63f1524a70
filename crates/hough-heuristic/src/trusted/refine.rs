//! A candidate at the full size of the frame: its outline fitted to the steepest places of the rays, and the evidence for it.

use image::GrayImage;

use super::candidate::Candidate;
use super::directions::UnitCircle;
use super::polar::{Outline, Polar};
use super::search::Normal;

/// What a candidate proved to be.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Proof {
    pub(super) outline: Outline,
    /// Minus the decimal logarithm of the number of false alarms.
    pub(super) certainty: f32,
    /// Share of the visible outline on an edge along it.
    pub(super) share: f32,
    pub(super) background: f32,
    pub(super) visible: f32,
    pub(super) centre_error: f32,
    pub(super) radius_error: f32,
}

/// What the refinement needs to know of the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    /// Deviation of the noise, grey levels.
    pub(super) noise: f32,
    /// Decimal logarithm of the number of circles that might have been tested.
    pub(super) tests: f32,
}

/// Directions of neighbouring rays lie about this far apart on the outline, pixels.
const SPACING: f32 = 1.5;

fn rays(r: f32) -> usize {
    ((std::f32::consts::TAU * r / SPACING) as usize).clamp(32, 160)
}

/// How many directions are averaged, by the noise.
fn average(noise: f32) -> usize {
    match noise {
        n if n < 4.0 => 1,
        n if n < 12.0 => 3,
        n if n < 25.0 => 5,
        _ => 7,
    }
}

pub(super) fn refine(
    frame: &GrayImage,
    circle: &UnitCircle,
    polar: &mut Polar,
    candidate: &Candidate,
    setting: &Setting,
) -> Option<Proof> {
    let mut outline = Outline {
        x: candidate.x,
        y: candidate.y,
        r: candidate.r,
    };
    let average = average(setting.noise);
    let wide = (1.2 * candidate.scale + 0.02 * outline.r).clamp(2.0, 12.0);
    for reach in [wide, (0.5 * wide).max(2.0), 2.0 + 0.01 * outline.r] {
        let rays = rays(outline.r);
        polar.sample(frame, circle, &outline, (rays, reach.ceil() as usize, average));
        outline = fit(polar, circle, &outline, reach)?;
        let moved = (outline.x - candidate.x).abs() + (outline.y - candidate.y).abs();
        if moved + (outline.r - candidate.r).abs() > 3.0 * candidate.scale + 0.2 * candidate.r || outline.r < 2.0 {
            return None;
        }
    }
    Some(prove(frame, circle, polar, outline, average, setting))
}

/// Moves the outline to where the rays are steepest.
fn fit(polar: &Polar, circle: &UnitCircle, outline: &Outline, reach: f32) -> Option<Outline> {
    let m = polar.distances;
    let mut normal = Normal::default();
    for index in 0..polar.directions {
        if !polar.visible[index] {
            continue;
        }
        let row = &polar.outward[index * m..][..m];
        let (mut best, mut at) = (0.0, 0);
        for (column, &slope) in row.iter().enumerate() {
            let taper = 1.0 - 0.5 * polar.distance(column as f32).abs() / (reach + 1.0);
            let strength = slope.abs() * taper;
            if strength > best {
                (best, at) = (strength, column);
            }
        }
        let here = row[at].abs();
        let mut column = at as f32;
        if at > 0 && at + 1 < m {
            let (before, behind) = (row[at - 1].abs(), row[at + 1].abs());
            let bend = 2.0 * here - before - behind;
            if bend > 0.0 {
                column += (0.5 * (behind - before) / bend).clamp(-0.5, 0.5);
            }
        }
        let (ux, uy) = circle.point(index, polar.directions);
        let residual = polar.distance(column);
        let off = residual / (reach + 1.0);
        let weight = here.min(40.0) * (1.0 - off * off).max(0.0);
        normal.add(ux, uy, residual, weight);
    }
    let (dx, dy, dr) = normal.solve()?;
    Some(Outline {
        x: outline.x + dx,
        y: outline.y + dy,
        r: outline.r + dr,
    })
}

/// Weighs the evidence on the outline against that beside it.
fn prove(
    frame: &GrayImage,
    circle: &UnitCircle,
    polar: &mut Polar,
    outline: Outline,
    average: usize,
    setting: &Setting,
) -> Proof {
    let rays = rays(outline.r);
    let slacks = [0.6 + 0.005 * outline.r, 0.6 + 0.015 * outline.r, 1.0 + 0.03 * outline.r];
    let reach = (slacks[2] * 2.0 + 5.0).min(outline.r - 1.0).max(4.0).ceil() as usize;
    polar.sample(frame, circle, &outline, (rays, reach, average));
    let m = polar.distances;
    let least = (2.5 * setting.noise / (average as f32).sqrt()).max(2.0);
    let is_edge = |row: &[f32], along: &[f32], column: usize| {
        let here = row[column].abs();
        here >= least
            && here > row[column - 1].abs()
            && here >= row[column + 1].abs()
            && along[column].abs() <= 0.6 * here
    };
    let mut best = Proof {
        outline,
        certainty: f32::NEG_INFINITY,
        ..Proof::default()
    };
    for slack in slacks {
        let (mut visible, mut hits, mut beside, mut chances) = (0u32, 0u32, 0u32, 0.0f32);
        for index in 0..polar.directions {
            if !polar.visible[index] {
                continue;
            }
            visible += 1;
            let (row, along) = (&polar.outward[index * m..][..m], &polar.along[index * m..][..m]);
            let mut hit = false;
            for column in 1..m - 1 {
                let distance = polar.distance(column as f32).abs();
                if distance <= slack {
                    hit |= is_edge(row, along, column);
                } else if distance > slack + 1.5 {
                    beside += u32::from(is_edge(row, along, column));
                    chances += 1.0;
                }
            }
            hits += u32::from(hit);
        }
        if visible == 0 {
            continue;
        }
        let width = (2.0 * slack).floor() + 1.0;
        let background = (beside as f32 * width / chances.max(1.0)).clamp(0.0, 0.9);
        let floor = 0.06 * width;
        let p = background.max(floor).min(0.9);
        let share = hits as f32 / visible as f32;
        let arc = outline.r * std::f32::consts::TAU / polar.directions as f32;
        let apart = (2.5f32).max(average as f32 * SPACING);
        let independent = (visible as f32 * (arc / apart).min(1.0)).min(64.0);
        let certainty = independent * divergence(share, p) - setting.tests;
        if certainty > best.certainty {
            best.certainty = certainty;
            best.share = share;
            best.background = background;
            best.visible = visible as f32 / polar.directions as f32;
        }
    }
    best
}

/// The divergence of the share found from the share expected, in decimal digits per sample; 0 unless more is found.
fn divergence(share: f32, p: f32) -> f32 {
    if share <= p {
        return 0.0;
    }
    let term = |q: f32, p: f32| if q > 0.0 { q * (q / p).log10() } else { 0.0 };
    term(share, p) + term(1.0 - share, 1.0 - p)
}
