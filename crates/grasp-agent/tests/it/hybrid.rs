//! The hybrid finds out what is wrong with the camera, and aims its grip by it.

use grasp_agent::hough_heuristic::Features;
use grasp_agent::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use grasp_agent::puma_val2::{JointDelta, Joints};
use grasp_agent::{
    Agent, CameraModel, Controller, Decision, EventLog, Feedback, GaveUp, Hybrid, HybridSettings,
    JointLimits, Request, Sighting, TaughtGoal,
};
use grasp_agent::{Behaviour, BehaviourSpec, Belief, Prior};

use crate::cell::{Fault, Shared, agent_of, config, hybrid};

#[test]
fn the_camera_is_learned_from_moves_alone() {
    let nominal = CameraModel::paper();
    let truth = wrong(1.0);
    let mut agent = agent_of(hybrid());
    for run in 0..40 {
        let azimuth = 0.04 * f64::from(run) - 0.8;
        let rho = 0.55 + 0.005 * f64::from(run % 20);
        let ball = [
            rho * azimuth.cos(),
            rho * azimuth.sin(),
            -0.15 + 0.01 * f64::from(run % 13),
        ];
        let cell = Shared::new(truth, ball, Fault::None);
        let outcome = cell.run(&mut agent, &mut EventLog::default()).unwrap();
        if run >= 20 && outcome.gave_up.is_none() {
            assert!(outcome.cycles <= 8, "run {run}: {outcome:?}");
            assert!(cell.miss() < 0.004, "run {run}: {}", cell.miss());
        }
    }
    let learned = agent.controller().belief().corrected(&nominal);
    assert!(
        (learned.focal / truth.focal - 1.0).abs() < 0.01,
        "{}",
        learned.focal
    );
    assert!(
        (learned.ball_radius / truth.ball_radius - 1.0).abs() < 0.02,
        "{}",
        learned.ball_radius
    );
    let off = learned.mount.inverse() * truth.mount;
    assert!(
        off.rotation.angle() < 0.02 && off.translation.vector.norm() < 0.003,
        "{off}"
    );
}

#[test]
fn a_saved_belief_comes_back_and_other_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera.belief");
    let belief = Belief::new(&Prior::by_eye());
    belief.save(&path).unwrap();
    assert_eq!(Belief::load(&path).unwrap(), belief);
    let refused = Behaviour::load(&path, &BehaviourSpec::centering()).unwrap_err();
    assert!(refused.to_string().contains("belief"), "{refused}");
    assert!(Belief::load(&folder.path().join("none")).is_err());
}

/// A camera that differs from the nominal one as `share` of a heavy error.
fn wrong(share: f64) -> CameraModel {
    let nominal = CameraModel::paper();
    let off = Isometry3::from_parts(
        Translation3::new(0.01 * share, -0.015 * share, 0.01 * share),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.08, -0.06, 0.1) * share),
    );
    CameraModel {
        focal: nominal.focal * (1.0 + 0.2 * share),
        mount: nominal.mount * off,
        ball_radius: nominal.ball_radius * (1.0 - 0.1 * share),
        ..nominal
    }
}

/// Runs on 20 balls in a cell with the camera `truth`; how many moves each of the last ten took.
fn runs(agent: &mut Agent<Hybrid>, truth: CameraModel) -> Vec<usize> {
    let mut cycles = Vec::new();
    for run in 0..20 {
        let (azimuth, rho) = (
            0.032 * f64::from(run * 7 % 20) - 0.4,
            0.55 + 0.005 * f64::from(run),
        );
        let height = -0.15 + 0.01 * f64::from(run % 13);
        let cell = Shared::new(
            truth,
            [rho * azimuth.cos(), rho * azimuth.sin(), height],
            Fault::None,
        );
        let outcome = cell.run(agent, &mut EventLog::default()).unwrap();
        if outcome.gave_up != Some(GaveUp::NotFound) {
            cycles.push(outcome.cycles);
        }
    }
    cycles.split_off(cycles.len().saturating_sub(10))
}

/// Logarithm of the focal length over the nominal one, and its standard deviation.
fn focal(agent: &Agent<Hybrid>) -> (f64, f64) {
    let belief = agent.controller().belief();
    (belief.mean()[0], belief.deviations()[0])
}

#[test]
fn a_hybrid_with_a_belief_goes_on_learning() {
    let new = |hybrid| agent_of(hybrid);
    let mut first = new(hybrid());
    runs(&mut first, wrong(1.0));
    let learned = first.controller().belief().clone();
    let (mean, deviation) = focal(&first);
    assert!(
        (mean - 1.2_f64.ln()).abs() < 0.005 && deviation < 0.01,
        "{mean} {deviation}"
    );

    // In the same cell, what was known before counts from the first run on.
    let mut again = new(Hybrid::with_belief(
        HybridSettings::paper(),
        learned.clone(),
    ));
    let cell = Shared::new(wrong(1.0), [0.6, 0.1, -0.1], Fault::None);
    let outcome = cell.run(&mut again, &mut EventLog::default()).unwrap();
    assert!(
        outcome.gave_up.is_none() && outcome.cycles <= 3,
        "{outcome:?}"
    );
    let after_one = focal(&again);
    assert!(
        after_one.1 < 0.02 && (after_one.0 - mean).abs() < 0.01,
        "{after_one:?}"
    );
    runs(&mut again, wrong(1.0));
    let after_all = focal(&again);
    assert!(
        after_all.1 < 1.1 * deviation,
        "{after_all:?} from {deviation}"
    );

    // In a cell whose camera has been exchanged, that one is learned instead.
    for share in [0.7, 0.3, 0.0, -0.3] {
        let mut moved = new(Hybrid::with_belief(
            HybridSettings::paper(),
            learned.clone(),
        ));
        let cycles = runs(&mut moved, wrong(share));
        assert!(
            cycles.iter().all(|cycles| *cycles <= 5),
            "{share}: {cycles:?}"
        );
        let mean = focal(&moved).0;
        assert!(
            (mean - (1.0 + 0.2 * share).ln()).abs() < 0.005,
            "{share}: {mean}"
        );
    }
}

#[test]
fn a_ball_that_the_fixed_grip_has_missed_is_aimed_at() {
    let features = Features::new(103.5, 78.0, 33.0);
    let ball = Sighting::new(features);
    let joints = Joints::from_degrees([0.0, -55.0, 184.0, 0.0, 45.0, 0.0]);
    let request = Request {
        joints,
        limits: JointLimits::paper(),
        grip: true,
    };
    let begin = |hybrid: &mut Hybrid| {
        hybrid.notice(&Feedback::Begin);
        hybrid.notice(&Feedback::Arm(joints));
    };
    let aim = |hybrid: &mut Hybrid| match hybrid.decide(&ball, &request) {
        Ok(Decision::Grip(delta)) => Some(delta.degrees()),
        _ => None,
    };
    let mut hybrid = hybrid();
    begin(&mut hybrid);
    // One sighting with a camera of which nothing is known: where the ball is, is not certain
    // enough.
    assert_eq!(aim(&mut hybrid), None);
    let mut tries = (0..4).filter_map(|_| aim(&mut hybrid));
    let own = tries.next().expect("an aim of its own, sooner or later");
    assert!((own[4] + 18.01).abs() < 1e-6, "{own:?}");
    // A goal that was shown with a turn of JT4 is aimed at with that turn.
    let grip = JointDelta::from_degrees([0.0, 0.0, 0.0, 8.0, -14.0, 0.0]);
    let goal = TaughtGoal::new(&config().goal, features, joints, grip).unwrap();
    let mut shown = Hybrid::new(HybridSettings::paper()).shown(&goal);
    begin(&mut shown);
    let mut tries = (0..4).filter_map(|_| aim(&mut shown));
    let own = tries.next().expect("an aim of its own");
    let close = (own[3] - 8.0).abs() < 1e-6 && (own[4] + 14.0).abs() < 1e-6;
    assert!(close, "{own:?}");
    // In the next run it is as careful as ever.
    begin(&mut hybrid);
    assert_eq!(aim(&mut hybrid), None);
}
