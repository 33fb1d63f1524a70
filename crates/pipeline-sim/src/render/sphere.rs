//! Shaded balls.

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
        let k = c.norm_squared() - 1.0;
        let (cx, cy, cz, k) = (c.x as f32, c.y as f32, c.z as f32, k as f32);
        let step = (1.0 / self.view.focal) as f32;
        let up = self.view.turned(&Vector3::z()).cast::<f32>();
        let (sky, ground) = (
            (0.5 * self.scene.ambient.max(0.0)) as f32,
            (0.5 * self.bounce) as f32,
        );
        let albedo = appearance.albedo as f32;
        let gloss = appearance.gloss as f32;
        let lamps: Vec<(Vector3<f32>, Vector3<f32>, f32)> = self
            .lamps
            .iter()
            .map(|(toward, intensity)| {
                let axis = self.view.turned(toward);
                let half = (axis - c.normalize()).try_normalize(1e-9).unwrap_or(axis);
                (axis.cast(), half.cast(), *intensity as f32)
            })
            .collect();
        let origin = columns.start;
        for y in rows {
            let yn = ((y as f64 - self.view.principal.y) / self.view.focal) as f32;
            let first = ((origin as f64 - self.view.principal.x) / self.view.focal) as f32;
            let place = y * canvas.width + origin;
            Vectorized::widest(SphereRow {
                centre: [cx, cy, cz],
                k,
                yn,
                first,
                step,
                up,
                even: ground + sky,
                steep: sky - ground,
                lamps: &lamps,
                albedo,
                gloss,
                light: &mut canvas.light[place..place + columns.len()],
            });
        }
    }

    /// Returns rows and columns that a sphere of radius 1 may touch.
    fn sphere_bounds(
        &self,
        canvas: &Canvas,
        c: &Vector3<f64>,
    ) -> Option<(std::ops::Range<usize>, std::ops::Range<usize>)> {
        let k = c.z * c.z - 1.0;
        let range = |across: f64, principal: f64, limit: usize| {
            let half = (across * across + k).max(0.0).sqrt() / k;
            let middle = across * c.z / k;
            let (least, most) = (
                principal + (middle - half) * self.view.focal - 1.0,
                principal + (middle + half) * self.view.focal + 2.0,
            );
            (most > 0.0 && least < limit as f64)
                .then(|| least.max(0.0) as usize..(most.min(limit as f64).max(0.0)) as usize)
                .filter(|r| !r.is_empty())
        };
        Some((
            range(c.y, self.view.principal.y, canvas.height)?,
            range(c.x, self.view.principal.x, canvas.width)?,
        ))
    }
}

/// A row of a sphere of radius 1 in the camera frame.
struct SphereRow<'a> {
    centre: [f32; 3],
    /// Squared distance of the centre, less 1.
    k: f32,
    /// Tangents of the angle to the axis: down, and across at the first pixel and from one pixel to
    /// the next.
    yn: f32,
    first: f32,
    step: f32,
    /// Direction toward the zenith.
    up: Vector3<f32>,
    /// Light from sky and table on an upright surface, and its change with the tilt.
    even: f32,
    steep: f32,
    /// Direction toward each lamp, the half vector toward the camera, and its light.
    lamps: &'a [(Vector3<f32>, Vector3<f32>, f32)],
    albedo: f32,
    gloss: f32,
    light: &'a mut [f32],
}

impl Vectorized for SphereRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        /// Pixels per vector.
        const LANES: usize = 8;
        let [cx, cy, cz] = self.centre;
        let (yn, k, up) = (self.yn, self.k, self.up);
        // Divided by the reflectance, which multiplies all light below.
        let shine = self.gloss / self.albedo.max(0.05);
        for (chunk, light) in self.light.chunks_mut(LANES).enumerate() {
            let ahead = chunk * LANES;
            let mut share = [0.0_f32; LANES];
            let mut normal = [[0.0_f32; LANES]; 3];
            let mut value = [0.0_f32; LANES];
            for i in 0..LANES {
                let xn = self.first + (ahead + i) as f32 * self.step;
                let dd = 1.0 + xn * xn + yn * yn;
                let b = xn * cx + yn * cy + cz;
                let disc = b * b - dd * k;
                let t = (b - disc.max(0.0).sqrt()) / dd;
                normal[0][i] = t * xn - cx;
                normal[1][i] = t * yn - cy;
                normal[2][i] = t - cz;
                let tilt = normal[0][i] * up.x + normal[1][i] * up.y + normal[2][i] * up.z;
                value[i] = self.even + self.steep * tilt;
                // Distance to the outline in pixels: the discriminant over its gradient.
                let (gx, gy) = (
                    2.0 * (b * cx - xn * k) * self.step,
                    2.0 * (b * cy - yn * k) * self.step,
                );
                share[i] = (0.5 + disc / (gx * gx + gy * gy).max(1e-20).sqrt()).clamp(0.0, 1.0);
            }
            if share.iter().all(|share| *share <= 0.0) {
                continue;
            }
            for (axis, half, intensity) in self.lamps {
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
                *light += (self.albedo * value - *light) * share;
            }
        }
    }
}
