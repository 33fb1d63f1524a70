//! The renderer: draws what the camera on the hand sees.

use hough_heuristic::image::GrayImage;
use puma_val2::Joints;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

use crate::cell::geometry::Cell;
use crate::render::blur::defocus;
use crate::render::canvas::Canvas;
use crate::render::lens::Warp;
use crate::render::light_grid::LightGrid;
use crate::render::scene::Scene;
use crate::render::sensor::Exposure;
use crate::render::shadow::ThingShadows;
use crate::render::texture::{CoarseMap, Texture};
use crate::render::view::View;

/// Draws frames of a cell.
///
/// Owns its buffers: after the first frame only small lists of corners are allocated. The scene's
/// textures are made once, from the seed; the sensor's noise depends only on the seed and the
/// number of frames drawn.
#[derive(Clone, Debug)]
pub struct Renderer {
    pub(super) scene: Scene,
    pub(super) seed: u64,
    pub(super) frames: u64,
    pub(super) wood: Texture,
    /// Light on the table: stains and the shadows of the things.
    pub(super) table: ThingShadows,
    /// Brightness of the panels on the walls.
    pub(super) walls: Vec<f32>,
    pub(super) exposure: Exposure,
    pub(super) light: LightGrid,
    pub(super) canvas: Canvas,
    /// The frame before distortion, and the distortion; unused without.
    pub(super) ideal: Canvas,
    pub(super) warp: Option<Warp>,
    pub(super) spare: Vec<f32>,
    /// Mean light of an exposure, and of the first field of an interlaced frame.
    pub(super) exposed: Vec<f32>,
    pub(super) first_field: Vec<f32>,
    pub(super) image: GrayImage,
}

impl Renderer {
    /// Creates a renderer for a scene.
    pub fn new(scene: &Scene, seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let wood = Texture::wood(0.60, &mut rng);
        let stains = 0.8 * scene.table.texture.clamp(0.0, 1.0) as f32;
        let stains = CoarseMap::stains(601, (-0.6, -1.2), 2.4, stains, &mut rng);
        let table = ThingShadows::new(stains, scene);
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
            first_field: Vec::new(),
            image: GrayImage::new(0, 0),
        }
    }

    /// Returns the scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    pub(crate) fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the last frame.
    pub(crate) fn frame(&self) -> &GrayImage {
        &self.image
    }

    /// Draws the view of the camera of `cell` with the arm at `joints`.
    ///
    /// Joints or places that are not finite give a frame of noise without content.
    pub fn render(&mut self, cell: &Cell, joints: &Joints) -> &GrayImage {
        self.illuminate(cell, joints);
        self.exposure.blurred = false;
        self.develop(cell)
    }

    /// Computes the light that reaches the sensor.
    pub(super) fn illuminate(&mut self, cell: &Cell, joints: &Joints) {
        let pose = cell.camera_pose(joints);
        let place = pose
            .translation
            .vector
            .iter()
            .chain(cell.ball.centre.iter());
        let mut numbers = place.chain(pose.rotation.coords.iter());
        let finite = numbers.all(|v| v.is_finite());
        let (width, height) = cell.camera.size();
        let mut canvas = std::mem::take(&mut self.canvas);
        canvas.resize(width as usize, height as usize);
        if self.warp.as_ref().is_none_or(|w| !w.is_for(&cell.camera)) {
            self.warp = Warp::new(&cell.camera);
        }
        if !finite {
            canvas.light.fill(0.0);
        } else if let Some(warp) = self.warp.take() {
            let mut ideal = std::mem::take(&mut self.ideal);
            let (width, height) = warp.ideal.size();
            ideal.resize(width as usize, height as usize);
            self.draw(&mut ideal, cell, &View::new(&warp.ideal, pose));
            warp.apply(&ideal, &mut canvas);
            (self.ideal, self.warp) = (ideal, Some(warp));
        } else {
            self.draw(&mut canvas, cell, &View::new(&cell.camera, pose));
        }
        defocus(&mut canvas, self.scene.sensor.defocus, &mut self.spare);
        self.canvas = canvas;
    }

    /// Turns the light into the next frame.
    pub(super) fn develop(&mut self, cell: &Cell) -> &GrayImage {
        let (width, height) = cell.camera.size();
        if self.image.dimensions() != (width, height) {
            self.image = GrayImage::new(width, height);
        }
        let (canvas, image, number) = (&self.canvas, &mut self.image, (self.seed, self.frames));
        self.exposure.expose(canvas, &cell.camera, number, image);
        self.frames += 1;
        &self.image
    }
}
