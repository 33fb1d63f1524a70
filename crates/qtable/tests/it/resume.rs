//! Stop, save, load, go on: the same bits as without stopping, for every learner.

use std::ops::ControlFlow;

use qtable::{
    Action, ActionMask, Boltzmann, DoubleQLearning, DynaQ, EpsilonGreedy, Error, ExpectedSarsa,
    Experience, Greedy, Intervals, Learner, ModelEnvironment, NStepQ, Policy, PrioritizedSweeping,
    QLambda, QLearning, QTable, Sarsa, SarsaLambda, Schedule, State, Status, Step, TimeLimit,
    Training, Ucb, Until, decode, encode, toys,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::support::{Settings, constant, corridor, forged};

type World = TimeLimit<ModelEnvironment>;

fn begun() -> QTable {
    QTable::filled(16, 4, 0.3).unwrap()
}

fn stopping_changes_nothing<L, P>(learner: L, policy: P)
where
    L: Learner + Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned,
    P: Policy + Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned,
{
    let lake = toys::frozen_lake(&toys::FROZEN_LAKE_4X4, true).unwrap();
    let lake = TimeLimit::new(lake, 30).unwrap();
    let begun = Training::new(&lake, begun(), learner, policy)
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
    assert_eq!(
        bytes,
        encode("run", &(&whole, &whole_lake, &whole_rng)).unwrap()
    );
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
    stopping_changes_nothing(
        DoubleQLearning::new(&begun(), alpha(), gamma).unwrap(),
        epsilon(),
    );
    stopping_changes_nothing(QLambda::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(SarsaLambda::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(NStepQ::new(alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(DynaQ::new(&begun(), alpha(), gamma).unwrap(), epsilon());
    stopping_changes_nothing(
        PrioritizedSweeping::new(&begun(), gamma).unwrap(),
        epsilon(),
    );
}

#[test]
fn a_run_in_blocks_goes_on_as_if_it_had_not_stopped() {
    type Run = (Training<QLearning, Boltzmann>, World, Xoshiro256PlusPlus);
    for alpha in [
        Schedule::exponential(0.6, 0.02, 900),
        Schedule::inverse_visits(1.0, 3.0),
    ] {
        let settings = Settings {
            alpha: alpha.unwrap(),
            temperature: Schedule::exponential(3.0, 0.001, 1_000).unwrap(),
            record_every: 81,
            ..Settings::new(1_000)
        };
        let mut lake = TimeLimit::new(corridor(), 30).unwrap();
        let mut whole = settings
            .begin(&lake, QTable::filled(16, 8, 0.3).unwrap())
            .unwrap();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(42);
        let mut bytes = encode("run", &(&whole, &lake, &rng)).unwrap();
        let go_on =
            |run: &mut Training<QLearning, Boltzmann>, lake: &mut World, rng: &mut _, until| {
                run.run_in_blocks(lake, Until::Actions(until), 3, rng, |_, _| {
                    ControlFlow::Continue(())
                })
                .unwrap();
            };
        go_on(&mut whole, &mut lake, &mut rng, 1_000);

        let mut in_episode = 0;
        for (stop, reached) in [
            (1, 27),
            (27, 27),
            (70, 81),
            (333, 351),
            (352, 378),
            (963, 972),
            (1_000, 1_026),
        ] {
            let (mut part, mut lake, mut rng): Run = decode("run", &bytes).unwrap();
            go_on(&mut part, &mut lake, &mut rng, stop);
            assert_eq!(part.actions(), reached);
            in_episode += u32::from(part.is_in_episode());
            bytes = encode("run", &(part, lake, rng)).unwrap();
        }
        assert!(in_episode > 3);
        let back: Run = decode("run", &bytes).unwrap();
        assert_eq!(whole.actions(), 1_026);
        assert_eq!(back, (whole, lake, rng));
        assert_eq!(back.0.curve().len(), 12);
    }
}

/// The change of a value from one end of the numbers to the other is beyond both.
#[test]
fn a_sweep_with_an_enormous_change_ahead_can_be_saved() {
    let mut table = QTable::filled(2, 1, -1.7e308).unwrap();
    let learner = PrioritizedSweeping::new(&table, 1.0).unwrap();
    let mut learner = learner.with_backups(1).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    for (state, reward, status) in [
        (1, 0.0, Status::Continuing),
        (0, 1.7e308, Status::Terminated),
    ] {
        let step = Step {
            observation: State(0),
            reward,
            status,
        };
        let experience = Experience {
            state: State(state),
            action: Action(0),
            step,
            next_action: None,
        };
        learner
            .learn(&mut table, &experience, &Greedy, &mut rng)
            .unwrap();
    }
    assert!(table.max(State(0)) > 1e308 && table.max(State(1)) < -1e308);
    let back: PrioritizedSweeping = decode("l", &encode("l", &learner).unwrap()).unwrap();
    assert_eq!(back, learner);
}

#[test]
fn damaged_parts_of_a_run_are_refused() {
    // bincode writes a schedule's variant, its numbers and its unit one after the other, then a
    // clock: actions and episodes.
    let (clock, half) = ((0u64, 0u64), (0u32, 0.5, false));
    let boltzmann = |t: f64| forged::<Boltzmann>("Boltzmann", ((0u32, t, false), clock));
    assert_eq!(
        boltzmann(1.0).unwrap(),
        Boltzmann::new(constant(1.0)).unwrap()
    );
    assert!(boltzmann(0.0).is_err() && boltzmann(f64::NAN).is_err());
    let q = |gamma: f64| forged::<QLearning>("QLearning", (half, gamma, clock));
    assert!(q(1.0).is_ok() && q(1.5).is_err());
    let no_steps = forged::<Schedule>("Schedule", (1u32, 0.0, 1.0, 0u64, false));
    assert!(no_steps.is_err());
    let intervals = |edges: Vec<f64>, goal: Option<u64>| {
        forged::<Intervals>("Intervals", (edges, goal)).is_ok()
    };
    assert!(intervals(vec![1.0], Some(1)));
    assert!(!intervals(vec![2.0, 1.0], None) && !intervals(vec![1.0], Some(2)));
    let mask = |allowed: Vec<bool>| forged::<ActionMask>("ActionMask", (2u64, allowed)).is_ok();
    assert!(mask(vec![true, false, false, true]));
    assert!(!mask(vec![true; 3]));
}

/// A run of SARSA on three cells with the given counters, in which state 0 is next and an action
/// was chosen for it.
fn forged_run(chosen: u64, count: u64) -> Training<Sarsa, EpsilonGreedy> {
    let table = QTable::new(3, 2).unwrap();
    let (half, clock) = ((0u32, 0.5, false), (count, count));
    let learner = (half, 0.9, clock);
    let policy = (half, 0u32, clock);
    let running = Some((0u64, Some(chosen), count, 0.0));
    let tally = (count, 0.0, 0.0, count, count, count, count, 0.0);
    let counts = (u64::MAX, 1u64, count, count.saturating_sub(1));
    let parts = (
        table,
        learner,
        policy,
        (counts, running, tally),
        Vec::<u8>::new(),
    );
    forged("Training Sarsa EpsilonGreedy", parts).unwrap()
}

#[test]
fn a_stored_action_is_checked_before_the_environment_sees_it() {
    let mut chain = toys::chain(3).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut run = |chosen| forged_run(chosen, 0).run(&mut chain, Until::Actions(5), &mut rng);
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
    let mut training = forged_run(1, u64::MAX);
    assert_eq!(
        (training.actions(), training.episodes()),
        (u64::MAX, u64::MAX - 1)
    );
    training
        .run(&mut chain, Until::Episodes(u64::MAX), &mut rng)
        .unwrap();
    assert_eq!(
        (training.actions(), training.episodes()),
        (u64::MAX, u64::MAX)
    );
    assert_eq!(training.curve().last().unwrap().actions, u64::MAX);
}
