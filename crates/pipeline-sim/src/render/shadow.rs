//! Shadows of the things on the table, worked out once.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::render::scene::{Light, Scene, Shape, Thing};
use crate::render::texture::CoarseMap;

/// Number of points of a lamp's disc.
const LAMP_POINTS: usize = 24;

/// Returns the light on a horizontal surface, and the fraction of it from each lamp.
pub(super) fn table_light(scene: &Scene) -> (f64, Vec<f64>) {
    let light = |lamp: &Light| lamp.intensity.max(0.0) * toward(lamp).z.max(0.0);
    let lamps: Vec<f64> = scene.lights.iter().map(light).collect();
    let total = scene.ambient.max(0.0) + lamps.iter().sum::<f64>();
    let shares = lamps.iter().map(|l| l / total.max(1e-9)).collect();
    (total, shares)
}

/// Returns the unit vector toward a lamp.
pub(super) fn toward(light: &Light) -> Vector3<f64> {
    light.toward.try_normalize(1e-12).unwrap_or_else(Vector3::z)
}

/// Returns the direction toward each lamp of a scene, and its light.
pub(super) fn lamps(scene: &Scene) -> Vec<(Vector3<f64>, f64)> {
    let lamp = |l: &Light| (toward(l), l.intensity.max(0.0));
    scene.lights.iter().map(lamp).collect()
}

/// The shadow of one thing: factors for a part of a map.
#[derive(Clone, Debug)]
struct Cast {
    columns: Range<usize>,
    rows: Range<usize>,
    factors: Vec<f32>,
}

/// The light on the table without ball and holder: stains, and the shadows of things.
#[derive(Clone, Debug)]
pub(super) struct ThingShadows {
    /// Values of the map without the things.
    bare: Vec<f32>,
    /// Map with the shadows of the things.
    map: CoarseMap,
    /// Shadow of each thing; `None` for flat things and those off the map.
    casts: Vec<Option<Cast>>,
    /// Things that are left out at present.
    left_out: Vec<usize>,
}

impl ThingShadows {
    /// Creates the map from `stains`, darkened in the shadows of the things and a little around
    /// their feet.
    pub(super) fn new(stains: CoarseMap, scene: &Scene) -> Self {
        let things = scene.things.iter();
        let mut shadows = Self {
            bare: stains.values.clone(),
            casts: things.map(|t| cast(&stains, scene, t)).collect(),
            map: stains,
            left_out: Vec::new(),
        };
        for i in 0..shadows.casts.len() {
            shadows.darken(i);
        }
        shadows
    }

    /// Writes the factors on the table's light at places, metres.
    #[inline(always)]
    pub(super) fn at(&self, x: &[f32], y: &[f32], factors: &mut [f32]) {
        self.map.at(x, y, factors);
    }

    /// Leaves out these things, in ascending order, and restores all others.
    pub(super) fn leave_out(&mut self, things: Vec<usize>) {
        if things == self.left_out {
            return;
        }
        let before = std::mem::replace(&mut self.left_out, things);
        for i in 0..self.casts.len() {
            if before.contains(&i) != self.left_out.contains(&i) {
                self.darken(i);
            }
        }
    }

    /// Recomputes the light in the shadow of a thing.
    fn darken(&mut self, thing: usize) {
        let Some(Some(Cast { columns, rows, .. })) = self.casts.get(thing) else {
            return;
        };
        let side = self.map.side;
        for j in rows.clone() {
            let row = j * side + columns.start..j * side + columns.end;
            self.map.values[row.clone()].copy_from_slice(&self.bare[row]);
        }
        for (i, other) in self.casts.iter().enumerate() {
            let Some(other) = other.as_ref().filter(|_| !self.left_out.contains(&i)) else {
                continue;
            };
            let columns = shared(columns, &other.columns);
            if columns.is_empty() {
                continue;
            }
            for j in shared(rows, &other.rows) {
                let row = (j - other.rows.start) * other.columns.len();
                let from = row + columns.start - other.columns.start;
                let values = &mut self.map.values[j * side..][columns.clone()];
                for (value, factor) in values.iter_mut().zip(&other.factors[from..]) {
                    *value *= factor;
                }
            }
        }
    }
}

/// Returns the intersection of two ranges.
fn shared(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
}

/// Returns the shadow of a thing on a map; `None` if there is none.
fn cast(map: &CoarseMap, scene: &Scene, thing: &Thing) -> Option<Cast> {
    if thing.shape.is_flat() {
        return None;
    }
    let (_, shares) = table_light(scene);
    let (foot, height) = (thing.shape.footprint(), thing.shape.height());
    let points = scene
        .lights
        .iter()
        .map(|light| lamp_points(light, thing.turn));
    let lamps: Vec<(f64, Vec<Vector3<f64>>)> = shares.into_iter().zip(points).collect();
    // Longest shadow for any point of a lamp.
    let slopes = lamps.iter().flat_map(|(_, points)| points);
    let slopes = slopes.map(|d| d.x.hypot(d.y) / d.z.max(1e-3));
    let reach = foot + (height * slopes.fold(0.0, f64::max)).max(0.05);
    let [columns, rows] = map.range(thing.x, thing.y, reach.min(map.size));
    if columns.is_empty() || rows.is_empty() {
        return None;
    }
    // Each point of a lamp samples another place of the map's cell, which softens the edges.
    let cell = map.size / (map.side - 1) as f64;
    let within = |k: usize, step: f64| cell * ((k as f64 * step).fract() - 0.5);
    let aside: [Vector3<f64>; LAMP_POINTS] =
        std::array::from_fn(|k| Vector3::new(within(k, 0.754_877_7), within(k, 0.569_840_3), 0.0));
    let (sin, cos) = thing.turn.sin_cos();
    let mut factors = Vec::with_capacity(columns.len() * rows.len());
    for j in rows.clone() {
        for i in columns.clone() {
            let (x, y) = map.place(i, j);
            let (dx, dy) = (x - thing.x, y - thing.y);
            if dx.hypot(dy) > reach {
                factors.push(1.0);
                continue;
            }
            let from = Point3::new(dx * cos + dy * sin, dy * cos - dx * sin, 0.0);
            // Things also hide part of the sky from the table near their feet.
            let mut factor = 1.0 - 0.35 * (-gap(&thing.shape, &from) / 0.012).exp();
            for (share, points) in &lamps {
                let hidden = |(d, aside): &(&Vector3<f64>, &Vector3<f64>)| {
                    d.z > 1e-3 && meets(&thing.shape, &(from + *aside), d)
                };
                let blocked = points.iter().zip(&aside).filter(hidden).count();
                factor -= share * blocked as f64 / LAMP_POINTS as f64;
            }
            factors.push(factor.max(0.02) as f32);
        }
    }
    Some(Cast {
        columns,
        rows,
        factors,
    })
}

/// Returns the distance from a point of the table to the foot of a shape at the origin; 0 under it.
fn gap(shape: &Shape, from: &Point3<f64>) -> f64 {
    match *shape {
        Shape::Box { length, width, .. } => {
            let beyond = |at: f64, side: f64| (at.abs() - 0.5 * side).max(0.0);
            beyond(from.x, length).hypot(beyond(from.y, width))
        }
        _ => (from.x.hypot(from.y) - shape.footprint()).max(0.0),
    }
}

/// Directions toward points spread evenly over a lamp's disc, in the frame of a thing turned by
/// `turn`.
fn lamp_points(light: &Light, turn: f64) -> Vec<Vector3<f64>> {
    let axis = toward(light);
    let side = if axis.x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = axis.cross(&side).normalize();
    let v = axis.cross(&u);
    let reach = light.half_angle.clamp(0.0, 0.7).tan();
    let (sin, cos) = turn.sin_cos();
    // Vogel's spiral.
    let point = |k: usize| {
        let radius = ((k as f64 + 0.5) / LAMP_POINTS as f64).sqrt() * reach;
        let angle = k as f64 * 2.399_963;
        let d = axis + u * (radius * angle.cos()) + v * (radius * angle.sin());
        Vector3::new(d.x * cos + d.y * sin, d.y * cos - d.x * sin, d.z)
    };
    (0..LAMP_POINTS).map(point).collect()
}

/// Returns `true` if the ray from a point of the table upward along `d` meets the shape, which
/// stands at the origin.
fn meets(shape: &Shape, from: &Point3<f64>, d: &Vector3<f64>) -> bool {
    match *shape {
        Shape::Box {
            length,
            width,
            height,
        } => {
            let mut interval = (0.0_f64, height / d.z);
            for (p, v, half) in [(from.x, d.x, 0.5 * length), (from.y, d.y, 0.5 * width)] {
                if v.abs() < 1e-12 {
                    if p.abs() > half {
                        return false;
                    }
                    continue;
                }
                let (a, b) = ((-half - p) / v, (half - p) / v);
                interval = (interval.0.max(a.min(b)), interval.1.min(a.max(b)));
            }
            interval.0 < interval.1
        }
        Shape::Cylinder { radius, height } => {
            // Nearest horizontal approach to the axis while the ray is below the top.
            let (dx, dy) = (d.x / d.z, d.y / d.z);
            let speed2 = dx * dx + dy * dy;
            let nearest = -(from.x * dx + from.y * dy) / speed2;
            let z = if speed2 > 0.0 {
                nearest.clamp(0.0, height)
            } else {
                0.0
            };
            (from.x + z * dx).hypot(from.y + z * dy) < radius
        }
        Shape::Ball { radius } => {
            let to = Point3::new(0.0, 0.0, radius) - from;
            let along = to.dot(d) / d.norm();
            along > 0.0 && to.norm_squared() - along * along < radius * radius
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scene::Appearance;

    #[test]
    fn gloom_at_the_foot_of_a_box_has_its_shape() {
        let appearance = Appearance::new(0.5, 0.0, 0.0);
        let scene = Scene {
            lights: Vec::new(),
            things: vec![Thing {
                shape: Shape::Box {
                    length: 0.10,
                    width: 0.02,
                    height: 0.01,
                },
                x: 0.0,
                y: 0.0,
                turn: 0.5,
                appearance,
            }],
            ..Scene::plain()
        };
        let map = CoarseMap {
            side: 401,
            corner: (-0.2, -0.2),
            size: 0.4,
            values: vec![1.0; 401 * 401],
        };
        let map = ThingShadows::new(map, &scene);
        let (sin, cos) = 0.5_f64.sin_cos();
        // Ahead of an end, and as far from the middle but beside the box.
        let (cos, sin) = (0.053 * cos as f32, 0.053 * sin as f32);
        let mut factors = [0.0; 2];
        map.at(&[cos, -sin], &[sin, cos], &mut factors);
        let [end, beside] = factors;
        assert!(end < 0.76 && beside > 0.98, "{end} {beside}");
    }

    #[test]
    fn things_left_out_throw_no_shadow() {
        let scene = Scene::laboratory();
        let stains = CoarseMap {
            side: 601,
            corner: (-0.6, -1.2),
            size: 2.4,
            values: vec![1.0; 601 * 601],
        };
        let all = ThingShadows::new(stains.clone(), &scene);
        let mut shadows = all.clone();
        // The first box and the cylinder beside it.
        for gone in [vec![0], vec![0, 6], vec![6]] {
            shadows.leave_out(gone.clone());
            let mut fewer = scene.clone();
            for i in gone.iter().rev() {
                fewer.things.remove(*i);
            }
            assert_eq!(
                shadows.map.values,
                ThingShadows::new(stains.clone(), &fewer).map.values
            );
            assert_ne!(shadows.map.values, all.map.values);
        }
        shadows.leave_out(Vec::new());
        assert_eq!(shadows.map.values, all.map.values);
    }
}
