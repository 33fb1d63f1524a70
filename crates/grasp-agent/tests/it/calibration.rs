//! Hand-eye calibration by looks at a ball, in cells that are wrong in every way that it knows.

use grasp_agent::hough_heuristic::{Features, FrameError};
use grasp_agent::puma_val2::{Joint, JointDelta, Joints, Manipulator};
use grasp_agent::{AgentError, Calibration, CameraModel, Eye, HandEye, Sighting};

use crate::plant::{HEAVY, Level, Odd, Plant, Site};

/// Zeros of the joints that looks can tell, degrees.
const ZEROS: [f64; 3] = [0.0, 1.5, -1.0];

/// A heavily wrong cell with little noise.
fn cell(seed: u64) -> Plant {
    let Level(mut of) = HEAVY;
    (of[2], of[3]) = (0.0, 0.1);
    let odd = Odd {
        zeros: ZEROS.map(f64::to_radians),
        ..Odd::default()
    };
    Plant::at(Site::puma(), Level(of), odd, seed)
}

/// Moves the arm to a search pose that shows the ball.
fn find(plant: &Plant) {
    let mut arm = plant.clone();
    let poses = Site::puma().config.search_poses;
    let seen = poses.iter().find(|pose| {
        arm.move_to(**pose).unwrap();
        arm.look().unwrap().is_some()
    });
    assert!(seen.is_some(), "no search pose shows the ball");
}

fn calibrated(plant: &Plant, task: &HandEye, eye: &mut dyn Eye) -> Result<Calibration, AgentError> {
    task.calibrate(eye, &mut plant.clone(), &mut |_| true)
}

/// Errors of a calibration over their standard errors.
fn deviations(found: &Calibration, truth: &CameraModel) -> Vec<f64> {
    let model = &found.model;
    let turn = (model.mount.rotation.inverse() * truth.mount.rotation).scaled_axis();
    let shift = truth.mount.translation.vector - model.mount.translation.vector;
    let mut off: Vec<f64> = turn.iter().map(|turn| turn.to_degrees()).collect();
    off.extend(shift.iter().map(|shift| 1000.0 * shift));
    off.push(truth.focal - model.focal);
    off.extend([0, 1].map(|i| truth.centre[i] - model.centre[i]));
    off.push(-found.distortion);
    off.push(1000.0 * (truth.ball_radius - model.ball_radius));
    let zeros = [Joint::J2, Joint::J3].map(|joint| {
        let zero = found.zeros[joint].to_degrees();
        ZEROS[joint.index()] - zero
    });
    let errors: Vec<f64> = found.estimates.iter().map(|e| e.error).collect();
    let ball = off.len()..off.len() + 3;
    let errors = errors[..ball.start].iter().chain(&errors[ball.end..]);
    off.extend(zeros);
    off.iter()
        .zip(errors)
        .map(|(off, error)| off / error)
        .collect()
}

#[test]
fn standard_errors_of_a_calibration_hold() {
    let mut all = Vec::new();
    for seed in 0..3 {
        let plant = cell(seed);
        plant.place_ball(seed);
        find(&plant);
        let task = HandEye::new(CameraModel::paper());
        let found = calibrated(&plant, &task, &mut plant.clone()).unwrap();
        assert_eq!(found.left_out, 0, "seed {seed}");
        assert!(found.noise[0] < 0.3, "seed {seed}: {found}");
        all.extend(deviations(&found, &plant.truth()));
    }
    let within = all.iter().filter(|z| z.abs() < 2.0).count();
    let most = all.iter().fold(0.0, |most: f64, z| most.max(z.abs()));
    // Of 39 that depend on one another within a cell.
    assert!(
        within * 100 > 75 * all.len() && most < 5.0,
        "{within} {most}: {all:.1?}"
    );
}

/// Shows the ball elsewhere in some looks, or nothing.
struct Glitch(Plant, fn(usize) -> bool, Option<Features>, usize);

impl Eye for Glitch {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        self.3 += 1;
        let seen = self.0.look()?;
        let wrong = (self.1)(self.3);
        Ok(if wrong {
            self.2.map(Sighting::new)
        } else {
            seen
        })
    }
}

#[test]
fn false_and_missed_looks_do_not_spoil_a_calibration() {
    let plant = cell(3);
    plant.place_ball(3);
    for elsewhere in [None, Some(Features::new(50.0, 30.0, 14.0))] {
        find(&plant);
        let mut eye = Glitch(plant.clone(), |look| look == 7 || look == 11, elsewhere, 0);
        let task = HandEye::new(CameraModel::paper());
        let found = calibrated(&plant, &task, &mut eye).unwrap();
        assert_eq!(found.left_out, if elsewhere.is_some() { 2 } else { 0 });
        let off = (found.model.focal / plant.truth().focal).ln();
        assert!(off.abs() < 0.02, "{elsewhere:?}: {found}");
    }
}

#[test]
fn calibrations_that_cannot_be_made_are_refused_with_the_reason() {
    let plant = cell(1);
    plant.place_ball(1);
    let task = HandEye::new(CameraModel::paper());
    let blind = |look: fn(usize) -> bool| {
        find(&plant);
        let mut eye = Glitch(plant.clone(), look, None, 0);
        calibrated(&plant, &task, &mut eye).unwrap_err().to_string()
    };
    assert!(blind(|_| true).contains("not in view"));
    assert!(blind(|look| look > 3).contains("lost in two of three"));
    let few = HandEye {
        looks: 4,
        ..task.clone()
    };
    let refused = few.fit(&[]).unwrap_err().to_string();
    assert!(refused.contains("4 looks are too few"), "{refused}");
    // Turns of the first joint alone show the ball from one distance and one side.
    let model = CameraModel::paper();
    let from = Joints::from_degrees([0.0, -80.0, 195.0, 0.0, 45.0, 0.0]);
    let ball = model
        .locate(&from, &Features::new(96.0, 72.0, 20.0))
        .unwrap();
    let looks: Vec<_> = (-7..8)
        .map(|turn| from + JointDelta::of(Joint::J1, 0.01 * f64::from(turn)))
        .filter_map(|joints| Some((joints, model.view(&joints, &ball)?)))
        .collect();
    let refused = task.fit(&looks).unwrap_err().to_string();
    assert!(refused.contains("do not determine"), "{refused}");
}

#[test]
fn looks_at_a_ball_that_was_pushed_are_refused() {
    let model = CameraModel::paper();
    let looks = |pushed: f64| {
        let look = |k: i32| {
            let turn = |step: i32| f64::from((k * step) % 11 - 5);
            let wrist = [8.0 * turn(5), 45.0 + 4.0 * turn(2), 8.0 * turn(7)];
            let [j4, j5, j6] = wrist;
            let joints = [turn(3), -80.0 + turn(4), 190.0 + turn(6), j4, j5, j6];
            let joints = Joints::from_degrees(joints);
            let aside = if k > 8 { pushed } else { 0.0 };
            Some((
                joints,
                model.view(&joints, &[0.75, 0.15 + aside, -0.15].into())?,
            ))
        };
        (0..20).filter_map(look).collect::<Vec<_>>()
    };
    let task = HandEye::new(model);
    let found = task.fit(&looks(0.0)).unwrap();
    assert!((found.model.focal / model.focal - 1.0).abs() < 1e-3);
    let refused = task.fit(&looks(0.04)).unwrap_err().to_string();
    assert!(refused.contains("the ball rests"), "{refused}");
}
