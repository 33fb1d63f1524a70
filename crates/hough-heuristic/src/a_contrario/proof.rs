//! The number of false alarms of a candidate, computed at the size of the frame where its radius is
//! one or two dozen pixels.

use super::against::Against;
use super::budget::ROUND;
use super::chance::divergence;
use super::consensus;
use super::directions::{Rays, UnitCircle};
use super::fit::Moments;
use super::polar::{Gray, LANES, Polar, Ring};
use super::strongest::{Edges, RAYS, Window};

/// Reach of the search for the strongest edge on either side of the outline, in radii.
const REACH: f32 = 0.33;
/// The least and the most of that, pixels.
const LEAST_REACH: usize = 3;
const MOST_REACH: usize = 8;
/// Reach of the first search, around the candidate, which is not exact, pixels.
const FIRST_REACH: usize = 6;
/// Spacing of samples along the outline at which they do not overlap, pixels.
const SPACING: f32 = 2.5;
/// Distance of independent samples as a share of the length over which slopes are averaged. At 0.75
/// noise alone made five times as many circles; at 1 a tenth of the circles in noise of 40 gray
/// levels were lost.
const OVERLAP: f32 = 0.85;

/// Noise from which slopes are averaged along the outline and edges may lie farther off the circle,
/// gray levels.
pub(super) const NOISE: f32 = 3.0;
/// Share of a circle in the frame below which its number of false alarms is multiplied.
const WHOLE: f32 = 0.9;
/// Decimal logarithm of that factor.
const CUT: f32 = 3.0;
/// Weight of a ray without any edge among the samples. It is weak evidence against an outline,
/// since balls darken towards one side.
const NO_EDGE: f32 = 0.25;

/// Width from which an edge counts as soft, pixels. A sharp edge is about 2 px wide.
const SOFT: f32 = 3.0;
/// Certainty subtracted from a soft outline, for which more tolerances are tested.
const SOFT_TESTS: f32 = 0.3;
/// Tolerances of the distance of an edge from the outline, pixels.
const SLACKS: [f32; 4] = [0.25, 0.5, 0.8, 1.2];
/// Certainty subtracted for the last two from an outline that is neither soft nor noisy.
const UNEVEN_TESTS: f32 = 1.3;
/// Least share of such an outline that the last two must cover.
const LEAST_UNEVEN: f32 = 0.5;
/// Width of an edge below which it belongs to a line or to grain, which displaces it, pixels.
const CRISP: f32 = 1.35;
/// Tangent of the largest angle between the outline and an edge that runs along it: 7 degrees.
const SLANT: f32 = 0.125;
/// Chance that an edge on the outline runs along it. It is 0.3 for random circles in photographs;
/// more of the edges on a ring that touches other things do, one after the other.
const ALONG: f32 = 0.62;
/// Certainty subtracted if the edges need not run along the outline.
const ASLANT_TESTS: f32 = 1.0;
/// Noise up to which the directions of a small ball's edges are too uncertain for that, gray
/// levels. In stronger noise slopes are averaged over so many rays that they are not.
const UNCERTAIN: f32 = 6.0;
/// Least number of rays whose edge lies on a circle.
const LEAST_NEAR: usize = 20;
/// Distances at which edges count in the narrow window, pixels.
const NARROW_FOCI: [f32; 3] = [2.0, 1.5, 1.2];
/// Number of rays by which another start must agree with more edges than the fit.
const MORE_AGREEING: f32 = 4.0;
/// Certainty subtracted from a circle from another start: dozens of them are tested.
const CONSENSUS_TESTS: f32 = 2.0;

/// Least share of the rays in the frame whose edge lies on the circle: before the outline is moved
/// to the edges, and after. A ball that is hidden to two fifths may show little more.
const LEAST_SHARE: [f32; 2] = [0.3, 0.4];

/// Result of the proof of a candidate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Proof {
    /// In pixels of the level, or of the frame once it has been measured.
    pub(super) ring: Ring,
    /// Minus the decimal logarithm of the number of false alarms.
    pub(super) certainty: f32,
    /// Number of halvings of the frame for the proof.
    pub(super) depth: usize,
    /// Share of the outline in the frame whose strongest edge lies on the outline.
    pub(super) covered: f32,
    /// Share of the outline that lies in the frame.
    pub(super) visible: f32,
    /// A bit for each ray whose strongest edge lies on the outline, and runs along it if that is
    /// surer.
    pub(super) hits: u64,
    /// A bit for each ray whose strongest edge is brighter outside.
    pub(super) brighter: u64,
    /// Largest distance of those edges from it, pixels of the level.
    pub(super) slack: f32,
    /// The chance of that on one ray.
    pub(super) chance: f32,
    /// Rays that count, the samples that they are worth, and the tests made.
    pub(super) rays: f32,
    pub(super) samples: f32,
    pub(super) tests: f32,
    /// What speaks against the circle.
    pub(super) against: Against,
}

impl Proof {
    /// Returns `true` if the circle explains the edge points that lie on it.
    pub(super) fn is_beyond_doubt(&self) -> bool {
        self.certainty >= BEYOND_DOUBT
            || (self.certainty >= HALF_SURE && self.covered >= ALL_BUT_COVERED)
    }

    /// The better of two proofs of one candidate, after `price` is subtracted from the certainty of
    /// the second.
    pub(super) fn better(first: Option<Self>, second: Option<Self>, price: f32) -> Option<Self> {
        let second = second.map(|proof| Self {
            certainty: proof.certainty - price,
            tests: proof.tests + price,
            ..proof
        });
        match (first, second) {
            (Some(first), Some(second)) if first.certainty >= second.certainty => Some(first),
            (first, second) => second.or(first),
        }
    }

    /// The circle in pixels of the frame.
    pub(super) fn in_frame(&self) -> Ring {
        self.ring.grown((1 << self.depth) as f32)
    }

    /// Takes evidence against the circle into account.
    pub(super) fn weaken(&mut self, against: Against) {
        self.against = against;
        self.certainty = self.certainty_of(self.hits);
    }

    /// The certainty without the rays whose edges lie on these circles of the frame.
    pub(super) fn certainty_beside(
        &self,
        rays: Rays<'_>,
        others: impl Iterator<Item = Ring>,
    ) -> f32 {
        let ring = self.in_frame();
        let slack = self.slack_in_frame();
        let mut hits = self.hits;
        for other in others {
            let (dx, dy) = (ring.x - other.x, ring.y - other.y);
            let reach = ring.r + other.r + slack;
            if dx.abs() > reach || dy.abs() > reach {
                continue;
            }
            let apart = (dx * dx + dy * dy).sqrt();
            if apart > reach || apart + slack < (ring.r - other.r).abs() {
                continue;
            }
            for ray in 0..RAYS {
                let (x, y) = (dx + ring.r * rays.x[ray], dy + ring.r * rays.y[ray]);
                let off = (x * x + y * y).sqrt() - other.r;
                hits &= !(u64::from(off.abs() <= slack) << ray);
            }
        }
        if hits == self.hits {
            return self.certainty;
        }
        self.certainty_of(hits)
    }

    /// The certainty that so many of the rays give.
    fn certainty_of(&self, hits: u64) -> f32 {
        let share = hits.count_ones() as f32 / self.rays.max(1.0);
        let alone = self.samples * divergence(share, self.chance) - self.tests;
        self.against.left * alone - self.against.price
    }

    /// Largest distance from another outline of edges that belong to it, pixels of the frame.
    pub(super) fn slack_in_frame(&self) -> f32 {
        (self.slack + MORE_SLACK) * (1 << self.depth) as f32
    }

    /// 0..1: the certainty, so that a number of false alarms of 1 in 10 frames gives one half.
    pub(super) fn score(&self) -> f64 {
        Self::score_of(self.certainty)
    }

    /// The score of a certainty.
    pub(super) fn score_of(certainty: f32) -> f64 {
        let certainty = f64::from(certainty.max(0.0));
        certainty / (certainty + f64::from(HALF_SURE))
    }
}

/// The certainty that gives a score of one half.
const HALF_SURE: f32 = 1.0;
/// Certainty from which a circle is beyond doubt and explains the edges on it.
const BEYOND_DOUBT: f32 = 4.0;
/// Covered share from which a circle of score 0.5 or more is beyond doubt too. Small circles never
/// reach a higher certainty.
const ALL_BUT_COVERED: f32 = 0.85;
/// Additional distance at which an edge still belongs to another circle, pixels of the level.
const MORE_SLACK: f32 = 0.5;

/// Properties of a level that the proof depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    /// Deviation of the noise at this level, gray levels.
    pub(super) noise: f32,
    /// Decimal logarithm of the number of circles that might have been tested.
    pub(super) tests: f32,
    /// The edges that count, if not all of the window do.
    pub(super) narrow: Option<Narrow>,
}

/// A part of the window around an outline.
#[derive(Clone, Copy, Debug)]
pub(super) enum Narrow {
    /// So many pixels on either side.
    Within(f32),
    /// Edges closer to the outline than to this one.
    Beside(Ring),
}

impl Narrow {
    /// The part in a frame whose pixels are `factor` times as large.
    pub(super) fn shrunk(&self, factor: f32) -> Self {
        match self {
            Self::Within(pixels) => Self::Within(pixels / factor),
            Self::Beside(other) => Self::Beside(other.shrunk(factor)),
        }
    }

    /// Its reach on either side of a ring, pixels.
    fn reach(&self, ring: &Ring) -> usize {
        let pixels = match self {
            Self::Within(pixels) => *pixels,
            Self::Beside(other) => 0.5 * ring.apart(other),
        };
        ((pixels + 0.5) as usize).max(2)
    }
}

/// Rays on either side over which slopes are averaged, for a ring of this radius.
#[inline(always)]
fn half_for(r: f32, noise: f32) -> usize {
    // Some three pixels where there is noise.
    let arc = r * std::f32::consts::TAU / RAYS as f32;
    if noise > NOISE {
        ((1.5 / arc) as usize).clamp(1, 5)
    } else {
        0
    }
}

/// The window in which the edges around an outline are sought.
#[inline(always)]
pub(super) fn window_for(ring: &Ring, noise: f32) -> Window {
    let half = half_for(ring.r, noise);
    let least = (2.0 * noise / (2.0 * half as f32 + 1.0).sqrt()).max(1.5);
    let reach = ((REACH * ring.r + 0.5) as usize).clamp(LEAST_REACH, MOST_REACH);
    Window {
        reach: reach.min((ring.r - 1.5) as usize).max(2),
        half,
        least,
        soft: false,
    }
}

#[inline(always)]
pub(super) fn prove(
    gray: Gray<'_>,
    circle: &UnitCircle,
    polar: &mut Polar,
    start: Ring,
    setting: &Setting,
    looks: &mut u64,
) -> Option<Proof> {
    let rays = circle.rays(RAYS);
    let mut window = window_for(&start, setting.noise);
    let mut wide = Window {
        reach: FIRST_REACH.min((start.r - 1.5) as usize).max(2),
        ..window
    };
    if let Some(narrow) = setting.narrow {
        window.reach = narrow.reach(&start).min(window.reach);
        wide.reach = window.reach;
    }
    *looks += ROUND;
    let edges = Edges::around(&start, gray, rays, polar, wide);
    let width = edges.width(polar);
    window.soft = width > SOFT;
    let foci = if setting.narrow.is_some() {
        NARROW_FOCI
    } else {
        [4.0, 3.0, 2.0]
    };
    let visible: f32 = polar.visible.iter().sum();
    let mut follow = |fitted: Option<(Ring, usize)>, looks: &mut u64| {
        let (ring, near) = fitted?;
        let few = near < LEAST_NEAR || (near as f32) < LEAST_SHARE[0] * visible;
        if few || !is_near(&ring, &start) {
            return None;
        }
        let path = (&start, ring);
        settle(gray, rays, polar, path, setting, (window, width), looks)
    };
    let fitted = improve(rays, &edges, start, start, foci);
    let first = follow(fitted, looks);
    if setting.narrow.is_some() || window.soft || first.is_some_and(|proof| proof.is_beyond_doubt())
    {
        return first;
    }
    // The fit may have been drawn to another thing: begin where most of the edges agree.
    let agreeing = fitted.map_or(0.0, |(ring, _)| {
        consensus::count(rays, &edges, &ring.since(&start))
    });
    *looks += ROUND / 2;
    let (shift, count) = consensus::of(rays, &edges);
    if count < (agreeing + MORE_AGREEING).max(LEAST_SHARE[0] * visible) {
        return first;
    }
    let second = improve(rays, &edges, start, start.moved(&shift), NARROW_FOCI);
    Proof::better(first, follow(second, looks), CONSENSUS_TESTS)
}

/// Returns `true` if a fit has not left the candidate.
fn is_near(ring: &Ring, start: &Ring) -> bool {
    ring.apart(start) <= 6.0 && ring.r >= 3.0
}

/// Moves the outline to its edges until it rests, and weighs them.
#[inline(always)]
fn settle(
    gray: Gray<'_>,
    rays: Rays<'_>,
    polar: &mut Polar,
    (start, fitted): (&Ring, Ring),
    setting: &Setting,
    (mut window, width): (Window, f32),
    looks: &mut u64,
) -> Option<Proof> {
    let (mut ring, mut moved) = (fitted, fitted.apart(start));
    let widest = window.reach.max(window_for(start, setting.noise).reach);
    for _ in 0..3 {
        if moved < 0.7 {
            break;
        }
        *looks += ROUND;
        if let Some(narrow) = setting.narrow {
            window.reach = narrow.reach(&ring).min(widest);
        }
        let edges = Edges::around(&ring, gray, rays, polar, window);
        let foci = if setting.narrow.is_some() {
            NARROW_FOCI
        } else if window.soft {
            [3.0, 2.5, 2.0]
        } else {
            [3.0, 2.0, 1.5]
        };
        let (better, near) = improve(rays, &edges, ring, ring, foci)?;
        let visible: f32 = polar.visible.iter().sum();
        if (near as f32) < LEAST_SHARE[1] * visible || near < LEAST_NEAR || !is_near(&better, start)
        {
            return None;
        }
        moved = better.apart(&ring);
        ring = better;
    }
    *looks += ROUND;
    let mut edges = Edges::around(&ring, gray, rays, polar, window);
    if edges.are_clipped(polar) {
        edges.leave_out_glow(&ring, gray, rays, polar, window);
    }
    Some(weigh(polar, &edges, ring, setting, window, width < CRISP))
}

/// Fits the outline `from` to the edges sampled around `start`, in one step for each entry of
/// `foci`: the largest distance at which an edge counts, pixels. Returns the outline and the
/// number of edges that counted in the last step.
#[inline(always)]
fn improve(
    rays: Rays<'_>,
    edges: &Edges,
    start: Ring,
    from: Ring,
    foci: [f32; 3],
) -> Option<(Ring, usize)> {
    let mut ring = from;
    let mut near = 0.0;
    for focus in foci {
        let mut moments = Moments::default();
        let mut count = [0.0f32; LANES];
        let (shift_x, shift_y, shift_r) = (ring.x - start.x, ring.y - start.y, ring.r - start.r);
        for block in 0..RAYS / LANES {
            let ux = &rays.x.as_chunks::<LANES>().0[block];
            let uy = &rays.y.as_chunks::<LANES>().0[block];
            let distance = &edges.distance.as_chunks::<LANES>().0[block];
            let slope = &edges.slope.as_chunks::<LANES>().0[block];
            let (mut residual, mut weight) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                residual[lane] = distance[lane] - shift_r - shift_x * ux[lane] - shift_y * uy[lane];
                let off = residual[lane] / focus;
                let within = (1.0 - off * off).max(0.0);
                let slope = slope[lane].min(30.0);
                weight[lane] = slope * slope * within;
                count[lane] += f32::from(u8::from(weight[lane] > 0.0));
            }
            moments.add(ux, uy, &residual, &weight);
        }
        near = count.iter().sum();
        if near < 12.0 {
            return None;
        }
        let step = moments.step()?;
        ring = Ring {
            x: ring.x + step.x,
            y: ring.y + step.y,
            r: ring.r + step.r,
        };
    }
    Some((ring, near as usize))
}

/// Weighs how many of the strongest edges lie on the outline.
fn weigh(
    polar: &Polar,
    edges: &Edges,
    ring: Ring,
    setting: &Setting,
    window: Window,
    is_crisp: bool,
) -> Proof {
    let visible: f32 = polar.visible.iter().sum();
    let arc = ring.r * std::f32::consts::TAU / RAYS as f32;
    let averaged = if window.half > 0 {
        (2 * window.half + 1) as f32 * arc
    } else {
        0.0
    };
    let apart = (OVERLAP * averaged).max(SPACING);
    let edges_found = edges.slope.iter().filter(|&&slope| slope > 0.0).count() as f32;
    let rays = edges_found + NO_EDGE * (visible - edges_found);
    let independent = (arc / apart).min(1.0) * rays;
    let brighter = |bits: u64, (ray, sign): (usize, &f32)| bits | u64::from(*sign > 0.0) << ray;
    let mut best = Proof {
        ring,
        brighter: edges.sign.iter().enumerate().fold(0, brighter),
        certainty: f32::NEG_INFINITY,
        visible: visible / RAYS as f32,
        rays,
        samples: independent,
        ..Proof::default()
    };
    // An outline that is neither averaged nor cut by the frame may be uneven, at a price.
    let even = setting.noise > NOISE || window.soft;
    let slacks = if even || (is_crisp && visible >= WHOLE * RAYS as f32) {
        &SLACKS[..]
    } else {
        &SLACKS[..2]
    };
    let tests = setting.tests
        + if window.soft { SOFT_TESTS } else { 0.0 }
        + if visible < WHOLE * RAYS as f32 {
            CUT
        } else {
            0.0
        };
    let uncertain = window.soft || (NOISE..UNCERTAIN).contains(&setting.noise);
    let aslant = if uncertain { 0.0 } else { ASLANT_TESTS };
    let along = bits(|ray| edges.slant[ray] <= SLANT);
    for &slack in slacks {
        let on = bits(|ray| edges.slope[ray] > 0.0 && edges.distance[ray].abs() <= slack);
        let covered = on.count_ones() as f32 / visible.max(1.0);
        let wide = slack > SLACKS[1] && !even;
        let chance = (2.0 * slack + 0.2) / (2 * window.reach + 1) as f32;
        for (hits, p, price) in [(on & along, ALONG * chance, 0.0), (on, chance, aslant)] {
            let share = hits.count_ones() as f32;
            if wide && share < LEAST_UNEVEN * visible {
                continue;
            }
            let tests = tests + price + if wide { UNEVEN_TESTS } else { 0.0 };
            let certainty = independent * divergence(share / rays.max(1.0), p) - tests;
            if certainty > best.certainty {
                (best.certainty, best.tests, best.covered) = (certainty, tests, covered);
                (best.hits, best.slack, best.chance) = (hits, slack, p);
            }
        }
    }
    best
}

/// A bit for each ray on which this holds.
#[inline(always)]
fn bits(holds: impl Fn(usize) -> bool) -> u64 {
    (0..RAYS).fold(0, |bits, ray| bits | u64::from(holds(ray)) << ray)
}
