//! Tests of the whole chain and of the example programs.

#![allow(clippy::print_stdout, reason = "figures and notes of skipped tests")]

use std::sync::OnceLock;

use example_support::learning::learn_both;
use grasp_agent::{Behaviour, BehaviourPair, Learned};
use pipeline_sim::{Ball, Cell, MoveForm};
use puma_grasp::Simulator;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

mod command_line;
mod detectors;
mod end_to_end;
mod exported_policy;
mod faults;
mod guard;
mod literal_reward;
mod result_files;
mod tallies;
mod taught_goal;

/// Returns both behaviours, learned once for all tests and passed through files.
fn learned() -> &'static Learned {
    static LEARNED: OnceLock<Learned> = OnceLock::new();
    LEARNED.get_or_init(|| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        let (centering, reaching) = cell.sample_moves(2_500, 0.5, &mut rng).expect("samples");
        let simulator =
            Simulator::fit(&centering, &reaching, MoveForm::Rigid22).expect("enough samples");
        let quality = simulator.quality();
        assert!(quality.iter().all(|output| output.r2 > 0.9), "{quality:?}");
        let pair = BehaviourPair::paper_mended();
        let learned = learn_both(&simulator, pair, 1, &mut rng).expect("learns");
        let folder = tempfile::tempdir().expect("a temporary folder");
        let saved = |behaviour: &Behaviour| {
            let path = folder.path().join("behaviour.policy");
            behaviour.save(&path).expect("saves");
            let loaded = Behaviour::load(&path, behaviour.spec()).expect("loads");
            assert_eq!(loaded, *behaviour);
            loaded
        };
        Learned::new(saved(learned.centering()), saved(learned.approaching()))
    })
}
