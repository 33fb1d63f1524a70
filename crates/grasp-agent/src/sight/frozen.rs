//! Detection of a frozen camera: an image that stays the same while the arm moves is an old one.

use hough_heuristic::Features;
use hough_heuristic::image::GrayImage;
use puma_val2::Joints;

use crate::percept::Sighting;

/// Memory of the last image and the pose it was taken from.
///
/// It lasts from run to run: a camera can freeze between two of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrozenCheck {
    pub(crate) from: Joints,
    pub(crate) shown: Option<Shown>,
    pub(crate) same: usize,
    /// Looks by which an image is late, once it was measured.
    pub(crate) late: Option<usize>,
}

/// Content of one look: the frame, or the ball for eyes without frames.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shown {
    Frame(GrayImage),
    Ball(Features),
}

impl FrozenCheck {
    /// Records one look and the pose it was taken from. Returns `true` if the arm has moved and the
    /// image has not changed: the camera may have frozen.
    ///
    /// Two frames are the same if all their pixels are, which the noise of a camera prevents. For
    /// eyes without frames, two sightings are the same if the features are equal.
    pub(crate) fn looked(
        &mut self,
        joints: &Joints,
        frame: Option<&GrayImage>,
        ball: Option<&Sighting>,
    ) -> bool {
        /// Least turns of one of the first three joints that change a frame, and features that a
        /// detector may round, radians.
        const A_MOVE: [f64; 2] = [0.002, 0.03];
        let unchanged = match (frame, ball, &self.shown) {
            (Some(frame), _, Some(Shown::Frame(shown))) => frame == shown,
            (None, Some(ball), Some(Shown::Ball(shown))) => ball.features == *shown,
            // A ball that is not seen can be anywhere.
            _ => false,
        };
        let least = A_MOVE[usize::from(frame.is_none())];
        let moved = (0..3).any(|i| (joints.0[i] - self.from.0[i]).abs() > least);
        let same = moved && unchanged;
        if moved {
            self.same = if same { self.same.saturating_add(1) } else { 0 };
        }
        if moved || !unchanged {
            self.from = *joints;
        }
        if !unchanged {
            self.show(frame, ball);
        }
        same
    }

    /// Keeps the content of a look, in the buffer of the one before where that fits.
    fn show(&mut self, frame: Option<&GrayImage>, ball: Option<&Sighting>) {
        match (&mut self.shown, frame) {
            (Some(Shown::Frame(shown)), Some(frame))
                if shown.dimensions() == frame.dimensions() =>
            {
                shown.copy_from_slice(frame);
            }
            (shown, Some(frame)) => *shown = Some(Shown::Frame(frame.clone())),
            (shown, None) => *shown = ball.map(|ball| Shown::Ball(ball.features)),
        }
    }

    /// Replaces the frame shown last, if there is one.
    pub(crate) fn pretend(&mut self, frame: GrayImage) {
        self.shown = self.shown.take().map(|_| Shown::Frame(frame));
    }

    /// Returns the number of looks in a row, each from another pose than the one before, that have
    /// shown the same as that one.
    pub(crate) fn same(&self) -> usize {
        self.same
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hough_heuristic::image::Luma;

    fn at(degrees: f64) -> Joints {
        Joints::from_degrees([degrees, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    fn frame(gray: u8) -> GrayImage {
        GrayImage::from_pixel(8, 6, Luma([gray]))
    }

    fn ball(x: f64) -> Sighting {
        Sighting::new(Features::new(x, 70.0, 20.0))
    }

    #[test]
    fn the_same_frame_counts_from_other_poses_only() {
        let mut check = FrozenCheck::default();
        check.looked(&at(10.0), Some(&frame(1)), None);
        check.looked(&at(10.0), Some(&frame(1)), None);
        assert_eq!(check.same(), 0);
        check.looked(&at(20.0), Some(&frame(1)), None);
        check.looked(&at(20.0), Some(&frame(1)), None);
        check.looked(&at(30.0), Some(&frame(1)), Some(&ball(50.0)));
        assert_eq!(check.same(), 2);
        check.looked(&at(40.0), Some(&frame(2)), None);
        assert_eq!(check.same(), 0);
    }

    #[test]
    fn the_count_of_the_same_frame_ends_at_the_largest_number() {
        let mut check = FrozenCheck {
            from: at(10.0),
            shown: Some(Shown::Frame(frame(1))),
            same: usize::MAX,
            late: None,
        };
        assert!(check.looked(&at(20.0), Some(&frame(1)), None));
        assert_eq!(check.same(), usize::MAX);
    }

    #[test]
    fn without_frames_the_ball_at_the_same_place_counts() {
        let mut check = FrozenCheck::default();
        for degrees in [10.0, 20.0, 30.0] {
            check.looked(&at(degrees), None, Some(&ball(50.0)));
        }
        assert_eq!(check.same(), 2);
        check.looked(&at(40.0), None, Some(&ball(51.0)));
        assert_eq!(check.same(), 0);
        // In between it was gone, so it is not an old image.
        check.looked(&at(50.0), None, None);
        check.looked(&at(60.0), None, None);
        check.looked(&at(70.0), None, Some(&ball(51.0)));
        assert_eq!(check.same(), 0);
    }
}
