//! Random parts of a scene.

use nalgebra::{Point2, Vector2, Vector3};
use rand::{Rng, RngExt};

use crate::render::scene::{Appearance, Light, Occluder, Shape, Thing};

/// Draws one to three lamps. `steepest` is the tangent of the largest angle from the vertical.
pub(super) fn lamps(steepest: f64, rng: &mut dyn Rng) -> Vec<Light> {
    let count = rng.random_range(1..=3);
    let total = rng.random_range(0.65..0.95);
    (0..count)
        .map(|_| {
            let angle = rng.random_range(0.0..std::f64::consts::TAU);
            let slant = rng.random_range(0.1..steepest);
            Light {
                toward: Vector3::new(slant * f64::cos(angle), slant * f64::sin(angle), 1.0),
                intensity: total / f64::from(count),
                half_angle: rng.random_range(0.02..0.15),
            }
        })
        .collect()
}

/// Draws up to `count` things that do not overlap, all over the workspace.
pub(super) fn things(count: usize, tall: bool, rng: &mut dyn Rng) -> Vec<Thing> {
    let mut things: Vec<Thing> = Vec::with_capacity(count);
    for _ in 0..4 * count {
        if things.len() == count {
            break;
        }
        let shape = match rng.random_range(0..20) {
            0..5 => Shape::Box {
                length: rng.random_range(0.02..0.10),
                width: rng.random_range(0.02..0.06),
                height: rng.random_range(0.01..0.06),
            },
            5..9 => Shape::Cylinder {
                radius: rng.random_range(0.008..0.035),
                height: rng.random_range(if tall { 0.05..0.16 } else { 0.01..0.09 }),
            },
            9..13 => {
                let radius = rng.random_range(0.010..0.045);
                Shape::Disc {
                    radius,
                    inner: if rng.random_bool(0.6) {
                        radius * rng.random_range(0.3..0.85)
                    } else {
                        0.0
                    },
                }
            }
            13..16 => Shape::Ball {
                radius: rng.random_range(0.006..0.032),
            },
            16..18 => Shape::Print {
                length: rng.random_range(0.06..0.16),
                width: rng.random_range(0.05..0.16),
                lines: rng.random_range(4..14),
            },
            _ => Shape::Tape {
                length: rng.random_range(0.08..0.30),
                width: rng.random_range(0.01..0.03),
            },
        };
        let rho = rng.random_range(0.25_f64.powi(2)..1.15_f64.powi(2)).sqrt();
        let azimuth: f64 = rng.random_range(-1.5..1.5);
        let mut thing = placed(shape, (rho * azimuth.cos(), rho * azimuth.sin()), rng);
        thing.appearance.gloss = rng.random_range(0.0..0.3);
        let apart = |other: &Thing| {
            (thing.x - other.x).hypot(thing.y - other.y)
                > shape.footprint() + other.shape.footprint() + 0.002
        };
        if things.iter().all(apart) {
            things.push(thing);
        }
    }
    things
}

/// Draws the turn and the surface of a thing. Paper is white and even.
pub(super) fn placed(shape: Shape, (x, y): (f64, f64), rng: &mut dyn Rng) -> Thing {
    let turn = rng.random_range(0.0..std::f64::consts::TAU);
    let (albedo, texture) = if matches!(shape, Shape::Print { .. }) {
        (0.85, 0.0)
    } else {
        (rng.random_range(0.05..0.9), rng.random_range(0.0..0.5))
    };
    let appearance = Appearance::new(albedo, texture, 0.0);
    Thing {
        shape,
        x,
        y,
        turn,
        appearance,
    }
}

/// Draws one to three cables across the frame.
pub(super) fn cables(rng: &mut dyn Rng) -> Vec<Occluder> {
    (0..rng.random_range(1..=3))
        .map(|_| {
            let angle = rng.random_range(0.0..std::f64::consts::PI);
            let middle = Point2::new(rng.random_range(40.0..152.0), rng.random_range(30.0..114.0));
            let along = Vector2::new(f64::cos(angle), f64::sin(angle)) * 200.0;
            let width = rng.random_range(4.0..14.0);
            Occluder {
                from: middle - along,
                to: middle + along,
                width,
                softness: rng.random_range(1.0..0.6 * width),
                albedo: rng.random_range(0.03..0.5),
            }
        })
        .collect()
}
