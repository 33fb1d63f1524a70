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
    /// The arm does not make small moves, or a joint none at all, although it reports them.
    DeadZone,
    /// The image is mirrored or turned by quarters of a turn.
    TurnedImage,
    /// The camera has moved in its mount, or its lens was turned, since the model was learned.
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
            Self::DeadZone => "the arm does not make all moves that it reports",
            Self::TurnedImage => "the image is mirrored or turned",
            Self::CameraSlipped => "the camera has moved in its mount, or its lens was turned",
            Self::Arm => "grips miss the ball that is seen; teach the goal, or check the arm",
            Self::Outliers => "some sightings are not of the ball",
            Self::Unexplained => "the ball may be moving, or the model of the cell is wrong",
        })
    }
}

/// Least number of sightings that are judged.
pub(crate) const ENOUGH: usize = 8;
/// Cost of a sighting whose residuals are as large as those of a poor camera, feature units
/// squared.
const FITS: f64 = 12.0;
/// Least number of different sightings that are judged, and the least cost that a cause saves.
const TELLS: (usize, f64) = (3, 30.0);
/// Number of different sightings of a run from which on the run before is not needed.
const TELLING: usize = 5;
/// Largest cost of another cause than outliers, as a share of the cost with outliers alone.
const BESIDE: f64 = 0.8;
/// Largest cost of the right cause, as a share of the cost without it.
const EXPLAINED: f64 = 0.6;
/// Cost of a sighting that is taken for an outlier, feature units squared, and the largest share of
/// such sightings.
const OUTLYING: (f64, f64) = (30.0, 0.7);
/// Least share of the sightings of which a lag says the pose.
const WHOLE: f64 = 0.5;
/// Dead zones that are tried, radians: the first, and the ratio of one to the next.
const DEAD_ZONES: (f64, f64, i32) = (0.005, 1.2, 14);
/// Turns of `JT3` per turn of `JT2` that are tried.
const DRAGS: [f64; 4] = [-0.3, -0.12, 0.12, 0.3];

/// Returns the cause of the residuals of one run, in which a ball at rest was seen; `None` if they
/// are as large as expected. `calm` says that the runs before did fit.
pub(crate) fn misfit(
    [recent, record]: [&Evidence; 2],
    belief: &Belief,
    prior: &Prior,
    nominal: &CameraModel,
    calm: bool,
) -> Option<Misfit> {
    let fresh = belief.fresh(prior);
    // An arm that stands in few poses tells too little in one run.
    let many = record.thinned().len() >= TELLING;
    let none = Evidence::default();
    let recent = if many { &none } else { recent };
    let pair = |other: &dyn Fn(&Evidence) -> Evidence| [other(recent), other(record)];
    // Mean cost of a sighting: squared feature units, up to the outliers.
    let cost = |records: &[Evidence; 2]| {
        let records = [records[0].thinned(), records[1].thinned()];
        let number = records[0].len() + records[1].len();
        let seen: Vec<_> = records.iter().filter(|r| r.len() > 0).collect();
        let fit = Fit::of(&fresh, &fresh.numbers(), nominal, &seen)?;
        (number >= TELLS.0).then(|| fit.cost / number as f64)
    };
    let plain = cost(&pair(&Evidence::clone))?;
    // A noisy camera that fits otherwise.
    let usual = FITS.max(3.0 * belief.noise().powi(2));
    if plain < FITS {
        let learned = Fit::of(belief, &belief.numbers(), nominal, &[&record.thinned()])?;
        let by_learned = learned.cost * belief.noise().powi(2) / record.thinned().len() as f64;
        return (calm && by_learned > 2.0 * usual).then_some(Misfit::CameraSlipped);
    }
    let (w, h) = (Features::WIDTH, Features::HEIGHT);
    // Rows of the matrices by which x and y are turned.
    let turns = [
        [-1.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, -1.0],
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
        (Misfit::TurnedImage, pair(&|record| record.seen_as(turned)))
    });
    let lags = [1, 2, 3].map(|poses| [(poses, true), (poses, false)]);
    let late = lags.as_flattened().iter().map(|(poses, surely)| {
        let late = pair(&|record| record.late(*poses, *surely));
        (Misfit::LateImages, late)
    });
    let (least, ratio, number) = DEAD_ZONES;
    let small = (0..number).map(|i| [least * ratio.powi(i); 3]);
    let never = f64::INFINITY;
    let joints = [0, 1, 2].map(|joint| {
        let mut zones = [0.0; 3];
        zones[joint] = never;
        zones
    });
    let sticking = |zones| (Misfit::DeadZone, pair(&|record| record.sticking(zones)));
    // Joints that stand explain whatever repeats, as a false circle does; so they must fit.
    let standing = joints.into_iter().chain([[never; 3]]).map(sticking);
    let standing = standing.filter(|(_, record)| cost(record).is_some_and(|cost| cost < FITS));
    let dead = small.map(sticking).chain(standing);
    let dragged = DRAGS.map(|share| {
        (
            Misfit::Arm,
            pair(&|record| record.dragged(share, &nominal.arm)),
        )
    });
    let plainly = std::iter::once((Misfit::Outliers, pair(&Evidence::clone)));
    let causes = turned.into_iter().chain(late).chain(dead).chain(dragged);
    let number = record.len() as f64;
    let mut best: Option<(Misfit, f64)> = None;
    let mut of_cause: Vec<(Misfit, f64, [Evidence; 2])> = Vec::new();
    for (cause, record) in causes.chain(plainly) {
        let most = record[1].len() as f64;
        let cost = match cause {
            Misfit::Outliers => Some(plain),
            // A lag leaves sightings after one that is missing out.
            Misfit::LateImages if most < WHOLE * number => None,
            _ => cost(&record),
        };
        let Some(cost) = cost else { continue };
        match of_cause.iter_mut().find(|other| other.0 == cause) {
            Some(other) if other.1 <= cost => {}
            Some(other) => *other = (cause, cost, record),
            None => of_cause.push((cause, cost, record)),
        }
    }
    let rest = |record: &Evidence| {
        without_outliers(&record.thinned(), &fresh, nominal).unwrap_or(f64::INFINITY)
    };
    let outliers = rest(record);
    for (cause, cost, record) in of_cause {
        // Outliers alone say more than outliers and another cause that saves little beside them.
        let least = match cause {
            Misfit::Outliers => outliers,
            _ => cost.min(rest(&record[1])) / BESIDE,
        };
        if best.is_none_or(|(_, other)| least < other) {
            best = Some((cause, least));
        }
    }
    let tells = |cause, cost: f64| {
        let own = if cause == Misfit::Outliers {
            cost
        } else {
            BESIDE * cost
        };
        own < EXPLAINED * plain && (plain - own) * number > TELLS.1
    };
    let explained = best.filter(|(cause, cost)| tells(*cause, *cost));
    let unexplained = (plain > usual).then_some(Misfit::Unexplained);
    explained.map(|(cause, _)| cause).or(unexplained)
}

/// Returns the mean cost of a sighting if the sightings that lie far from their expected place are
/// outliers; `None` if too many do. A few successive sightings, tried at several places, show where
/// the others are expected.
fn without_outliers(record: &Evidence, fresh: &Belief, nominal: &CameraModel) -> Option<f64> {
    /// Distances in the image beyond which a sighting is left out, feature units, in order.
    const FAR: [f64; 3] = [20.0, 10.0, 10.0];
    const TRIES: usize = 8;
    const FEW: usize = 3;
    let (cost, share) = OUTLYING;
    let fit = |kept: &Evidence| Fit::of(fresh, &fresh.numbers(), nominal, &[kept]);
    let within = |kept: &Evidence, far| fit(kept)?.within(nominal, record, far);
    let number = record.len();
    let tries = (0..TRIES).filter_map(|i| {
        let first = i * number.saturating_sub(FEW) / (TRIES - 1);
        let mut index = 0;
        let few = record.with_sightings(|_, _| {
            index += 1;
            (first + 1..first + 1 + FEW).contains(&index)
        });
        within(&few, 2.0 * FAR[0])
    });
    let mut kept = tries.max_by_key(Evidence::len)?;
    for far in FAR {
        kept = within(&kept, far)?;
    }
    let left = number - kept.len();
    let total = fit(&kept)?.cost + cost * left as f64;
    let few = left as f64 <= share * number as f64;
    (few && left > 0 && kept.len() > FEW).then(|| total / number as f64)
}
