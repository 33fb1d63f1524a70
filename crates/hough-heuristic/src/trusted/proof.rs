//! The evidence for a candidate, weighed where its radius is one or two dozen pixels: the same at every size.

use super::directions::UnitCircle;
use super::fit::Moments;
use super::polar::{Grey, Oval, Polar};

/// Directions that are looked in.
const RAYS: usize = 64;
/// How far on either side of the outline the strongest edge is sought, pixels.
const REACH: usize = 6;

/// What a candidate proved to be.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Proof {
    /// In pixels of the frame.
    pub(super) oval: Oval,
    /// Minus the decimal logarithm of the number of false alarms.
    pub(super) certainty: f32,
    /// Features, for development.
    pub(super) features: [f32; 8],
}

/// What the proof needs to know of the level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    /// Deviation of the noise at this level, grey levels.
    pub(super) noise: f32,
    /// Decimal logarithm of the number of circles that might have been tested.
    pub(super) tests: f32,
}

/// The strongest edge along each ray.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    /// How far outside the outline, pixels.
    distance: f32,
    /// Signed slope; 0 where there is no edge.
    slope: f32,
}

pub(super) fn prove(
    grey: Grey<'_>,
    circle: &UnitCircle,
    polar: &mut Polar,
    start: Oval,
    setting: &Setting,
) -> Option<Proof> {
    let mut edges = [Edge::default(); RAYS];
    // Slopes are averaged along the outline over some three pixels where there is noise.
    let arc = start.r * std::f32::consts::TAU / RAYS as f32;
    let half = if setting.noise > 3.0 {
        ((super::tune(13, 1.5) / arc) as usize).clamp(1, 5)
    } else {
        0
    };
    let least = (3.0 * setting.noise / (2.0 * half as f32 + 1.0).sqrt()).max(1.5);
    let sample = |polar: &mut Polar, oval: &Oval, edges: &mut [Edge; RAYS]| {
        let reach = REACH.min((oval.r - 1.5) as usize).max(2);
        polar.sample(grey, circle, oval, (RAYS, reach, half));
        strongest(polar, least, edges);
    };
    let mut oval = start;
    for round in 0..super::tune(15, 4.0) as usize {
        sample(polar, &oval, &mut edges);
        let foci: &[f32] = if round == 0 { &[4.0, 3.0, 2.0] } else { &[3.0, 2.0, 1.5] };
        let (better, near) = improve(circle, &edges, oval, foci)?;
        if near < super::tune(20, 20.0) as usize {
            return None;
        }
        let moved = (better.x - oval.x).hypot(better.y - oval.y) + (better.r - oval.r).abs();
        oval = better;
        if moved < super::tune(16, 0.7) {
            break;
        }
    }
    sample(polar, &oval, &mut edges);
    Some(weigh(polar, &edges, oval, setting))
}

/// Moves the outline to the edges, in steps that look at those within the foci, pixels.
fn improve(circle: &UnitCircle, edges: &[Edge; RAYS], start: Oval, foci: &[f32]) -> Option<(Oval, usize)> {
    let mut oval = start;
    let mut last = 0;
    for &focus in foci {
        let mut moments = Moments::default();
        let mut near = 0;
        for (index, edge) in edges.iter().enumerate() {
            let unit = circle.point(index, RAYS);
            let moved = (oval.x - start.x) * unit.0 + (oval.y - start.y) * unit.1;
            let residual = edge.distance + start.radius(unit) - oval.radius(unit) - moved;
            let off = residual / focus;
            if edge.slope != 0.0 && off.abs() < 1.0 {
                moments.add(unit, residual, edge.slope.abs().min(30.0) * (1.0 - off * off));
                near += 1;
            }
        }
        if near < 12 {
            return None;
        }
        last = near;
        let step = moments
            .step(focus <= 2.0 && near >= super::tune(10, 100.0) as usize)
            .or_else(|| moments.step(false))?;
        oval.x += step.x;
        oval.y += step.y;
        oval.r += step.r;
        let moved = (oval.x - start.x).hypot(oval.y - start.y) + (oval.r - start.r).abs();
        if !(moved <= 6.0 && oval.r >= 3.0) {
            return None;
        }
        let most = 0.08 * oval.r;
        oval.cos2 = (oval.cos2 + step.cos2).clamp(-most, most);
        oval.sin2 = (oval.sin2 + step.sin2).clamp(-most, most);
    }
    Some((oval, last))
}

/// Finds the strongest edge along the outline's normal on each ray.
fn strongest(polar: &Polar, least: f32, edges: &mut [Edge; RAYS]) {
    let m = polar.columns;
    for (index, edge) in edges.iter_mut().enumerate() {
        *edge = Edge::default();
        if !polar.visible[index] {
            continue;
        }
        let (row, along) = (&polar.outward[index * m..][..m], &polar.along[index * m..][..m]);
        let (mut best, mut at) = (least, usize::MAX);
        for column in 0..m {
            let strength = row[column].abs() - 0.7 * along[column].abs();
            if strength > best {
                (best, at) = (strength, column);
            }
        }
        if at == usize::MAX {
            continue;
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
        *edge = Edge {
            distance: polar.distance(column),
            slope: row[at],
        };
    }
}

/// Weighs how many of the strongest edges lie on the outline.
fn weigh(polar: &Polar, edges: &[Edge; RAYS], oval: Oval, setting: &Setting) -> Proof {
    let visible = polar.visible.iter().filter(|&&visible| visible).count();
    let independent = (oval.r * std::f32::consts::TAU / 2.5).min(RAYS as f32) / RAYS as f32 * visible as f32;
    let mut best = Proof {
        oval,
        certainty: f32::NEG_INFINITY,
        ..Proof::default()
    };
    for slack in [super::tune(17, 0.25), 0.5f32, 0.8, 1.2] {
        let hits = edges
            .iter()
            .filter(|edge| edge.slope != 0.0 && edge.distance.abs() <= slack)
            .count();
        let p = (2.0 * slack + super::tune(9, 0.2)) / polar.columns as f32;
        let share = hits as f32 / (visible as f32).max(1.0);
        let certainty = independent * divergence(share, p) - setting.tests;
        if certainty > best.certainty {
            best.certainty = certainty;
            best.features = [share, slack, visible as f32 / RAYS as f32, independent, 0.0, 0.0, 0.0, 0.0];
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
