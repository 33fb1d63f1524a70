//! The circle itself, and the paper's three image features.

/// A circle in the pixel grid of the frame it was found in.
///
/// `(0, 0)` is the *centre* of the top-left pixel, x grows to the right, y downward.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Circle {
    /// Centre, pixels from the centre of the leftmost column.
    pub x: f64,
    /// Centre, pixels from the centre of the top row.
    pub y: f64,
    /// Radius, pixels, above zero.
    pub radius: f64,
}

/// The paper's image features: centre and radius of the ball's outline in units that do not depend
/// on the resolution of the frame (section 2.1).
///
/// The whole frame is [`Features::WIDTH`] x [`Features::HEIGHT`] units with the origin at its
/// top-left *corner*, so that the middle of the frame is (96, 72) at every resolution. The paper's
/// grabber delivers 768x576 pixels, and its goal intervals (x in 99..108, y in 74..82, r in 32..34)
/// are in these units: a unit is four of its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Features {
    /// Centre, units from the left border.
    pub x: f64,
    /// Centre, units from the top border.
    pub y: f64,
    /// Radius, units.
    pub r: f64,
}

impl Features {
    /// Width of a frame in feature units.
    pub const WIDTH: f64 = 192.0;
    /// Height of a frame in feature units.
    pub const HEIGHT: f64 = 144.0;

    /// Creates features from a centre and a radius, units.
    pub const fn new(x: f64, y: f64, r: f64) -> Self {
        Self { x, y, r }
    }

    /// Returns the features of `circle`, found in a frame `frame_width` pixels wide.
    ///
    /// Pixels are square, so one scale serves both axes. A frame of width 0 has no circles; it
    /// gives features that are not finite.
    pub fn from_circle(circle: &Circle, frame_width: u32) -> Self {
        let unit = Self::WIDTH / f64::from(frame_width);
        Self {
            x: (circle.x + 0.5) * unit,
            y: (circle.y + 0.5) * unit,
            r: circle.radius * unit,
        }
    }

    /// Returns the circle with these features in a frame `frame_width` pixels wide: the inverse of
    /// [`Features::from_circle`].
    pub fn to_circle(self, frame_width: u32) -> Circle {
        let pixels = f64::from(frame_width) / Self::WIDTH;
        Circle {
            x: self.x * pixels - 0.5,
            y: self.y * pixels - 0.5,
            radius: self.r * pixels,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_four_pixels_of_the_papers_frame() {
        let middle = Circle {
            x: 383.5,
            y: 287.5,
            radius: 132.0,
        };
        assert_eq!(
            Features::from_circle(&middle, 768),
            Features {
                x: 96.0,
                y: 72.0,
                r: 33.0
            }
        );
        assert_eq!(Features::from_circle(&middle, 768).to_circle(768), middle);
    }
}
