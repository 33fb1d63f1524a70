//! The whole chain on its real parts: samples, regression, learning, policies on disk, the emulated
//! controller on a pseudo-terminal (a socket where the system has none), rendered frames, the
//! paper's detector, and the grip.

use std::sync::Arc;

use grasp_agent::{Agent, AgentConfig, EventKind, GaveUp};
use hough_heuristic::CircleDetector;
use pipeline_sim::{Ball, Scene, Workspace};
use puma_grasp::{BallDetector, Rig};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use crate::learned;

fn detector() -> Box<dyn CircleDetector + Send> {
    BallDetector::Heuristic.build(1).expect("valid settings")
}

fn agent() -> Agent {
    let config = AgentConfig::paper(Workspace::paper().search_poses());
    Agent::with_controller(config, learned().clone()).expect("valid settings")
}

#[test]
fn balls_are_gripped_and_the_same_seed_repeats_the_run() {
    let run = |balls| {
        let mut rig = Rig::emulated(false, &Scene::bright_ball(), 3, &Arc::default())
            .expect("an emulated controller");
        let mut agent = agent();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut log = Vec::new();
        let (mut grasped, mut moves) = (0, 0);
        for _ in 0..balls {
            let cell = rig.cell().get();
            let (ball, _) = Workspace::paper()
                .sample_seen_ball(&cell, &mut rng)
                .expect("a ball in view");
            rig.place(&ball).expect("away from the hand");
            let outcome = rig
                .run(&mut agent, &mut *detector(), &mut |event| {
                    log.push((event.kind.clone(), event.joints));
                })
                .expect("the line holds");
            moves += outcome.cycles;
            grasped += usize::from(outcome.gave_up.is_none() && rig.holds_ball());
            assert_eq!(rig.contacts().collisions, 0);
        }
        (grasped, moves, log)
    };
    let (grasped, moves, log) = run(3);
    assert!(grasped >= 2, "only {grasped} of 3 grasped");
    assert!(moves <= 3 * 25, "{moves} moves for 3 balls");
    assert!(log.iter().any(|(kind, _)| *kind == EventKind::Gripped));
    assert!(log.starts_with(&run(1).2), "the same seed gave another run");
}

#[test]
fn a_ball_out_of_view_is_reported_and_not_gripped() {
    let mut rig = Rig::emulated(false, &Scene::bright_ball(), 3, &Arc::default())
        .expect("an emulated controller");
    let mut agent = agent();
    // Behind the arm.
    rig.place(&Ball::at(-0.6, 0.0, -0.1))
        .expect("away from the hand");
    let mut searched = Vec::new();
    let outcome = rig
        .run(&mut agent, &mut *detector(), &mut |event| {
            if let EventKind::AtSearchPose(pose) = event.kind {
                searched.push(pose);
            }
        })
        .expect("the line holds");
    assert_eq!(outcome.gave_up, Some(GaveUp::NotFound));
    searched.sort_unstable();
    // The six poses, and twice more from beside them.
    assert_eq!(searched, (0..18).collect::<Vec<_>>());
}
