//! What is looked for in a frame: the ball by its circle, or another object by another set of
//! features.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    Canny, Circle, CircleDetector, CurveSearch, Detection, EdgeDetector, Ellipse, Features,
};

use crate::checked::checked;
use crate::percept::Sighting;

/// A set of image features that describes one kind of object: the door through which objects other
/// than balls come in.
///
/// Section 2.1 of the paper: "it is possible to extend the grasping behavior to objects of
/// different shapes, characterizing them uniquely, simply by considering a different set of
/// features of the images". Whatever the object, what the controllers are told is a place in the
/// image and a size that is inversely proportional to the distance.
pub trait ObjectFeatures {
    /// The object in `frame`; `None` if it is not there.
    fn find(&mut self, frame: &GrayImage) -> Option<Sighting>;
}

/// The paper's object: a ball, by centre and radius of the best circle whose centre lies in the
/// frame.
pub struct BallFeatures<'a> {
    detector: &'a mut dyn CircleDetector,
}

impl<'a> BallFeatures<'a> {
    /// By the circles that `detector` finds.
    pub fn new(detector: &'a mut dyn CircleDetector) -> Self {
        Self { detector }
    }
}

impl<O: ObjectFeatures + ?Sized> ObjectFeatures for &mut O {
    fn find(&mut self, frame: &GrayImage) -> Option<Sighting> {
        (**self).find(frame)
    }
}

impl ObjectFeatures for BallFeatures<'_> {
    fn find(&mut self, frame: &GrayImage) -> Option<Sighting> {
        let found = self.detector.detect(frame).unwrap_or_default();
        found
            .iter()
            .find_map(|detection| sighting(*detection, None, frame))
    }
}

impl std::fmt::Debug for BallFeatures<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BallFeatures").finish_non_exhaustive()
    }
}

/// An egg: a body of revolution that is longer than it is thick, by centre and *shorter* half-axis
/// of its outline.
///
/// The outline of such a body is (nearly) an ellipse. Its longer half-axis depends on where one
/// looks from, its shorter one is the radius of a ball that is as thick as the egg at the same
/// distance, from everywhere: with it in the place of the radius, behaviours learned for that ball
/// reach the egg. Where the outline is longer than it is wide by a tenth, its direction is
/// [`Sighting::long_axis`], by which [`GripAcross`](crate::GripAcross) turns the hand.
#[derive(Clone, Debug)]
pub struct EggFeatures<E = Canny> {
    edge_detector: E,
    search: CurveSearch,
    limits: EggLimits,
    last: Option<Ellipse>,
}

/// Which ellipses can be the outline of an egg.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(remote = "Self")
)]
pub struct EggLimits {
    /// Least shorter half-axis, pixels.
    pub min_minor: f64,
    /// Greatest shorter half-axis, pixels.
    pub max_minor: f64,
    /// How many times as long as the shorter half-axis the longer one may be at most.
    pub elongation: f64,
}

checked!(EggLimits);

#[cfg(feature = "serde")]
impl EggLimits {
    /// Whether an ellipse can be within them; if not, why.
    fn check(&self) -> Result<(), String> {
        let Self {
            min_minor,
            max_minor,
            elongation,
        } = *self;
        if min_minor >= 0.0 && max_minor >= min_minor && elongation >= 1.0 {
            return Ok(());
        }
        Err(format!(
            "an outline with a shorter half-axis of {min_minor} to {max_minor} pixels and a longer one of up to {elongation} times that is none"
        ))
    }
}

impl<E: EdgeDetector> EggFeatures<E> {
    /// By the ellipses that `search` finds among the edges of `edge_detector`.
    pub fn new(edge_detector: E, search: CurveSearch, limits: EggLimits) -> Self {
        Self {
            edge_detector,
            search,
            limits,
            last: None,
        }
    }

    /// The outline seen last, pixels: its angle says how the object lies. `None` if nothing was
    /// found.
    pub fn outline(&self) -> Option<Ellipse> {
        self.last
    }
}

impl<E: EdgeDetector> ObjectFeatures for EggFeatures<E> {
    fn find(&mut self, frame: &GrayImage) -> Option<Sighting> {
        let edges = self.edge_detector.detect_edges(frame);
        let limits = self.limits;
        let found = self.search.find::<Ellipse>(edges, |ellipse| {
            (limits.min_minor..=limits.max_minor).contains(&ellipse.minor)
                && ellipse.major <= limits.elongation * ellipse.minor
        });
        let seen = found.into_iter().find_map(|found| {
            let detection = Detection {
                circle: Circle {
                    x: found.curve.x,
                    y: found.curve.y,
                    radius: found.curve.minor,
                },
                score: found.beta,
            };
            let Ellipse {
                major,
                minor,
                angle,
                ..
            } = found.curve;
            let long_axis = (major > LONG * minor).then_some(angle);
            Some((found.curve, sighting(detection, long_axis, frame)?))
        });
        self.last = seen.map(|(ellipse, _)| ellipse);
        seen.map(|(_, sighting)| sighting)
    }
}

/// How many times as long as the shorter half-axis the longer one must be for its direction to be
/// known.
const LONG: f64 = 1.1;

/// A detection in feature units, if its centre lies in the frame.
fn sighting(detection: Detection, long_axis: Option<f64>, frame: &GrayImage) -> Option<Sighting> {
    let height = Features::WIDTH * f64::from(frame.height()) / f64::from(frame.width());
    let features = Features::from_circle(&detection.circle, frame.width());
    let inside =
        (0.0..=Features::WIDTH).contains(&features.x) && (0.0..=height).contains(&features.y);
    (inside && features.r.is_finite()).then_some(Sighting {
        detection,
        features,
        long_axis,
    })
}
