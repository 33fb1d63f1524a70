//! Drawing pairs of edge points, and looking at the circle each pair determines: the paper's steps 3a to 3c.

use super::candidate::{Candidate, Collected};
use super::directions::{CODES, UnitCircle, apart, code};
use super::level::{EdgePoint, Level, Lines};

/// Points of a circle's outline that are looked at.
pub(super) const LOOKS: usize = 32;
/// How far the direction of an edge may be off that of the outline, in codes of 2.8 degrees.
pub(super) const DIRECTION_SLACK: u8 = 7;
/// The sine of how far two normals may be from mirroring one another.
const MIRROR_SLACK: f32 = 0.25;
/// The least part of a normal along the line that the pair lies on.
const LEAST_ALONG: f32 = 0.45;
/// How many mirrored partners of a point are tried.
const PARTNERS: u32 = 6;

/// A circle in pixels of a level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) r: f32,
}

/// What a ring's outline shows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Support {
    /// Points of the outline that lie on an edge along it.
    pub(super) hits: u32,
    /// Points of the outline that lie in the frame.
    pub(super) visible: u32,
}

impl Support {
    pub(super) fn share(&self) -> f32 {
        self.hits as f32 / self.visible.max(1) as f32
    }
}

/// What may be spent, and what has been.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Budget {
    pub(super) draws: u64,
    pub(super) looks: u64,
    pub(super) most_looks: u64,
}

impl Budget {
    pub(super) fn is_spent(&self) -> bool {
        self.looks >= self.most_looks
    }
}

/// The points of the outline in the order in which they are looked at, each with the code of its normal.
#[derive(Clone, Debug)]
pub(super) struct Outline(Vec<(f32, f32, u8)>);

impl Outline {
    pub(super) fn new(circle: &UnitCircle) -> Self {
        // Bits reversed: any first part of the order is spread over the whole outline.
        let order = (0..LOOKS).map(|index| (index as u32).reverse_bits() >> (32 - LOOKS.trailing_zeros()));
        Self(
            order
                .map(|index| {
                    let (x, y) = circle.point(index as usize, LOOKS);
                    (x, y, code(x, y))
                })
                .collect(),
        )
    }

    /// Looks at the outline until it is plain that there is no circle; None then.
    #[inline]
    pub(super) fn support(&self, level: &Level, ring: &Ring, looks: &mut u64) -> Option<Support> {
        let mut support = Support::default();
        for (index, &(ux, uy, normal)) in self.0.iter().enumerate() {
            if let Some((mark, _)) = level.mark(ring.x + ring.r * ux, ring.y + ring.r * uy) {
                support.visible += 1;
                let matches = mark != 0 && apart((mark - 1) % CODES, normal) <= DIRECTION_SLACK;
                support.hits += u32::from(matches);
            }
            if index % 4 == 3 && support.hits * 5 + 5 < support.visible * 2 {
                *looks += index as u64 + 1;
                return None;
            }
        }
        *looks += LOOKS as u64;
        (support.visible >= LOOKS as u32 / 3 && support.hits * 5 >= support.visible * 2).then_some(support)
    }

    /// Fits the ring to the edge points along it; None if they do not determine one.
    pub(super) fn fit(&self, level: &Level, ring: &Ring, reach: f32, looks: &mut u64) -> Option<Ring> {
        let mut normal = Normal::default();
        for &(ux, uy, direction) in &self.0 {
            for step in [0.0, -1.5, 1.5] {
                *looks += 1;
                let at = ring.r + step;
                let Some((mark, pixel)) = level.mark(ring.x + at * ux, ring.y + at * uy) else {
                    continue;
                };
                if mark == 0 || apart((mark - 1) % CODES, direction) > DIRECTION_SLACK {
                    continue;
                }
                let point = level.point_at(pixel);
                let (dx, dy) = (point.x - ring.x, point.y - ring.y);
                let distance = (dx * dx + dy * dy).sqrt();
                if (distance - ring.r).abs() <= reach && distance > 0.5 {
                    normal.add(dx / distance, dy / distance, distance - ring.r, 1.0);
                    break;
                }
            }
        }
        let (dx, dy, dr) = normal.solve()?;
        (dx.abs() + dy.abs() + dr.abs() <= 3.0 * reach).then_some(Ring {
            x: ring.x + dx,
            y: ring.y + dy,
            r: ring.r + dr,
        })
    }

    /// Marks the points along the ring as explained.
    pub(super) fn explain(&self, circle: &UnitCircle, level: &mut Level, ring: &Ring, looks: &mut u64) {
        let count = ((6.3 * ring.r) as usize).clamp(16, 512);
        *looks += 3 * count as u64;
        for index in 0..count {
            let (ux, uy) = circle.point(index, count);
            let direction = code(ux, uy);
            for step in [0.0, -1.5, 1.5] {
                let at = ring.r + step;
                if let Some((mark, pixel)) = level.mark(ring.x + at * ux, ring.y + at * uy)
                    && mark != 0
                    && apart((mark - 1) % CODES, direction) <= DIRECTION_SLACK + 2
                {
                    let id = level.point_at(pixel).id;
                    level.free[id as usize] = false;
                }
            }
        }
    }
}

/// Least squares of `residual = dr + ux dx + uy dy`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Normal {
    pub(super) n: f32,
    ux: f32,
    uy: f32,
    uxx: f32,
    uxy: f32,
    uyy: f32,
    d: f32,
    dx: f32,
    dy: f32,
}

impl Normal {
    #[inline]
    pub(super) fn add(&mut self, ux: f32, uy: f32, residual: f32, weight: f32) {
        self.n += weight;
        self.ux += weight * ux;
        self.uy += weight * uy;
        self.uxx += weight * ux * ux;
        self.uxy += weight * ux * uy;
        self.uyy += weight * uy * uy;
        self.d += weight * residual;
        self.dx += weight * residual * ux;
        self.dy += weight * residual * uy;
    }

    pub(super) fn solve(&self) -> Option<(f32, f32, f32)> {
        let n = self.n;
        if n <= 0.0 {
            return None;
        }
        let uxx = self.uxx - self.ux * self.ux / n;
        let uxy = self.uxy - self.ux * self.uy / n;
        let uyy = self.uyy - self.uy * self.uy / n;
        let dx = self.dx - self.ux * self.d / n;
        let dy = self.dy - self.uy * self.d / n;
        let determinant = uxx * uyy - uxy * uxy;
        if determinant < 1e-3 * n * n {
            return None;
        }
        let x = (dx * uyy - dy * uxy) / determinant;
        let y = (dy * uxx - dx * uxy) / determinant;
        Some((x, y, (self.d - self.ux * x - self.uy * y) / n))
    }
}

/// The two normals' account of the circle through a point and one further along its line; None if they tell of none.
#[inline]
fn mirrored(p: &EdgePoint, q: &EdgePoint) -> Option<Ring> {
    if (p.nx * q.ny + p.ny * q.nx).abs() > MIRROR_SLACK || q.nx.abs() < LEAST_ALONG {
        return None;
    }
    // Inward: along the line at p, against it at q.
    let (px, py) = if p.nx > 0.0 { (p.nx, p.ny) } else { (-p.nx, -p.ny) };
    let (qx, qy) = if q.nx < 0.0 { (q.nx, q.ny) } else { (-q.nx, -q.ny) };
    let (across, along) = (py + qy, px - qx);
    let length = (across * across + along * along).sqrt();
    let r = (q.x - p.x) * length / (2.0 * along);
    let r = 0.5 * (q.x - p.x) * length / along;
    Some(Ring {
        x: 0.5 * (p.x + q.x),
        y: 0.5 * (p.y + q.y) + r * across / length,
        r,
    })
}

/// Everything the search of a level needs.
pub(super) struct Search<'a> {
    pub(super) circle: &'a UnitCircle,
    pub(super) outline: &'a Outline,
    /// Radii sought at this level, pixels of the level.
    pub(super) radii: (f32, f32),
    /// Pixels of the frame per pixel of the level.
    pub(super) scale: f32,
    pub(super) seed: u64,
}

impl Search<'_> {
    /// Draws pairs on the rows, then on the columns, until all points have had their turn or the budget is spent.
    pub(super) fn run(&self, level: &mut Level, found: &mut Collected, budget: &mut Budget) {
        for transposed in [false, true] {
            let count = level.rows.points.len();
            let stride = stride(count);
            let mut at = (self.seed % count.max(1) as u64) as usize;
            for _ in 0..count {
                at = (at + stride) % count;
                if budget.is_spent() {
                    return;
                }
                self.from_point(level, transposed, at, found, budget);
            }
        }
    }

    fn from_point(
        &self,
        level: &mut Level,
        transposed: bool,
        at: usize,
        found: &mut Collected,
        budget: &mut Budget,
    ) {
        let mut next = at + 1;
        let mut partners = 0;
        while partners < PARTNERS {
            let lines: &Lines = if transposed { &level.columns } else { &level.rows };
            let p = lines.points[at];
            if !level.free[p.id as usize] || p.nx.abs() < LEAST_ALONG {
                return;
            }
            let Some(ring) = lines.next_partner(&p, &mut next, self.radii, &level.free, budget) else {
                return;
            };
            partners += 1;
            let ring = if transposed {
                Ring {
                    x: ring.y,
                    y: ring.x,
                    r: ring.r,
                }
            } else {
                ring
            };
            self.consider(level, ring, found, budget);
        }
    }

    fn consider(&self, level: &mut Level, ring: Ring, found: &mut Collected, budget: &mut Budget) {
        budget.draws += 1;
        let Some(_) = self.outline.support(level, &ring, &mut budget.looks) else {
            return;
        };
        let fit = |ring: &Ring, reach: f32, budget: &mut Budget| {
            self.outline.fit(level, ring, reach, &mut budget.looks)
        };
        let Some(ring) = fit(&ring, 3.0, budget).and_then(|ring| fit(&ring, 2.0, budget)) else {
            return;
        };
        if ring.r < 0.8 * self.radii.0 || ring.r > 1.25 * self.radii.1 {
            return;
        }
        let Some(support) = self.outline.support(level, &ring, &mut budget.looks) else {
            return;
        };
        found.add(Candidate::new(&ring, self.scale, support), budget);
        if support.share() >= 0.6 {
            self.outline
                .explain(self.circle, level, &ring, &mut budget.looks);
        }
    }
}

impl Lines {
    /// The next point on the line of `p` that mirrors it, as the circle of the two.
    #[inline]
    fn next_partner(
        &self,
        p: &EdgePoint,
        next: &mut usize,
        radii: (f32, f32),
        free: &[bool],
        budget: &mut Budget,
    ) -> Option<Ring> {
        let first = *next;
        while let Some(q) = self.points.get(*next) {
            *next += 1;
            // A point of another line lies at least half a pixel off, and most often lies before this one.
            if (q.y - p.y).abs() > 1.0 || q.x <= p.x || q.x - p.x > 2.0 * radii.1 {
                break;
            }
            if !free[q.id as usize] {
                continue;
            }
            if let Some(ring) = mirrored(p, q)
                && ring.r >= radii.0
                && ring.r <= radii.1
            {
                budget.looks += (*next - first) as u64 / 4;
                return Some(ring);
            }
        }
        budget.looks += (*next - first) as u64 / 4;
        None
    }
}

/// A step through `count` points that meets each of them once and leaps far.
fn stride(count: usize) -> usize {
    let mut step = (count as f64 * 0.618) as usize | 1;
    while gcd(step, count) != 1 {
        step += 2;
    }
    step
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
