//! What stands on the table, how it is lit, and what the sensor makes of it.

use nalgebra::{Point2, Vector3};

/// A far lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Light {
    /// Direction *toward* the lamp, world frame; its length does not matter. Must point upward.
    pub toward: Vector3<f64>,
    /// Irradiance on a surface that faces the lamp; a white surface under 1 is just white in the
    /// image.
    pub intensity: f64,
    /// Half the angle under which the lamp is seen, radians: the softness of its shadows.
    pub half_angle: f64,
}

/// How a surface looks.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Look {
    /// Mean reflectance, 0 (black) to 1 (white).
    pub albedo: f64,
    /// Strength of the surface's texture relative to the reflectance, 0 (even) to about 1. Flat
    /// surfaces only.
    pub texture: f64,
    /// Strength of the highlight, 0 (dull) to about 1. Balls and cylinders only.
    pub gloss: f64,
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
    /// Whether the shape lies flat on the table, so that nothing can stand in front of it by
    /// accident.
    pub fn is_flat(&self) -> bool {
        matches!(
            self,
            Self::Disc { .. } | Self::Print { .. } | Self::Tape { .. }
        )
    }

    /// Height above the table, metres; 0 for what lies flat.
    pub fn height(&self) -> f64 {
        match *self {
            Self::Box { height, .. } | Self::Cylinder { height, .. } => height,
            Self::Ball { radius } => 2.0 * radius,
            Self::Disc { .. } | Self::Print { .. } | Self::Tape { .. } => 0.0,
        }
    }

    /// Radius of the smallest circle on the table, about the thing's middle, that holds the shape.
    pub fn footprint(&self) -> f64 {
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

/// Something on the table that is not the ball.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Thing {
    /// Its shape.
    pub shape: Shape,
    /// Where its middle stands, world frame, metres.
    pub x: f64,
    /// Where its middle stands, world frame, metres.
    pub y: f64,
    /// By how much it is turned about the vertical, radians.
    pub turn: f64,
    /// How it looks.
    pub look: Look,
}

/// A strip right before the lens, a cable or the edge of a finger: it hides whatever is behind it.
/// Lengths in feature units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Occluder {
    /// One end of its middle line, in the image.
    pub from: Point2<f64>,
    /// The other end.
    pub to: Point2<f64>,
    /// Width.
    pub width: f64,
    /// Width of its blurred edges.
    pub softness: f64,
    /// Reflectance.
    pub albedo: f64,
}

/// What turns light into grey levels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sensor {
    /// Standard deviation of the noise in the dark, grey levels of 255 before gamma.
    pub read_noise: f64,
    /// Standard deviation of the photon noise at full white, grey levels of 255 before gamma; it
    /// falls with the root of the light.
    pub shot_noise: f64,
    /// Standard deviation of the blur of lens and video electronics, pixels, 0 to about 1.2.
    pub blur: f64,
    /// Standard deviation of the blur of a lens out of focus, pixels; 0 for none.
    pub defocus: f64,
    /// Strength of the fall of light toward the corners, 0 (none) to 1 (the natural cos⁴).
    pub vignetting: f64,
    /// Exponent of the grey levels: value^(1 / gamma). 1 is linear.
    pub gamma: f64,
    /// Factor on the light.
    pub exposure: f64,
}

impl Default for Sensor {
    /// A decent interline CCD of the 1990s behind an analogue grabber.
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

/// A scene: all that a frame shows besides the ball, its holder and the table's place.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scene {
    /// The lamps.
    pub lights: Vec<Light>,
    /// Light from everywhere, as the irradiance on a horizontal surface.
    pub ambient: f64,
    /// The table's surface.
    pub table: Look,
    /// The ball's surface.
    pub ball: Look,
    /// What else is on the table. No two standing things may overlap; one that stands where the
    /// holder or a low ball is, is left out.
    pub things: Vec<Thing>,
    /// What hangs before the lens.
    pub occluders: Vec<Occluder>,
    /// The sensor.
    pub sensor: Sensor,
}

impl Scene {
    /// A light ball over a bare, slightly textured table under one lamp.
    pub fn plain() -> Self {
        Self {
            lights: vec![Light {
                toward: Vector3::new(-0.35, 0.45, 1.0),
                intensity: 0.75,
                half_angle: 0.06,
            }],
            ambient: 0.25,
            table: Look {
                albedo: 0.30,
                texture: 0.15,
                gloss: 0.0,
            },
            ball: Look {
                albedo: 0.80,
                texture: 0.0,
                gloss: 0.25,
            },
            things: Vec::new(),
            occluders: Vec::new(),
            sensor: Sensor::default(),
        }
    }

    /// The scene used throughout: a wooden table under two lamps, with boxes, cylinders, discs,
    /// another ball, print and tape.
    pub fn laboratory() -> Self {
        let thing = |shape, x, y, degrees: f64, albedo, texture| Thing {
            shape,
            x,
            y,
            turn: degrees.to_radians(),
            look: Look {
                albedo,
                texture,
                gloss: 0.15,
            },
        };
        let solid = |length, width, height| Shape::Box {
            length,
            width,
            height,
        };
        Self {
            lights: vec![
                Light {
                    toward: Vector3::new(-0.45, 0.5, 1.0),
                    intensity: 0.62,
                    half_angle: 0.05,
                },
                Light {
                    toward: Vector3::new(0.7, -0.35, 1.0),
                    intensity: 0.28,
                    half_angle: 0.10,
                },
            ],
            ambient: 0.22,
            table: Look {
                albedo: 0.40,
                texture: 0.55,
                gloss: 0.0,
            },
            ball: Look {
                albedo: 0.86,
                texture: 0.03,
                gloss: 0.30,
            },
            things: vec![
                thing(solid(0.090, 0.050, 0.045), 0.780, 0.210, 28.0, 0.62, 0.25),
                thing(solid(0.060, 0.060, 0.060), 0.480, -0.300, -15.0, 0.22, 0.30),
                thing(solid(0.130, 0.032, 0.025), 0.640, 0.420, 70.0, 0.70, 0.15),
                thing(solid(0.050, 0.030, 0.020), 0.860, -0.120, 5.0, 0.16, 0.20),
                thing(solid(0.075, 0.075, 0.030), 0.350, 0.560, 40.0, 0.50, 0.40),
                thing(solid(0.040, 0.040, 0.050), 0.600, -0.620, 20.0, 0.66, 0.20),
                thing(
                    Shape::Cylinder {
                        radius: 0.022,
                        height: 0.070,
                    },
                    0.560,
                    0.170,
                    0.0,
                    0.72,
                    0.10,
                ),
                thing(
                    Shape::Cylinder {
                        radius: 0.033,
                        height: 0.040,
                    },
                    0.800,
                    -0.330,
                    0.0,
                    0.30,
                    0.20,
                ),
                thing(
                    Shape::Cylinder {
                        radius: 0.012,
                        height: 0.110,
                    },
                    0.420,
                    0.330,
                    0.0,
                    0.55,
                    0.10,
                ),
                thing(
                    Shape::Cylinder {
                        radius: 0.040,
                        height: 0.018,
                    },
                    0.330,
                    -0.520,
                    0.0,
                    0.75,
                    0.10,
                ),
                thing(
                    Shape::Disc {
                        radius: 0.030,
                        inner: 0.012,
                    },
                    0.680,
                    -0.030,
                    0.0,
                    0.70,
                    0.10,
                ),
                thing(
                    Shape::Disc {
                        radius: 0.045,
                        inner: 0.036,
                    },
                    0.560,
                    -0.430,
                    0.0,
                    0.16,
                    0.10,
                ),
                thing(
                    Shape::Disc {
                        radius: 0.018,
                        inner: 0.0,
                    },
                    0.880,
                    0.080,
                    0.0,
                    0.82,
                    0.05,
                ),
                thing(
                    Shape::Disc {
                        radius: 0.025,
                        inner: 0.010,
                    },
                    0.470,
                    0.500,
                    0.0,
                    0.60,
                    0.10,
                ),
                thing(Shape::Ball { radius: 0.012 }, 0.730, 0.110, 0.0, 0.25, 0.05),
                thing(Shape::Ball { radius: 0.030 }, 0.900, 0.330, 0.0, 0.35, 0.05),
                thing(
                    Shape::Print {
                        length: 0.150,
                        width: 0.100,
                        lines: 9,
                    },
                    0.480,
                    -0.080,
                    12.0,
                    0.88,
                    0.02,
                ),
                thing(
                    Shape::Print {
                        length: 0.100,
                        width: 0.140,
                        lines: 12,
                    },
                    0.720,
                    -0.520,
                    -35.0,
                    0.85,
                    0.02,
                ),
                thing(
                    Shape::Tape {
                        length: 0.500,
                        width: 0.024,
                    },
                    0.960,
                    0.050,
                    84.0,
                    0.12,
                    0.10,
                ),
                thing(
                    Shape::Tape {
                        length: 0.350,
                        width: 0.018,
                    },
                    0.540,
                    0.720,
                    15.0,
                    0.70,
                    0.10,
                ),
            ],
            occluders: Vec::new(),
            sensor: Sensor::default(),
        }
    }
}

impl Default for Scene {
    fn default() -> Self {
        Self::laboratory()
    }
}
