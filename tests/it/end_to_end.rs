//! The whole chain on its real parts: samples, regression, learning, policies on disk, the emulated
//! controller on a pseudo-terminal (a socket where the system has none), rendered frames, the
//! paper's detector, and the grip.

use example_support::plane::search_percepts;
use grasp_agent::{
    Agent, AgentConfig, Behaviour, BehaviourSpec, EventKind, GaveUp, Learned, Percept,
};
use hough_heuristic::CircleDetector;
use pipeline_sim::{Ball, ReachForm, Workspace};
use puma_grasp::{BallDetector, Rig, Simulator, bright_ball_scene};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn detector() -> Box<dyn CircleDetector + Send> {
    BallDetector::Heuristic.build(1).expect("valid settings")
}

/// Learns both behaviours in a simulator fitted to `rig`'s cell; they pass through files on the
/// way.
fn agent(rig: &Rig, seed: u64) -> Agent {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (centring, reaching) = rig
        .cell()
        .get()
        .sample_moves(2_500, 0.5, &mut rng)
        .expect("samples");
    let simulator =
        Simulator::fit(&centring, &reaching, ReachForm::Rigid22).expect("enough samples");
    assert!(
        simulator.quality().iter().all(|quality| quality.r2 > 0.9),
        "{:?}",
        simulator.quality()
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut taught = |spec: BehaviourSpec, trials: &[Percept], actions| {
        let lesson = simulator
            .learn(spec, trials, actions, &mut rng, &mut |_| {})
            .expect("learns");
        let path = folder.path().join("behaviour.policy");
        lesson.behaviour.save(&path).expect("saves");
        let loaded = Behaviour::load(&path, lesson.behaviour.spec()).expect("loads");
        assert_eq!(loaded, lesson.behaviour);
        loaded
    };
    let centering = taught(BehaviourSpec::centering(), &[], 60_000);
    let approaching = taught(
        BehaviourSpec::approaching(),
        &search_percepts(200, seed),
        300_000,
    );
    let config = AgentConfig::paper(Workspace::paper().search_poses());
    Agent::with_controller(config, Learned::new(centering, approaching)).expect("valid settings")
}

#[test]
fn balls_are_found_reached_and_gripped_and_the_same_seed_repeats_the_run() {
    let run = || {
        let mut rig =
            Rig::emulated(false, &bright_ball_scene(), 3).expect("an emulated controller");
        let mut agent = agent(&rig, 2000);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut log = Vec::new();
        let (mut grasped, mut moves) = (0, 0);
        for _ in 0..4 {
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
    let (grasped, moves, log) = run();
    assert!(grasped >= 3, "only {grasped} of 4 grasped");
    assert!(moves <= 4 * 25, "{moves} moves for 4 balls");
    assert!(log.iter().any(|(kind, _)| *kind == EventKind::Gripped));
    assert!(log == run().2, "the same seed gave another run");
}

#[test]
fn a_ball_out_of_view_is_reported_and_not_gripped() {
    let mut rig = Rig::emulated(false, &bright_ball_scene(), 3).expect("an emulated controller");
    let mut agent = agent(&rig, 1);
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
