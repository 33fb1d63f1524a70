//! Frames of the cell: table, things, holder and ball as the camera on the hand sees them.

mod bodies;
mod canvas;
mod sensor;
mod shadow;
mod texture;
mod view;

use hough_heuristic::image::GrayImage;
use nalgebra::{Point2, Point3, Vector3};
use puma_val2::Joints;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::{Cell, Look, Scene};
use bodies::{Studio, plane_row};
use canvas::Canvas;
use sensor::Exposure;
use shadow::{BallShadow, cast_things, table_light};
use texture::{CoarseMap, Texture};
use view::View;

/// Near and far edge of the table along x, and its half width along y, metres.
const TABLE: (f64, f64, f64) = (-0.45, 1.30, 1.15);
/// Depth of the floor below the shoulder, metres.
const FLOOR: f64 = -1.05;
/// How far the walls are, metres.
const WALLS: f64 = 3.2;

/// Draws frames of a cell.
///
/// Owns its buffers: after the first frame nothing is allocated but small lists of corners. The scene's textures are made once, from the
/// seed; the sensor's noise depends on the seed and on how many frames have been drawn, on nothing else.
///
/// ```
/// use pipeline_sim::{Ball, Cell, Renderer, Scene, Workspace};
///
/// let cell = Cell::paper(Ball::at(0.6, 0.15, -0.1));
/// let mut renderer = Renderer::new(&Scene::laboratory(), 1);
/// let pose = Workspace::paper().search_poses()[3];
/// let frame = renderer.render(&cell, &pose);
/// assert_eq!(frame.dimensions(), (768, 576));
/// ```
#[derive(Clone, Debug)]
pub struct Renderer {
    scene: Scene,
    seed: u64,
    frames: u64,
    wood: Texture,
    /// Light on the table: stains and the shadows of the things.
    table: CoarseMap,
    /// Brightness of the panels on the walls.
    walls: Vec<f32>,
    exposure: Exposure,
    canvas: Canvas,
    image: GrayImage,
}

impl Renderer {
    /// A renderer for a scene.
    pub fn new(scene: &Scene, seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let wood = Texture::wood(0.60, &mut rng);
        let stains = 0.8 * scene.table.texture.clamp(0.0, 1.0) as f32;
        let mut table = CoarseMap::stains(961, (-0.6, -1.2), 2.4, stains, &mut rng);
        cast_things(&mut table, scene);
        let walls = (0..48).map(|_| rng.random_range(0.12_f32..0.55)).collect();
        let exposure = Exposure::new(scene.sensor, &mut rng);
        Self {
            scene: scene.clone(),
            seed,
            frames: 0,
            wood,
            table,
            walls,
            exposure,
            canvas: Canvas::new(0, 0),
            image: GrayImage::new(0, 0),
        }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Frames drawn so far: the number of the next frame.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Draws what the camera of `cell` sees with the arm at `joints`.
    ///
    /// Joints or places that are not finite give a frame of noise without content.
    pub fn render(&mut self, cell: &Cell, joints: &Joints) -> &GrayImage {
        let view = View::new(&cell.camera, cell.camera_pose(joints));
        if (self.canvas.width, self.canvas.height) != (view.width, view.height) {
            self.canvas = Canvas::new(view.width, view.height);
            self.image = GrayImage::new(view.width as u32, view.height as u32);
        }
        let finite = view
            .pose
            .translation
            .vector
            .iter()
            .chain(view.pose.rotation.coords.iter())
            .all(|v| v.is_finite());
        if finite {
            self.draw(cell, &view);
        } else {
            self.canvas.light.fill(0.0);
        }
        self.exposure
            .expose(&self.canvas, &view, self.seed, self.frames, &mut self.image);
        self.frames += 1;
        &self.image
    }

    fn draw(&mut self, cell: &Cell, view: &View) {
        let (total, _) = table_light(&self.scene);
        let studio = Studio {
            view,
            scene: &self.scene,
            texture: &self.wood,
            table: cell.table,
            bounce: self.scene.table.albedo * total,
        };
        let canvas = &mut self.canvas;
        let (near, far, half) = TABLE;
        let corners = [(near, -half), (far, -half), (far, half), (near, half)]
            .map(|(x, y)| Point3::new(x, y, cell.table));
        let plane = view.plane(&Point3::new(0.0, 0.0, cell.table), &Vector3::x(), &Vector3::y());
        let mut polygon = Vec::with_capacity(8);
        let above = view.eye().z > cell.table;
        if !(above && fills_frame(view, &plane)) {
            backdrop(canvas, &studio, &self.walls);
        }
        if above {
            view.polygon(&corners, &mut polygon);
            let light = (self.scene.table.albedo * total) as f32;
            let ball = BallShadow::new(&self.scene, &cell.ball, cell.holder, cell.table);
            let strength = self.scene.table.texture as f32;
            canvas.fill(&polygon, |y, x0, row| {
                plane_row(&plane, &self.wood, strength, (y, x0), row, |(u, v)| {
                    light * self.table.at(u, v) * ball.factor(u, v)
                });
            });
        }
        // What lies flat first; then what stands, far things before near ones. Circles that do not overlap are in the right order
        // when sorted by power (squared distance less squared radius): their radical axes separate them.
        let eye = view.eye();
        let power = |x: f64, y: f64, r: f64| (x - eye.x).powi(2) + (y - eye.y).powi(2) - r * r;
        let stands_clear = |x: f64, y: f64, r: f64| {
            let (bx, by) = cell
                .holder
                .map_or((cell.ball.centre.x, cell.ball.centre.y), |h| (h.foot.x, h.foot.y));
            (x - bx).hypot(y - by) > r + cell.ball.radius
        };
        for thing in self.scene.things.iter().filter(|t| t.shape.is_flat()) {
            studio.thing(canvas, thing);
        }
        let mut order: Vec<(f64, Option<usize>)> = self
            .scene
            .things
            .iter()
            .enumerate()
            .filter(|(_, t)| !t.shape.is_flat() && stands_clear(t.x, t.y, t.shape.footprint()))
            .map(|(i, t)| (power(t.x, t.y, t.shape.footprint()), Some(i)))
            .collect();
        order.push((
            power(cell.ball.centre.x, cell.ball.centre.y, cell.ball.radius),
            None,
        ));
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, which) in order {
            match which {
                Some(i) => studio.thing(canvas, &self.scene.things[i]),
                None => ball_on_holder(canvas, &studio, cell),
            }
        }
    }
}

/// Ball and holder, the farther one first.
fn ball_on_holder(canvas: &mut Canvas, studio: &Studio<'_>, cell: &Cell) {
    let rod = Look {
        albedo: 0.35,
        texture: 0.0,
        gloss: 0.3,
    };
    let from_above = cell.holder.is_some_and(|h| studio.view.eye().z > h.top);
    if !from_above {
        studio.sphere(canvas, &cell.ball.centre, cell.ball.radius, &studio.scene.ball);
    }
    if let Some(h) = cell.holder {
        studio.cylinder(
            canvas,
            Point2::new(h.foot.x, h.foot.y),
            h.radius,
            cell.table,
            h.top,
            &rod,
        );
    }
    if from_above {
        studio.sphere(canvas, &cell.ball.centre, cell.ball.radius, &studio.scene.ball);
    }
}

/// Whether every ray of the frame meets the table.
fn fills_frame(view: &View, plane: &nalgebra::Matrix3<f64>) -> bool {
    let (near, far, half) = TABLE;
    let (w, h) = (view.width as f64, view.height as f64);
    [(-1.0, -1.0), (w, -1.0), (-1.0, h), (w, h)]
        .into_iter()
        .all(|(x, y)| {
            let p = plane * Vector3::new(x, y, 1.0);
            let (u, v) = (p.x / p.z, p.y / p.z);
            p.z > 0.0 && u > near && u < far && v.abs() < half
        })
}

/// Floor and walls of the room.
fn backdrop(canvas: &mut Canvas, studio: &Studio<'_>, walls: &[f32]) {
    canvas.light.fill(0.30);
    let mut polygon = Vec::with_capacity(8);
    let n = walls.len() / 2;
    let corner = |i: usize, z: f64| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / n as f64).sin_cos();
        Point3::new(WALLS * cos, WALLS * sin, z)
    };
    for (i, pair) in walls.chunks_exact(2).enumerate() {
        for (light, low, high) in [(pair[0], FLOOR, 0.2), (pair[1], 0.2, 1.8)] {
            let corners = [
                corner(i, low),
                corner(i + 1, low),
                corner(i + 1, high),
                corner(i, high),
            ];
            studio.view.polygon(&corners, &mut polygon);
            canvas.fill(&polygon, |_, _, row| row.fill(light));
        }
    }
    let floor: Vec<Point3<f64>> = (0..n).map(|i| corner(i, FLOOR)).collect();
    studio.view.polygon(&floor, &mut polygon);
    let plane = studio.view.plane(
        &Point3::new(0.0, 0.0, FLOOR),
        &Vector3::new(4.0, 0.0, 0.0),
        &Vector3::new(0.0, 4.0, 0.0),
    );
    canvas.fill(&polygon, |y, x0, row| {
        plane_row(&plane, studio.texture, 0.4, (y, x0), row, |_| 0.16);
    });
}
