//! Sightings, the poses they were made from, and the links' positions behind the backlash.

use hough_heuristic::Features;
use puma_val2::Joints;

use crate::controllers::hybrid::parameters::{Numbers, at};

/// Path of the arm in one run, and the sightings of a ball at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Evidence {
    /// Reported joint angles, radians, in order.
    path: Vec<Joints>,
    sightings: Vec<(usize, Features)>,
}

impl Evidence {
    pub(crate) fn arm_at(&mut self, joints: &Joints) {
        self.path.push(*joints);
    }

    /// Records a sighting from the current pose.
    pub(crate) fn saw(&mut self, features: Features) {
        if let Some(last) = self.path.len().checked_sub(1) {
            self.sightings.push((last, features));
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.sightings.len()
    }

    /// Drops the sightings and keeps the path, which determines the backlash.
    pub(crate) fn forget_sightings(&mut self) {
        self.sightings.clear();
    }

    /// Returns the links' angles at each sighting, with its features.
    pub(crate) fn views(&self, numbers: &Numbers) -> Vec<(Joints, Features)> {
        let mut links = Links::new(numbers);
        let mut views = Vec::with_capacity(self.sightings.len());
        let mut next = self.sightings.iter().peekable();
        for (index, motors) in self.path.iter().enumerate() {
            links.follow(motors);
            while let Some((_, features)) = next.next_if(|(seen_at, _)| *seen_at == index) {
                views.push((links.stand, *features));
            }
        }
        views
    }

    /// Returns the links at the end of the path.
    pub(crate) fn links(&self, numbers: &Numbers) -> Links {
        let mut links = Links::new(numbers);
        for motors in &self.path {
            links.follow(motors);
        }
        links
    }
}

/// Links of the first three joints. A link follows its motor once the backlash is taken up.
#[derive(Clone, Debug)]
pub(crate) struct Links {
    half: [f64; 3],
    stand: Joints,
    begun: bool,
}

impl Links {
    fn new(numbers: &Numbers) -> Self {
        Self {
            half: std::array::from_fn(|i| 0.5 * numbers[at::PLAY + i].max(0.0)),
            stand: Joints::default(),
            begun: false,
        }
    }

    /// Turns the motors to `motors`.
    pub(crate) fn follow(&mut self, motors: &Joints) {
        for i in 0..6 {
            let half = if i < 3 { self.half[i] } else { 0.0 };
            let motor = motors.0[i];
            // `max` and `min` would hide NaN.
            self.stand.0[i] = match self.stand.0[i] {
                _ if !self.begun || motor.is_nan() => motor,
                at if at < motor - half => motor - half,
                at if at > motor + half => motor + half,
                at => at,
            };
        }
        self.begun = true;
    }

    /// Returns the links' angles.
    pub(crate) fn stand(&self) -> &Joints {
        &self.stand
    }

    /// Returns the motor angles that bring the links to `target`.
    pub(crate) fn motors_for(&self, target: &Joints, motors: &Joints) -> Joints {
        Joints(std::array::from_fn(|i| {
            let way = target.0[i] - self.stand.0[i];
            if i >= 3 {
                target.0[i]
            } else if way.abs() < 1e-9 {
                motors.0[i]
            } else {
                target.0[i] + self.half[i].copysign(way)
            }
        }))
    }
}
