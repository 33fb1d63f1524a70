//! Checks of scenes and shots.

use crate::error::{QuantityError, amount, at_most, finite, positive};
use crate::render::scene::{Appearance, Scene, Sensor, Shape};
use crate::render::shot::Shot;

impl Scene {
    /// Checks every quantity. [`Renderer`](crate::Renderer) does not: it draws the usable parts of
    /// a scene and replaces a gamma that is not above zero by 1.
    ///
    /// # Errors
    /// [`QuantityError`] names the first quantity that is not finite, below zero, or, for gamma and
    /// a lamp's height, not above zero.
    pub fn check(&self) -> Result<(), QuantityError> {
        amount("ambient light", self.ambient)?;
        for (i, light) in self.lights.iter().enumerate() {
            for (axis, value) in ["x", "y", "z"].into_iter().zip(light.toward.iter()) {
                finite(format!("{axis} of the direction to lamp {i}"), *value)?;
            }
            positive(format!("z of the direction to lamp {i}"), light.toward.z)?;
            amount(format!("intensity of lamp {i}"), light.intensity)?;
            amount(format!("half angle of lamp {i} (rad)"), light.half_angle)?;
        }
        self.table.check("the table")?;
        self.ball.check("the ball")?;
        for (i, thing) in self.things.iter().enumerate() {
            finite(format!("x of thing {i} (m)"), thing.x)?;
            finite(format!("y of thing {i} (m)"), thing.y)?;
            finite(format!("turn of thing {i} (rad)"), thing.turn)?;
            thing.appearance.check(&format!("thing {i}"))?;
            for (name, value) in thing.shape.lengths() {
                amount(format!("{name} of thing {i} (m)"), value)?;
            }
        }
        for (i, occluder) in self.occluders.iter().enumerate() {
            for value in occluder.from.iter().chain(occluder.to.iter()) {
                finite(format!("an end of occluder {i} (units)"), *value)?;
            }
            amount(format!("width of occluder {i} (units)"), occluder.width)?;
            amount(
                format!("softness of occluder {i} (units)"),
                occluder.softness,
            )?;
            amount(format!("albedo of occluder {i}"), occluder.albedo)?;
        }
        self.sensor.check()
    }
}

impl Sensor {
    /// Checks every quantity.
    ///
    /// # Errors
    /// [`QuantityError`] names the first quantity that is not finite or below zero; gamma must be
    /// above zero.
    pub(crate) fn check(&self) -> Result<(), QuantityError> {
        amount("read noise (gray levels)", self.read_noise)?;
        amount("shot noise (gray levels)", self.shot_noise)?;
        amount("blur (px)", self.blur)?;
        amount("defocus (px)", self.defocus)?;
        amount("vignetting", self.vignetting)?;
        amount("exposure", self.exposure)?;
        positive("gamma", self.gamma)
    }
}

impl Shot {
    /// Checks every quantity. [`Renderer::take`](crate::Renderer::take) does not.
    ///
    /// # Errors
    /// [`QuantityError`] names the time that is not finite, below zero or above [`Shot::LONGEST`],
    /// or the number of moments that is zero or above [`Shot::MOST_MOMENTS`].
    pub fn check(&self) -> Result<(), QuantityError> {
        for (quantity, time) in [
            ("exposure time (s)", self.exposure),
            ("time between the fields (s)", self.interlace.unwrap_or(0.0)),
        ] {
            amount(quantity, time)?;
            at_most(quantity, time, Self::LONGEST)?;
        }
        let (quantity, moments) = ("number of moments", self.moments as f64);
        positive(quantity, moments)?;
        at_most(quantity, moments, Self::MOST_MOMENTS as f64)
    }
}

impl Appearance {
    fn check(&self, of: &str) -> Result<(), QuantityError> {
        amount(format!("albedo of {of}"), self.albedo)?;
        amount(format!("texture of {of}"), self.texture)?;
        amount(format!("gloss of {of}"), self.gloss)
    }
}

impl Shape {
    /// Returns its measures by name.
    fn lengths(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::Box {
                length,
                width,
                height,
            } => vec![("length", length), ("width", width), ("height", height)],
            Self::Cylinder { radius, height } => vec![("radius", radius), ("height", height)],
            Self::Disc { radius, inner } => vec![("radius", radius), ("inner radius", inner)],
            Self::Ball { radius } => vec![("radius", radius)],
            Self::Print { length, width, .. } | Self::Tape { length, width } => {
                vec![("length", length), ("width", width)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Vector3};

    use super::*;
    use crate::render::scene::{Light, Occluder};

    type Spoil = fn(&mut Scene);

    #[test]
    fn out_of_range_quantities_are_named() {
        let spoil: [(&str, Spoil); 12] = [
            ("ambient light", |s| s.ambient = -1.0),
            ("gamma", |s| s.sensor.gamma = -2.0),
            ("gamma", |s| s.sensor.gamma = 0.0),
            ("gamma", |s| s.sensor.gamma = f64::NAN),
            ("read noise", |s| s.sensor.read_noise = f64::NAN),
            ("defocus", |s| s.sensor.defocus = f64::INFINITY),
            ("albedo of the table", |s| s.table.albedo = f64::NAN),
            ("gloss of the ball", |s| s.ball.gloss = -0.1),
            ("x of thing 1", |s| s.things[1].x = f64::NAN),
            ("radius of thing 0", |s| {
                s.things[0].shape = Shape::Ball { radius: -0.1 }
            }),
            ("z of the direction to lamp", |s| {
                s.lights.push(Light {
                    toward: -Vector3::z(),
                    intensity: 1.0,
                    half_angle: 0.1,
                });
            }),
            ("softness of occluder 0", |s| {
                s.occluders.push(Occluder {
                    from: Point2::origin(),
                    to: Point2::new(1.0, 1.0),
                    width: 1.0,
                    softness: f64::NAN,
                    albedo: 0.1,
                });
            }),
        ];
        for (named, spoil) in spoil {
            let mut scene = Scene::laboratory();
            spoil(&mut scene);
            let refused = scene.check().expect_err("makes no sense").to_string();
            assert!(refused.starts_with(named), "{named}: {refused}");
        }
        assert!(Shot::pal(0.02, Shot::MOST_MOMENTS).check().is_ok());
        for moments in [0, Shot::MOST_MOMENTS + 1, usize::MAX] {
            let error = Shot::pal(0.02, moments)
                .check()
                .expect_err("no number of moments");
            assert!(error.to_string().contains("moments"), "{error}");
        }
        let error = Shot::pal(1e300, 3)
            .check()
            .expect_err("for ever")
            .to_string();
        assert!(
            error.contains("exposure time") && error.contains("60"),
            "{error}"
        );
        let shot = Shot::pal(f64::NAN, 3)
            .check()
            .expect_err("no time")
            .to_string();
        assert!(shot.starts_with("exposure time"), "{shot}");
    }
}
