//! Stop, save, load, go on: the same bits as without stopping, for every learner.
#![cfg(feature = "serde")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should fail")]

use qtable::{
    Action, Boltzmann, DoubleQLearning, DynaQ, EpsilonGreedy, Error, ExpectedSarsa, Learner,
    ModelEnvironment, NStepQ, Policy, PrioritizedSweeping, QLambda, QLearning, QTable, Sarsa, SarsaLambda,
    Schedule, TimeLimit, Training, Ucb, Until, decode, encode, toys,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use serde::Serialize;
use serde::de::DeserializeOwned;

type World = TimeLimit<ModelEnvironment>;

fn stopping_changes_nothing<L, P>(learner: L, policy: P)
where
    L: Learner + Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned,
    P: Policy + Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned,
{
    let lake = toys::frozen_lake(&toys::FROZEN_LAKE_4X4, true).unwrap();
    let lake = TimeLimit::new(lake, 30).unwrap();
    let table = QTable::filled(16, 4, 0.3).unwrap();
    let begun = Training::new(&lake, table, learner, policy)
        .unwrap()
        .with_record_every(70)
        .unwrap();
    let rng = Xoshiro256PlusPlus::seed_from_u64(42);

    let (mut whole, mut whole_lake, mut whole_rng) = (begun.clone(), lake.clone(), rng.clone());
    whole
        .run(&mut whole_lake, Until::Actions(1_000), &mut whole_rng)
        .unwrap();

    // Stops at each of several places, most of them within an episode and a record.
    let mut bytes = encode("run", &(begun, lake, rng)).unwrap();
    for stop in [1, 2, 3, 69, 70, 71, 333, 512, 999, 1_000] {
        let (mut part, mut lake, mut rng): (Training<L, P>, World, Xoshiro256PlusPlus) =
            decode("run", &bytes).unwrap();
        part.run(&mut lake, Until::Actions(stop), &mut rng).unwrap();
        bytes = encode("run", &(part, lake, rng)).unwrap();
    }
    let (part, part_lake, part_rng): (Training<L, P>, World, Xoshiro256PlusPlus) =
        decode("run", &bytes).unwrap();
    assert_eq!(part.table().to_csv(), whole.table().to_csv());
    assert_eq!(part.curve().len(), 14);
    assert_eq!((&part_lake, &part_rng), (&whole_lake, &whole_rng));
    assert_eq!(bytes, encode("run", &(&whole, &whole_lake, &whole_rng)).unwrap());
    assert_eq!(part, whole);
}

#[test]
fn a_resumed_run_ends_as_an_uninterrupted_one() {
    let alpha = || Schedule::exponential(0.6, 0.02, 900).unwrap();
    let epsilon = || EpsilonGreedy::new(Schedule::linear(1.0, 0.1, 800).unwrap()).unwrap();
    let gamma = 0.95;
    stopping_changes_nothing(
        QLearning::new(alpha(), gamma).unwrap(),
        Boltzmann::new(Schedule::exponential(10.0, 0.01, 900).unwrap()).unwrap(),
    );
    stopping_changes_nothing(
        QLearning::new(Schedule::inverse_visits(1.0, 3.0).unwrap(), gamma).unwrap(),
        Ucb::new(0.5).unwrap(),
    );
    stopping_changes_nothing(Sarsa::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(ExpectedSarsa::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(DoubleQLearning::<f64>::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(QLambda::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(SarsaLambda::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(NStepQ::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(DynaQ::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(PrioritizedSweeping::new(gamma).unwrap(), epsilon());
}

#[test]
fn damaged_parts_of_a_run_are_refused() {
    // bincode writes a schedule's variant and numbers one after the other: a temperature of 1, then of 0.
    let sound = Boltzmann::new(Schedule::constant(1.0).unwrap()).unwrap();
    let bytes = encode("p", &sound).unwrap();
    assert_eq!(decode::<Boltzmann>("p", &bytes).unwrap(), sound);
    assert!(decode::<Boltzmann>("p", &encode("p", &(0u32, 0.0f64, 0u64)).unwrap()).is_err());
    assert!(decode::<Boltzmann>("p", &encode("p", &(0u32, f64::NAN, 0u64)).unwrap()).is_err());
    assert!(decode::<QLearning>("p", &encode("p", &(0u32, 0.5f64, 1.5f64, 0u64)).unwrap()).is_err());
    assert!(decode::<QLearning>("p", &encode("p", &(0u32, 0.5f64, 1.0f64, 0u64)).unwrap()).is_ok());
    assert!(decode::<Schedule>("p", &encode("p", &(1u32, 0.0f64, 1.0f64, 0u64)).unwrap()).is_err());
    assert!(decode::<qtable::Intervals>("p", &encode("p", &(vec![2.0, 1.0], None::<u64>)).unwrap()).is_err());
    assert!(decode::<qtable::Intervals>("p", &encode("p", &(vec![1.0], Some(2u64))).unwrap()).is_err());
    assert!(
        decode::<qtable::ActionMask>(
            "p",
            &encode("p", &(2u64, vec![true, false, false, false])).unwrap()
        )
        .is_err()
    );
    assert!(decode::<qtable::ActionMask>("p", &encode("p", &(2u64, vec![true; 3])).unwrap()).is_err());
}

/// A run of SARSA on three cells with the given counters, in which state 0 is next and an action was chosen for it.
fn forged(chosen: u64, count: u64) -> Training<Sarsa, EpsilonGreedy> {
    let table = QTable::<f64>::new(3, 2).unwrap();
    let half = (0u32, 0.5f64);
    let learner = (half, 0.9f64, count);
    let policy = (half, 0u32, count);
    let running = Some((0u64, Some(chosen), count, 0.0f64));
    let tally = (count, 0.0f64, 0.0f64, count, count, count, 0.0f64);
    let course = ((u64::MAX, 1u64, count, count.saturating_sub(1)), running, tally);
    let curve = Vec::<u8>::new();
    decode(
        "run",
        &encode("run", &(table, learner, policy, course, curve)).unwrap(),
    )
    .unwrap()
}

#[test]
fn a_stored_action_is_checked_before_the_environment_sees_it() {
    let mut chain = toys::chain(3).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut run = |chosen| forged(chosen, 0).run(&mut chain, Until::Actions(5), &mut rng);
    assert_eq!(run(1), Ok(()));
    for chosen in [2, 9, u64::MAX] {
        let refused = Err(Error::ActionOutOfRange {
            action: Action(chosen as usize),
            actions: 2,
        });
        assert_eq!(run(chosen), refused);
    }
}

#[test]
fn counters_stop_at_their_largest_number() {
    let mut chain = toys::chain(3).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut training = forged(1, u64::MAX);
    assert_eq!(
        (training.actions(), training.episodes()),
        (u64::MAX, u64::MAX - 1)
    );
    training
        .run(&mut chain, Until::Episodes(u64::MAX), &mut rng)
        .unwrap();
    assert_eq!((training.actions(), training.episodes()), (u64::MAX, u64::MAX));
    assert_eq!(training.curve().last().unwrap().actions, u64::MAX);
}
