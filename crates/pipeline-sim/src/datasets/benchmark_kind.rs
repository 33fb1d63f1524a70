//! Frames to compare circle detectors on: one difficulty at a time, and balls whose size in the
//! frame is known beforehand.

use std::fmt;
use std::str::FromStr;

use hough_heuristic::Circle;
use nalgebra::{Point2, Point3};
use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Ball;
use crate::cell::camera::Camera;
use crate::cell::errors::UnknownName;
use crate::cell::geometry::Cell;
use crate::cell::workspace::Workspace;
use crate::datasets::scene_kind::Snapshot;
use crate::datasets::scene_kind::lamps;
use crate::error::CameraError;
use crate::render::scene::{Look, Occluder, Scene, Sensor, Shape, Thing};
use crate::render::shot::Shot;

/// One difficulty for a circle detector.
///
/// The camera looks down on balls that lie on a table. Unless said otherwise there is one, lighter
/// than the table, wholly in the frame, and its radius is spread evenly, on a logarithmic scale,
/// over 12..145 pixels of a frame of 768x576; in other frames it scales ([`Camera::resized`]). What
/// is no ball has straight edges only. Deviations of noise are those of the grey levels before they
/// are cut off at 0 and 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum BenchmarkKind {
    /// A ball on a bare table.
    Clean,
    /// With five boxes, tapes and sheets of print beside it.
    Distractors,
    /// 40 % of its outline hidden by a straight edge.
    Occluded40,
    /// Noise of 10 grey levels.
    Noise10,
    /// Noise of 25 grey levels.
    Noise25,
    /// Noise of 40 grey levels.
    Noise40,
    /// Twenty balls, of 12..60 pixels.
    Many,
    /// Motion of 4 to 12 pixels (of 768) during the exposure.
    MotionBlur,
    /// A ball darker than the table.
    DarkBall,
    /// No ball, five things with straight edges.
    EmptyTable,
    /// No ball, five things with straight edges, and noise of 10 to 40 grey levels.
    NoisyEmpty,
    /// With five distractors and noise of 10 grey levels.
    DistractorsNoise10,
    /// With five distractors and noise of 25 grey levels.
    DistractorsNoise25,
    /// Four balls of any brightness that is not quite the table's, on strong grain among forty
    /// boxes, tapes and sheets of print.
    Textured,
}

/// Radii of the balls, pixels of a frame of 768x576.
const RADII: (f64, f64) = (12.0, 145.0);
/// Radii where there are many.
const SMALL_RADII: (f64, f64) = (12.0, 60.0);

impl BenchmarkKind {
    /// All kinds.
    pub const ALL: [Self; 14] = [
        Self::Clean,
        Self::Distractors,
        Self::Occluded40,
        Self::Noise10,
        Self::Noise25,
        Self::Noise40,
        Self::Many,
        Self::MotionBlur,
        Self::DarkBall,
        Self::EmptyTable,
        Self::NoisyEmpty,
        Self::DistractorsNoise10,
        Self::DistractorsNoise25,
        Self::Textured,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Distractors => "distractors",
            Self::Occluded40 => "occluded-40",
            Self::Noise10 => "noise-10",
            Self::Noise25 => "noise-25",
            Self::Noise40 => "noise-40",
            Self::Many => "many",
            Self::MotionBlur => "motion-blur",
            Self::DarkBall => "dark-ball",
            Self::EmptyTable => "empty-table",
            Self::NoisyEmpty => "noisy-empty",
            Self::DistractorsNoise10 => "distractors-noise-10",
            Self::DistractorsNoise25 => "distractors-noise-25",
            Self::Textured => "textured",
        }
    }

    /// How many balls a frame shows.
    pub fn balls(self) -> usize {
        match self {
            Self::EmptyTable | Self::NoisyEmpty => 0,
            Self::Many => 20,
            Self::Textured => 4,
            _ => 1,
        }
    }

    /// How many things with straight edges there are.
    fn distractors(self) -> usize {
        match self {
            Self::Distractors
            | Self::EmptyTable
            | Self::NoisyEmpty
            | Self::DistractorsNoise10
            | Self::DistractorsNoise25 => 5,
            Self::Textured => 40,
            _ => 0,
        }
    }

    /// A scene of this kind and the frame to be taken of it, `size` pixels wide and high.
    ///
    /// # Errors
    /// [`CameraError::NotPositive`] for a frame without pixels.
    pub fn draw<R: Rng + ?Sized>(
        self,
        size: (u32, u32),
        rng: &mut R,
    ) -> Result<(Scene, Snapshot), CameraError> {
        let mut stage = Stage::new(Camera::paper().resized(size.0, size.1)?, rng);
        let radii = if self == Self::Many {
            SMALL_RADII
        } else {
            RADII
        };
        stage.put_balls(self.balls(), radii, rng);
        let mut scene = self.surfaces(rng);
        scene.things = stage.other_balls(scene.table.albedo, rng);
        stage.put_distractors(self.distractors(), &mut scene.things, rng);
        let (mut speed, mut shot) = (JointDelta::default(), Shot::still());
        match self {
            Self::Occluded40 => scene.occluders.extend(stage.cover(0.4, rng)),
            Self::MotionBlur => {
                shot = Shot {
                    exposure: 0.010,
                    moments: 8,
                    interlace: None,
                };
                speed = stage.speed(rng.random_range(4.0..12.0), shot.exposure, rng);
            }
            _ => {}
        }
        let Stage { cell, joints, .. } = stage;
        let snapshot = Snapshot {
            cell,
            joints,
            speed,
            shot,
        };
        Ok((scene, snapshot))
    }

    /// Lamps, table, the ball's surface and the sensor.
    fn surfaces<R: Rng + ?Sized>(self, rng: &mut R) -> Scene {
        let table = Look {
            albedo: rng.random_range(0.30..0.50),
            texture: if self == Self::Textured {
                rng.random_range(0.8..1.0)
            } else {
                0.15
            },
            gloss: 0.0,
        };
        let albedo = match self {
            Self::DarkBall => rng.random_range(0.03..0.12),
            Self::Textured => other_than(table.albedo, rng),
            _ => rng.random_range(0.70..0.90),
        };
        let noise = match self {
            Self::Noise10 | Self::DistractorsNoise10 => Some(10.0),
            Self::Noise25 | Self::DistractorsNoise25 => Some(25.0),
            Self::Noise40 => Some(40.0),
            Self::NoisyEmpty => Some(rng.random_range(10.0..40.0)),
            _ => None,
        };
        let sensor = Sensor::default();
        Scene {
            lights: lamps(0.6, rng),
            ambient: rng.random_range(0.20..0.30),
            table,
            ball: Look {
                albedo,
                texture: 0.0,
                gloss: rng.random_range(0.05..0.3),
            },
            things: Vec::new(),
            occluders: Vec::new(),
            sensor: noise.map_or(sensor, |read_noise| Sensor {
                read_noise,
                shot_noise: 0.0,
                ..sensor
            }),
        }
    }
}

impl fmt::Display for BenchmarkKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for BenchmarkKind {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = "clean, distractors, occluded-40, noise-10, noise-25, noise-40, many, motion-blur, dark-ball, empty-table, \
                     noisy-empty, distractors-noise-10, distractors-noise-25, textured";
        let mut kinds = Self::ALL.into_iter();
        kinds.find(|k| k.name() == name).ok_or_else(|| UnknownName {
            name: name.to_owned(),
            known,
        })
    }
}

/// A reflectance that differs from `albedo` by a quarter of it at least.
fn other_than<R: Rng + ?Sized>(albedo: f64, rng: &mut R) -> f64 {
    if rng.random_bool(0.4) {
        rng.random_range(0.05..0.75 * albedo)
    } else {
        rng.random_range(1.25 * albedo..0.9)
    }
}

/// The camera over the table, and what has been put into its view.
struct Stage {
    cell: Cell,
    joints: Joints,
    /// Pixels for each pixel of a frame of 768x576.
    scale: f64,
    /// The balls in the image, and in the world.
    balls: Vec<(Circle, Ball)>,
}

impl Stage {
    /// An empty table under a camera that looks nearly straight down.
    fn new<R: Rng + ?Sized>(camera: Camera, rng: &mut R) -> Self {
        // The ball that no frame shows lies behind the arm.
        let mut cell = Cell::paper(Ball::at(-0.40, 0.0, -0.28));
        cell.camera = camera;
        cell.holder = None;
        let above = Workspace {
            height: (0.0, 0.05),
            ..Workspace::paper()
        };
        let joints = loop {
            // The pose is drawn as for the paper's frame: one of another shape shows that and more.
            let over = Cell {
                ball: above.sample_ball(rng),
                camera: Camera::paper(),
                ..cell
            };
            let aside = [0.0; 6].map(|_: f64| rng.random_range(-4.0_f64..4.0).to_radians());
            let turn = rng.random_range(-1.0..1.0);
            if let Some(mut pose) = over.goal_pose(Cell::REACHING_JT5_DEGREES) {
                pose.0
                    .iter_mut()
                    .zip(aside)
                    .for_each(|(angle, by)| *angle += by);
                pose.0[5] = turn;
                break pose;
            }
        };
        Self {
            cell,
            joints,
            scale: camera.focal_px() / Camera::paper().focal_px(),
            balls: Vec::new(),
        }
    }

    /// Puts up to `count` balls on the table, clear of each other and of the frame's border; the
    /// first is the one to be grasped.
    fn put_balls<R: Rng + ?Sized>(&mut self, count: usize, (least, most): (f64, f64), rng: &mut R) {
        let (width, height) = self.cell.camera.size();
        let (width, height) = (f64::from(width), f64::from(height));
        const TRIES: u32 = 4000;
        for attempt in 0..TRIES {
            if self.balls.len() == count {
                break;
            }
            // Many cannot all be large: the longer the search, the smaller they are.
            let most = least + (most - least) * (1.0 - f64::from(attempt) / f64::from(TRIES));
            let radius = self.scale * least * (most / least).powf(rng.random_range(0.0..1.0));
            let margin = radius + 10.0 * self.scale;
            let mut place = |extent: f64| {
                let border = margin.min(0.5 * extent);
                rng.random_range(border..=extent - border) - 0.5
            };
            let circle = Circle {
                x: place(width),
                y: place(height),
                radius,
            };
            let apart = |(other, _): &(Circle, Ball)| {
                (circle.x - other.x).hypot(circle.y - other.y)
                    > 1.15 * (circle.radius + other.radius) + 4.0 * self.scale
            };
            if self.balls.iter().all(apart)
                && let Some(ball) = self.lying(&circle)
            {
                self.balls.push((circle, ball));
            }
        }
        if let Some((_, first)) = self.balls.first() {
            self.cell.ball = *first;
        }
    }

    /// The ball on the table that shows as `circle`.
    fn lying(&self, circle: &Circle) -> Option<Ball> {
        // Balls that show as one circle lie on one ray, farther away the larger they are.
        let unit = self.cell.camera.sphere_of_circle(circle, 1.0)?;
        let pose = self.cell.camera_pose(&self.joints);
        let (eye, direction) = (pose.translation.vector, pose.rotation * unit.coords);
        let radius = (eye.z - self.cell.table) / (1.0 - direction.z);
        (radius > 0.0).then(|| Ball {
            centre: Point3::from(eye + direction * radius),
            radius,
        })
    }

    /// All balls but the first, as things.
    fn other_balls<R: Rng + ?Sized>(&self, table_albedo: f64, rng: &mut R) -> Vec<Thing> {
        let others = self.balls.iter().skip(1);
        others
            .map(|(_, ball)| Thing {
                shape: Shape::Ball {
                    radius: ball.radius,
                },
                x: ball.centre.x,
                y: ball.centre.y,
                turn: 0.0,
                look: Look {
                    albedo: other_than(table_albedo, rng),
                    texture: 0.0,
                    gloss: rng.random_range(0.05..0.3),
                },
            })
            .collect()
    }

    /// Puts `count` things with straight edges beside what is there.
    fn put_distractors<R: Rng + ?Sized>(&self, count: usize, things: &mut Vec<Thing>, rng: &mut R) {
        let (width, height) = self.cell.camera.size();
        let pose = self.cell.camera_pose(&self.joints);
        let eye = pose.translation.vector;
        let wanted = things.len() + count;
        for attempt in 0..400 * count {
            if things.len() == wanted {
                break;
            }
            let pixel = Point2::new(
                rng.random_range(0.0..f64::from(width)),
                rng.random_range(0.0..f64::from(height)),
            );
            let ray = pose.rotation * self.cell.camera.ray(pixel);
            let depth = (self.cell.table - eye.z) / ray.z;
            // Metres on the table for a pixel of a frame of 768x576; where there is little room,
            // things get smaller.
            let pixel_size = depth / Camera::paper().focal_px();
            let shrink = 1.0 - 0.8 * attempt as f64 / (400 * count) as f64;
            let mut size =
                |least: f64, most: f64| pixel_size * shrink * rng.random_range(least..most);
            let (long, wide, high) = (size(40.0, 200.0), size(25.0, 100.0), size(4.0, 40.0));
            let shape = match rng.random_range(0..4) {
                0 | 1 => Shape::Box {
                    length: long,
                    width: wide,
                    height: high,
                },
                2 => Shape::Tape {
                    length: 1.5 * long,
                    width: 0.4 * wide,
                },
                _ => Shape::Print {
                    length: long,
                    width: long.min(2.0 * wide),
                    lines: rng.random_range(4..14),
                },
            };
            let place = eye + ray * depth;
            let paper = matches!(shape, Shape::Print { .. });
            let thing = Thing {
                shape,
                x: place.x,
                y: place.y,
                turn: rng.random_range(0.0..std::f64::consts::TAU),
                look: Look {
                    albedo: if paper {
                        0.85
                    } else {
                        rng.random_range(0.05..0.9)
                    },
                    texture: if paper {
                        0.0
                    } else {
                        rng.random_range(0.0..0.5)
                    },
                    gloss: 0.0,
                },
            };
            let clear = |x: f64, y: f64, radius: f64| {
                (thing.x - x).hypot(thing.y - y) > thing.shape.footprint() + 1.1 * radius
            };
            if self
                .balls
                .iter()
                .all(|(_, b)| clear(b.centre.x, b.centre.y, b.radius))
                && things.iter().all(|t| clear(t.x, t.y, t.shape.footprint()))
            {
                things.push(thing);
            }
        }
    }

    /// A strip before the first ball that hides `share` of its outline.
    fn cover<R: Rng + ?Sized>(&self, share: f64, rng: &mut R) -> Option<Occluder> {
        let (circle, _) = self.balls.first()?;
        let unit = f64::from(self.cell.camera.size().0) / hough_heuristic::Features::WIDTH;
        let (x, y, r) = (
            (circle.x + 0.5) / unit,
            (circle.y + 0.5) / unit,
            circle.radius / unit,
        );
        let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
        // The chord that cuts off this share lies so far from the centre; the strip begins there.
        let (chord, width) = (r * (std::f64::consts::PI * share).cos(), 1.2 * r);
        let middle = Point2::new(
            x + (chord + 0.5 * width) * cos,
            y + (chord + 0.5 * width) * sin,
        );
        let along = nalgebra::Vector2::new(-sin, cos) * (1.5 * r);
        Some(Occluder {
            from: middle - along,
            to: middle + along,
            width,
            softness: 0.25,
            albedo: rng.random_range(0.03..0.25),
        })
    }

    /// Joint speeds, radians per second, at which the first ball moves by `pixels` (of 768) during
    /// `exposure` seconds.
    fn speed<R: Rng + ?Sized>(&self, pixels: f64, exposure: f64, rng: &mut R) -> JointDelta {
        let mut speed = JointDelta::default();
        for i in 0..3 {
            speed.0[i] = rng.random_range(-0.3..0.3);
        }
        let place = |joints: &Joints| self.cell.outline(joints).map(|o| o.centre);
        for _ in 0..3 {
            let moved = self.joints + JointDelta(speed.0.map(|v| v * exposure));
            if let (Some(from), Some(to)) = (place(&self.joints), place(&moved)) {
                let factor = pixels * self.scale / (to - from).norm().max(1e-9);
                speed.0.iter_mut().for_each(|v| *v *= factor);
            }
        }
        speed
    }
}
