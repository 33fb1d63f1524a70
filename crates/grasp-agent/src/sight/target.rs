//! Targets that are looked for in a frame: the ball by its circle, an egg by its ellipse, others by
//! features of their own.

use std::ops::RangeInclusive;

use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Canny, Circle, CircleDetector, CurveSearch, Detection, EdgeDetector, Ellipse, Features,
    FrameError,
};

use crate::percept::Sighting;

/// A kind of object that can be found in a frame by its image features.
///
/// Section 2.1 of the paper: "it is possible to extend the grasping behavior to objects of
/// different shapes, characterizing them uniquely, simply by considering a different set of
/// features of the images". Controllers expect a place in the image, and a radius that is inversely
/// proportional to the distance.
pub trait Target {
    /// Finds the object in `frame`; `None` if it is not there.
    ///
    /// # Errors
    /// Reason why this frame cannot be searched.
    fn find(&mut self, frame: &GrayImage) -> Result<Option<Sighting>, FrameError>;
}

impl<T: Target + ?Sized> Target for &mut T {
    fn find(&mut self, frame: &GrayImage) -> Result<Option<Sighting>, FrameError> {
        (**self).find(frame)
    }
}

/// The paper's object: a ball, by the best circle whose centre lies in the frame.
pub(crate) struct BallTarget<'a> {
    detector: &'a mut dyn CircleDetector,
}

impl<'a> BallTarget<'a> {
    pub(crate) fn new(detector: &'a mut dyn CircleDetector) -> Self {
        Self { detector }
    }
}

impl Target for BallTarget<'_> {
    fn find(&mut self, frame: &GrayImage) -> Result<Option<Sighting>, FrameError> {
        let found = self.detector.detect(frame);
        let found = found.map_err(|refused| FrameError::Failed {
            origin: "circle detector".into(),
            reason: refused.to_string(),
        })?;
        let mut found = found.iter();
        Ok(found.find_map(|detection| sighting(detection, None, frame)))
    }
}

/// An egg, a body of revolution that is longer than it is thick, by the ellipse of its outline.
///
/// The longer half-axis of the outline depends on the direction of view. The shorter one is the
/// radius of a ball as thick as the egg at the same distance, from every direction: as the radius
/// of the [`Sighting`] it lets behaviours that were learned for that ball reach the egg. An outline
/// that is longer than it is wide by a tenth has a [`Sighting::long_axis`], across which
/// [`AgentConfig::grip_across`](crate::AgentConfig::grip_across) closes the jaws.
#[derive(Clone, Debug)]
pub struct EggTarget<E = Canny> {
    edge_detector: E,
    search: CurveSearch,
    minor: RangeInclusive<f64>,
    elongation: f64,
    last: Option<Ellipse>,
}

/// Least ratio of the half-axes at which the direction of the longer one is known.
const LONG: f64 = 1.1;

impl<E: EdgeDetector> EggTarget<E> {
    /// Creates a target of the ellipses that `search` finds among the edges of `edge_detector`,
    /// with a shorter half-axis in `minor`, pixels, and a longer one of at most `elongation` times
    /// that.
    pub fn new(
        edge_detector: E,
        search: CurveSearch,
        minor: RangeInclusive<f64>,
        elongation: f64,
    ) -> Self {
        Self {
            edge_detector,
            search,
            minor,
            elongation,
            last: None,
        }
    }

    /// Returns the outline found last, pixels; `None` if the last frame showed no egg.
    pub fn outline(&self) -> Option<Ellipse> {
        self.last
    }
}

impl<E: EdgeDetector> Target for EggTarget<E> {
    fn find(&mut self, frame: &GrayImage) -> Result<Option<Sighting>, FrameError> {
        let edges = self.edge_detector.detect_edges(frame);
        let found = self.search.find::<Ellipse>(edges, |ellipse| {
            self.minor.contains(&ellipse.minor) && ellipse.major <= self.elongation * ellipse.minor
        });
        let seen = found.into_iter().find_map(|(ellipse, belonging)| {
            let detection = Detection {
                circle: Circle {
                    x: ellipse.x,
                    y: ellipse.y,
                    radius: ellipse.minor,
                },
                score: belonging,
            };
            let long_axis = (ellipse.major > LONG * ellipse.minor).then_some(ellipse.angle);
            Some((ellipse, sighting(&detection, long_axis, frame)?))
        });
        self.last = seen.map(|(ellipse, _)| ellipse);
        Ok(seen.map(|(_, sighting)| sighting))
    }
}

/// Converts a detection to feature units; `None` if its centre lies outside the frame.
fn sighting(detection: &Detection, long_axis: Option<f64>, frame: &GrayImage) -> Option<Sighting> {
    let height = Features::WIDTH * f64::from(frame.height()) / f64::from(frame.width());
    let features = Features::from_circle(&detection.circle, frame.width());
    let inside =
        (0.0..=Features::WIDTH).contains(&features.x) && (0.0..=height).contains(&features.y);
    (inside && features.r.is_finite()).then_some(Sighting {
        features,
        score: detection.score,
        long_axis,
    })
}
