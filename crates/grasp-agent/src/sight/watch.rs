//! The watch over the camera: a picture that stays as it is while the arm moves is an old one.

use hough_heuristic::Features;
use hough_heuristic::image::GrayImage;
use puma_val2::Joints;

use crate::percept::Sighting;

/// What the camera showed last, from where, and how often it has shown that.
///
/// It goes on from run to run: a camera can freeze between two of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Watch {
    pub(crate) from: Joints,
    pub(crate) shown: Option<Shown>,
    pub(crate) same: usize,
}

/// What a look is told by: the frame, or the ball where there is none.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shown {
    Frame(GrayImage),
    Ball(Features),
}

impl Watch {
    /// Takes down a look from the pose `joints`, and tells whether it showed the same as the one
    /// before from another pose. Two frames are the same when all their pixels are, which the noise
    /// of a camera prevents; of an eye without frames, two sightings are when the ball is at
    /// exactly the same place.
    pub(crate) fn looked(
        &mut self,
        joints: &Joints,
        frame: Option<GrayImage>,
        ball: Option<&Sighting>,
    ) -> bool {
        /// Least turn of one of the first three joints that changes what is seen, radians.
        const A_MOVE: f64 = 0.002;
        let shown = match (frame, ball) {
            (Some(frame), _) => Some(Shown::Frame(frame)),
            (None, Some(sighting)) => Some(Shown::Ball(sighting.features)),
            // What is not seen can be anything.
            (None, None) => None,
        };
        let moved = (0..3).any(|i| (joints.0[i] - self.from.0[i]).abs() > A_MOVE);
        let same = moved && shown.is_some() && shown == self.shown;
        if moved {
            self.same = if same { self.same.saturating_add(1) } else { 0 };
        }
        self.from = *joints;
        self.shown = shown;
        same
    }

    /// As if what was shown last had been `frame`, if anything was.
    pub(crate) fn pretend(&mut self, frame: GrayImage) {
        self.shown = self.shown.take().map(|_| Shown::Frame(frame));
    }

    /// How many looks in a row, each from another pose than the one before, have shown the same as
    /// that.
    pub(crate) fn same(&self) -> usize {
        self.same
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hough_heuristic::Detection;
    use hough_heuristic::image::Luma;

    fn at(degrees: f64) -> Joints {
        Joints::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    fn frame(gray: u8) -> Option<GrayImage> {
        Some(GrayImage::from_pixel(8, 6, Luma([gray])))
    }

    fn ball(x: f64) -> Sighting {
        let features = Features {
            x,
            y: 70.0,
            r: 20.0,
        };
        Sighting {
            long_axis: None,
            features,
            detection: Detection {
                circle: features.to_circle(768),
                score: 1.0,
            },
        }
    }

    #[test]
    fn the_same_frame_counts_from_other_poses_only_with_and_without_a_ball() {
        let mut watch = Watch::default();
        watch.looked(&at(10.0), frame(1), None);
        watch.looked(&at(10.0), frame(1), None);
        assert_eq!(watch.same(), 0);
        watch.looked(&at(20.0), frame(1), None);
        watch.looked(&at(20.0), frame(1), None);
        watch.looked(&at(30.0), frame(1), Some(&ball(50.0)));
        assert_eq!(watch.same(), 2);
        watch.looked(&at(40.0), frame(2), None);
        assert_eq!(watch.same(), 0);
    }

    #[test]
    fn the_count_of_the_same_frame_ends_at_the_largest_number() {
        let mut watch = Watch {
            from: at(10.0),
            shown: frame(1).map(Shown::Frame),
            same: usize::MAX,
        };
        assert!(watch.looked(&at(20.0), frame(1), None));
        assert_eq!(watch.same(), usize::MAX);
    }

    #[test]
    fn without_frames_the_ball_at_the_same_place_counts() {
        let mut watch = Watch::default();
        watch.looked(&at(10.0), None, Some(&ball(50.0)));
        watch.looked(&at(20.0), None, Some(&ball(50.0)));
        watch.looked(&at(30.0), None, Some(&ball(50.0)));
        assert_eq!(watch.same(), 2);
        watch.looked(&at(40.0), None, Some(&ball(51.0)));
        assert_eq!(watch.same(), 0);
        // In between it was gone, so it is not an old picture.
        watch.looked(&at(50.0), None, None);
        watch.looked(&at(60.0), None, None);
        watch.looked(&at(70.0), None, Some(&ball(51.0)));
        assert_eq!(watch.same(), 0);
    }
}
