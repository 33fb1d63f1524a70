//! A table with balls under the camera.

use hough_heuristic::{Circle, Features};
use nalgebra::{Point2, Point3, Vector2};
use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Ball;
use crate::cell::camera::Camera;
use crate::cell::geometry::Cell;
use crate::cell::workspace::Workspace;
use crate::datasets::things::placed;
use crate::render::scene::{Appearance, Occluder, Shape, Thing};

/// Draws a reflectance that differs from `albedo` by at least a quarter of it.
pub(super) fn other_than(albedo: f64, rng: &mut dyn Rng) -> f64 {
    if rng.random_bool(0.4) {
        rng.random_range(0.05..0.75 * albedo)
    } else {
        rng.random_range(1.25 * albedo..0.9)
    }
}

/// The camera over the table, and the balls in its view.
pub(super) struct Stage {
    pub(super) cell: Cell,
    pub(super) joints: Joints,
    /// Pixels per pixel of a frame of 768x576.
    scale: f64,
    /// Balls in the image and in the world.
    balls: Vec<(Circle, Ball)>,
}

impl Stage {
    /// Sets up an empty table under a camera that looks nearly straight down.
    pub(super) fn new(camera: Camera, rng: &mut dyn Rng) -> Self {
        // Out of every view, behind the arm.
        let mut cell = Cell::paper(Ball::at(-0.40, 0.0, -0.28));
        cell.camera = camera;
        cell.holder = None;
        let above = Workspace {
            height: (0.0, 0.05),
            ..Workspace::paper()
        };
        let joints = loop {
            // A pose for the paper's frame: one of another shape shows that and more.
            let over = Cell {
                ball: above.sample_ball(rng),
                camera: Camera::paper(),
                ..cell
            };
            let aside = [0.0; 6].map(|_: f64| rng.random_range(-4.0_f64..4.0).to_radians());
            let turn = rng.random_range(-1.0..1.0);
            if let Ok(pose) = over.goal_pose(Cell::REACHING_JT5_DEGREES) {
                let mut pose = pose + JointDelta(aside);
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
    pub(super) fn put_balls(&mut self, count: usize, (least, most): (f64, f64), rng: &mut dyn Rng) {
        let (width, height) = self.cell.camera.size();
        let (width, height) = (f64::from(width), f64::from(height));
        const TRIES: u32 = 4000;
        for attempt in 0..TRIES {
            if self.balls.len() == count {
                break;
            }
            // The longer the search, the smaller the balls.
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

    /// Returns the ball on the table that shows as `circle`.
    fn lying(&self, circle: &Circle) -> Option<Ball> {
        // Balls that show as one circle lie on one ray, farther away the larger they are.
        let unit = self.cell.camera.sphere_of_circle(circle, 1.0)?;
        let pose = self.cell.camera_pose(&self.joints);
        let (eye, direction) = (pose.translation.vector, pose.rotation * unit.coords);
        let radius = (eye.z - self.cell.table) / (1.0 - direction.z);
        let centre = Point3::from(eye + direction * radius);
        (radius > 0.0).then_some(Ball { centre, radius })
    }

    /// Returns all balls but the first as things.
    pub(super) fn other_balls(&self, table_albedo: f64, rng: &mut dyn Rng) -> Vec<Thing> {
        let thing = |(_, Ball { centre, radius }): &(Circle, Ball)| Thing {
            shape: Shape::Ball { radius: *radius },
            x: centre.x,
            y: centre.y,
            turn: 0.0,
            appearance: Appearance::new(
                other_than(table_albedo, rng),
                0.0,
                rng.random_range(0.05..0.3),
            ),
        };
        self.balls.iter().skip(1).map(thing).collect()
    }

    /// Puts `count` things with straight edges beside what is there.
    pub(super) fn put_distractors(&self, count: usize, things: &mut Vec<Thing>, rng: &mut dyn Rng) {
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
            let Ok(ray) = self.cell.camera.ray(pixel) else {
                continue;
            };
            let ray = pose.rotation * ray;
            let depth = (self.cell.table - eye.z) / ray.z;
            // Metres on the table per pixel of a frame of 768x576; things shrink as space runs out.
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
            let thing = placed(shape, (place.x, place.y), rng);
            let clear = |x: f64, y: f64, radius: f64| {
                (thing.x - x).hypot(thing.y - y) > thing.shape.footprint() + 1.1 * radius
            };
            let mut balls = self.balls.iter().map(|(_, ball)| ball);
            if balls.all(|b| clear(b.centre.x, b.centre.y, b.radius))
                && things.iter().all(|t| clear(t.x, t.y, t.shape.footprint()))
            {
                things.push(thing);
            }
        }
    }

    /// Returns a strip before the first ball that hides `share` of its outline.
    pub(super) fn cover(&self, share: f64, rng: &mut dyn Rng) -> Option<Occluder> {
        let (circle, _) = self.balls.first()?;
        let unit = f64::from(self.cell.camera.size().0) / Features::WIDTH;
        let (x, y, r) = (
            (circle.x + 0.5) / unit,
            (circle.y + 0.5) / unit,
            circle.radius / unit,
        );
        let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
        // The strip begins at the chord that cuts off this share.
        let (chord, width) = (r * (std::f64::consts::PI * share).cos(), 1.2 * r);
        let middle = Point2::new(
            x + (chord + 0.5 * width) * cos,
            y + (chord + 0.5 * width) * sin,
        );
        let along = Vector2::new(-sin, cos) * (1.5 * r);
        Some(Occluder {
            from: middle - along,
            to: middle + along,
            width,
            softness: 0.25,
            albedo: rng.random_range(0.03..0.25),
        })
    }

    /// Draws joint speeds, radians per second, at which the first ball moves by `pixels` (of 768)
    /// during `exposure` seconds.
    pub(super) fn speed(&self, pixels: f64, exposure: f64, rng: &mut dyn Rng) -> JointDelta {
        let mut speed = JointDelta::default();
        for speed in &mut speed.0[..3] {
            *speed = rng.random_range(-0.3..0.3);
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
