//! The camera: its optics and the exact outline of a sphere.

use hough_heuristic::Circle;
use nalgebra::{Point2, Point3, Vector3};

use crate::cell::distortion::Distortion;
use crate::cell::ellipse::ProjectedEllipse;
use crate::error::{QuantityError, SightError, at_most, finite, positive};

/// A monochrome camera: a pinhole with square pixels, and the distortion of its lens.
///
/// Camera frame: origin at the centre of projection, z along the optical axis, x to the right of
/// the image, y downward. Valid by construction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    focal_px: f64,
    principal: Point2<f64>,
    width: u32,
    height: u32,
    distortion: Distortion,
}

impl Camera {
    /// Greatest width and height of a frame, pixels.
    pub const LARGEST_SIDE: u32 = 16_384;

    /// Returns the paper's camera: an 11.5 mm lens and a frame of 768x576 pixels (section 2), on a
    /// 2/3" CCD, whose image is 8.8 mm wide; principal point in the middle of the frame, no
    /// distortion.
    ///
    /// ```
    /// let camera = pipeline_sim::Camera::paper();
    /// assert_eq!(camera.size(), (768, 576));
    /// assert!((camera.focal_px() / 4.0 - 250.9).abs() < 0.01); // in feature units
    /// ```
    pub fn paper() -> Self {
        Self::ideal(11.5 / 8.8 * 768.0, Point2::new(383.5, 287.5), 768, 576)
    }

    /// Creates a pinhole camera with a lens of `focal_length` metres, a sensor `sensor_width`
    /// metres wide and a frame of `width` x `height` pixels, principal point in the middle of the
    /// frame.
    ///
    /// # Errors
    /// [`QuantityError::Value`] names the quantity that is not above zero, or the side that is more
    /// than [`Camera::LARGEST_SIDE`].
    pub fn pinhole(
        focal_length: f64,
        sensor_width: f64,
        width: u32,
        height: u32,
    ) -> Result<Self, QuantityError> {
        positive("focal length (m)", focal_length)?;
        positive("sensor width (m)", sensor_width)?;
        frame_size(width, height)?;
        let focal_px = focal_length / sensor_width * f64::from(width);
        positive("focal length (px)", focal_px)?;
        Ok(Self::ideal(focal_px, middle(width, height), width, height))
    }

    /// Creates a pinhole given in pixels.
    pub(crate) fn ideal(focal_px: f64, principal: Point2<f64>, width: u32, height: u32) -> Self {
        Self {
            focal_px,
            principal,
            width,
            height,
            distortion: Distortion::default(),
        }
    }

    /// Multiplies the focal length by `factor`.
    ///
    /// # Errors
    /// [`QuantityError::Value`] if the factor is not above zero; [`QuantityError::Folds`] if a
    /// distorted image would fold.
    pub fn with_focal_factor(self, factor: f64) -> Result<Self, QuantityError> {
        positive("focal factor", factor)?;
        let focal_px = self.focal_px * factor;
        positive("focal length (px)", focal_px)?;
        Self { focal_px, ..self }.unfolded()
    }

    /// Moves the principal point to `principal`, pixels.
    ///
    /// # Errors
    /// [`QuantityError::Value`] if it is not finite; [`QuantityError::Folds`] if a distorted image
    /// would fold.
    pub(crate) fn with_principal_point(
        self,
        principal: Point2<f64>,
    ) -> Result<Self, QuantityError> {
        finite("principal point x (px)", principal.x)?;
        finite("principal point y (px)", principal.y)?;
        Self { principal, ..self }.unfolded()
    }

    /// Changes the frame to `width` x `height` pixels and scales the image so that it just fits. A
    /// frame of another shape shows more on two sides.
    ///
    /// # Errors
    /// [`QuantityError::Value`] for a frame without pixels, or with a side of more than
    /// [`Camera::LARGEST_SIDE`]; [`QuantityError::Folds`] if a distorted image would fold.
    pub fn resized(self, width: u32, height: u32) -> Result<Self, QuantityError> {
        frame_size(width, height)?;
        let scale = (f64::from(width) / f64::from(self.width))
            .min(f64::from(height) / f64::from(self.height));
        let off_middle = self.principal - middle(self.width, self.height);
        Self {
            focal_px: self.focal_px * scale,
            principal: middle(width, height) + off_middle * scale,
            width,
            height,
            distortion: self.distortion,
        }
        .unfolded()
    }

    /// Replaces the lens distortion.
    ///
    /// # Errors
    /// [`QuantityError::Value`] if it is not finite; [`QuantityError::Folds`] if the image folds
    /// over within the frame.
    pub fn with_distortion(self, distortion: Distortion) -> Result<Self, QuantityError> {
        let Distortion { k1, k2, k3, p1, p2 } = distortion;
        for (name, value) in [("k1", k1), ("k2", k2), ("k3", k3), ("p1", p1), ("p2", p2)] {
            finite(name, value)?;
        }
        Self { distortion, ..self }.unfolded()
    }

    /// Returns the width and height of the frame, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Returns the focal length in pixels.
    pub fn focal_px(&self) -> f64 {
        self.focal_px
    }

    /// Returns the pixel at which the optical axis meets the image.
    pub fn principal_point(&self) -> Point2<f64> {
        self.principal
    }

    /// Returns the lens distortion.
    pub fn distortion(&self) -> &Distortion {
        &self.distortion
    }

    /// Returns the pixel that shows a point of the camera frame; `None` for a point that is not in
    /// front of the camera, or lies beyond the fold of the lens.
    pub fn project(&self, point: &Point3<f64>) -> Option<Point2<f64>> {
        let ahead = (point.z > 0.0).then(|| Point2::new(point.x / point.z, point.y / point.z));
        self.to_pixel(ahead?)
    }

    /// Returns the direction, in the camera frame and with z = 1, that is seen at a pixel. Within
    /// the frame there always is one.
    ///
    /// # Errors
    /// [`QuantityError::NoRay`] for a pixel outside the frame where the lens shows nothing, or one
    /// that is not finite.
    pub fn ray(&self, pixel: Point2<f64>) -> Result<Vector3<f64>, QuantityError> {
        let image = (pixel - self.principal.coords) / self.focal_px;
        let ideal = self
            .distortion
            .undistort(image)
            .filter(|p| (p.x + p.y).is_finite());
        ideal
            .map(|p| Vector3::new(p.x, p.y, 1.0))
            .ok_or(QuantityError::NoRay {
                x: pixel.x,
                y: pixel.y,
            })
    }

    /// Returns the outline of a sphere whose centre is given in the camera frame.
    ///
    /// Without distortion the ellipse is exact: the section of the image plane with the cone of
    /// half-angle asin(radius / distance) about the direction of the centre. With distortion it is
    /// the ellipse with the area and the second moments of the distorted outline.
    ///
    /// # Errors
    /// [`SightError`]: a radius that is not above zero, a camera inside the sphere, a sphere not
    /// wholly in front of the camera, or one that reaches beyond the fold of the lens.
    pub fn project_sphere(
        &self,
        centre: &Point3<f64>,
        radius: f64,
    ) -> Result<ProjectedEllipse, SightError> {
        let outline = unit_outline(centre, radius)?;
        if self.distortion.is_none() {
            return Ok(ProjectedEllipse {
                centre: self.principal + outline.centre.coords * self.focal_px,
                major: outline.major * self.focal_px,
                minor: outline.minor * self.focal_px,
                angle: outline.angle,
            });
        }
        let angle = centre.xy().coords.norm().atan2(centre.z);
        ProjectedEllipse::of_outline(|t| self.to_pixel(outline.point(t)))
            .ok_or(SightError::BeyondLens { angle })
    }

    /// Returns the centre, in the camera frame, of the sphere of `radius` metres whose
    /// [`Camera::project_sphere`] has the mean circle `circle`. Exact without distortion; otherwise
    /// the distortion at the circle's centre is undone.
    ///
    /// `None` if `circle` or `radius` is not finite or not above zero, the lens shows nothing at
    /// the circle's centre, or the circle is too large for double precision.
    pub fn sphere_of_circle(&self, circle: &Circle, radius: f64) -> Option<Point3<f64>> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if !(positive(circle.radius) && positive(radius)) {
            return None;
        }
        let ray = self.ray(Point2::new(circle.x, circle.y)).ok()?;
        let (m, r) = (ray.xy().norm(), circle.radius / self.focal_px);
        // Unknown: tan(eta) of the centre's direction, sin²(alpha), and the minor semi-axis b. The
        // formulas of `unit_outline` come to m = tan(eta) (1 + b²), sin²(alpha) = b² cos²(eta) /
        // (1 + b²) and r = b (1 + sqrt(1 + m² / (1 + b²))) / 2.
        let b = minor_axis(m, r);
        let outer = 1.0 + b * b;
        let tan = m / outer;
        let sin = b / (outer * (1.0 + tan * tan)).sqrt();
        let direction = Vector3::new(ray.x / outer, ray.y / outer, 1.0).normalize();
        let centre = Point3::from(direction * (radius / sin));
        let shown = unit_outline(&centre, radius).ok()?;
        let off =
            (shown.centre - ray.xy()).coords.norm() + (0.5 * (shown.major + shown.minor) - r).abs();
        (off <= 1e-6 * (m + r)).then_some(centre)
    }

    /// Returns the pixel that shows the direction (p, 1); `None` beyond the fold of the lens.
    fn to_pixel(self, p: Point2<f64>) -> Option<Point2<f64>> {
        let image = if self.distortion.is_none() {
            p
        } else if self.distortion.shows(p) {
            self.distortion.distort(p)
        } else {
            return None;
        };
        Some(self.principal + image.coords * self.focal_px)
    }

    /// Refuses a distortion that turns back before the farthest corner of the frame.
    fn unfolded(self) -> Result<Self, QuantityError> {
        if self.distortion.is_none() {
            return Ok(self);
        }
        let (w, h) = (f64::from(self.width) - 0.5, f64::from(self.height) - 0.5);
        let reach = [(-0.5, -0.5), (w, -0.5), (-0.5, h), (w, h)]
            .into_iter()
            .map(|(x, y)| (Point2::new(x, y) - self.principal).norm())
            .fold(0.0, f64::max);
        for direction in 0..32 {
            let (sin, cos) = (f64::from(direction) * std::f64::consts::TAU / 32.0).sin_cos();
            let at = |u: f64| Point2::new(u * cos, u * sin);
            let out = |u: f64| {
                let image = self.distortion.distort(at(u));
                (image.x * cos + image.y * sin) * self.focal_px
            };
            // Outward until the image of the ray has left the frame, or the lens has folded it.
            let mut beyond = reach / self.focal_px;
            while self.distortion.shows(at(beyond)) && out(beyond) < reach {
                beyond *= 2.0;
            }
            if self.distortion.shows(at(beyond)) {
                continue;
            }
            let mut shown = 0.0;
            for _ in 0..60 {
                let middle = 0.5 * (shown + beyond);
                if self.distortion.shows(at(middle)) {
                    shown = middle;
                } else {
                    beyond = middle;
                }
            }
            let radius_px = out(shown);
            if radius_px < reach {
                return Err(QuantityError::Folds { radius_px });
            }
        }
        Ok(self)
    }
}

/// Returns the minor semi-axis b of a sphere's outline on the plane at unit depth, from the
/// distance `m` of its centre from the axis and the mean `r` of both semi-axes.
///
/// It is the root of b (1 + sqrt(1 + m² / (1 + b²))) = 2 r, whose left side rises with b, by
/// Newton's method, with bisection where a step leaves the bracket.
fn minor_axis(m: f64, r: f64) -> f64 {
    let (mut low, mut high) = (2.0 * r / (1.0 + 1.0_f64.hypot(m)), r);
    let mut b = low;
    for _ in 0..100 {
        let outer = 1.0 + b * b;
        let root = (1.0 + m * m / outer).sqrt();
        let excess = b * (1.0 + root) - 2.0 * r;
        if excess <= 0.0 {
            low = b;
        } else {
            high = b;
        }
        let slope = 1.0 + root - (m * b / outer).powi(2) / root;
        let mut next = b - excess / slope;
        if !(low..=high).contains(&next) {
            next = 0.5 * (low + high);
        }
        if (next - b).abs() <= 1e-16 * b {
            break;
        }
        b = next;
    }
    b
}

/// Returns the outline of a sphere on the plane at unit depth.
pub(crate) fn unit_outline(
    centre: &Point3<f64>,
    radius: f64,
) -> Result<ProjectedEllipse, SightError> {
    positive("the radius of the ball (m)", radius)?;
    let distance2 = centre.coords.norm_squared();
    finite("the squared distance of the ball (m²)", distance2)?;
    if distance2 <= radius * radius || centre.z <= radius {
        return Err(SightError::Behind {
            depth: centre.z,
            radius,
        });
    }
    let sin2_alpha = radius * radius / distance2;
    let cos2_eta = centre.z * centre.z / distance2;
    // cos²(alpha) - sin²(eta), above zero because the whole sphere is in front of the camera.
    let k = cos2_eta - sin2_alpha;
    let scale = centre.z / distance2 / k;
    Ok(ProjectedEllipse {
        centre: Point2::new(centre.x * scale, centre.y * scale),
        major: (sin2_alpha * (1.0 - sin2_alpha)).sqrt() / k,
        minor: (sin2_alpha / k).sqrt(),
        // 0 on the axis, whatever the signs of the zeros.
        angle: (centre.y + 0.0).atan2(centre.x + 0.0),
    })
}

/// Returns the middle of a frame.
fn middle(width: u32, height: u32) -> Point2<f64> {
    Point2::new(
        (f64::from(width) - 1.0) / 2.0,
        (f64::from(height) - 1.0) / 2.0,
    )
}

/// Refuses a frame without pixels, or one larger than a renderer can hold.
fn frame_size(width: u32, height: u32) -> Result<(), QuantityError> {
    positive("frame width (px)", f64::from(width))?;
    positive("frame height (px)", f64::from(height))?;
    let (side, most) = (width.max(height), Camera::LARGEST_SIDE);
    at_most("frame side (px)", f64::from(side), f64::from(most))
}
