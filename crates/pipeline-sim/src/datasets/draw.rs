//! Random scenes and snapshots by the parameters of a recipe.

use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Ball;
use crate::cell::camera::Camera;
use crate::cell::distortion::Distortion;
use crate::cell::geometry::Cell;
use crate::cell::workspace::Workspace;
use crate::datasets::snapshot::Snapshot;
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
    /// Function that changes the drawn scene.
    pub(super) change: fn(&mut Scene, &mut dyn Rng),
    /// A lens with barrel distortion.
    pub(super) barrel: bool,
    /// The ball out of sight.
    pub(super) empty: bool,
    /// The exposure, from a time drawn, of an arm that moves; `None` for one at rest.
    pub(super) shot: Option<fn(f64) -> Shot>,
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
            table: Appearance::new(
                rng.random_range(0.25..0.50),
                rng.random_range(0.35..0.7),
                0.0,
            ),
            ball: Appearance::new(
                rng.random_range(0.70..0.90),
                0.0,
                rng.random_range(0.05..0.4),
            ),
            sensor: Sensor {
                gamma: if rng.random_bool(0.3) { 2.2 } else { 1.0 },
                ..Sensor::default()
            },
            ..Scene::plain()
        };
        scene.things = things(self.things, self.tall, rng);
        (self.change)(&mut scene, rng);
        scene
    }

    /// Draws a random ball and a random pose of the arm on its way from a search pose to the ball.
    ///
    /// The radius of the ball in the image is log-uniform over the radii on such ways.
    pub(super) fn snapshot(
        &self,
        size: (u32, u32),
        rng: &mut dyn Rng,
    ) -> Result<Snapshot, QuantityError> {
        let workspace = Workspace::paper();
        let mut cell = Cell::paper(Ball::at(0.6, 0.1, -0.1));
        while self.barrel && cell.camera == Camera::paper() {
            let lens = Distortion {
                k1: rng.random_range(-0.35..-0.10),
                k2: rng.random_range(0.0..0.08),
                ..Distortion::default()
            };
            cell.camera = cell.camera.with_distortion(lens).unwrap_or(cell.camera);
        }
        let poses = workspace.search_poses();
        let joints = loop {
            let seen = workspace.sample_seen_ball(&cell, rng);
            let (ball, pose) = seen.unwrap_or((cell.ball, poses[0]));
            cell.place_ball(ball.centre);
            let Ok(goal) = cell.goal_pose(Cell::REACHING_JT5_DEGREES) else {
                continue;
            };
            let t: f64 = rng.random_range(0.0..1.0);
            let aside = [0.0; 6].map(|_: f64| rng.random_range(-4.0_f64..4.0).to_radians());
            let mut joints = Joints(std::array::from_fn(|i| {
                let wrist = i == 3 || i == 5;
                pose.0[i] + t * (goal.0[i] - pose.0[i]) + if wrist { 0.0 } else { aside[i] }
            }));
            if self.empty {
                // Turned away from the ball.
                joints.0[0] += if joints.0[0] > 0.0 { -0.9 } else { 0.9 };
            }
            let gone = || {
                let outline = cell.outline(&joints);
                outline.is_none_or(|o| o.share_inside(768, 576) == 0.0)
            };
            let seen = || cell.features(&joints).is_ok_and(|f| f.r > 6.0);
            let wanted = if self.empty { gone() } else { seen() };
            if wanted && cell.arm.check(&joints).is_ok() {
                break joints;
            }
        };
        let (mut speed, mut shot) = (JointDelta::default(), Shot::still());
        if let Some(exposed) = self.shot {
            // Image speeds of up to some hundred pixels a second.
            for speed in &mut speed.0[..3] {
                *speed = rng.random_range(-0.30..0.30);
            }
            shot = exposed(rng.random_range(0.005..0.015));
        }
        cell.camera = cell.camera.resized(size.0, size.1)?;
        Ok(Snapshot {
            cell,
            joints,
            speed,
            shot,
        })
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
        let Stage { cell, joints, .. } = stage;
        Ok((
            scene,
            Snapshot {
                cell,
                joints,
                speed,
                shot,
            },
        ))
    }

    /// Draws lamps, table, the ball's surface and the sensor.
    fn surfaces(&self, rng: &mut dyn Rng) -> Scene {
        let table = Appearance::new(rng.random_range(0.30..0.50), drawn(self.grain, rng), 0.0);
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
            sensor,
            ..Scene::plain()
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
