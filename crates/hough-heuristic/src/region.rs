//! Where in the frame a centre may lie.

use crate::circle::Circle;
use crate::error::ConfigError;

/// A rectangle of pixels of a frame, never empty: the *region of interest* for the centre of a
/// circle.
///
/// Only the centre must lie inside; the outline may leave the region, and the frame. A detector
/// refuses frames that its region sticks out of
/// ([`CircleDetector::check_frame`](crate::CircleDetector::check_frame)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Rectangle"))]
pub struct Region {
    left: u32,
    top: u32,
    width: u32,
    height: u32,
}

/// A [`Region`] as it was stored, and not yet looked at.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
#[serde(rename = "Region")]
struct Rectangle {
    left: u32,
    top: u32,
    width: u32,
    height: u32,
}

#[cfg(feature = "serde")]
impl TryFrom<Rectangle> for Region {
    type Error = ConfigError;

    /// The frame is not known yet, so it is the largest there could be.
    fn try_from(stored: Rectangle) -> Result<Self, ConfigError> {
        let Rectangle {
            left,
            top,
            width,
            height,
        } = stored;
        Self::in_frame((left, top), (width, height), (u32::MAX, u32::MAX))
    }
}

impl Region {
    /// The `width` x `height` pixels whose top-left one is `(left, top)`, in frames of
    /// `frame_width` x `frame_height`.
    ///
    /// # Errors
    /// [`ConfigError::Region`] if the region is empty or sticks out of the frame.
    pub fn in_frame(
        (left, top): (u32, u32),
        (width, height): (u32, u32),
        (frame_width, frame_height): (u32, u32),
    ) -> Result<Self, ConfigError> {
        let region = Self {
            left,
            top,
            width,
            height,
        };
        region.check_frame(frame_width, frame_height)?;
        Ok(region)
    }

    /// Whether the region lies in frames of this size.
    ///
    /// # Errors
    /// [`ConfigError::Region`] if it is empty or sticks out of them.
    pub fn check_frame(&self, frame_width: u32, frame_height: u32) -> Result<(), ConfigError> {
        let &Self {
            left,
            top,
            width,
            height,
        } = self;
        let fits = |start: u32, length: u32, end: u32| {
            length > 0 && start.checked_add(length).is_some_and(|stop| stop <= end)
        };
        if fits(left, width, frame_width) && fits(top, height, frame_height) {
            Ok(())
        } else {
            Err(ConfigError::Region {
                left,
                top,
                width,
                height,
                frame_width,
                frame_height,
            })
        }
    }

    /// Whether the centre of `circle` lies on one of the region's pixels (half a pixel of border
    /// included).
    pub fn holds(&self, circle: &Circle) -> bool {
        let within = |value: f64, start: u32, length: u32| {
            let from_edge = value + 0.5 - f64::from(start);
            (0.0..=f64::from(length)).contains(&from_edge)
        };
        within(circle.x, self.left, self.width) && within(circle.y, self.top, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_must_lie_in_its_frame() {
        assert!(Region::in_frame((0, 0), (768, 576), (768, 576)).is_ok());
        for (corner, size) in [
            ((0, 0), (0, 5)),
            ((760, 0), (9, 5)),
            ((0, 576), (1, 1)),
            ((u32::MAX, 0), (2, 1)),
        ] {
            let error = Region::in_frame(corner, size, (768, 576)).unwrap_err();
            assert!(error.to_string().contains("768x576"), "{error}");
        }
        let region = Region::in_frame((700, 0), (68, 5), (768, 576)).unwrap();
        let error = region.check_frame(720, 576).unwrap_err().to_string();
        assert!(
            error.contains("68x5 px at (700, 0)") && error.contains("720x576"),
            "{error}"
        );
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_stored_region_is_checked_too() {
        let region = Region::in_frame((7, 0), (68, 5), (768, 576)).unwrap();
        let stored = serde_json::to_string(&region).unwrap();
        assert_eq!(serde_json::from_str::<Region>(&stored).unwrap(), region);
        for (stored, value) in [
            (
                r#"{"left":1,"top":2,"width":0,"height":5}"#,
                "0x5 px at (1, 2)",
            ),
            (
                r#"{"left":4294967295,"top":2,"width":9,"height":5}"#,
                "4294967295",
            ),
        ] {
            let error = serde_json::from_str::<Region>(stored).unwrap_err();
            assert!(error.to_string().contains(value), "{error}");
        }
    }

    #[test]
    fn the_centre_decides() {
        let region = Region::in_frame((10, 20), (5, 5), (100, 100)).unwrap();
        let at = |x, y| Circle { x, y, radius: 50.0 };
        assert!(region.holds(&at(10.0, 20.0)));
        assert!(region.holds(&at(14.4, 24.4)));
        assert!(!region.holds(&at(15.0, 22.0)));
        assert!(!region.holds(&at(f64::NAN, 22.0)));
    }
}
