//! Cutting of moves, and numbers that are not finite.

use super::*;
use puma_val2::Joint;

#[test]
fn turns_are_cut_to_steps_and_nan_stays_nan() {
    let (hybrid, limits) = (Hybrid::new(HybridSettings::paper()), JointLimits::paper());
    let from = Joints::from_degrees([0.0, -80.0, 190.0, 0.0, 45.0, 0.0]);
    let cut = |turn: f64, hybrid: &Hybrid| {
        let delta = hybrid.cut(&(from + JointDelta::of(Joint::J1, turn)), &from, &limits);
        (delta[Joint::J1], limits.admit(&(from + delta)))
    };
    let step = 5_f64.to_radians();
    for (turn, expected) in [(0.01, 0.01), (1.0, step), (-1.0, -step)] {
        let (turned, admitted) = cut(turn, &hybrid);
        assert!((turned - expected).abs() < 1e-12 && admitted, "{turned}");
    }
    assert!(!cut(f64::NAN, &hybrid).1);
    let mut endless = HybridSettings::paper();
    endless.steps[0] = f64::NAN;
    assert!(!cut(0.01, &Hybrid::new(endless)).1);
}

#[test]
fn near_a_joint_limit_a_move_keeps_its_direction() {
    let (hybrid, limits) = (Hybrid::new(HybridSettings::paper()), JointLimits::paper());
    let turn = JointDelta::from_degrees([1.5, -6.0, 4.0, 0.0, 0.0, 0.0]);
    for (jt3, share) in [(214.0, 0.25), (213.0, 0.5), (200.0, 1.0)] {
        let from = Joints::from_degrees([0.0, -80.0, jt3, 0.0, 45.0, 0.0]);
        let delta = hybrid.cut(&(from + turn), &from, &limits);
        for i in 0..3 {
            assert!(
                (delta.0[i] - share * turn.0[i]).abs() < 1e-9,
                "{jt3}: {delta:?}"
            );
        }
    }
    // At the limit itself the other joints go on.
    let from = Joints::from_degrees([0.0, -80.0, 215.0, 0.0, 45.0, 0.0]);
    let delta = hybrid.cut(&(from + turn), &from, &limits);
    assert!((delta.0[0] - turn.0[0]).abs() < 1e-9 && (delta.0[1] - turn.0[1]).abs() < 1e-9);
    assert!(delta.0[2].abs() < 1e-6 && limits.admit(&(from + delta)));
}

#[test]
fn nan_is_never_evidence() {
    let (limits, grip) = (JointLimits::paper(), false);
    let features = Features::new(80.0, 60.0, 15.0);
    let ball = Sighting::new(features);
    let mut hybrid = Hybrid::new(HybridSettings::paper());
    let learned = |hybrid: &mut Hybrid, unseen: bool| {
        hybrid.notice(&Feedback::Begin);
        let mut joints = Joints::from_degrees([0.0, -80.0, 190.0, 0.0, 45.0, 0.0]);
        for _ in 0..3 {
            hybrid.notice(&Feedback::Arm(joints));
            let request = Request {
                joints,
                limits,
                grip,
            };
            match hybrid.decide(&ball, &request).unwrap() {
                Decision::Move(delta) | Decision::Grip(delta) => joints = joints + delta,
            }
        }
        for x in [f64::NAN, f64::INFINITY] {
            let nothing = Sighting::new(Features { x, ..features });
            for grip in [false, true] {
                let request = Request {
                    joints,
                    limits,
                    grip,
                };
                let decide = |hybrid: &mut Hybrid| hybrid.decide(&nothing, &request);
                assert!(!unseen || decide(hybrid) == Err(GaveUp::NoMoveLeft));
            }
        }
        hybrid.notice(&Feedback::End);
        hybrid.belief().clone()
    };
    let as_well = learned(&mut hybrid.clone(), false);
    assert_ne!(as_well, *hybrid.belief());
    assert_eq!(learned(&mut hybrid, true), as_well);
}
