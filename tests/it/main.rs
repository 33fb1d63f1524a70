//! Tests of the whole chain and of the example programs.

#![allow(clippy::print_stdout, reason = "figures and notes of skipped tests")]

use std::sync::OnceLock;

use example_support::learning::{learn_both, paper_cell, simulators};
use grasp_agent::{Behaviour, BehaviourPair, Learned};
use pipeline_sim::MoveForm;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

mod command_line;
mod detectors;
mod end_to_end;
mod exported_policy;
mod faults;
mod guard;
mod literal_reward;
#[cfg(all(unix, feature = "serial"))]
mod real_camera;
mod result_files;
#[cfg(unix)]
mod stopping;
mod sweeps;
mod tallies;
mod taught_goal;

/// Returns both behaviours, learned once for all tests and passed through files.
fn learned() -> &'static Learned {
    static LEARNED: OnceLock<Learned> = OnceLock::new();
    LEARNED.get_or_init(|| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let [simulator] =
            simulators(&paper_cell(), [MoveForm::Rigid22], &mut rng).expect("enough samples");
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
