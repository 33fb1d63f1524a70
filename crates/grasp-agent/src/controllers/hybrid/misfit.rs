//! Causes of residuals that are larger than the image noise, ranked by the pattern that fits best.

use hough_heuristic::Features;
use serde::{Deserialize, Serialize};

use crate::controllers::hybrid::belief::{Belief, Prior};
use crate::controllers::hybrid::evidence::Evidence;
use crate::controllers::hybrid::fit::Fit;
use crate::sight::camera_model::CameraModel;

/// Cause that explains best why the model of a controller does not fit what is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Misfit {
    /// Images show an earlier pose; see [`AgentConfig::lag_check`](crate::AgentConfig::lag_check).
    LateImages,
    /// The arm does not make small moves, although it reports them.
    DeadZone,
    /// The image is mirrored or turned by quarters of a turn.
    TurnedImage,
    /// The camera has moved in its mount since the model was learned.
    CameraSlipped,
    /// Grips miss where the sightings put the ball: the arm differs from its model.
    Arm,
    /// Some sightings show something else than the ball.
    Outliers,
    /// No known cause explains the sightings. The ball may be moving.
    Unexplained,
}

impl std::fmt::Display for Misfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::LateImages => "the images are late; take newer ones, or set lag_check",
            Self::DeadZone => "the arm does not make the small moves that it reports",
            Self::TurnedImage => "the image is mirrored or turned",
            Self::CameraSlipped => "the camera has moved in its mount",
            Self::Arm => "grips miss the ball that is seen; teach the goal, or check the arm",
            Self::Outliers => "some sightings are not of the ball",
            Self::Unexplained => "the ball may be moving, or the model of the cell is wrong",
        })
    }
}

/// Least number of sightings that are judged.
pub(crate) const ENOUGH: usize = 8;
/// Mean squared residual of a model that fits, feature units squared: twice the noise of a poor
/// camera.
const FITS: f64 = 9.0;
/// Largest cost of the right cause, as a share of the cost without it.
const EXPLAINED: f64 = 0.5;
/// Share below which it leaves no doubt.
const CLEAR: f64 = 0.2;
/// Largest share of sightings that can be outliers.
const FEW: f64 = 0.4;
/// Step of the dead zones that are tried, radians, and their number.
const DEAD_ZONES: (f64, usize) = (0.0045, 8);

/// Returns the cause of the residuals of one run, in which a ball at rest was seen; `None` if they
/// are as large as expected.
pub(crate) fn misfit(
    record: &Evidence,
    belief: &Belief,
    prior: &Prior,
    nominal: &CameraModel,
) -> Option<Misfit> {
    if record.len() < ENOUGH {
        return None;
    }
    let fresh = belief.fresh(prior);
    let fit = |record: &Evidence| Fit::of(&fresh, &fresh.numbers(), nominal, &[record]);
    // Mean cost of a residual: squared feature units, up to the outliers.
    let cost = |record: &Evidence| {
        let fit = fit(record).filter(|_| record.len() >= ENOUGH)?;
        Some(fit.cost / (3 * record.len()) as f64)
    };
    let plain = cost(record).unwrap_or(f64::INFINITY);
    let learned = Fit::of(belief, &belief.numbers(), nominal, &[record]);
    if plain < FITS {
        let by_learned = learned?.cost * belief.noise().powi(2) / (3 * record.len()) as f64;
        return (by_learned > 2.0 * FITS).then_some(Misfit::CameraSlipped);
    }
    let (w, h) = (Features::WIDTH, Features::HEIGHT);
    // Rows of the matrices by which x and y are turned.
    let turns = [
        [-1.0, 0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.0, -1.0],
        [0.0, 1.0, -1.0, 0.0],
        [0.0, -1.0, 1.0, 0.0],
    ];
    let turned = turns.map(|[xx, xy, yx, yy]| {
        let turned = |f: &Features| {
            let (x, y) = (f.x - 0.5 * w, f.y - 0.5 * h);
            let (x, y) = (xx * x + xy * y, yx * x + yy * y);
            Features::new(x + 0.5 * w, y + 0.5 * h, f.r)
        };
        (Misfit::TurnedImage, record.seen_as(turned))
    });
    let late = [1, 2, 3].map(|poses| (Misfit::LateImages, record.late(poses)));
    let zones = (1..=DEAD_ZONES.1).map(|i| DEAD_ZONES.0 * i as f64);
    let dead = zones.map(|zone| (Misfit::DeadZone, record.sticking(zone)));
    let causes = turned.into_iter().chain(late).chain(dead);
    let costs = causes.filter_map(|(cause, record)| Some((cause, cost(&record)?)));
    let best = costs.min_by(|a, b| a.1.total_cmp(&b.1));
    let (cause, least) = best.unwrap_or((Misfit::Unexplained, plain));
    let fits = fit(record).into_iter().chain(learned);
    let mut outliers = fits.filter_map(|fit| fit.outliers(nominal, record, FITS));
    Some(match least / plain {
        share if share < CLEAR => cause,
        _ if outliers.any(|share| share < FEW) => Misfit::Outliers,
        share if share < EXPLAINED => cause,
        _ => Misfit::Unexplained,
    })
}
