//! Sightings, the poses they were made from, and the true joint angles behind play and arm errors.

use hough_heuristic::Features;
use puma_val2::{Arm, Joints};
use serde::{Deserialize, Serialize};

use crate::controllers::hybrid::parameters::{Numbers, at};
use crate::error::BehaviourError;

/// Path of the arm in one run, and the sightings of a ball at rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Evidence {
    /// Reported joint angles, radians, in order.
    path: Vec<Joints>,
    sightings: Vec<(usize, Features)>,
    /// Pose of the path at which the jaws closed around the ball, and the standard deviation of the
    /// ball from their middle, metres.
    held: Option<(usize, f64)>,
}

/// True joint angles at each sighting, with its features, and where the jaws closed.
pub(crate) struct Stands {
    pub(crate) views: Vec<(Joints, Features)>,
    pub(crate) held: Option<(Joints, f64)>,
}

impl Evidence {
    /// Checks what was read: sightings at places of the path, and numbers that are finite.
    pub(crate) fn check(&self) -> Result<(), BehaviourError> {
        let inside = |at: usize| at < self.path.len();
        let placed = self.sightings.iter().all(|(at, _)| inside(*at))
            && self
                .held
                .is_none_or(|(at, unsure)| inside(at) && unsure > 0.0);
        let angles = self.path.iter().flat_map(|joints| joints.0);
        let seen = self.sightings.iter().flat_map(|(_, f)| [f.x, f.y, f.r]);
        if placed && angles.chain(seen).all(f64::is_finite) {
            return Ok(());
        }
        Err(BehaviourError::Text {
            what: "the sightings of the run before are damaged".into(),
        })
    }

    /// Creates the evidence of a ball that shows as `seen` from a pose and is between the jaws, up
    /// to `unsure` metres, after the move to another.
    pub(crate) fn shown(seen: Features, [from, gripping]: [Joints; 2], unsure: f64) -> Self {
        Self {
            path: vec![from, gripping],
            sightings: vec![(0, seen)],
            held: Some((1, unsure)),
        }
    }

    pub(crate) fn arm_at(&mut self, joints: &Joints) {
        self.path.push(*joints);
    }

    /// Records a sighting from the current pose.
    pub(crate) fn saw(&mut self, features: Features) {
        if let Some(last) = self.path.len().checked_sub(1)
            && self.sightings.last() != Some(&(last, features))
        {
            self.sightings.push((last, features));
        }
    }

    /// Records that the jaws closed around the ball at `joints`, up to `unsure` metres.
    pub(crate) fn held_at(&mut self, joints: &Joints, unsure: f64) {
        let index = self.path.iter().rposition(|pose| pose == joints);
        self.held = index.map(|index| (index, unsure));
    }

    pub(crate) fn is_held(&self) -> bool {
        self.held.is_some()
    }

    /// Changes the standard deviation of a ball that is held.
    pub(crate) fn hold_within(&mut self, deviation: f64) {
        if let Some((_, unsure)) = &mut self.held {
            *unsure = deviation;
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.sightings.len()
    }

    /// Returns `true` if it says more than where the ball was: two sightings, or one and a grip.
    pub(crate) fn tells(&self) -> bool {
        self.len() + usize::from(self.held.is_some()) >= 2
    }

    /// Drops the sightings and keeps the path, which determines the backlash.
    pub(crate) fn forget_sightings(&mut self) {
        self.sightings.clear();
        self.held = None;
    }

    /// Returns the evidence with those sightings, from a pose, that `keep` chooses.
    pub(crate) fn with_sightings(&self, mut keep: impl FnMut(&Joints, &Features) -> bool) -> Self {
        let mut evidence = self.clone();
        let path = &self.path;
        evidence
            .sightings
            .retain(|(at, seen)| keep(&path[*at], seen));
        evidence
    }

    /// Returns the evidence with the first of the sightings that repeat one another.
    pub(crate) fn thinned(&self) -> Self {
        /// Least turn of a joint between two poses, radians, or distance in the image, units.
        const APART: (f64, f64) = (0.001, 5.0);
        const MOST: usize = 32;
        let mut last: Option<(Joints, Features)> = None;
        let mut left = MOST;
        self.with_sightings(|pose, seen| {
            let apart = |(stood, before): (Joints, Features)| {
                (0..3).any(|i| (stood.0[i] - pose.0[i]).abs() > APART.0)
                    || (before.x - seen.x).hypot(before.y - seen.y) > APART.1
            };
            let keep = left > 0 && last.is_none_or(apart);
            if keep {
                (last, left) = (Some((*pose, *seen)), left - 1);
            }
            keep
        })
    }

    /// Returns the evidence with a path on which `JT2` turns `JT3` by this share.
    pub(crate) fn dragged(&self, share: f64, arm: &Arm) -> Self {
        let (mut evidence, [middle, _]) = (self.clone(), middle(arm));
        for pose in &mut evidence.path {
            pose.0[2] += share * (pose.0[1] - middle);
        }
        evidence
    }

    /// Returns the evidence with other features in the sightings.
    pub(crate) fn seen_as(&self, other: impl Fn(&Features) -> Features) -> Self {
        let mut evidence = self.clone();
        for (_, features) in &mut evidence.sightings {
            *features = other(features);
        }
        evidence
    }

    /// Returns the sightings as made so many poses before. `surely` leaves those after a pose
    /// without a sighting out: the number of looks there is unknown, though mostly one.
    pub(crate) fn late(&self, poses: usize, surely: bool) -> Self {
        let mut evidence = self.clone();
        evidence.sightings.clear();
        for (at, features) in &self.sightings {
            let seen = |earlier: usize| self.sightings.iter().any(|(at, _)| *at == earlier);
            let first = evidence
                .sightings
                .last()
                .is_none_or(|(last, _)| last + poses < *at);
            if let Some(from) = at.checked_sub(poses)
                && first
                && (!surely || (from..*at).all(seen))
            {
                evidence.sightings.push((from, *features));
            }
        }
        evidence
    }

    /// Returns the evidence with a path on which the first three joints do not make turns of less
    /// than so many radians.
    pub(crate) fn sticking(&self, zones: [f64; 3]) -> Self {
        let mut evidence = self.clone();
        for i in 1..evidence.path.len() {
            for (joint, zone) in zones.into_iter().enumerate() {
                let stands = evidence.path[i - 1].0[joint];
                let wanted = &mut evidence.path[i].0[joint];
                if (*wanted - stands).abs() < zone {
                    *wanted = stands;
                }
            }
        }
        evidence
    }

    /// Returns the true joint angles at each sighting and at the grip.
    pub(crate) fn stands(&self, numbers: &Numbers, arm: &Arm) -> Stands {
        let mut links = Links::new(numbers, arm);
        let mut stands = Stands {
            views: Vec::with_capacity(self.sightings.len()),
            held: None,
        };
        let mut next = self.sightings.iter().peekable();
        for (index, motors) in self.path.iter().enumerate() {
            links.follow(motors);
            while let Some((_, features)) = next.next_if(|(seen_at, _)| *seen_at == index) {
                stands.views.push((links.stand(), *features));
            }
            if let Some((_, unsure)) = self.held.filter(|(at, _)| *at == index) {
                stands.held = Some((links.stand(), unsure));
            }
        }
        stands
    }

    /// Returns the links at the end of the path.
    pub(crate) fn links<'a>(&self, numbers: &Numbers, arm: &'a Arm) -> Links<'a> {
        let mut links = Links::new(numbers, arm);
        for motors in &self.path {
            links.follow(motors);
        }
        links
    }
}

/// Links of the arm. Those of the first three joints follow their motors once the backlash is taken
/// up, and stand beside them by the errors of the arm.
#[derive(Clone, Debug)]
pub(crate) struct Links<'a> {
    arm: &'a Arm,
    half: [f64; 3],
    /// Zero of `JT3`, gears of `JT2` and `JT3`, sag, coupling.
    errors: [f64; 5],
    /// Angles with the backlash, before the errors of the arm.
    driven: Joints,
    begun: bool,
}

/// Returns the angles of `JT2` and `JT3`, radians, at which gears and coupling displace nothing:
/// those of a PUMA at work, the middle of the range of another arm.
fn middle(arm: &Arm) -> [f64; 2] {
    match arm {
        Arm::Puma(_) => [-1.4, 3.3],
        Arm::Serial { limits, .. } => [1, 2].map(|i: usize| 0.5 * (limits[i].0 + limits[i].1)),
    }
}

impl<'a> Links<'a> {
    fn new(numbers: &Numbers, arm: &'a Arm) -> Self {
        Self {
            arm,
            half: std::array::from_fn(|i| 0.5 * numbers[at::PLAY + i].max(0.0)),
            errors: std::array::from_fn(|i| numbers[at::ARM + i]),
            driven: Joints::default(),
            begun: false,
        }
    }

    /// Turns the motors to `motors`.
    pub(crate) fn follow(&mut self, motors: &Joints) {
        for i in 0..6 {
            let half = if i < 3 { self.half[i] } else { 0.0 };
            let motor = motors.0[i];
            // `max` and `min` would hide NaN.
            self.driven.0[i] = match self.driven.0[i] {
                _ if !self.begun || motor.is_nan() => motor,
                at if at < motor - half => motor - half,
                at if at > motor + half => motor + half,
                at => at,
            };
        }
        self.begun = true;
    }

    /// Returns the true joint angles.
    pub(crate) fn stand(&self) -> Joints {
        self.bent(&self.driven)
    }

    fn bent(&self, driven: &Joints) -> Joints {
        let [zero, gear2, gear3, sag, coupling] = self.errors;
        let middle = middle(self.arm);
        let [j2, j3] = [driven.0[1] - middle[0], driven.0[2] - middle[1]];
        let mut bent = *driven;
        let fall = if sag == 0.0 {
            0.0
        } else {
            sag * self.arm.droop(driven)
        };
        bent.0[1] += gear2 * j2 + fall + coupling * j3;
        bent.0[2] += zero + gear3 * j3;
        bent
    }

    /// Returns the motor angles that bring the links to `target`, from where the motors are.
    pub(crate) fn motors_for(&self, target: &Joints, motors: &Joints) -> Joints {
        /// The errors of the arm are small: each round divides the rest by ten and more.
        const ROUNDS: usize = 8;
        let mut driven = *target;
        for _ in 0..ROUNDS {
            let bent = self.bent(&driven);
            for i in 1..3 {
                driven.0[i] += target.0[i] - bent.0[i];
            }
        }
        Joints(std::array::from_fn(|i| {
            let way = driven.0[i] - self.driven.0[i];
            if i >= 3 {
                driven.0[i]
            } else if way.abs() < 1e-9 {
                motors.0[i]
            } else {
                driven.0[i] + self.half[i].copysign(way)
            }
        }))
    }
}
