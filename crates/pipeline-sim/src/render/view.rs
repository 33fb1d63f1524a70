//! From the world to pixels and back, for an ideal pinhole, in the renderer's single precision.

use hough_heuristic::Features;
use nalgebra::{Isometry3, Matrix3, Point2, Point3, Vector2, Vector3};

use crate::cell::camera::Camera;

/// A camera at a place.
#[derive(Clone, Debug)]
pub(super) struct View {
    /// Camera frame to world.
    pub(super) pose: Isometry3<f64>,
    pub(super) focal: f64,
    pub(super) principal: Point2<f64>,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Pixels of this view for a feature unit of the camera's frame.
    pub(super) unit: f64,
    /// Upper left corner of the camera's frame in this view, pixels.
    pub(super) corner: Vector2<f64>,
}

/// Least depth that is drawn, metres.
const NEAR: f64 = 0.004;

impl View {
    pub(super) fn new(camera: &Camera, pose: Isometry3<f64>) -> Self {
        let (width, height) = camera.size();
        Self {
            pose,
            focal: camera.focal_px(),
            principal: camera.principal_point(),
            width: width as usize,
            height: height as usize,
            unit: f64::from(width) / Features::WIDTH,
            corner: Vector2::new(-0.5, -0.5),
        }
    }

    /// Returns a part of the view, enlarged by `scale`: `size` pixels wide and high, with its upper
    /// left corner at `corner` (pixels of this view).
    pub(super) fn part(&self, corner: Vector2<f64>, scale: f64, size: (usize, usize)) -> Self {
        let there = |p: Vector2<f64>| (p - corner) * scale - Vector2::new(0.5, 0.5);
        Self {
            pose: self.pose,
            focal: self.focal * scale,
            principal: Point2::from(there(self.principal.coords)),
            width: size.0,
            height: size.1,
            unit: self.unit * scale,
            corner: there(self.corner),
        }
    }

    /// Returns the pixel of the direction (p, 1) of the camera frame.
    pub(super) fn spot(&self, p: &Point2<f64>) -> Point2<f64> {
        self.principal + p.coords * self.focal
    }

    /// Returns the direction that a pixel shows, camera frame, with z = 1.
    pub(super) fn direction(&self, x: f64, y: f64) -> Vector3<f64> {
        let Point2 { coords: middle } = self.principal;
        Vector3::new(
            (x - middle.x) / self.focal,
            (y - middle.y) / self.focal,
            1.0,
        )
    }

    /// Returns a world point in the camera frame.
    pub(super) fn seen(&self, point: &Point3<f64>) -> Point3<f64> {
        self.pose.inverse_transform_point(point)
    }

    /// Returns a world direction in the camera frame.
    pub(super) fn turned(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        self.pose.inverse_transform_vector(direction)
    }

    /// Returns the camera's centre of projection.
    pub(super) fn eye(&self) -> Point3<f64> {
        Point3::from(self.pose.translation.vector)
    }

    /// Returns `true` if no part of a sphere, given in the world, can be in the frame.
    pub(super) fn misses(&self, centre: &Point3<f64>, radius: f64) -> bool {
        let c = self.seen(centre);
        let (left, right) = (self.principal.x + 1.0, self.width as f64 - self.principal.x);
        let (top, bottom) = (
            self.principal.y + 1.0,
            self.height as f64 - self.principal.y,
        );
        // Distance of the centre beyond the plane through the eye and one border of the frame.
        let beyond = |across: f64, border: f64| {
            (across * self.focal - border * c.z) / self.focal.hypot(border)
        };
        c.z < -radius
            || [(c.x, right), (-c.x, left), (c.y, bottom), (-c.y, top)]
                .iter()
                .any(|(a, b)| beyond(*a, *b) > radius)
    }

    /// Projects a convex polygon given in the world, cut at the near plane. Empty if nothing is
    /// left.
    pub(super) fn polygon(&self, corners: &[Point3<f64>]) -> Vec<Point2<f64>> {
        let mut out = Vec::with_capacity(corners.len() + 1);
        let Some(first) = corners.first().map(|p| self.seen(p)) else {
            return out;
        };
        let mut p = first;
        for i in 0..corners.len() {
            let q = corners.get(i + 1).map_or(first, |q| self.seen(q));
            if p.z >= NEAR {
                out.push(self.pixel(&p));
            }
            if (p.z >= NEAR) != (q.z >= NEAR) {
                let t = (NEAR - p.z) / (q.z - p.z);
                out.push(self.pixel(&(p + (q - p) * t)));
            }
            p = q;
        }
        out
    }

    fn pixel(&self, p: &Point3<f64>) -> Point2<f64> {
        self.principal + Vector2::new(p.x, p.y) * (self.focal / p.z)
    }

    /// Returns the matrix that takes a pixel (x, y, 1) to homogeneous coordinates on the plane
    /// through `origin` spanned by `u` and `v` (world frame): the third divides the first two.
    pub(super) fn plane(
        &self,
        origin: &Point3<f64>,
        u: &Vector3<f64>,
        v: &Vector3<f64>,
    ) -> Matrix3<f64> {
        let (o, u, v) = (self.seen(origin).coords, self.turned(u), self.turned(v));
        // A plane point with coordinates (a, b) lies at a u + b v + o in the camera frame: columns
        // of the matrix to invert.
        let to_camera = Matrix3::from_columns(&[u, v, o]);
        let (scale, middle) = (1.0 / self.focal, -self.principal.coords / self.focal);
        let ray = Matrix3::new(
            scale, 0.0, middle.x, //
            0.0, scale, middle.y, //
            0.0, 0.0, 1.0,
        );
        to_camera.try_inverse().unwrap_or_else(Matrix3::zeros) * ray
    }
}
