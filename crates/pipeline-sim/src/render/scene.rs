//! A scene: lamps, surfaces, things on the table, and the sensor.

use nalgebra::{Point2, Vector3};

/// A far lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Light {
    /// Direction *toward* the lamp, world frame; its length does not matter. Must point upward.
    pub toward: Vector3<f64>,
    /// Irradiance on a surface that faces the lamp; 1 makes a white surface just white in the
    /// image.
    pub intensity: f64,
    /// Half the angle that the lamp subtends, radians: the softness of its shadows.
    pub half_angle: f64,
}

/// The appearance of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Appearance {
    /// Mean reflectance, 0 (black) to 1 (white).
    pub albedo: f64,
    /// Strength of the surface's texture relative to the reflectance, 0 (even) to about 1. Flat
    /// surfaces only.
    pub texture: f64,
    /// Strength of the highlight, 0 (dull) to about 1. Balls and cylinders only.
    pub gloss: f64,
}

impl Appearance {
    /// Returns a surface of this reflectance, strength of texture and strength of highlight.
    pub const fn new(albedo: f64, texture: f64, gloss: f64) -> Self {
        Self {
            albedo,
            texture,
            gloss,
        }
    }
}

/// The shape of a [`Thing`], metres.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Shape {
    /// An upright box.
    Box {
        /// Length along the thing's own x.
        length: f64,
        /// Width along its own y.
        width: f64,
        /// Height.
        height: f64,
    },
    /// An upright cylinder.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Height.
        height: f64,
    },
    /// A flat disc on the table, with an inner disc of other brightness.
    Disc {
        /// Radius.
        radius: f64,
        /// Radius of the inner disc; 0 for none.
        inner: f64,
    },
    /// A ball on the table.
    Ball {
        /// Radius.
        radius: f64,
    },
    /// A sheet of paper with lines of print.
    Print {
        /// Length of the lines.
        length: f64,
        /// Height of the sheet.
        width: f64,
        /// Number of lines.
        lines: u32,
    },
    /// A strip of tape on the table.
    Tape {
        /// Length.
        length: f64,
        /// Width.
        width: f64,
    },
}

impl Shape {
    /// Returns `true` if the shape lies flat on the table.
    pub(super) fn is_flat(&self) -> bool {
        matches!(
            self,
            Self::Disc { .. } | Self::Print { .. } | Self::Tape { .. }
        )
    }

    /// Returns the height above the table, metres; 0 for flat shapes.
    pub(super) fn height(&self) -> f64 {
        match *self {
            Self::Box { height, .. } | Self::Cylinder { height, .. } => height,
            Self::Ball { radius } => 2.0 * radius,
            Self::Disc { .. } | Self::Print { .. } | Self::Tape { .. } => 0.0,
        }
    }

    /// Returns the radius of the smallest circle about the thing's middle that holds the shape.
    pub(crate) fn footprint(&self) -> f64 {
        match *self {
            Self::Box { length, width, .. }
            | Self::Print { length, width, .. }
            | Self::Tape { length, width } => 0.5 * length.hypot(width),
            Self::Cylinder { radius, .. } | Self::Disc { radius, .. } | Self::Ball { radius } => {
                radius
            }
        }
    }
}

/// A thing on the table other than the ball.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Thing {
    /// Its shape.
    pub shape: Shape,
    /// Position of its middle along the world's x, metres.
    pub x: f64,
    /// Position of its middle along the world's y, metres.
    pub y: f64,
    /// Turn about the vertical, radians.
    pub turn: f64,
    /// Appearance of its surface.
    pub appearance: Appearance,
}

/// A strip right before the lens, such as a cable or the edge of a finger. Lengths in feature
/// units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Occluder {
    /// One end of its middle line, in the image.
    pub from: Point2<f64>,
    /// The other end.
    pub to: Point2<f64>,
    /// Width, feature units.
    pub width: f64,
    /// Width of its blurred edges, feature units.
    pub softness: f64,
    /// Reflectance.
    pub albedo: f64,
}

/// The sensor, which turns light into gray levels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sensor {
    /// Standard deviation of the noise in the dark, gray levels of 255 before gamma.
    pub read_noise: f64,
    /// Standard deviation of the photon noise at full white, gray levels of 255 before gamma; it
    /// falls with the root of the light.
    pub shot_noise: f64,
    /// Standard deviation of the blur of lens and video electronics, pixels, 0 to about 1.2.
    pub blur: f64,
    /// Standard deviation of the blur of a lens out of focus, pixels; 0 for none.
    pub defocus: f64,
    /// Strength of the fall of light toward the corners, 0 (none) to 1 (the natural cos⁴).
    pub vignetting: f64,
    /// Exponent of the gray levels: value^(1 / gamma). 1 is linear.
    pub gamma: f64,
    /// Factor on the light.
    pub exposure: f64,
}

impl Default for Sensor {
    /// Returns a decent interline CCD of the 1990s behind an analogue grabber.
    fn default() -> Self {
        Self {
            read_noise: 1.6,
            shot_noise: 2.4,
            blur: 0.7,
            defocus: 0.0,
            vignetting: 1.0,
            gamma: 1.0,
            exposure: 1.0,
        }
    }
}

/// The content of a frame besides the ball, its holder and the table's height.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scene {
    /// Lamps.
    pub lights: Vec<Light>,
    /// Light from all directions, as the irradiance on a horizontal surface.
    pub ambient: f64,
    /// Surface of the table.
    pub table: Appearance,
    /// Surface of the ball.
    pub ball: Appearance,
    /// Things on the table. Standing things must not overlap; one in the place of the holder or of
    /// a low ball is left out.
    pub things: Vec<Thing>,
    /// Strips before the lens.
    pub occluders: Vec<Occluder>,
    /// Sensor of the camera.
    pub sensor: Sensor,
}

impl Scene {
    /// Returns a light ball over a bare, slightly textured table under one lamp.
    pub fn plain() -> Self {
        Self {
            lights: vec![lamp(-0.35, 0.45, 0.75, 0.06)],
            ambient: 0.25,
            table: Appearance::new(0.30, 0.15, 0.0),
            ball: Appearance::new(0.80, 0.0, 0.25),
            things: Vec::new(),
            occluders: Vec::new(),
            sensor: Sensor::default(),
        }
    }

    /// Returns the scene of the examples and benchmarks: a wooden table under two lamps, with
    /// boxes, cylinders, discs, another ball, print and tape.
    pub fn laboratory() -> Self {
        /// Shape, x and y (m), turn (degrees), reflectance, texture.
        type Row = (Shape, f64, f64, f64, f64, f64);
        let solid = |length, width, height| Shape::Box {
            length,
            width,
            height,
        };
        let post = |radius, height| Shape::Cylinder { radius, height };
        let disc = |radius, inner| Shape::Disc { radius, inner };
        let ball = |radius| Shape::Ball { radius };
        let print = |length, width, lines| Shape::Print {
            length,
            width,
            lines,
        };
        let tape = |length, width| Shape::Tape { length, width };
        let thing = |(shape, x, y, degrees, albedo, texture): Row| Thing {
            shape,
            x,
            y,
            turn: degrees.to_radians(),
            appearance: Appearance::new(albedo, texture, 0.15),
        };
        Self {
            lights: vec![lamp(-0.45, 0.5, 0.62, 0.05), lamp(0.7, -0.35, 0.28, 0.10)],
            ambient: 0.22,
            table: Appearance::new(0.40, 0.55, 0.0),
            ball: Appearance::new(0.86, 0.03, 0.30),
            things: [
                (solid(0.090, 0.050, 0.045), 0.780, 0.210, 28.0, 0.62, 0.25),
                (solid(0.060, 0.060, 0.060), 0.480, -0.300, -15.0, 0.22, 0.30),
                (solid(0.130, 0.032, 0.025), 0.640, 0.420, 70.0, 0.70, 0.15),
                (solid(0.050, 0.030, 0.020), 0.860, -0.120, 5.0, 0.16, 0.20),
                (solid(0.075, 0.075, 0.030), 0.350, 0.560, 40.0, 0.50, 0.40),
                (solid(0.040, 0.040, 0.050), 0.600, -0.620, 20.0, 0.66, 0.20),
                (post(0.022, 0.070), 0.560, 0.170, 0.0, 0.72, 0.10),
                (post(0.033, 0.040), 0.800, -0.330, 0.0, 0.30, 0.20),
                (post(0.012, 0.110), 0.420, 0.330, 0.0, 0.55, 0.10),
                (post(0.040, 0.018), 0.330, -0.520, 0.0, 0.75, 0.10),
                (disc(0.030, 0.012), 0.680, -0.030, 0.0, 0.70, 0.10),
                (disc(0.045, 0.036), 0.560, -0.430, 0.0, 0.16, 0.10),
                (disc(0.018, 0.0), 0.880, 0.080, 0.0, 0.82, 0.05),
                (disc(0.025, 0.010), 0.470, 0.500, 0.0, 0.60, 0.10),
                (ball(0.012), 0.730, 0.110, 0.0, 0.25, 0.05),
                (ball(0.030), 0.900, 0.330, 0.0, 0.35, 0.05),
                (print(0.150, 0.100, 9), 0.480, -0.080, 12.0, 0.88, 0.02),
                (print(0.100, 0.140, 12), 0.720, -0.520, -35.0, 0.85, 0.02),
                (tape(0.500, 0.024), 0.960, 0.050, 84.0, 0.12, 0.10),
                (tape(0.350, 0.018), 0.540, 0.720, 15.0, 0.70, 0.10),
            ]
            .map(thing)
            .to_vec(),
            occluders: Vec::new(),
            sensor: Sensor::default(),
        }
    }

    /// Returns a scene of a bright ball over a dark wooden table with boxes and tape on it.
    ///
    /// Nothing else in the scene is round: the outline of a disc seen straight on is that of a
    /// ball.
    pub fn bright_ball() -> Self {
        let mut scene = Self::laboratory();
        (scene.table.albedo, scene.table.texture) = (0.20, 0.30);
        scene
            .things
            .retain(|thing| matches!(thing.shape, Shape::Box { .. } | Shape::Tape { .. }));
        for thing in &mut scene.things {
            thing.appearance.albedo *= 0.5;
        }
        scene
    }
}

impl Default for Scene {
    fn default() -> Self {
        Self::laboratory()
    }
}

/// Returns a lamp in the direction (x, y, 1).
fn lamp(x: f64, y: f64, intensity: f64, half_angle: f64) -> Light {
    Light {
        toward: Vector3::new(x, y, 1.0),
        intensity,
        half_angle,
    }
}
