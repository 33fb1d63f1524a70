//! An egg that lies in the ball's place, drawn into the frames of the cell.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{FrameError, FrameSource};
use nalgebra::{Matrix3, Rotation3, Vector3};
use pipeline_sim::{Light, Scene, SharedCell};
use puma_val2::Joints;
use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;

/// A spheroid on its side: as thick as the ball, and longer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Egg {
    /// Half its length, metres.
    pub(crate) half_length: f64,
    /// Direction of its length in the horizontal plane, radians from the world's x axis.
    pub(crate) heading: f64,
}

impl Egg {
    /// Returns the direction of its length.
    pub(crate) fn axis(&self) -> Vector3<f64> {
        let (sin, cos) = self.heading.sin_cos();
        Vector3::new(cos, sin, 0.0)
    }
}

/// A camera that shows the egg in the place of the cell's ball, which lies inside it.
pub(crate) struct EggCamera<'a> {
    pub(crate) frames: &'a mut dyn FrameSource,
    pub(crate) cell: SharedCell,
    pub(crate) pose: Box<dyn Fn() -> Joints>,
    pub(crate) egg: Egg,
    pub(crate) scene: Scene,
    pub(crate) noise: Xoshiro256PlusPlus,
}

/// Reflectance of the shell, and half the range of its noise in gray levels.
const ALBEDO: f64 = 0.82;
const GRAIN: f64 = 4.0;
/// Exponent from light to gray level.
const GAMMA: f64 = 0.6;

impl EggCamera<'_> {
    /// Draws the egg: the ray of every pixel meets the spheroid, and the point met is lit.
    fn paint(&mut self, frame: &mut GrayImage) {
        let cell = self.cell.get();
        let camera = cell.camera_pose(&(self.pose)());
        let centre = camera.inverse_transform_point(&cell.ball.centre).coords;
        let turn = camera.rotation.inverse()
            * Rotation3::from_axis_angle(&Vector3::z_axis(), self.egg.heading);
        let (long, thick) = (self.egg.half_length, cell.ball.radius);
        if centre.z < 2.0 * long {
            return;
        }
        let inverse_squares = Vector3::new(long, thick, thick).map(|half| half.powi(-2));
        let axes = turn.to_rotation_matrix().into_inner();
        let form: Matrix3<f64> = axes * Matrix3::from_diagonal(&inverse_squares) * axes.transpose();
        let (focal, middle) = (cell.camera.focal_px(), cell.camera.principal_point());
        let (pulled, beyond) = (form * centre, centre.dot(&(form * centre)) - 1.0);
        let up = camera.rotation.inverse() * Vector3::z();
        let lamp = |lamp: &Light| {
            let toward = camera.rotation.inverse() * lamp.toward.normalize();
            (toward, lamp.intensity)
        };
        let lamps: Vec<(Vector3<f64>, f64)> = self.scene.lights.iter().map(lamp).collect();
        let reach = focal * long / (centre.z - long) + 3.0;
        let at = (
            middle.x + focal * centre.x / centre.z,
            middle.y + focal * centre.y / centre.z,
        );
        let range = |at: f64, size: u32| {
            let end = f64::from(size);
            (at - reach).clamp(0.0, end) as u32..(at + reach).clamp(0.0, end) as u32
        };
        for y in range(at.1, frame.height()) {
            for x in range(at.0, frame.width()) {
                let ray = Vector3::new(
                    (f64::from(x) - middle.x) / focal,
                    (f64::from(y) - middle.y) / focal,
                    1.0,
                );
                let formed = form * ray;
                let (a, b) = (ray.dot(&formed), ray.dot(&pulled));
                let under = b * b - a * beyond;
                // Distance to the outline in pixels: the discriminant over its slope.
                let slope = (2.0 / focal) * (pulled * b - formed * beyond).xy().norm();
                let share = (0.5 + under / slope.max(1e-12)).clamp(0.0, 1.0);
                if share <= 0.0 {
                    continue;
                }
                let met = ray * ((b - under.max(0.0).sqrt()) / a) - centre;
                let normal = (form * met).normalize();
                let lit: f64 = lamps.iter().map(|(l, i)| i * l.dot(&normal).max(0.0)).sum();
                let light = ALBEDO * (lit + self.scene.ambient * (0.5 + 0.5 * up.dot(&normal)));
                let grain = self.noise.random_range(-GRAIN..GRAIN);
                let gray = 255.0 * light.clamp(0.0, 1.0).powf(GAMMA) + grain;
                let pixel = frame.get_pixel_mut(x, y);
                pixel.0[0] =
                    (f64::from(pixel.0[0]) * (1.0 - share) + gray * share).clamp(0.0, 255.0) as u8;
            }
        }
    }
}

impl FrameSource for EggCamera<'_> {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        self.frames.grab(frame)?;
        self.paint(frame);
        Ok(())
    }
}
