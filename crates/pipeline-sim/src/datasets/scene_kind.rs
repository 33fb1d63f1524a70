//! Scenes and snapshots by kind of difficulty, drawn from a seed.

use std::fmt;
use std::str::FromStr;

use hough_heuristic::Features;
use hough_heuristic::image::GrayImage;
use nalgebra::{Point2, Vector3};
use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Ball;
use crate::cell::camera::Camera;
use crate::cell::distortion::Distortion;
use crate::cell::errors::UnknownName;
use crate::cell::geometry::Cell;
use crate::cell::workspace::Workspace;
use crate::error::CameraError;
use crate::render::renderer::Renderer;
use crate::render::scene::{Light, Look, Occluder, Scene, Sensor, Shape, Thing};
use crate::render::shot::Shot;
use crate::render::truth::Sighting;

/// What makes a frame difficult.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SceneKind {
    /// A light ball over a bare, slightly textured table.
    Plain,
    /// A wooden table with some things on it.
    Things,
    /// A strongly grained table crowded with things, print and other balls.
    Clutter,
    /// As `Things`, with cables before the lens and tall things beside the ball.
    Occluded,
    /// As `Things`, in little light with high gain.
    Noise,
    /// As `Things`, with a dark ball and a dull lamp: little contrast, and of changing sign.
    Dark,
    /// As `Things`, with a ball as bright as the table and a lamp from the side.
    Camouflage,
    /// As `Things`, out of focus.
    Defocus,
    /// As `Things`, with the arm in motion while the shutter is open.
    Motion,
    /// As `Motion`, in two fields 20 ms apart.
    Interlaced,
    /// As `Things`, through a lens with barrel distortion.
    Distorted,
    /// As `Clutter`, without the ball: nothing in the frame is to be found but what is truly round.
    Empty,
}

impl SceneKind {
    /// All kinds.
    pub const ALL: [Self; 12] = [
        Self::Plain,
        Self::Things,
        Self::Clutter,
        Self::Occluded,
        Self::Noise,
        Self::Dark,
        Self::Camouflage,
        Self::Defocus,
        Self::Motion,
        Self::Interlaced,
        Self::Distorted,
        Self::Empty,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Things => "things",
            Self::Clutter => "clutter",
            Self::Occluded => "occluded",
            Self::Noise => "noise",
            Self::Dark => "dark",
            Self::Camouflage => "camouflage",
            Self::Defocus => "defocus",
            Self::Motion => "motion",
            Self::Interlaced => "interlaced",
            Self::Distorted => "distorted",
            Self::Empty => "empty",
        }
    }
}

impl fmt::Display for SceneKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for SceneKind {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = "plain, things, clutter, occluded, noise, dark, camouflage, defocus, motion, interlaced, distorted, empty";
        Self::ALL
            .into_iter()
            .find(|k| k.name() == name)
            .ok_or_else(|| UnknownName {
                name: name.to_owned(),
                known,
            })
    }
}

impl Scene {
    /// A random scene of a kind: lamps, table, ball's surface, things all over the workspace.
    pub fn generate<R: Rng + ?Sized>(kind: SceneKind, rng: &mut R) -> Self {
        let mut scene = Self {
            lights: lamps(1.1, rng),
            ambient: rng.random_range(0.15..0.30),
            table: Look {
                albedo: rng.random_range(0.25..0.50),
                texture: rng.random_range(0.35..0.7),
                gloss: 0.0,
            },
            ball: Look {
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
        let crowd = match kind {
            SceneKind::Plain => 0,
            SceneKind::Clutter | SceneKind::Empty => 170,
            _ => 70,
        };
        scene.things = things(crowd, kind == SceneKind::Occluded, rng);
        match kind {
            SceneKind::Plain => scene.table.texture = 0.15,
            SceneKind::Clutter | SceneKind::Empty => {
                scene.table.texture = rng.random_range(0.7..1.0)
            }
            SceneKind::Occluded => scene.occluders = cables(rng),
            SceneKind::Noise => {
                scene.sensor.exposure = rng.random_range(0.35..0.6);
                scene.sensor.read_noise = rng.random_range(6.0..14.0);
                scene.sensor.shot_noise = rng.random_range(8.0..16.0);
            }
            SceneKind::Dark => {
                scene.ball.albedo = rng.random_range(0.04..0.14);
                scene.ball.gloss = rng.random_range(0.0..0.15);
                scene.sensor.exposure = rng.random_range(0.6..0.9);
            }
            SceneKind::Camouflage => {
                scene.ball.albedo = scene.table.albedo * rng.random_range(0.85..1.15);
                scene.ball.gloss = rng.random_range(0.0..0.1);
                let angle = rng.random_range(0.0..std::f64::consts::TAU);
                scene.lights.truncate(1);
                scene.lights[0].toward = Vector3::new(1.6 * angle.cos(), 1.6 * angle.sin(), 1.0);
            }
            SceneKind::Defocus => scene.sensor.defocus = rng.random_range(1.0..3.5),
            SceneKind::Things
            | SceneKind::Motion
            | SceneKind::Interlaced
            | SceneKind::Distorted => {}
        }
        scene
    }
}

/// One to three lamps, at most `steepest` (tangent) off the vertical.
pub(crate) fn lamps<R: Rng + ?Sized>(steepest: f64, rng: &mut R) -> Vec<Light> {
    let count = rng.random_range(1..=3);
    let total = rng.random_range(0.65..0.95);
    (0..count)
        .map(|_| {
            let (angle, slant) = (
                rng.random_range(0.0..std::f64::consts::TAU),
                rng.random_range(0.1..steepest),
            );
            Light {
                toward: Vector3::new(slant * f64::cos(angle), slant * f64::sin(angle), 1.0),
                intensity: total / f64::from(count),
                half_angle: rng.random_range(0.02..0.15),
            }
        })
        .collect()
}

/// Up to `count` things that do not overlap, all over the workspace.
fn things<R: Rng + ?Sized>(count: usize, tall: bool, rng: &mut R) -> Vec<Thing> {
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
                height: if tall {
                    rng.random_range(0.05..0.16)
                } else {
                    rng.random_range(0.01..0.09)
                },
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
        let (rho, azimuth) = (
            rng.random_range(0.25_f64.powi(2)..1.15_f64.powi(2)).sqrt(),
            rng.random_range(-1.5..1.5),
        );
        let thing = Thing {
            shape,
            x: rho * f64::cos(azimuth),
            y: rho * f64::sin(azimuth),
            turn: rng.random_range(0.0..std::f64::consts::TAU),
            look: Look {
                albedo: if matches!(shape, Shape::Print { .. }) {
                    0.85
                } else {
                    rng.random_range(0.05..0.9)
                },
                texture: if matches!(shape, Shape::Print { .. }) {
                    0.0
                } else {
                    rng.random_range(0.0..0.5)
                },
                gloss: rng.random_range(0.0..0.3),
            },
        };
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

/// One to three cables across the frame.
fn cables<R: Rng + ?Sized>(rng: &mut R) -> Vec<Occluder> {
    (0..rng.random_range(1..=3))
        .map(|_| {
            let angle = rng.random_range(0.0..std::f64::consts::PI);
            let middle = Point2::new(rng.random_range(40.0..152.0), rng.random_range(30.0..114.0));
            let along = nalgebra::Vector2::new(f64::cos(angle), f64::sin(angle)) * 200.0;
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

/// One frame to be taken: the cell, the arm, and how both move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// The cell.
    pub cell: Cell,
    /// Where the joints are when the shutter opens.
    pub joints: Joints,
    /// How fast they turn, radians per second.
    pub speed: JointDelta,
    /// How the frame is taken.
    pub shot: Shot,
}

impl Snapshot {
    /// A random ball and a random pose of the arm on its way from a search pose to the ball, such
    /// that the ball is in sight (out of sight for [`SceneKind::Empty`]), with the lens, the motion
    /// and the shot that belong to the kind.
    ///
    /// The radius of the ball in the image is spread evenly, on a logarithmic scale, over what such
    /// ways offer.
    pub fn draw<R: Rng + ?Sized>(kind: SceneKind, rng: &mut R) -> Self {
        let workspace = Workspace::paper();
        let mut cell = Cell::paper(Ball::at(0.6, 0.1, -0.1));
        if kind == SceneKind::Distorted {
            // None of these folds the image; one that did would be drawn anew.
            cell.camera = loop {
                let k1 = rng.random_range(-0.35..-0.10);
                let lens = Distortion {
                    k1,
                    k2: rng.random_range(0.0..0.08),
                    ..Distortion::default()
                };
                if let Ok(camera) = Camera::paper().with_distortion(lens) {
                    break camera;
                }
            };
        }
        let poses = workspace.search_poses();
        loop {
            let (ball, pose) = workspace
                .sample_seen_ball(&cell, rng)
                .unwrap_or((cell.ball, poses[0]));
            cell.place_ball(ball.centre);
            let Some(goal) = cell.goal_pose(Cell::REACHING_JT5_DEGREES) else {
                continue;
            };
            let t: f64 = rng.random_range(0.0..1.0);
            let aside = [0.0; 6].map(|_: f64| rng.random_range(-4.0_f64..4.0).to_radians());
            let mut joints = Joints(std::array::from_fn(|i| {
                let wrist = i == 3 || i == 5;
                pose.0[i] + t * (goal.0[i] - pose.0[i]) + if wrist { 0.0 } else { aside[i] }
            }));
            if kind == SceneKind::Empty {
                // The arm looks elsewhere, where things are but not the ball.
                joints.0[0] += if joints.0[0] > 0.0 { -0.9 } else { 0.9 };
            }
            let seen = cell.features(&joints).is_some_and(|f| f.r > 6.0);
            let gone = cell
                .outline(&joints)
                .is_none_or(|o| o.share_inside(768, 576) == 0.0);
            if cell.params.check(&joints).is_err()
                || !(if kind == SceneKind::Empty { gone } else { seen })
            {
                continue;
            }
            let mut speed = JointDelta::default();
            let shot = match kind {
                SceneKind::Motion | SceneKind::Interlaced => {
                    // Image speeds of up to some hundred pixels a second.
                    for i in 0..3 {
                        speed.0[i] = rng.random_range(-0.30..0.30);
                    }
                    let exposure = rng.random_range(0.005..0.015);
                    if kind == SceneKind::Motion {
                        Shot {
                            exposure: 1.5 * exposure,
                            moments: 6,
                            interlace: None,
                        }
                    } else {
                        Shot::pal(exposure, 3)
                    }
                }
                _ => Shot::still(),
            };
            return Self {
                cell,
                joints,
                speed,
                shot,
            };
        }
    }

    /// Cell and joints `seconds` after the shutter opened.
    pub fn moment(&self, seconds: f64) -> (Cell, Joints) {
        (
            self.cell,
            self.joints + JointDelta(self.speed.0.map(|v| v * seconds)),
        )
    }

    /// The same moment, taken with [`Camera::resized`].
    ///
    /// # Errors
    /// As for [`Camera::resized`].
    pub fn resized(mut self, width: u32, height: u32) -> Result<Self, CameraError> {
        self.cell.camera = self.cell.camera.resized(width, height)?;
        Ok(self)
    }

    /// Takes the frame.
    pub fn take<'a>(&self, renderer: &'a mut Renderer) -> &'a GrayImage {
        renderer.take(&self.shot, |seconds| self.moment(seconds))
    }

    /// The round outlines that the frame shows ([`Renderer::truth`]), in the middle of its
    /// exposure.
    pub fn truth(&self, renderer: &Renderer) -> Vec<Sighting> {
        let (cell, joints) = self.middle();
        renderer.truth(&cell, &joints)
    }

    /// The ball's features in the middle of the exposure; `None` if it counts as lost.
    pub fn features(&self) -> Option<Features> {
        let (cell, joints) = self.middle();
        cell.features(&joints)
    }

    fn middle(&self) -> (Cell, Joints) {
        self.moment(0.5 * (self.shot.exposure + self.shot.interlace.unwrap_or(0.0)))
    }
}
