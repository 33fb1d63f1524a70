//! The fast form of Boltzmann exploration against the plain one.

use std::ops::ControlFlow;

use qtable::*;
use rand::{Rng, RngExt};

use crate::support::{Settings, constant, corridor, odd_of, q_learning, rng, step, zeros};

/// After many updates of both forms: the same values, the same best actions, the same
/// probabilities. Rows of all lengths around the sizes of groups and blocks; jumps far beyond what
/// the offset follows.
#[test]
fn the_cached_table_stays_equal_to_the_plain_one() {
    for (actions, temperature, spread) in [
        (1, 1.0, 5.0),
        (7, 0.01, 1.0),
        (16, 3.0, 9.0),
        (17, 1e-6, 1.0),
        (81, 2.0, 200.0),
        (81, 1e6, 1e3),
        (128, 1.0, 3.0),
        (129, 0.5, 3.0),
        (300, 1.0, 50.0),
        (1000, 10.0, 100.0),
    ] {
        let (mut rng, mut table) = (rng(actions as u64), zeros(3, actions));
        table.restrict(|s, a| s != State(1) || a.0 % 3 == 0);
        let mut cached = CachedBoltzmann::new(&table, temperature).unwrap();
        let mut learner = q_learning(0.5, 0.9);
        for _ in 0..3_000 {
            let state = State(rng.random_range(0..3));
            let action = cached.choose(state, &mut rng);
            assert!(table.allows(state, action));
            let step = Step {
                observation: State(rng.random_range(0..3)),
                reward: rng.random_range(-spread..spread),
                status: [Status::Continuing, Status::Terminated, Status::Truncated]
                    [rng.random_range(0..3)],
            };
            let here = learner.update(&mut table, state, action, &step).unwrap();
            let there = cached.update(state, action, &step, 0.5, 0.9).unwrap();
            assert_eq!(here.to_bits(), there.to_bits());
            // What the cached table stores is rounded to `f32`.
            let rounded = f64::from(table.value(state, action) as f32);
            table.set(state, action, rounded).unwrap();
            assert_eq!(cached.best(state), table.best(state));
        }
        let plain = Boltzmann::new(constant(temperature)).unwrap();
        let mut back = table.clone();
        for state in (0..3).map(State) {
            let (mut found, mut wanted) = (vec![f64::NAN; actions], vec![0.0; actions]);
            cached.probabilities(state, &mut found);
            plain.probabilities(&table, state, &mut wanted);
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert_near!(found, wanted, 1e-6);
            }
            for action in table.offered(state) {
                back.set(state, action, -1.0).unwrap();
            }
        }
        cached.write_to(&mut back).unwrap();
        assert_eq!(back, table);
    }
}

type Run = Training<QLearning, Boltzmann>;

fn in_blocks(
    run: &mut Run,
    environment: &mut dyn Environment,
    actions: u64,
    blocks: u64,
    rng: &mut dyn Rng,
) -> Result<bool, Error> {
    run.run_in_blocks(environment, Until::Actions(actions), blocks, rng, |_, _| {
        ControlFlow::Continue(())
    })
}

/// Both reach the optimum, and are equally far half-way.
#[test]
fn runs_in_blocks_learn_what_plain_runs_learn() {
    let toy = corridor();
    let settings = Settings {
        gamma: 0.95,
        alpha: Schedule::exponential(0.6, 0.05, 20_000).unwrap(),
        temperature: Schedule::exponential(1.0, 0.002, 20_000).unwrap(),
        record_every: 2_000,
        ..Settings::new(20_000)
    };
    let outcomes = over_seeds(0..8, |seed| {
        let begin = || settings.begin(&toy, QTable::new(16, 8)?);
        let (mut plain, mut fast, all) = (begin()?, begin()?, Until::Actions(20_000));
        plain.run(&mut toy.clone(), all, &mut rng(seed))?;
        in_blocks(
            &mut fast,
            &mut toy.clone(),
            20_000,
            50,
            &mut rng(seed + 100),
        )?;
        assert_eq!((fast.actions(), fast.curve().len()), (20_000, 10));
        let visits = (0..16).flat_map(|s| fast.table().visit_row(State(s)).to_vec());
        assert_eq!(visits.sum::<u32>(), 20_000);
        let middle = |run: &Run| run.curve()[4].mean_steps.unwrap();
        for run in [&plain, &fast] {
            let [learned, optimal] = toy.compare(run.table(), 0.95, 200)?;
            assert!(learned.value > 0.999 * optimal.value, "{learned:?}");
        }
        Ok::<_, Error>((middle(&plain), middle(&fast)))
    })
    .unwrap();
    let mean = |of: fn(&(f64, f64)) -> f64| outcomes.iter().map(of).sum::<f64>() / 8.0;
    let (plain, fast) = (mean(|o| o.0), mean(|o| o.1));
    assert_near!(plain, fast, 0.1 * plain);
}

#[test]
fn more_blocks_than_actions_are_one_an_action() {
    let run = |blocks| {
        let mut chain = corridor();
        let mut run = Settings::new(300).begin(&chain, zeros(16, 8)).unwrap();
        in_blocks(&mut run, &mut chain, 300, blocks, &mut rng(4)).unwrap();
        run.into_parts().0
    };
    assert_eq!(run(u64::MAX), run(3));
}

#[test]
fn records_of_a_run_in_blocks_see_the_table_and_can_stop_it() {
    let mut chain = corridor();
    let settings = Settings {
        record_every: 100,
        ..Settings::new(1_000)
    };
    let mut run = settings.begin(&chain, zeros(16, 8)).unwrap();
    let until = Until::Actions(1_000);
    let stopped = run.run_in_blocks(&mut chain, until, 7, &mut rng(4), |record, run| {
        let visits = (0..16).flat_map(|s| run.table().visit_row(State(s)).to_vec());
        assert_eq!(u64::from(visits.sum::<u32>()), record.actions);
        match record.actions {
            300 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    });
    assert_eq!((stopped, run.actions()), (Ok(true), 300));
    assert_eq!(run.take_curve().len(), 3);
    assert!(run.curve().is_empty());
}

#[test]
fn faults_are_refused_and_change_nothing() {
    let mut table = zeros(2, 3);
    table.restrict(|_, action| action != Action(1));
    let mut cached = CachedBoltzmann::new(&table, 1.0).unwrap();
    let mut update = |state, action, next, reward, alpha| {
        let step = step(next, reward, Status::Continuing);
        cached.update(State(state), Action(action), &step, alpha, 1.0)
    };
    assert_refused!(
        update(2, 0, 0, 0.0, 1.0),
        Error::OutOfRange {
            what: "state",
            index: 2,
            ..
        }
    );
    assert_refused!(
        update(0, 0, 7, 0.0, 1.0),
        Error::OutOfRange {
            what: "state",
            index: 7,
            ..
        }
    );
    assert_refused!(
        update(0, 3, 0, 0.0, 1.0),
        Error::OutOfRange { what: "action", .. }
    );
    assert_refused!(update(0, 1, 0, 0.0, 1.0), Error::ActionNotAllowed(..));
    assert_refused!(
        update(0, 0, 0, f64::NAN, 1.0),
        Error::NotFinite { what: "reward", .. }
    );
    assert_refused!(
        update(0, 0, 0, 1e39, 1.0),
        Error::NotFinite { what: "value", .. }
    );
    // Not even where the learning rate lets nothing in.
    assert_refused!(update(0, 1, 0, 0.0, 0.0), Error::ActionNotAllowed(..));
    assert_refused!(
        update(0, 0, 0, f64::INFINITY, 0.0),
        Error::NotFinite { what: "reward", .. }
    );
    let mut same = table.clone();
    cached.write_to(&mut same).unwrap();
    assert_eq!(same, table);
    for temperature in [0.0, -1.0, 1e-7, f64::INFINITY, f64::NAN] {
        assert!(CachedBoltzmann::new(&table, temperature).is_err());
        assert!(cached.set_temperature(temperature).is_err());
    }
    assert!(cached.write_to(&mut zeros(3, 3)).is_err());
    let huge = CachedBoltzmann::new(&QTable::filled(1, 1, 1e300).unwrap(), 1.0);
    assert_refused!(huge, Error::NotFinite { what: "value", .. });
}

#[test]
fn what_was_learned_before_a_fault_stays() {
    // Pays well twice, then breaks.
    let mut breaks = odd_of((1, 8), None, |n, _| {
        let reward = if n > 2 { f64::INFINITY } else { 8.0 };
        Ok(step(0, reward, Status::Terminated))
    });
    let settings = Settings {
        alpha: constant(0.5),
        temperature: constant(1e-6),
        ..Settings::new(10)
    };
    let mut table = zeros(1, 8);
    table.set(State(0), Action(0), 1e-3).unwrap();
    let mut run = settings.begin(&breaks, table).unwrap();
    let outcome = in_blocks(&mut run, &mut breaks, 10, 1, &mut rng(0));
    assert_refused!(outcome, Error::NotFinite { what: "reward", .. });
    assert_near!(run.table().max(State(0)), 6.0, 1e-3);
    assert_eq!(run.table().visits(State(0), Action(0)), 2);
    let none = in_blocks(&mut run, &mut breaks, 10, 0, &mut rng(0));
    assert_refused!(none, Error::Setting { name: "blocks", .. });
}

#[test]
fn an_action_out_of_range_is_no_padding() {
    let cached = CachedBoltzmann::new(&zeros(2, 5), 1.0).unwrap();
    assert!(cached.value(State(1), Action(4)).abs() < 1e-30);
    for action in [5, 15, 16].map(Action) {
        assert!(std::panic::catch_unwind(|| cached.value(State(0), action)).is_err());
    }
}

#[test]
fn of_equals_the_lowest_index_is_best() {
    let mut cached = CachedBoltzmann::new(&zeros(1, 40), 1.0).unwrap();
    // Risen above, level from below and from above, and fallen.
    for (action, reward, best) in [
        (30, 2.0, 30),
        (7, 2.0, 7),
        (20, 2.0, 7),
        (7, 1.0, 20),
        (30, 0.0, 20),
        (20, -1.0, 7),
    ] {
        let step = step(0, reward, Status::Terminated);
        let updated = cached.update(State(0), Action(action), &step, 1.0, 0.0);
        assert!(updated.is_ok());
        assert_eq!(cached.best(State(0)).0, best);
    }
}
