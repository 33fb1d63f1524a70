//! Shadows of ball and holder on the table, computed for every frame.

use nalgebra::Vector3;

use crate::cell::ball::{Ball, Holder};
use crate::render::scene::{Light, Scene};
use crate::render::shadow::{table_light, toward};

/// The soft shadows of ball and holder on the table.
#[derive(Clone, Debug)]
pub(super) struct BallShadow {
    lamps: Vec<Lamp>,
    ball: Ball,
    holder: Option<Holder>,
    table: f64,
}

#[derive(Clone, Debug)]
struct Lamp {
    /// Direction toward the lamp.
    axis: Vector3<f64>,
    /// Radius of its disc at unit distance.
    reach: f64,
    /// Fraction of the light on the table.
    share: f64,
    /// Box on the table that holds both shadows: least and greatest x, least and greatest y.
    bounds: [f32; 4],
}

impl BallShadow {
    pub(super) fn new(scene: &Scene, ball: &Ball, holder: Option<Holder>, table: f64) -> Self {
        let (_, shares) = table_light(scene);
        let lamp = |(light, share): (&Light, f64)| {
            let axis = toward(light);
            let (steep, reach) = (axis.z.max(0.05), light.half_angle.clamp(0.0, 0.7).tan());
            let drop = (ball.centre.z - table).max(0.0) / steep;
            let margin = ball.radius / steep + drop * reach * 1.5 / steep + 0.03;
            let tip = (ball.centre - axis * drop).xy();
            let foot = holder.map_or(tip, |h| h.foot);
            let (low, high) = (tip.inf(&foot), tip.sup(&foot));
            let bounds = [
                low.x - margin,
                high.x + margin,
                low.y - margin,
                high.y + margin,
            ];
            Lamp {
                axis,
                reach,
                share,
                bounds: bounds.map(|b| b as f32),
            }
        };
        let lamps = scene.lights.iter().zip(shares).map(lamp).collect();
        Self {
            lamps,
            ball: *ball,
            holder,
            table,
        }
    }

    /// Writes the factors on the table's light at places, metres; `spare` holds as many numbers.
    #[inline(always)]
    pub(super) fn at(&self, x: &[f32], y: &[f32], factors: &mut [f32], spare: &mut [f32]) {
        factors.fill(1.0);
        let (lesser, greater) = (
            |a, b| if b < a { b } else { a },
            |a, b| if b > a { b } else { a },
        );
        let least = |v: &[f32]| v.iter().copied().fold(f32::INFINITY, lesser);
        let most = |v: &[f32]| v.iter().copied().fold(f32::NEG_INFINITY, greater);
        let places = [least(x), most(x), least(y), most(y)];
        let apart = |b: &[f32; 4]| {
            places[1] <= b[0] || places[0] >= b[1] || places[3] <= b[2] || places[2] >= b[3]
        };
        for lamp in &self.lamps {
            if apart(&lamp.bounds) {
                continue;
            }
            spare.fill(0.0);
            self.behind_ball(lamp, x, y, spare);
            if let Some(holder) = &self.holder {
                self.behind_holder(lamp, holder, x, y, spare);
            }
            let [x0, x1, y0, y1] = lamp.bounds;
            let share = lamp.share as f32;
            for (((factor, hidden), x), y) in factors.iter_mut().zip(&*spare).zip(x).zip(y) {
                let inside = (*x > x0) & (*x < x1) & (*y > y0) & (*y < y1);
                *factor -= if inside { share * hidden } else { 0.0 };
            }
        }
        if let Some(h) = &self.holder {
            // The holder also hides part of the sky from the table near its foot.
            let (fx, fy, radius) = (h.foot.x as f32, h.foot.y as f32, h.radius as f32);
            if !apart(&[fx - NEAR, fx + NEAR, fy - NEAR, fy + NEAR]) {
                for ((factor, x), y) in factors.iter_mut().zip(x).zip(y) {
                    let (dx, dy) = (x - fx, y - fy);
                    let distance2 = dx * dx + dy * dy;
                    let gloom = 0.35 * fading((distance2.sqrt() - radius).max(0.0) * (1.0 / 0.012));
                    let near = distance2 < NEAR * NEAR;
                    *factor *= if near { 1.0 - gloom } else { 1.0 };
                }
            }
        }
        factors.iter_mut().for_each(|f| *f = f.max(0.02));
    }

    /// Raises `hidden` to the shares of a lamp that the ball hides.
    #[inline(always)]
    fn behind_ball(&self, lamp: &Lamp, x: &[f32], y: &[f32], hidden: &mut [f32]) {
        let [ax, ay, az] = [lamp.axis.x as f32, lamp.axis.y as f32, lamp.axis.z as f32];
        let (cx, cy) = (self.ball.centre.x as f32, self.ball.centre.y as f32);
        let dz = (self.ball.centre.z - self.table) as f32;
        let (radius, reach) = (self.ball.radius as f32, lamp.reach as f32);
        for ((hidden, x), y) in hidden.iter_mut().zip(x).zip(y) {
            let (dx, dy) = (cx - x, cy - y);
            let along = dx * ax + dy * ay + dz * az;
            let (u, v, w) = (dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax);
            *hidden = hidden.max(overlap(radius, along * reach, u * u + v * v + w * w));
        }
    }

    /// Raises `hidden` to the shares of a lamp that the holder hides.
    #[inline(always)]
    fn behind_holder(
        &self,
        lamp: &Lamp,
        holder: &Holder,
        x: &[f32],
        y: &[f32],
        hidden: &mut [f32],
    ) {
        let steep = lamp.axis.z.max(0.05);
        let (dx, dy) = ((lamp.axis.x / steep) as f32, (lamp.axis.y / steep) as f32);
        let slope2 = dx * dx + dy * dy;
        // Rays to a lamp right above come nearest to the axis at their foot.
        let inverse = if slope2 > 1e-9 { 1.0 / slope2 } else { 0.0 };
        let (fx, fy) = (holder.foot.x as f32, holder.foot.y as f32);
        let top = (holder.top - self.table).max(0.0) as f32;
        let (radius, reach) = (holder.radius as f32, lamp.reach as f32);
        for ((hidden, x), y) in hidden.iter_mut().zip(x).zip(y) {
            let (px, py) = (x - fx, y - fy);
            // Height at which the ray to the lamp passes the rod's axis most closely.
            let z = (-(px * dx + py * dy) * inverse).max(0.0).min(top);
            let (qx, qy) = (px + z * dx, py + z * dy);
            *hidden = hidden.max(overlap(radius, z * reach, qx * qx + qy * qy));
        }
    }
}

/// Distance from its axis within which the holder hides part of the sky, metres.
const NEAR: f32 = 0.1;

/// Returns the fraction of a lamp's disc of radius `lamp` hidden by a body of radius `body`,
/// `across2` being the squared distance between their middles.
#[inline(always)]
fn overlap(body: f32, lamp: f32, across2: f32) -> f32 {
    let lamp = lamp.max(1e-4);
    let t = ((body + lamp - across2.sqrt()) / (2.0 * lamp.min(body))).clamp(0.0, 1.0);
    let depth = (body / lamp).min(1.0);
    t * t * (3.0 - 2.0 * t) * depth * depth.sqrt()
}

/// Returns exp(-t) for t from 0 on, within 3e-5.
#[inline(always)]
fn fading(t: f32) -> f32 {
    // A sixteenth of the way by the first terms of the series, then to the 16th power.
    let x = t * (1.0 / 16.0);
    let part = 1.0 / (1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0))));
    let fourth = (part * part) * (part * part);
    (fourth * fourth) * (fourth * fourth)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Point3};

    use super::*;

    /// Factors along the x-axis, one for each millimetre.
    fn along_x(scene: &Scene, ball: &Ball, holder: Option<Holder>) -> Vec<f32> {
        let x: Vec<f32> = (0..200).map(|k| k as f32 * 0.001).collect();
        let (mut factors, mut spare) = (vec![0.0; 200], vec![0.0; 200]);
        BallShadow::new(scene, ball, holder, 0.0).at(&x, &[0.0; 200], &mut factors, &mut spare);
        factors
    }

    #[test]
    fn ball_under_a_lamp_throws_a_penumbra() {
        let lamp = Light {
            toward: Vector3::z(),
            intensity: 0.6,
            half_angle: 0.1_f64.atan(),
        };
        let scene = Scene {
            lights: vec![lamp],
            ambient: 0.4,
            ..Scene::plain()
        };
        // The lamp's disc has a radius of 10 mm at the ball, whose own is 30 mm.
        let ball = Ball {
            centre: Point3::new(0.0, 0.0, 0.1),
            radius: 0.03,
        };
        let factors = along_x(&scene, &ball, None);
        for (k, factor) in factors.iter().enumerate() {
            let expected = match k {
                0..20 => 0.4..0.401,
                30 => 0.69..0.71,
                41.. => 1.0..1.001,
                _ => 0.4..1.001,
            };
            assert!(expected.contains(&(factor + 1e-6)), "{k}: {factor}");
        }
        assert!(factors.is_sorted());
    }

    #[test]
    fn sky_is_darker_at_the_foot_of_the_holder() {
        let scene = Scene {
            lights: Vec::new(),
            ..Scene::plain()
        };
        let holder = Holder {
            foot: Point2::origin(),
            radius: 0.01,
            top: 0.1,
        };
        let ball = Ball {
            centre: Point3::new(0.0, 0.0, 0.13),
            radius: 0.03,
        };
        for (k, factor) in along_x(&scene, &ball, Some(holder)).iter().enumerate() {
            let beyond = (0.001 * k as f64 - 0.01).max(0.0);
            let exact = if k < 100 {
                1.0 - 0.35 * (-beyond / 0.012).exp()
            } else {
                1.0
            };
            assert!(
                (f64::from(*factor) - exact).abs() < 2e-5,
                "{k}: {factor} {exact}"
            );
        }
    }
}
