//! An exported policy says all that another program needs: docs/run_policy.py, which knows nothing
//! but the file, reaches the balls with it, and in as many moves as the
//! controller here.

use std::process::Command;

use example_support::trial::TrialCell;
use grasp_agent::{Agent, AgentConfig, CameraModel};
use pipeline_sim::{ErrorLevel, Workspace};

use crate::learned;

/// Balls reached, and moves on average, as the script says: "reached 198 of 200 balls, in 9.71
/// moves on average; gripped 197".
fn by_the_script(policy: &str) -> Option<(usize, f64)> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("policy.json");
    std::fs::write(&path, policy).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/run_policy.py");
    let output = Command::new("python3").arg(script).arg(&path).output();
    let Some(output) = output
        .ok()
        .filter(|output| output.status.code() != Some(127))
    else {
        println!("skipped: there is no python3");
        return None;
    };
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let numbers: Vec<f64> = said
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    assert_eq!(numbers.len(), 4, "{said}");
    let (reached, moves, gripped) = (numbers[0], numbers[2], numbers[3]);
    assert!(gripped >= 0.98 * reached, "{said}");
    Some((reached as usize, moves))
}

#[test]
fn another_program_reaches_the_balls_with_an_exported_policy() {
    let learned = learned().clone();
    let mut config = AgentConfig::paper(Workspace::paper().search_poses());
    let policy = learned.to_json(&config, &CameraModel::paper(), "a test");
    let Some((reached, moves)) = by_the_script(&policy) else {
        return;
    };
    let cell = TrialCell::draw(ErrorLevel::None, 0)
        .expect("a camera")
        .without_bodies();
    // What the hand touches nothing with it cannot lift.
    config.lift = None;
    let mut agent = Agent::with_controller(config, learned).expect("valid settings");
    let (mut here, mut cycles) = (0, 0);
    for seed in 0..200 {
        let run = cell.run(&mut agent, seed, &mut |_, _| (), &mut |_| ());
        let trial = run.expect("no fault").expect("a ball in view");
        if trial.at_goal.is_some() {
            here += 1;
            cycles += trial.outcome.cycles;
        }
    }
    let here_moves = f64::from(cycles as u32) / f64::from(here);
    println!("reached {reached} of 200 in {moves} moves there, {here} in {here_moves:.2} here");
    // The balls are others: 200 of them scatter the mean by about half a move.
    assert!(
        reached >= 190 && here >= 190 && (moves - here_moves).abs() < 1.5,
        "{reached} in {moves} there, {here} in {here_moves} here"
    );

    // Its parts matter: without loop breakers, or with the actions counted the other way round, the
    // same table does worse.
    let endless = policy
        .replace("\"centering\": 20.0", "\"centering\": 0.0")
        .replace("\"approaching\": 20.0", "\"approaching\": 0.0");
    let turned = policy
        .replace("\"J2\"", "\"Jx\"")
        .replace("\"J3\"", "\"J2\"")
        .replace("\"Jx\"", "\"J3\"");
    for changed in [endless, turned] {
        assert_ne!(changed, policy);
        let (worse, _) = by_the_script(&changed).expect("python3 was there");
        assert!(worse < reached, "{worse} of 200, unchanged {reached}");
    }
}
