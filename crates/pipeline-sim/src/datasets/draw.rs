//! Random scenes and snapshots by the parameters of a recipe.

use rand::{Rng, RngExt};

use crate::cell::camera::Camera;
use crate::datasets::snapshot::{Snapshot, View};
use crate::datasets::stage::Stage;
use crate::datasets::things::{lamps, things};
use crate::error::QuantityError;
use crate::render::scene::{Appearance, Scene, Sensor};
use crate::render::shot::Shot;

/// The arm at work.
#[derive(Debug)]
pub(super) struct CellRecipe {
    /// Greatest number of things on the table.
    pub(super) things: usize,
    /// Taller cylinders.
    pub(super) tall: bool,
    /// Change of the scene.
    pub(super) change: fn(&mut Scene, &mut dyn Rng),
    pub(super) view: View,
}

/// Balls on a table under the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct BenchmarkRecipe {
    pub(super) balls: usize,
    /// Least and greatest radius of the balls, pixels of a frame of 768x576.
    pub(super) radii: (f64, f64),
    /// Number of things with straight edges.
    pub(super) distractors: usize,
    /// Range of the grain of the table.
    pub(super) grain: (f64, f64),
    /// Reflectance of the first ball, from that of the table.
    pub(super) albedo: fn(f64, &mut dyn Rng) -> f64,
    /// Range of the noise, gray levels; `None` for the sensor's own.
    pub(super) noise: Option<(f64, f64)>,
    /// Fraction of the first ball's outline that is hidden.
    pub(super) hidden: f64,
    /// Range of the motion during the exposure, pixels of 768.
    pub(super) motion: Option<(f64, f64)>,
}

impl CellRecipe {
    /// Draws a scene: lamps, table, ball's surface, things all over the workspace.
    pub(super) fn scene(&self, rng: &mut dyn Rng) -> Scene {
        let mut scene = Scene {
            lights: lamps(1.1, rng),
            ambient: rng.random_range(0.15..0.30),
            table: Appearance {
                albedo: rng.random_range(0.25..0.50),
                texture: rng.random_range(0.35..0.7),
                gloss: 0.0,
            },
            ball: Appearance {
                albedo: rng.random_range(0.70..0.90),
                texture: 0.0,
                gloss: rng.random_range(0.05..0.4),
            },
            things: Vec::new(),
            occluders: Vec::new(),
            sensor: Sensor {
                gamma: if rng.random_bool(0.3) { 2.2 } else { 1.0 },
                ..Sensor::default()
            },
        };
        scene.things = things(self.things, self.tall, rng);
        (self.change)(&mut scene, rng);
        scene
    }
}

impl BenchmarkRecipe {
    pub(super) fn draw(
        &self,
        size: (u32, u32),
        rng: &mut dyn Rng,
    ) -> Result<(Scene, Snapshot), QuantityError> {
        let mut stage = Stage::new(Camera::paper().resized(size.0, size.1)?, rng);
        stage.put_balls(self.balls, self.radii, rng);
        let mut scene = self.surfaces(rng);
        scene.things = stage.other_balls(scene.table.albedo, rng);
        stage.put_distractors(self.distractors, &mut scene.things, rng);
        if self.hidden > 0.0 {
            scene.occluders.extend(stage.cover(self.hidden, rng));
        }
        let (mut speed, mut shot) = (Default::default(), Shot::still());
        if let Some((least, most)) = self.motion {
            shot = Shot {
                exposure: 0.010,
                moments: 8,
                interlace: None,
            };
            speed = stage.speed(rng.random_range(least..most), shot.exposure, rng);
        }
        let snapshot = Snapshot {
            cell: stage.cell,
            joints: stage.joints,
            speed,
            shot,
        };
        Ok((scene, snapshot))
    }

    /// Draws lamps, table, the ball's surface and the sensor.
    fn surfaces(&self, rng: &mut dyn Rng) -> Scene {
        let table = Appearance {
            albedo: rng.random_range(0.30..0.50),
            texture: drawn(self.grain, rng),
            gloss: 0.0,
        };
        let albedo = (self.albedo)(table.albedo, rng);
        let mut sensor = Sensor::default();
        if let Some(noise) = self.noise {
            (sensor.read_noise, sensor.shot_noise) = (drawn(noise, rng), 0.0);
        }
        Scene {
            lights: lamps(0.6, rng),
            ambient: rng.random_range(0.20..0.30),
            table,
            ball: Appearance {
                albedo,
                texture: 0.0,
                gloss: rng.random_range(0.05..0.3),
            },
            things: Vec::new(),
            occluders: Vec::new(),
            sensor,
        }
    }
}

/// Draws from a range; one without width draws nothing.
fn drawn((least, most): (f64, f64), rng: &mut dyn Rng) -> f64 {
    if least < most {
        rng.random_range(least..most)
    } else {
        least
    }
}
