//! Every learner finds the known optimum, and none falls for a fault of its environment.

use qtable::*;
use rand::{Rng, RngExt};

use crate::support::{constant, experience, rng, step, trained, zeros, zeros_of};

type Named = (&'static str, Box<dyn Learner>);

/// Every learner of the crate with the same rates.
pub(crate) fn learners(table: &QTable, alpha: &Schedule, gamma: f64) -> Vec<Named> {
    let n_step = |target, n| Box::new(NStep::new(target, n, alpha.clone(), gamma).unwrap());
    let traces = |target| Box::new(Traces::new(target, 0.8, alpha.clone(), gamma).unwrap());
    let dyna = DynaQ::new(table, alpha.clone(), gamma).unwrap();
    let double = DoubleQLearning::new(table, alpha.clone(), gamma).unwrap();
    let sweeping = PrioritizedSweeping::new(table, gamma).unwrap();
    vec![
        ("Q", Box::new(QLearning::new(alpha.clone(), gamma).unwrap())),
        ("SARSA", n_step(Target::Sarsa, 1)),
        ("expected SARSA", n_step(Target::ExpectedSarsa, 1)),
        ("4-step Q", n_step(Target::Q, 4)),
        ("4-step Q uncut", n_step(Target::UncutQ, 4)),
        ("4-step SARSA", n_step(Target::Sarsa, 4)),
        ("4-step expected SARSA", n_step(Target::ExpectedSarsa, 4)),
        ("4-step tree backup", n_step(Target::TreeBackup, 4)),
        ("Q(lambda)", traces(Target::Q)),
        ("Q(lambda) uncut", traces(Target::UncutQ)),
        ("SARSA(lambda)", traces(Target::Sarsa)),
        ("expected SARSA(lambda)", traces(Target::ExpectedSarsa)),
        ("TB(lambda)", traces(Target::TreeBackup)),
        ("double Q", Box::new(double)),
        ("Dyna-Q", Box::new(dyna)),
        ("prioritized sweeping", Box::new(sweeping)),
    ]
}

fn policy(epsilon: Schedule) -> EpsilonGreedy {
    EpsilonGreedy::new(epsilon).unwrap()
}

/// Exploration fades, so that on-policy learners find the optimum too.
#[test]
fn every_learner_finds_the_optimal_values_of_the_chain() {
    let mut toy = ModelEnvironment::chain(6).unwrap();
    let optimal = toy.model().value_iteration(0.9, 1e-13).unwrap().table;
    let alpha = Schedule::linear(0.5, 0.1, 20_000).unwrap();
    for (name, learner) in learners(&zeros(6, 2), &alpha, 0.9) {
        let policy = policy(Schedule::linear(1.0, 0.0, 15_000).unwrap());
        let training = trained(&mut toy, zeros(6, 2), learner, policy, (200, 20_000, 3));
        for state in (0..5).map(State) {
            assert_near!(training.table().max(state), optimal.max(state), 0.002, name);
            assert_eq!(training.table().best(state), Action(1), "{name}");
        }
    }
}

#[test]
fn every_learner_walks_along_the_cliff_in_13_steps() {
    let mut toy = ModelEnvironment::cliff_walking().unwrap();
    let actions = 120_000;
    for (name, learner) in learners(&zeros(48, 4), &constant(0.2), 0.99) {
        let points = [(0, 0.5), (actions / 2, 0.05), (actions * 3 / 4, 0.0)];
        let policy = policy(Schedule::piecewise(&points).unwrap());
        let table = zeros(48, 4);
        let training = trained(&mut toy, table, learner, policy, (200, actions, 6));
        let found = toy.assess(&training.table().greedy(), 0.99, 200).unwrap();
        assert_near!(found.success, 1.0, 1e-12, name);
        // Those that learn the policy that acts, exploration included, have learned to keep away
        // from the edge. Double Q, with half the updates for each table, needs 13 to 17 steps.
        let on_policy = ["SARSA", "uncut", "tree", "TB", "double"]
            .iter()
            .any(|word| name.contains(word));
        let longest = if on_policy { 19.0 } else { 13.0 };
        assert!(found.steps <= longest + 1e-9, "{name}: {found:?}");
    }
}

#[test]
fn off_policy_learners_find_the_optimum_on_slippery_ice() {
    let mut toy = ModelEnvironment::frozen_lake("4x4", true).unwrap();
    let (gamma, actions) = (0.95, 400_000);
    let alpha = Schedule::inverse_visits(1.0, 30.0).unwrap();
    for (name, learner) in learners(&zeros(16, 4), &alpha, gamma) {
        let off_policy = ["Q", "4-step Q", "Q(lambda)", "double Q", "Dyna-Q"].contains(&name);
        if !off_policy && name != "prioritized sweeping" {
            continue;
        }
        let (table, policy) = (zeros(16, 4), policy(constant(0.5)));
        let training = trained(&mut toy, table, learner, policy, (200, actions, 6));
        let [found, best] = toy.compare(training.table(), gamma, 10_000).unwrap();
        // Double Q, with half the updates for each table, comes from below and may be wrong about
        // one state still.
        let (share, near) = match name {
            "double Q" => (0.9, 0.15),
            _ => (0.999, 0.04),
        };
        assert!(found.value >= share * best.value, "{name}: {found:?}");
        let believed = training.table().max(State(0));
        assert_near!(believed / best.value, 1.0, near, name);
    }
}

#[test]
fn learners_are_unbiased_once_exploration_has_faded() {
    let mut toy = ModelEnvironment::frozen_lake("4x4", false).unwrap();
    for (name, learner) in learners(&zeros(16, 4), &constant(0.2), 0.9) {
        let temperature = Schedule::exponential(1.0, 1e-3, 60_000).unwrap();
        let policy = Boltzmann::new(temperature).unwrap();
        let training = trained(&mut toy, zeros(16, 4), learner, policy, (200, 60_000, 2));
        let found = toy.assess(&training.table().greedy(), 0.9, 100).unwrap();
        assert_near!(found.steps, 6.0, 1e-9, name);
        assert_near!(found.success, 1.0, 1e-3, name);
        assert_near!(training.table().max(State(0)), 0.9f64.powi(5), 0.01, name);
    }
}

/// The mean of all returns: a chain of two pairs, left at random, ends with 1 or 0.
#[test]
fn monte_carlo_control_averages_whole_returns() {
    let alpha = Schedule::inverse_visits(1.0, 1.0).unwrap();
    let mut learner = NStep::new(Target::Sarsa, usize::MAX, alpha, 0.5).unwrap();
    let (mut table, mut sums) = (zeros(2, 1), [0.0, 0.0]);
    let mut rng = rng(2);
    for _ in 0..50 {
        learner.begin_episode();
        let reward = f64::from(u8::from(rng.random::<bool>()));
        let first = Experience {
            next_action: Some(Action(0)),
            ..experience(0, 0, step(1, 0.25, Status::Continuing))
        };
        for experience in [first, experience(1, 0, step(0, reward, Status::Terminated))] {
            learner
                .learn(&mut table, &experience, &Greedy, &mut rng)
                .unwrap();
        }
        sums = [sums[0] + 0.25 + 0.5 * reward, sums[1] + reward];
    }
    assert_near!(table.max(State(0)), sums[0] / 50.0, 1e-12);
    assert_near!(table.max(State(1)), sums[1] / 50.0, 1e-12);
}

/// Action 1 pays 1 and leads to a state that pays nothing; action 0 pays 0.4 and stays: better by
/// less than the average of the other way round, 0.5.
#[test]
fn the_average_reward_of_a_task_without_end_is_learned() {
    let model = Model::new(2, 2, |state, action| match (state, action) {
        (State(0), Action(0)) => vec![Outcome::certain(State(0), 0.4, false)],
        (State(0), _) => vec![Outcome::certain(State(1), 1.0, false)],
        _ => vec![Outcome::certain(State(0), 0.0, false)],
    });
    let mut world = ModelEnvironment::new(model.unwrap(), &[(State(0), 1.0)]).unwrap();
    for (target, n) in [(Target::Q, 1), (Target::Sarsa, 1), (Target::Sarsa, 3)] {
        let learner = NStep::new(target, n, constant(0.05), 1.0).unwrap();
        let learner = learner.with_average_reward(0.2).unwrap();
        let fading = policy(Schedule::linear(0.5, 0.0, 20_000).unwrap());
        let settings = (u64::MAX, 30_000, 4);
        let training = trained(&mut world, zeros(2, 2), learner, fading, settings);
        assert_near!(training.learner().average_reward(), 0.5, 0.02);
        assert_eq!(training.table().best(State(0)), Action(1));
    }
    let discounted = NStep::new(Target::Q, 1, constant(0.1), 0.9).unwrap();
    assert_refused!(
        discounted.with_average_reward(0.1),
        Error::Setting { name: "gamma", .. }
    );
}

#[test]
fn double_q_counts_the_visits_of_the_table_that_learns() {
    // With α = 1/n each table holds the mean of what it alone has seen.
    let mut table = zeros(1, 1);
    let alpha = Schedule::inverse_visits(1.0, 1.0).unwrap();
    let mut learner = DoubleQLearning::new(&table, alpha, 0.9).unwrap();
    let mut rng = rng(6);
    let mut seen = [(0.0, 0.0); 2];
    for n in 0..40 {
        let reward = f64::from(n * n);
        let first: bool = rng.clone().random();
        let (sum, count) = &mut seen[usize::from(first)];
        (*sum, *count) = (*sum + reward, *count + 1.0);
        let experience = experience(0, 0, step(0, reward, Status::Terminated));
        learner
            .learn(&mut table, &experience, &Greedy, &mut rng)
            .unwrap();
    }
    assert!(seen.iter().all(|&(_, count)| count > 10.0));
    let means = seen.iter().map(|(sum, count)| 0.5 * sum / count);
    assert_near!(table.max(State(0)), means.sum::<f64>(), 1e-9);
    assert_eq!(table.visits(State(0), Action(0)), 40);
}

#[test]
fn learners_bootstrap_through_truncation_only() {
    for (status, wanted) in [
        (Status::Terminated, 1.0),
        (Status::Truncated, 1.0 + 0.5 * 8.0),
    ] {
        let mut begun = zeros(2, 2);
        begun.set(State(1), Action(1), 8.0).unwrap();
        for (name, mut learner) in learners(&begun, &constant(1.0), 0.5) {
            let mut table = begun.clone();
            let experience = Experience {
                next_action: (status == Status::Truncated).then_some(Action(1)),
                ..experience(0, 0, step(1, 1.0, status))
            };
            let error = learner.learn(&mut table, &experience, &Greedy, &mut rng(0));
            assert_near!(error.unwrap(), wanted, 1e-12, name);
            // Of Double Q's two tables one has learned, and the table shows the mean.
            let share = if name == "double Q" { 0.5 } else { 1.0 };
            assert_near!(
                table.value(State(0), Action(0)),
                share * wanted,
                1e-12,
                name
            );
            assert_eq!(table.visits(State(0), Action(0)), 1, "{name}");
        }
    }
}

#[test]
fn no_learner_lets_a_fault_into_the_table() {
    for (state, action, step) in [
        (0, 0, step(1, f64::NAN, Status::Continuing)),
        (0, 0, step(1, f64::INFINITY, Status::Terminated)),
        (0, 0, step(1, f64::NEG_INFINITY, Status::Truncated)),
        (0, 0, step(2, 0.0, Status::Continuing)),
        (2, 0, step(1, 0.0, Status::Continuing)),
        (0, 2, step(1, 0.0, Status::Continuing)),
    ] {
        for (name, mut learner) in learners(&zeros(2, 2), &constant(0.5), 0.9) {
            let mut table = zeros(2, 2);
            let experience = Experience {
                next_action: Some(Action(0)),
                ..experience(state, action, step)
            };
            match learner.learn(&mut table, &experience, &Greedy, &mut rng(0)) {
                Err(Error::NotFinite { what: "reward", .. } | Error::OutOfRange { .. }) => {}
                other => panic!("{name}: {other:?}"),
            }
            assert_eq!(table, zeros(2, 2), "{name}");
        }
    }
}

#[test]
fn values_that_overflow_are_refused() {
    for (name, mut learner) in learners(&zeros(1, 1), &constant(1.0), 1.0) {
        let (mut table, mut rng, mut refused) = (zeros(1, 1), rng(0), false);
        for _ in 0..40 {
            let experience = Experience {
                next_action: Some(Action(0)),
                ..experience(0, 0, step(0, f64::MAX, Status::Truncated))
            };
            let outcome = learner.learn(&mut table, &experience, &Greedy, &mut rng);
            refused |= matches!(outcome, Err(Error::NotFinite { what: "value", .. }));
            assert!(table.max(State(0)).is_finite(), "{name}");
        }
        assert!(refused, "{name}");
    }
}

/// An update of the second pair would overflow the first one.
#[test]
fn traces_are_taken_back_when_one_of_them_overflows() {
    let mut table = zeros(3, 1);
    table.set(State(0), Action(0), 1.7e308).unwrap();
    let mut learner = Traces::new(Target::UncutQ, 1.0, constant(1.0), 1.0).unwrap();
    let mut learn = |table: &mut QTable, state, next, reward| {
        let experience = experience(state, 0, step(next, reward, Status::Continuing));
        learner.learn(table, &experience, &Greedy, &mut rng(0))
    };
    learn(&mut table, 0, 1, 1.7e308).unwrap();
    learn(&mut table, 1, 2, 0.0).unwrap();
    let before = table.clone();
    assert_refused!(
        learn(&mut table, 2, 2, 1e308),
        Error::NotFinite { what: "value", .. }
    );
    assert_eq!(table, before);
}

/// A policy that cannot tell its probabilities.
struct Mute;

impl Policy for Mute {
    fn choose(&mut self, _table: &QTable, _state: State, _rng: &mut dyn Rng) -> Action {
        Action(0)
    }
}

#[test]
fn what_a_learner_misses_is_named() {
    let experience = experience(0, 0, step(1, 0.0, Status::Continuing));
    for (name, mut learner) in learners(&zeros(2, 1), &constant(0.5), 0.9) {
        let learned = learner.learn(&mut zeros(2, 1), &experience, &Mute, &mut rng(0));
        let wanted = match name {
            _ if learner.needs_next_action() => Err(Error::NextActionMissing(State(1))),
            _ if ["expected", "tree", "TB"].iter().any(|w| name.contains(w)) => {
                Err(Error::NoProbabilities)
            }
            _ => Ok(0.0),
        };
        assert_eq!(learned, wanted, "{name}");
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let (above, table, half) = (constant(1.5), zeros(2, 2), constant(0.5));
    let n_step = |n, gamma| NStep::new(Target::Sarsa, n, half.clone(), gamma);
    let traces = |lambda| Traces::new(Target::Q, lambda, half.clone(), 0.9);
    let refused = QLearning::new(above.clone(), 0.9).unwrap_err();
    assert_eq!(refused.to_string(), "alpha is 1.5, but must be in 0..=1");
    assert_refused!(n_step(1, 1.1), Error::Setting { name: "gamma", .. });
    assert_refused!(n_step(1, f64::NAN), Error::Setting { name: "gamma", .. });
    assert_refused!(n_step(0, 0.9), Error::Setting { name: "n", .. });
    assert_refused!(traces(-0.1), Error::Setting { name: "lambda", .. });
    assert_refused!(traces(f64::NAN), Error::Setting { name: "lambda", .. });
    let sweeping = PrioritizedSweeping::new(&table, 0.9).unwrap();
    assert!(sweeping.clone().with_backups(0).is_err());
    assert!(sweeping.with_threshold(-1.0).is_err());
    let dyna = DynaQ::new(&table, half.clone(), 0.9).unwrap();
    assert!(dyna.with_bonus(-1.0).is_err());
    assert!(EpsilonGreedy::new(above).is_err());
    assert!(Boltzmann::new(constant(1e-7)).is_err());
}

/// Two steps along three states, by hand.
#[test]
fn returns_reach_back_as_the_formulas_say() {
    let run = |mut learner: Box<dyn Learner>, last: usize| {
        let (mut table, mut rng) = (zeros(3, 2), rng(0));
        table.set(State(1), Action(1), 0.1).unwrap();
        let first = Experience {
            next_action: Some(Action(last)),
            ..experience(0, 0, step(1, 0.0, Status::Continuing))
        };
        let second = experience(1, last, step(2, 1.0, Status::Terminated));
        let policy = policy(constant(0.2));
        for experience in [first, second] {
            learner
                .learn(&mut table, &experience, &policy, &mut rng)
                .unwrap();
        }
        (
            table.value(State(0), Action(0)),
            table.value(State(1), Action(last)),
        )
    };
    let traces = |target| Box::new(Traces::new(target, 0.5, constant(0.5), 0.8).unwrap()) as Box<_>;
    let n_step = |target| Box::new(NStep::new(target, 2, constant(0.5), 0.8).unwrap()) as Box<_>;
    // First 0.5 * 0.8 * 0.1; then the error 0.9 with the trace 0.8 * 0.5.
    let first = 0.5 * 0.8 * 0.1;
    let whole = first + 0.5 * 0.9 * 0.4;
    // The policy takes action 1 with probability 0.9, so that its state is worth 0.09.
    let mean = 0.5 * 0.8 * 0.09;
    for (learner, last, wanted) in [
        (traces(Target::Q), 1, (whole, 0.55)),
        // An exploratory action cuts the trace, or is measured from the best one for the pair
        // before.
        (traces(Target::Q), 0, (first, 0.5)),
        (traces(Target::UncutQ), 0, (whole, 0.5)),
        // SARSA values the action that was taken.
        (traces(Target::Sarsa), 0, (0.5 * 1.0 * 0.4, 0.5)),
        (traces(Target::Sarsa), 1, (whole, 0.55)),
        (
            traces(Target::ExpectedSarsa),
            1,
            (mean + 0.5 * 0.9 * 0.4, 0.55),
        ),
        (
            traces(Target::TreeBackup),
            1,
            (mean + 0.5 * 0.9 * 0.4 * 0.9, 0.55),
        ),
        // Two-step returns: 0 + 0.8 * 1 for the first pair; closed at the exploratory action: 0.8
        // * 0.1.
        (n_step(Target::Q), 1, (0.4, 0.55)),
        (n_step(Target::Q), 0, (0.04, 0.5)),
        (n_step(Target::UncutQ), 0, (0.4, 0.5)),
        (n_step(Target::Sarsa), 0, (0.4, 0.5)),
        // 0.1 * 0 + 0.9 * 1, or 0.9 * 0.1 + 0.1 * 1.
        (n_step(Target::TreeBackup), 1, (0.5 * 0.8 * 0.9, 0.55)),
        (n_step(Target::TreeBackup), 0, (0.5 * 0.8 * 0.19, 0.5)),
    ] {
        let found = run(learner, last);
        assert_near!(found.0, wanted.0, 1e-12);
        assert_near!(found.1, wanted.1, 1e-12);
    }
}

/// Every learner under every policy finds the shortest way with legal moves only.
#[test]
fn masks_hold_for_every_learner_and_policy() {
    // Cells in a row; only legal moves are offered, and every move costs.
    let model = Model::new(7, 3, |State(cell), Action(action)| {
        let legal = [cell > 0, cell < 6, cell % 2 == 0 && cell < 5][action];
        let next = [cell.wrapping_sub(1), cell + 1, cell + 2][action];
        match legal && cell < 6 {
            true => vec![Outcome::certain(State(next), -1.0, next == 6)],
            false => vec![],
        }
    });
    let mut world = ModelEnvironment::new(model.unwrap(), &[(State(0), 1.0)]).unwrap();
    let unmasked = zeros_of(&world);
    for (name, learner) in learners(&unmasked, &constant(0.1), 1.0) {
        let policy = policy(Schedule::linear(0.5, 0.0, 15_000).unwrap());
        let training = trained(
            &mut world,
            unmasked.clone(),
            learner,
            policy,
            (50, 20_000, 1),
        );
        let found = world.assess(&training.table().greedy(), 1.0, 50).unwrap();
        assert_near!(found.steps, 3.0, 1e-9, name);
        assert_near!(training.table().max(State(0)), -3.0, 0.01, name);
    }
}
