//! Shaded balls.

use std::ops::Range;

use hough_heuristic::Vectorized;
use nalgebra::{Point3, Vector3};

use crate::render::bodies::Studio;
use crate::render::canvas::Canvas;
use crate::render::scene::Appearance;

impl Studio<'_> {
    /// Draws a sphere.
    pub(super) fn sphere(
        &self,
        canvas: &mut Canvas,
        centre: &Point3<f64>,
        radius: f64,
        appearance: &Appearance,
    ) {
        // In units of the radius, camera frame.
        let c = self.view.seen(centre).coords / radius;
        if c.z <= 1.05 || c.norm_squared() <= 1.0 {
            return;
        }
        let Some((rows, columns)) = self.sphere_bounds(canvas, &c) else {
            return;
        };
        let (sky, ground) = (0.5 * self.scene.ambient.max(0.0), 0.5 * self.bounce);
        let (sky, ground) = (sky as f32, ground as f32);
        let lamp = |(toward, intensity): &(Vector3<f64>, f64)| {
            let axis = self.view.turned(toward);
            let half = (axis - c.normalize()).try_normalize(1e-9).unwrap_or(axis);
            (axis.cast(), half.cast(), *intensity as f32)
        };
        let view = self.view;
        let sphere = Sphere {
            centre: c.cast(),
            k: (c.norm_squared() - 1.0) as f32,
            first: ((columns.start as f64 - view.principal.x) / view.focal) as f32,
            step: (1.0 / view.focal) as f32,
            up: view.turned(&Vector3::z()).cast(),
            even: ground + sky,
            steep: sky - ground,
            lamps: self.lamps.iter().map(lamp).collect(),
            albedo: appearance.albedo as f32,
            gloss: appearance.gloss as f32,
        };
        for y in rows {
            let down = ((y as f64 - view.principal.y) / view.focal) as f32;
            let row = &mut canvas.light[y * canvas.width..][columns.clone()];
            SphereRow(&sphere, down, row).widest();
        }
    }

    /// Returns rows and columns that a sphere of radius 1 may touch.
    fn sphere_bounds(
        &self,
        canvas: &Canvas,
        c: &Vector3<f64>,
    ) -> Option<(Range<usize>, Range<usize>)> {
        let k = c.z * c.z - 1.0;
        let range = |across: f64, principal: f64, limit: usize| {
            let half = (across * across + k).max(0.0).sqrt() / k;
            let middle = across * c.z / k;
            let least = principal + (middle - half) * self.view.focal - 1.0;
            let most = principal + (middle + half) * self.view.focal + 2.0;
            let pixels = least.max(0.0) as usize..most.min(limit as f64).max(0.0) as usize;
            (most > 0.0 && least < limit as f64 && !pixels.is_empty()).then_some(pixels)
        };
        Some((
            range(c.y, self.view.principal.y, canvas.height)?,
            range(c.x, self.view.principal.x, canvas.width)?,
        ))
    }
}

/// A sphere of radius 1 in the camera frame.
struct Sphere {
    centre: Vector3<f32>,
    /// Squared distance of the centre, less 1.
    k: f32,
    /// Tangent of the angle to the axis across, at the first pixel and from one to the next.
    first: f32,
    step: f32,
    /// Direction toward the zenith.
    up: Vector3<f32>,
    /// Light from sky and table on an upright surface, and its change with the tilt.
    even: f32,
    steep: f32,
    /// Direction toward each lamp, the half vector toward the camera, and its light.
    lamps: Vec<(Vector3<f32>, Vector3<f32>, f32)>,
    albedo: f32,
    gloss: f32,
}

/// A sphere, the tangent of the angle to the axis down to a row, and the light of its pixels.
struct SphereRow<'a>(&'a Sphere, f32, &'a mut [f32]);

impl Vectorized for SphereRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        /// Pixels per vector.
        const LANES: usize = 8;
        let Self(sphere, yn, row) = self;
        let (c, k, up) = (sphere.centre, sphere.k, sphere.up);
        let (cx, cy, cz) = (c.x, c.y, c.z);
        // Divided by the reflectance, which multiplies all light below.
        let shine = sphere.gloss / sphere.albedo.max(0.05);
        for (chunk, light) in row.chunks_mut(LANES).enumerate() {
            let ahead = chunk * LANES;
            let mut share = [0.0_f32; LANES];
            let mut normal = [[0.0_f32; LANES]; 3];
            let mut value = [0.0_f32; LANES];
            for i in 0..LANES {
                let xn = sphere.first + (ahead + i) as f32 * sphere.step;
                let dd = 1.0 + xn * xn + yn * yn;
                let b = xn * cx + yn * cy + cz;
                let disc = b * b - dd * k;
                let t = (b - disc.max(0.0).sqrt()) / dd;
                normal[0][i] = t * xn - cx;
                normal[1][i] = t * yn - cy;
                normal[2][i] = t - cz;
                let tilt = normal[0][i] * up.x + normal[1][i] * up.y + normal[2][i] * up.z;
                value[i] = sphere.even + sphere.steep * tilt;
                // Distance to the outline in pixels: the discriminant over its gradient.
                let (gx, gy) = (
                    2.0 * (b * cx - xn * k) * sphere.step,
                    2.0 * (b * cy - yn * k) * sphere.step,
                );
                share[i] = (0.5 + disc / (gx * gx + gy * gy).max(1e-20).sqrt()).clamp(0.0, 1.0);
            }
            if share.iter().all(|share| *share <= 0.0) {
                continue;
            }
            for (axis, half, intensity) in &sphere.lamps {
                for i in 0..LANES {
                    let toward = |v: &Vector3<f32>| {
                        (normal[0][i] * v.x + normal[1][i] * v.y + normal[2][i] * v.z).max(0.0)
                    };
                    let (lit, h) = (toward(axis), toward(half));
                    let (h2, h4) = (h * h, h * h * h * h);
                    let h16 = h4 * h4 * h4 * h4;
                    let h64 = h16 * h16 * h16 * h16;
                    value[i] += intensity * lit + intensity * shine * (1.6 * h64 + 0.12 * h4 * h2);
                }
            }
            for ((light, value), share) in light.iter_mut().zip(&value).zip(&share) {
                *light += (sphere.albedo * value - *light) * share;
            }
        }
    }
}
