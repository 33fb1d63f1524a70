//! The shaded bodies: cylinders, boxes, and what lies flat; balls are drawn in `sphere`.

use hough_heuristic::Vectorized;
use nalgebra::{Matrix3, Point2, Point3, Vector3};

use crate::render::canvas::Canvas;
use crate::render::scene::{Appearance, Occluder, Scene, Shape, Thing};
use crate::render::texture::Texture;
use crate::render::view::View;

/// The inputs of a body's shading.
pub(super) struct Studio<'a> {
    pub(super) view: &'a View,
    pub(super) scene: &'a Scene,
    pub(super) texture: &'a Texture,
    /// Direction toward each lamp, and its light.
    pub(super) lamps: Vec<(Vector3<f64>, f64)>,
    /// Height of the table.
    pub(super) table: f64,
    /// Light reflected by the table.
    pub(super) bounce: f64,
}

/// Arguments of [`Studio::textured_row`].
struct PlaneRow<'a>(
    &'a Matrix3<f64>,
    &'a Texture,
    f32,
    (usize, usize),
    &'a mut [f32],
);

impl Vectorized for PlaneRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(plane, texture, strength, (y, x0), row) = self;
        let base = plane * Vector3::new(0.0, y as f64, 1.0);
        let step = plane.column(0);
        let place = |x: usize| {
            let x = x as f64;
            let w = 1.0 / (base.z + x * step.z);
            ((base.x + x * step.x) * w, (base.y + x * step.y) * w)
        };
        let middle = x0 + row.len() / 2;
        let (a, b) = (place(middle), place(middle + 1));
        let below = plane * Vector3::new(middle as f64, y as f64 + 1.0, 1.0);
        let down = (below.x / below.z, below.y / below.z);
        let footprint = ((b.0 - a.0).hypot(b.1 - a.1) * (down.0 - a.0).hypot(down.1 - a.1)).sqrt();
        texture.walk(texture.level(footprint), place, strength, x0, row);
    }
}

impl Studio<'_> {
    /// Writes a row of a textured plane of reflectance 1 from a pixel, given by row and column, on;
    /// `plane` takes pixels to homogeneous plane coordinates in metres.
    pub(super) fn textured_row(
        &self,
        plane: &Matrix3<f64>,
        strength: f32,
        start: (usize, usize),
        row: &mut [f32],
    ) {
        PlaneRow(plane, self.texture, strength, start, row).widest();
    }

    /// Returns the light that a surface with this normal receives, world frame.
    pub(super) fn irradiance(&self, normal: &Vector3<f64>) -> f64 {
        let up = 0.5 + 0.5 * normal.z;
        let lamp = |(toward, light): &(Vector3<f64>, f64)| light * toward.dot(normal).max(0.0);
        let lamps: f64 = self.lamps.iter().map(lamp).sum();
        self.scene.ambient.max(0.0) * up + self.bounce * (1.0 - up) + lamps
    }

    /// Draws an upright rod or cylinder from `low` to `high`, hollow-looking tops left out.
    pub(super) fn cylinder(
        &self,
        canvas: &mut Canvas,
        foot: Point2<f64>,
        radius: f64,
        [low, high]: [f64; 2],
        appearance: &Appearance,
    ) {
        const SIDES: usize = 40;
        let ring = |z: f64| -> [Point3<f64>; SIDES] {
            std::array::from_fn(|i| {
                let (sin, cos) = (i as f64 * std::f64::consts::TAU / SIDES as f64).sin_cos();
                Point3::new(foot.x + radius * cos, foot.y + radius * sin, z)
            })
        };
        let eye = self.view.eye();
        let (top, bottom) = (ring(high), ring(low));
        // Silhouette of the side: the hull of both rings, made of the half of each that faces away
        // from the other in the image.
        let mut outlines = self.view.polygon(&top);
        outlines.extend(self.view.polygon(&bottom));
        let hull = convex_hull(outlines);
        let axis = Point2::new(foot.x - eye.x, foot.y - eye.y);
        let rotation = self.view.pose.rotation.to_rotation_matrix();
        let shade = |x: f64, y: f64| {
            let d = rotation * self.view.direction(x, y);
            // Intersection of the ray with the wall, seen from above.
            let dd = (d.x * d.x + d.y * d.y).max(1e-12);
            let b = d.x * axis.x + d.y * axis.y;
            let disc = b * b - dd * (axis.coords.norm_squared() - radius * radius);
            let t = (b - disc.max(0.0).sqrt()) / dd;
            let n = Vector3::new(t * d.x - axis.x, t * d.y - axis.y, 0.0).try_normalize(1e-12);
            let n = n.unwrap_or_else(Vector3::x);
            let mut light = self.irradiance(&n);
            if appearance.gloss > 0.0 {
                let back = -d.normalize();
                for (toward, intensity) in &self.lamps {
                    let half = (toward + back).try_normalize(1e-9).unwrap_or(n);
                    let tilt = (1.0 - half.dot(&n)).max(0.0);
                    light += intensity * appearance.gloss * (-40.0 * tilt).exp();
                }
            }
            // Darker toward the table.
            let depth = ((eye.z + t * d.z - self.table) / 0.03).clamp(0.0, 1.0);
            (appearance.albedo * light * (0.75 + 0.25 * depth)) as f32
        };
        canvas.fill(&hull, |y, x0, row| {
            // Exact at every fourth pixel and straight between.
            let mut from = shade(x0 as f64, y as f64);
            for (k, chunk) in row.chunks_mut(4).enumerate() {
                let to = shade((x0 + 4 * k + 4) as f64, y as f64);
                for (i, value) in (0_i32..).zip(chunk) {
                    *value = from + 0.25 * (to - from) * i as f32;
                }
                from = to;
            }
        });
        if eye.z > high {
            self.face(canvas, &top, [Vector3::x(), Vector3::y()], appearance);
        }
    }

    /// Draws a flat convex face with the texture running along u and v.
    fn face(
        &self,
        canvas: &mut Canvas,
        corners: &[Point3<f64>],
        [u, v]: [Vector3<f64>; 2],
        appearance: &Appearance,
    ) {
        let polygon = self.view.polygon(corners);
        let light = (appearance.albedo * self.irradiance(&u.cross(&v))) as f32;
        if appearance.texture <= 0.0 {
            canvas.fill(&polygon, |_, _, row| row.fill(light));
            return;
        }
        let plane = self.view.plane(&corners[0], &u, &v);
        let strength = appearance.texture as f32;
        canvas.fill(&polygon, |y, x0, row| {
            self.textured_row(&plane, strength, (y, x0), row);
            row.iter_mut().for_each(|value| *value *= light);
        });
    }

    /// Draws a thing.
    pub(super) fn thing(&self, canvas: &mut Canvas, thing: &Thing) {
        let [along, across] = axes(thing);
        let middle = Point3::new(thing.x, thing.y, self.table);
        let half = 0.5 * thing.shape.height();
        let reach = thing.shape.footprint().hypot(half);
        if self.view.misses(&(middle + Vector3::z() * half), reach) {
            return;
        }
        let appearance = &thing.appearance;
        match thing.shape {
            Shape::Box {
                length,
                width,
                height,
            } => {
                let (l, w) = (along * (0.5 * length), across * (0.5 * width));
                let h = Vector3::z() * (0.5 * height);
                let (centre, eye) = (middle + h, self.view.eye());
                for (out, u, v) in [(l, w, h), (-l, -w, h), (w, -l, h), (-w, l, h), (h, l, w)] {
                    if (eye - (centre + out)).dot(&out) > 0.0 {
                        let corners = quad(centre + out, u, v);
                        self.face(canvas, &corners, [u.normalize(), v.normalize()], appearance);
                    }
                }
            }
            Shape::Cylinder { radius, height } => {
                let heights = [self.table, self.table + height];
                self.cylinder(canvas, middle.xy(), radius, heights, appearance);
            }
            Shape::Ball { radius } => {
                let centre = middle + Vector3::z() * radius;
                self.sphere(canvas, &centre, radius, appearance);
            }
            Shape::Disc { radius, inner } => {
                let albedo = appearance.albedo;
                let other = if albedo > 0.5 {
                    0.4 * albedo
                } else {
                    0.5 + 0.5 * albedo
                };
                for (radius, albedo) in [(radius, albedo), (inner, other)] {
                    if radius > 0.0 {
                        let ring: [Point3<f64>; 64] = std::array::from_fn(|i| {
                            let (s, c) = (i as f64 * std::f64::consts::TAU / 64.0).sin_cos();
                            middle + along * (radius * c) + across * (radius * s)
                        });
                        let appearance = Appearance {
                            albedo,
                            ..*appearance
                        };
                        self.face(canvas, &ring, [along, across], &appearance);
                    }
                }
            }
            Shape::Tape { length, width } | Shape::Print { length, width, .. } => {
                let corners = quad(middle, along * (0.5 * length), across * (0.5 * width));
                self.face(canvas, &corners, [along, across], appearance);
                if let Shape::Print { lines, .. } = thing.shape {
                    self.print(canvas, thing, (length, width), lines);
                }
            }
        }
    }

    /// Draws a strip right before the lens: too near to be sharp, so its edges are soft.
    pub(super) fn occluder(&self, canvas: &mut Canvas, strip: &Occluder) {
        let unit = self.view.unit;
        let pixel = |p: Point2<f64>| p.coords * unit + self.view.corner;
        let (from, to) = (pixel(strip.from), pixel(strip.to));
        let Some(along) = (to - from).try_normalize(1e-9) else {
            return;
        };
        let across = nalgebra::Vector2::new(-along.y, along.x);
        let light = strip.albedo * self.irradiance(&Vector3::z());
        // Several ever narrower layers make a soft edge: each adds its share of what is still
        // missing.
        const LAYERS: usize = 6;
        let soft = strip.softness.max(0.0) * unit;
        for k in 0..LAYERS {
            let inward = 0.5 - (k as f64 + 0.5) / LAYERS as f64;
            let half = across * (0.5 * strip.width * unit + soft * inward).max(0.0);
            let corners = [from - half, to - half, to + half, from + half].map(Point2::from);
            let share = 1.0 / (LAYERS - k) as f32;
            canvas.blend(&corners, light as f32, share);
        }
    }

    /// Words on a sheet: dark bars of the length of words, each with gaps and strokes like letters
    /// from afar.
    fn print(&self, canvas: &mut Canvas, thing: &Thing, (length, width): (f64, f64), lines: u32) {
        let [along, across] = axes(thing);
        let middle = Point3::new(thing.x, thing.y, self.table);
        let ink = Appearance::new(0.1, 0.0, 0.0);
        let pitch = 0.86 * width / f64::from(lines.max(1));
        let size = 0.55 * pitch;
        // No sheet at all, or print that no camera could show: not to be drawn stroke by stroke.
        let drawable = size > 0.0 && length / size <= 1000.0 && lines <= 1000;
        if !drawable {
            return;
        }
        // A fixed, scrambled sequence of letters, equal in every frame.
        let mut state =
            (thing.x.to_bits() ^ thing.y.to_bits()).wrapping_mul(0x2545_f491_4f6c_dd1d) | 1;
        let mut next = |n: u64| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 33) % n
        };
        for line in 0..lines {
            let y = 0.43 * width - (f64::from(line) + 0.5) * pitch;
            let mut x = -0.43 * length;
            let share = if line + 1 == lines { 0.1 } else { 0.43 };
            let end = share * length;
            while x < end {
                for _ in 0..2 + next(7) {
                    let kind = next(5);
                    let mut stroke = |x0: f64, y0: f64, w: f64, h: f64| {
                        let at = middle + along * (x + x0) + across * (y + y0);
                        let corners = quad(at, along * (0.5 * w), across * (0.5 * h));
                        self.face(canvas, &corners, [along, across], &ink);
                    };
                    let thick = 0.16 * size;
                    stroke(0.0, 0.0, thick, size);
                    if kind & 1 == 1 {
                        stroke(0.4 * size, 0.0, thick, 0.8 * size);
                    }
                    if kind > 1 {
                        let height = 0.3 * size * (kind as f64 - 3.0);
                        stroke(0.2 * size, height, 0.5 * size, thick);
                    }
                    x += 0.75 * size;
                    if x > end {
                        break;
                    }
                }
                x += 0.5 * size;
            }
        }
    }
}

/// Returns the directions of a thing's own x and y.
fn axes(thing: &Thing) -> [Vector3<f64>; 2] {
    let (sin, cos) = thing.turn.sin_cos();
    [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0)]
}

/// Returns the corners of a parallelogram with the middle `at`.
fn quad(at: Point3<f64>, u: Vector3<f64>, v: Vector3<f64>) -> [Point3<f64>; 4] {
    [at - u - v, at + u - v, at + u + v, at - u + v]
}

/// The convex hull of points in the plane, in order.
fn convex_hull(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    let mut hull: Vec<Point2<f64>> = Vec::with_capacity(points.len() + 1);
    let mut half = |points: &mut dyn Iterator<Item = Point2<f64>>| {
        let start = hull.len();
        for p in points {
            while hull.len() >= start + 2 {
                let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
                if (b - a).perp(&(p - a)) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    half(&mut points.iter().copied());
    half(&mut points.iter().rev().copied());
    hull
}
