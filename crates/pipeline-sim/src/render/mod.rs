//! Frames of the cell: table, things, holder and ball as the camera on the hand sees them.

mod bodies;
mod canvas;
mod lens;
mod light_grid;
mod sensor;
mod shadow;
mod shot;
mod texture;
mod truth;
mod view;

use hough_heuristic::image::GrayImage;
use nalgebra::{Point3, Vector3};
use puma_val2::Joints;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::{Cell, Look, Scene, Thing};
use bodies::{Studio, plane_row};
use canvas::Canvas;
use lens::{Warp, defocus};
use light_grid::LightGrid;
use sensor::Exposure;
use shadow::{BallShadow, cast_things, lamps, table_light};
use texture::{CoarseMap, Texture};
use view::View;

pub use shot::Shot;
pub use truth::{Round, Sighting};

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
    light: LightGrid,
    canvas: Canvas,
    /// The frame before distortion, and the distortion; unused without.
    ideal: Canvas,
    warp: Option<Warp>,
    spare: Vec<f32>,
    /// Light of one field, and of both.
    exposed: Vec<f32>,
    woven: Vec<f32>,
    image: GrayImage,
}

impl Renderer {
    /// A renderer for a scene.
    pub fn new(scene: &Scene, seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let wood = Texture::wood(0.60, &mut rng);
        let stains = 0.8 * scene.table.texture.clamp(0.0, 1.0) as f32;
        let mut table = CoarseMap::stains(601, (-0.6, -1.2), 2.4, stains, &mut rng);
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
            light: LightGrid::default(),
            canvas: Canvas::default(),
            ideal: Canvas::default(),
            warp: None,
            spare: Vec::new(),
            exposed: Vec::new(),
            woven: Vec::new(),
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
        self.illuminate(cell, joints);
        self.exposure.blurred = false;
        self.develop(cell)
    }

    /// The light that reaches the sensor.
    fn illuminate(&mut self, cell: &Cell, joints: &Joints) {
        let (width, height) = cell.camera.size();
        let pose = cell.camera_pose(joints);
        if self.warp.as_ref().is_none_or(|warp| !warp.is_for(&cell.camera)) {
            self.warp = Warp::new(&cell.camera);
        }
        self.canvas.resize(width as usize, height as usize);
        let coordinates = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        if !coordinates.chain(cell.ball.centre.iter()).all(|v| v.is_finite()) {
            self.canvas.light.fill(0.0);
            return;
        }
        match self.warp.take() {
            None => {
                let mut canvas = std::mem::take(&mut self.canvas);
                self.draw(&mut canvas, cell, &View::new(&cell.camera, pose));
                self.canvas = canvas;
            }
            Some(warp) => {
                let mut ideal = std::mem::take(&mut self.ideal);
                let (width, height) = warp.ideal.size();
                ideal.resize(width as usize, height as usize);
                self.draw(&mut ideal, cell, &View::new(&warp.ideal, pose));
                warp.apply(&ideal, &mut self.canvas);
                self.ideal = ideal;
                self.warp = Some(warp);
            }
        }
        defocus(&mut self.canvas, self.scene.sensor.defocus, &mut self.spare);
    }

    /// Turns the light into the next frame.
    fn develop(&mut self, cell: &Cell) -> &GrayImage {
        let (width, height) = cell.camera.size();
        if self.image.dimensions() != (width, height) {
            self.image = GrayImage::new(width, height);
        }
        self.exposure.expose(
            &self.canvas,
            &cell.camera,
            self.seed,
            self.frames,
            &mut self.image,
        );
        self.frames += 1;
        &self.image
    }

    fn draw(&mut self, canvas: &mut Canvas, cell: &Cell, view: &View) {
        let (total, _) = table_light(&self.scene);
        let plane = view.plane(&Point3::new(0.0, 0.0, cell.table), &Vector3::x(), &Vector3::y());
        let above = view.eye().z > cell.table;
        if above {
            let light = (self.scene.table.albedo * total) as f32;
            let ball = BallShadow::new(&self.scene, &cell.ball, cell.holder, cell.table);
            self.light.lay(view, &plane, |u, v| {
                light * self.table.at(u, v) * ball.factor(u, v)
            });
        }
        let bounce = self.scene.table.albedo * total;
        let studio = Studio {
            view,
            scene: &self.scene,
            texture: &self.wood,
            lamps: lamps(&self.scene),
            table: cell.table,
            bounce,
        };
        if !(above && fills_frame(view, &plane)) {
            backdrop(canvas, &studio, &self.walls);
        }
        if above {
            let (near, far, half) = TABLE;
            let corners = [(near, -half), (far, -half), (far, half), (near, half)];
            let mut polygon = Vec::with_capacity(8);
            view.polygon(&corners.map(|(x, y)| Point3::new(x, y, cell.table)), &mut polygon);
            let strength = self.scene.table.texture as f32;
            canvas.fill(&polygon, |y, x0, row| {
                plane_row(&plane, &self.wood, strength, (y, x0), row, |x| {
                    self.light.at(x, y)
                });
            });
        }
        for item in self.items(cell, view) {
            self.draw_item(canvas, &studio, cell, &item);
        }
    }

    /// All that is drawn over the table, in the order of drawing.
    ///
    /// What lies flat comes first; then what stands, far things before near ones; occluders, which are before the lens, last. Circles that
    /// do not overlap are in the right order when sorted by power (squared distance less squared radius): their radical axes
    /// separate them. A ball above a thing, or on its holder, overlaps it as seen from above: a level plane separates the two, and the one
    /// on the far side of it comes first.
    fn items(&self, cell: &Cell, view: &View) -> Vec<Item> {
        let eye = view.eye();
        let power = |x: f64, y: f64, r: f64| (x - eye.x).powi(2) + (y - eye.y).powi(2) - r * r;
        let ball = cell.ball.centre;
        let bottom = ball.z - cell.ball.radius;
        let overlaps = |x: f64, y: f64, r: f64| (x - ball.x).hypot(y - ball.y) < r + cell.ball.radius;
        // A thing where the holder stands, or in a ball that lies or is carried low, is left out.
        let in_the_way = |t: &Thing| {
            let foot = t.shape.footprint();
            let at_holder = cell.holder.is_some_and(|h| {
                (t.x - h.foot.x).hypot(t.y - h.foot.y) <= foot + h.radius.max(cell.ball.radius)
            });
            at_holder || (bottom < cell.table + t.shape.height() && overlaps(t.x, t.y, foot))
        };
        let things = || self.scene.things.iter().enumerate();
        let mut items: Vec<Item> = things()
            .filter(|(_, t)| t.shape.is_flat())
            .map(|(i, _)| Item::Thing(i))
            .collect();
        // Each with its power, its top, and whether the ball is above it.
        let mut standing: Vec<(f64, f64, bool, Item)> = things()
            .filter(|(_, t)| !t.shape.is_flat() && !in_the_way(t))
            .map(|(i, t)| {
                let (foot, top) = (t.shape.footprint(), cell.table + t.shape.height());
                (
                    power(t.x, t.y, foot),
                    top,
                    overlaps(t.x, t.y, foot),
                    Item::Thing(i),
                )
            })
            .collect();
        standing.extend(cell.holder.map(|h| {
            let under = ball.z > h.top && overlaps(h.foot.x, h.foot.y, h.radius);
            (power(h.foot.x, h.foot.y, h.radius), h.top, under, Item::Holder)
        }));
        standing.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Where the ball goes among them: by power, but after what it is above, and before what it is above as seen from below.
        let of_ball = power(ball.x, ball.y, cell.ball.radius);
        let by_power = standing.iter().filter(|(power, ..)| *power >= of_ball).count();
        let seen_from_above = |top: f64| eye.z > top;
        let after = standing
            .iter()
            .rposition(|(_, top, under, _)| *under && seen_from_above(*top))
            .map_or(0, |i| i + 1);
        let before = standing
            .iter()
            .position(|(_, top, under, _)| *under && !seen_from_above(*top))
            .unwrap_or(standing.len());
        let place = by_power.min(before).max(after);
        items.extend(standing[..place].iter().map(|s| s.3));
        items.push(Item::Ball);
        items.extend(standing[place..].iter().map(|s| s.3));
        items.extend((0..self.scene.occluders.len()).map(Item::Occluder));
        items
    }

    fn draw_item(&self, canvas: &mut Canvas, studio: &Studio<'_>, cell: &Cell, item: &Item) {
        match item {
            Item::Thing(i) => studio.thing(canvas, &self.scene.things[*i]),
            Item::Ball => {
                studio.sphere(canvas, &cell.ball.centre, cell.ball.radius, &studio.scene.ball);
            }
            Item::Holder => {
                if let Some(h) = cell.holder {
                    studio.cylinder(canvas, h.foot, h.radius, cell.table, h.top, &ROD);
                }
            }
            Item::Occluder(i) => studio.occluder(canvas, &self.scene.occluders[*i]),
        }
    }
}

/// How the holder looks.
const ROD: Look = Look {
    albedo: 0.35,
    texture: 0.0,
    gloss: 0.3,
};

/// Something drawn over the table.
#[derive(Clone, Copy, Debug)]
enum Item {
    /// The ball.
    Ball,
    /// What it stands on, or stood on.
    Holder,
    /// A thing of the scene.
    Thing(usize),
    /// An occluder of the scene.
    Occluder(usize),
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
