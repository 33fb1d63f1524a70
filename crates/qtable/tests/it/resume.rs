//! Stop, save, load, go on: the same bits as without stopping, for every learner.

use std::ops::ControlFlow;

use qtable::*;
use rand::rngs::Xoshiro256PlusPlus;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::support::{Settings, constant, corridor, experience, forged, rng, step, zeros};

type World = TimeLimit<ModelEnvironment>;

fn begun() -> QTable {
    QTable::filled(16, 4, 0.3).unwrap()
}

fn stopping_changes_nothing<L, P>(learner: L, policy: P)
where
    L: Learner + Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned,
    P: Policy + Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned,
{
    let lake = ModelEnvironment::frozen_lake("4x4", true).unwrap();
    let lake = TimeLimit::new(lake, 30).unwrap();
    let begun = Training::new(&lake, begun(), learner, policy).unwrap();
    let begun = (begun.with_record_every(70).unwrap(), lake, rng(42));
    let mut whole = begun.clone();
    let until = Until::Actions(1_000);
    whole.0.run(&mut whole.1, until, &mut whole.2).unwrap();

    // Stops at each of several places, most of them within an episode and a record.
    type Run<L, P> = (Training<L, P>, World, Xoshiro256PlusPlus);
    let mut bytes = encode("run", &begun).unwrap();
    for stop in [1, 2, 3, 69, 70, 71, 333, 512, 999, 1_000] {
        let mut part: Run<L, P> = decode("run", &bytes).unwrap();
        let until = Until::Actions(stop);
        part.0.run(&mut part.1, until, &mut part.2).unwrap();
        bytes = encode("run", &part).unwrap();
    }
    assert_eq!(bytes, encode("run", &whole).unwrap());
    let part: Run<L, P> = decode("run", &bytes).unwrap();
    assert_eq!(part.0.curve().len(), 14);
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
    let by_visits = Schedule::inverse_visits(1.0, 3.0).unwrap();
    let learner = QLearning::new(by_visits, gamma).unwrap();
    stopping_changes_nothing(learner, Ucb::new(0.5).unwrap());
    for target in [
        Target::Q,
        Target::UncutQ,
        Target::Sarsa,
        Target::ExpectedSarsa,
        Target::TreeBackup,
    ] {
        for n in [1, 4, usize::MAX] {
            stopping_changes_nothing(NStep::new(target, n, alpha(), gamma).unwrap(), epsilon());
        }
        stopping_changes_nothing(Traces::new(target, 0.8, alpha(), gamma).unwrap(), epsilon());
    }
    let average = NStep::new(Target::Sarsa, 2, alpha(), 1.0).unwrap();
    stopping_changes_nothing(average.with_average_reward(0.1).unwrap(), epsilon());
    let dyna = DynaQ::new(&begun(), alpha(), gamma).unwrap();
    stopping_changes_nothing(dyna.clone(), epsilon());
    stopping_changes_nothing(
        dyna.with_last_outcome().with_bonus(0.01).unwrap(),
        epsilon(),
    );
    let double = DoubleQLearning::new(&begun(), alpha(), gamma).unwrap();
    stopping_changes_nothing(double, epsilon());
    let sweeping = PrioritizedSweeping::new(&begun(), gamma).unwrap();
    stopping_changes_nothing(sweeping, epsilon());
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
        let table = QTable::filled(16, 8, 0.3).unwrap();
        let (mut whole, mut rng) = (settings.begin(&lake, table).unwrap(), rng(42));
        let mut bytes = encode("run", &(&whole, &lake, &rng)).unwrap();
        let go_on = |run: &mut Training<_, _>, lake: &mut World, rng: &mut _, until| {
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
        assert_eq!((whole.actions(), whole.curve().len()), (1_026, 12));
        assert_eq!(back, (whole, lake, rng));
    }
}

/// The change of a value from one end of the numbers to the other is beyond both.
#[test]
fn a_sweep_with_an_enormous_change_ahead_can_be_saved() {
    let mut table = QTable::filled(2, 1, -1.7e308).unwrap();
    let learner = PrioritizedSweeping::new(&table, 1.0).unwrap();
    let mut learner = learner.with_backups(1).unwrap();
    for experience in [
        experience(1, 0, step(0, 0.0, Status::Continuing)),
        experience(0, 0, step(0, 1.7e308, Status::Terminated)),
    ] {
        learner
            .learn(&mut table, &experience, &Greedy, &mut rng(1))
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
    let intervals = |edges: Vec<f64>| forged::<Intervals>("Intervals", (edges,)).is_ok();
    assert!(intervals(vec![1.0]) && !intervals(vec![2.0, 1.0]));
    let masked = |mask: Vec<bool>| {
        let parts = (2u64, 0.0, vec![0.0; 4], vec![0u32; 4], Some(mask));
        forged::<QTable>("QTable", parts).is_ok()
    };
    assert!(masked(vec![true, false, false, true]) && !masked(vec![true; 3]));
}

/// A run of SARSA on three cells with the given counters, in which state 0 is next and an action
/// was chosen for it.
fn forged_run(chosen: u64, count: u64) -> Training<NStep, EpsilonGreedy> {
    let table = zeros(3, 2);
    let (half, clock) = ((0u32, 0.5, false), (count, count));
    // Target::Sarsa, n, average reward, pending pairs.
    let learner = ((half, 0.9, clock), 2u32, 1u64, (0.0, 0.0), Vec::<u8>::new());
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
    forged("Training NStep EpsilonGreedy", parts).unwrap()
}

#[test]
fn a_stored_action_is_checked_before_the_environment_sees_it() {
    let mut chain = ModelEnvironment::chain(3).unwrap();
    let mut run = |chosen| forged_run(chosen, 0).run(&mut chain, Until::Actions(5), &mut rng(1));
    assert_eq!(run(1), Ok(()));
    for chosen in [2, 9, u64::MAX] {
        assert_refused!(
            run(chosen),
            Error::OutOfRange {
                what: "action",
                count: 2,
                ..
            }
        );
    }
}

#[test]
fn counters_stop_at_their_largest_number() {
    let mut chain = ModelEnvironment::chain(3).unwrap();
    let mut training = forged_run(1, u64::MAX);
    let counters = |of: &Training<_, _>| (of.actions(), of.episodes());
    assert_eq!(counters(&training), (u64::MAX, u64::MAX - 1));
    let until = Until::Episodes(u64::MAX);
    training.run(&mut chain, until, &mut rng(1)).unwrap();
    assert_eq!(counters(&training), (u64::MAX, u64::MAX));
    assert_eq!(training.curve().last().unwrap().actions, u64::MAX);
}
