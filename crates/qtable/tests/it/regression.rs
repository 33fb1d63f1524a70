//! Faults that a demanding user met, each with the right value.

use qtable::*;
use rand::{Rng, SeedableRng, rngs::Xoshiro256PlusPlus};

use crate::support::{constant, epsilon, experience, q_learning, rng, step, trained, zeros};

fn end(reward: f64) -> Experience {
    experience(0, 0, step(0, reward, Status::Terminated))
}

/// F1: with ties by lowest index no seed reached the goal.
#[test]
fn the_lake_is_learned_with_the_defaults() {
    let mut lake = ModelEnvironment::frozen_lake("4x4", false).unwrap();
    for seed in 0..5 {
        let (learner, settings) = (q_learning(0.1, 0.99), (100, 60_000, seed));
        let training = trained(&mut lake, zeros(16, 4), learner, epsilon(0.1), settings);
        let [learned, _] = lake.compare(training.table(), 0.99, 100).unwrap();
        assert_near!(learned.success, 1.0, 1e-12, seed);
    }
}

/// F2: the table showed 25 after a single reward of 0, what was learned of another table.
#[test]
fn a_learner_refuses_another_table() {
    let begun = zeros(1, 1);
    let mut double = DoubleQLearning::new(&begun, constant(0.5), 0.9).unwrap();
    let mut dyna = DynaQ::new(&begun, constant(0.5), 0.9).unwrap();
    let mut sweeping = PrioritizedSweeping::new(&begun, 0.9).unwrap();
    let learners: [&mut dyn Learner; 3] = [&mut double, &mut dyna, &mut sweeping];
    for learner in learners {
        let (mut old, mut fresh) = (begun.clone(), begun.clone());
        for _ in 0..20 {
            learner
                .learn(&mut old, &end(100.0), &Greedy, &mut rng(1))
                .unwrap();
        }
        let refused = learner.learn(&mut fresh, &end(0.0), &Greedy, &mut rng(1));
        assert_refused!(refused, Error::OtherTable(..));
        assert_eq!(fresh, begun);
    }
    // A table that was changed by hand was overwritten.
    let mut changed = begun.clone();
    let mut double = DoubleQLearning::new(&changed, constant(0.5), 0.9).unwrap();
    changed.set(State(0), Action(0), 50.0).unwrap();
    let refused = double.learn(&mut changed, &end(0.0), &Greedy, &mut rng(1));
    assert_refused!(refused, Error::OtherTable(..));
}

/// F3: a table above 1 GiB was trained and could not be saved.
#[cfg(all(feature = "files", unix))]
#[test]
fn a_file_has_no_size_limit() {
    struct Wide<'a>(&'a [u8]);
    impl serde::Serialize for Wide<'_> {
        fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.serialize_bytes(self.0)
        }
    }
    let part = vec![7; 1 << 28];
    let whole: [Wide<'_>; 5] = std::array::from_fn(|_| Wide(&part));
    save("/dev/null", "wide/1", &whole).unwrap();
}

/// Two actions, of which the first is forbidden.
struct Masked;

impl Environment for Masked {
    fn states(&self) -> usize {
        1
    }
    fn actions(&self) -> usize {
        2
    }
    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        Ok(State(0))
    }
    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
        assert_eq!(action, Action(1), "a forbidden action was taken");
        Ok(step(0, 1.0, Status::Terminated))
    }
    fn allows(&self, _state: State, action: Action) -> bool {
        action == Action(1)
    }
}

/// F4: the environment was given the forbidden action 0.
#[test]
fn an_evaluation_honours_the_mask_of_the_environment() {
    let table = zeros(1, 2);
    let found = evaluate(&mut Masked, &table, &mut Greedy, 3, 1, &mut rng(1)).unwrap();
    assert!((found.mean_return - 1.0).abs() < 1e-12 && found.success_share.is_none());
}

/// F5: terminal states had to offer an action.
#[test]
fn a_state_without_actions_is_a_terminal_one() {
    let model = Model::new(2, 1, |s, _| match s {
        State(0) => vec![Outcome::certain(State(1), 1.0, false)],
        _ => vec![],
    });
    let model = model.unwrap();
    let plan = model.value_iteration(0.9, 1e-12).unwrap();
    assert!((plan.table.max(State(0)) - 1.0).abs() < 1e-12);
    assert!(plan.table.max(State(1)).abs() < 1e-300);
    let values = model.evaluate(&[Action(0), Action(0)], 0.9, 1e-12).unwrap();
    assert!((values[0] - 1.0).abs() < 1e-12 && values[1].abs() < 1e-300);

    let mut world = ModelEnvironment::new(model, &[(State(0), 1.0)]).unwrap();
    let (learner, ucb) = (q_learning(1.0, 0.9), Ucb::new(1.0).unwrap());
    let training = trained(&mut world, zeros(2, 1), learner, ucb, (9, 3, 1));
    assert_eq!(training.episodes(), 3);

    // An episode that goes on where nothing is offered is a fault of the environment.
    let mut table = zeros(1, 2);
    table.restrict(|_, _| false);
    let stuck = evaluate(&mut Masked, &table, &mut Greedy, 1, 1, &mut rng(1));
    assert!(stuck.is_ok(), "the mask of the environment holds");
    let mut choice = EpsilonGreedy::new(constant(1.0)).unwrap();
    assert_eq!(choice.choose(&table, State(0), &mut rng(1)), Action(0));
}

/// F6: a thousand rewards of 1e-4 left the value at 0.
#[test]
fn sweeping_learns_small_rewards() {
    let mut table = zeros(1, 1);
    let mut sweeping = PrioritizedSweeping::new(&table, 0.9).unwrap();
    for _ in 0..1000 {
        sweeping
            .learn(&mut table, &end(1e-4), &Greedy, &mut rng(1))
            .unwrap();
    }
    assert!((table.max(State(0)) - 1e-4).abs() < 1e-12);
}

/// F7: one state at γ = 0.99999 did not converge, and γ = 1 with an endless reward took 30 s.
#[test]
fn planning_neither_gives_up_nor_runs_on() {
    let stay = Model::new(1, 1, |s, _| vec![Outcome::certain(s, 1.0, false)]).unwrap();
    let plan = stay.value_iteration(0.99999, 1e-6).unwrap();
    assert!((plan.table.max(State(0)) / 100_000.0 - 1.0).abs() < 1e-9);
    let plan = stay.policy_iteration(0.99999, 1e-6).unwrap();
    assert!((plan.table.max(State(0)) / 100_000.0 - 1.0).abs() < 1e-9);
    let endless = stay.value_iteration(1.0, 1e-6).unwrap_err();
    assert!(matches!(endless, Error::NotConverged(sweeps, _) if sweeps < 10_000));
    let few = stay
        .with_most_sweeps(7)
        .unwrap()
        .value_iteration(0.9, 1e-12);
    assert!(matches!(few, Err(Error::NotConverged(7, _))));
    let taxi = ModelEnvironment::taxi().unwrap();
    let plan = taxi.model().policy_iteration(1.0, 1e-9).unwrap();
    let found = taxi.assess(&plan.table.greedy(), 1.0, 200).unwrap();
    assert!((found.total_reward - 7.93).abs() < 1e-9, "{found:?}");
}

/// F8: with n = 4 the bound saw no visit for four steps and tried 0, 0, 0, 0, 1.
#[test]
fn n_step_learning_counts_a_visit_at_once() {
    let mut table = zeros(1, 5);
    let mut learner = NStep::new(Target::Q, 4, constant(0.5), 0.9).unwrap();
    let mut ucb = Ucb::new(1.0).unwrap().with_ties(Ties::Lowest);
    let tried = [0, 1, 2, 3, 4].map(|_| {
        let action = ucb.choose(&table, State(0), &mut rng(1));
        let experience = experience(0, action.0, step(0, 0.0, Status::Continuing));
        learner
            .learn(&mut table, &experience, &ucb, &mut rng(1))
            .unwrap();
        action.0
    });
    assert_eq!(tried, [0, 1, 2, 3, 4]);
}

/// F9: the product of the index wrapped and row 0 was returned.
#[test]
fn an_index_that_wraps_panics() {
    let table = zeros(3, 4);
    let mut masked = table.clone();
    masked.restrict(|_, action| action.0 > 0);
    let far = State(1 << (usize::BITS - 2));
    let panics = |of: &dyn Fn() -> f64| {
        let of = std::panic::AssertUnwindSafe(of);
        std::panic::catch_unwind(of).is_err()
    };
    assert!(panics(&|| table.value(far, Action(0))));
    assert!(panics(&|| table.row(far)[0]));
    assert!(panics(&|| f64::from(table.visits(far, Action(0)))));
    assert!(panics(&|| f64::from(u8::from(
        masked.allows(far, Action(0))
    ))));
    assert_eq!(table.get(far, Action(0)), None);
}

/// Draws each of the 2^24 uniform numbers that a choice can see, once.
struct Everything(u64);

impl rand::rand_core::TryRng for Everything {
    type Error = std::convert::Infallible;
    fn try_next_u32(&mut self) -> Result<u32, Self::Error> {
        unreachable!("a choice takes 64 bits")
    }
    fn try_next_u64(&mut self) -> Result<u64, Self::Error> {
        self.0 += 1;
        Ok((self.0 - 1) << 40)
    }
    fn try_fill_bytes(&mut self, _bytes: &mut [u8]) -> Result<(), Self::Error> {
        unreachable!("a choice takes 64 bits")
    }
}

/// F10: the probabilities were said to be right to 1e-6 and were not beyond 81 actions.
#[test]
fn cached_choices_are_as_exact_as_documented() {
    for actions in [81, 1000] {
        let mut table = zeros(1, actions);
        let mut cached = CachedBoltzmann::new(&table, 1.0).unwrap();
        // Learned values, not fresh ones.
        for n in 0..20_000 {
            let (action, reward) = (Action(n * 7 % actions), 3.0 * (n as f64 * 0.37).sin());
            let step = step(0, reward, Status::Terminated);
            cached.update(State(0), action, &step, 0.5, 0.9).unwrap();
        }
        cached.write_to(&mut table).unwrap();
        let weights: Vec<f64> = table.row(State(0)).iter().map(|q| q.exp()).collect();
        let sum: f64 = weights.iter().sum();
        let (mut counts, mut all) = (vec![0u32; actions], Everything(0));
        for _ in 0..1 << 24 {
            counts[cached.choose(State(0), &mut all).0] += 1;
        }
        let bound = 1e-6 + 1e-8 * actions as f64;
        for (count, weight) in counts.into_iter().zip(weights) {
            let drawn = f64::from(count) / f64::from(1 << 24);
            assert!((drawn - weight / sum).abs() < bound, "{drawn} of {actions}");
        }
    }
}

/// F11: every episode reached the goal and the curve said 0.
#[test]
fn success_is_not_told_by_the_reward() {
    let cliff = ModelEnvironment::cliff_walking().unwrap();
    let mut own = ModelEnvironment::new(cliff.model().clone(), cliff.start()).unwrap();
    let optimum = own.model().value_iteration(1.0, 1e-9).unwrap().table;
    let found = evaluate(&mut own, &optimum, &mut Greedy, 5, 100, &mut rng(1)).unwrap();
    assert_eq!(found.success_share, Some(1.0));
}

/// Sutton and Barto's blocking maze (example 8.2): a wall opens on the left and closes on the right
/// after 1000 actions. F13: averaging over all outcomes, Dyna-Q had 45 goals by action 3000.
#[test]
fn dyna_notices_that_a_world_has_changed() {
    let goals = |make: &dyn Fn(&QTable) -> DynaQ, seed| {
        let mut rng = rng(seed);
        let mut table = zeros(54, 4);
        let mut learner = make(&table);
        let mut policy = EpsilonGreedy::new(constant(0.1)).unwrap();
        let (mut at, mut goals) = (48, 0);
        for time in 0..3000 {
            let wall = if time < 1000 { 0..8 } else { 1..9 };
            let action = policy.choose(&table, State(at), &mut rng);
            let (row, column) = (at / 9, at % 9);
            let (to_row, to_column) = match action.0 {
                0 => (row.saturating_sub(1), column),
                1 => ((row + 1).min(5), column),
                2 => (row, column.saturating_sub(1)),
                _ => (row, (column + 1).min(8)),
            };
            let blocked = to_row == 3 && wall.contains(&to_column);
            let next = if blocked { at } else { to_row * 9 + to_column };
            let arrived = next == 8;
            let status = [Status::Continuing, Status::Terminated][usize::from(arrived)];
            let step = step(next, f64::from(u8::from(arrived)), status);
            let experience = experience(at, action.0, step);
            learner
                .learn(&mut table, &experience, &policy, &mut rng)
                .unwrap();
            goals += u32::from(arrived);
            at = if arrived { 48 } else { next };
        }
        goals
    };
    let mean = |make: &dyn Fn(&QTable) -> DynaQ| {
        let all = (0..30).map(|seed| f64::from(goals(make, seed)));
        all.sum::<f64>() / 30.0
    };
    let new = |table: &QTable| {
        let dyna = DynaQ::new(table, constant(0.7), 0.95).unwrap();
        dyna.with_planning_steps(10)
    };
    let averaging = mean(&new);
    let last = mean(&|table| new(table).with_last_outcome());
    let plus = mean(&|table| new(table).with_last_outcome().with_bonus(1e-3).unwrap());
    assert!(last > 1.2 * averaging, "{last} and {averaging}");
    assert!(plus > 1.2 * averaging, "{plus} and {averaging}");
}

/// F14: with α = 1/n the largest error of Q was 0.4 after three million actions.
#[test]
fn a_power_of_the_visits_learns_faster_than_their_inverse() {
    let mut lake = ModelEnvironment::frozen_lake("4x4", true).unwrap();
    let optimum = lake.model().value_iteration(0.99, 1e-10).unwrap().table;
    let mut error = |alpha: Schedule| {
        let (learner, settings) = (QLearning::new(alpha, 0.99).unwrap(), (u64::MAX, 300_000, 2));
        let training = trained(&mut lake, zeros(16, 4), learner, epsilon(1.0), settings);
        let pairs = (0..16).flat_map(|s| (0..4).map(move |a| (State(s), Action(a))));
        let errors = pairs.map(|(s, a)| training.table().value(s, a) - optimum.value(s, a));
        errors.map(f64::abs).fold(0.0, f64::max)
    };
    let inverse = error(Schedule::inverse_visits(1.0, 1.0).unwrap());
    let power = error(Schedule::visits_power(1.0, 0.7).unwrap());
    assert!(
        power < 0.25 && inverse > 2.0 * power,
        "{inverse} and {power}"
    );
}

/// F15 and F16: nothing of a run could be adjusted, and its curve was kept for ever.
#[test]
fn a_run_can_be_adjusted_and_its_curve_drained() {
    let mut chain = ModelEnvironment::chain(5).unwrap();
    let training = Training::new(&chain, zeros(5, 2), q_learning(0.5, 0.9), epsilon(1.0));
    let (mut training, until) = (training.unwrap(), Until::Actions(5_000));
    let mut drained = 0;
    let run = training.run_with(&mut chain, until, &mut rng(1), |_, run| {
        *run.policy_mut() = epsilon(0.1);
        drained += run.take_curve().len();
        std::ops::ControlFlow::Continue(())
    });
    assert_eq!((run, drained, training.curve().len()), (Ok(false), 5, 0));
    assert_near!(training.into_parts().2.epsilon(), 0.1, 1e-12);
}

/// F17: a process that was killed while it saved left its file for ever.
#[cfg(feature = "files")]
#[test]
fn files_left_by_a_killed_process_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let left = folder.path().join(".policy.qt.part-4711-0");
    let other = folder.path().join(".other.qt.part-4711-0");
    std::fs::write(&left, "half").unwrap();
    std::fs::write(&other, "half").unwrap();
    // A file that a living process writes is locked.
    let busy = folder.path().join(".policy.qt.part-4712-0");
    let held = std::fs::File::create(&busy).unwrap();
    held.lock().unwrap();
    save(folder.path().join("policy.qt"), "k", &1u8).unwrap();
    assert!(!left.exists() && other.exists() && busy.exists());
}

/// F12: a method said that Expected SARSA was off-policy.
#[test]
fn only_learners_that_need_the_next_action_ask_for_it() {
    let asks = |target| {
        NStep::new(target, 1, constant(0.5), 0.9)
            .unwrap()
            .needs_next_action()
    };
    assert!(asks(Target::Sarsa) && !asks(Target::ExpectedSarsa));
}

/// F18: with few actions the cached form was slower than the plain one.
#[test]
fn few_actions_are_chosen_by_the_plain_policy() {
    let chain = ModelEnvironment::chain(5).unwrap();
    let runs = [false, true].map(|in_blocks| {
        let (learner, policy) = (q_learning(0.5, 0.9), Boltzmann::new(constant(0.1)).unwrap());
        let mut run = Training::new(&chain, zeros(5, 2), learner, policy).unwrap();
        let (mut chain, until, mut rng) = (chain.clone(), Until::Actions(2_500), rng(1));
        let go_on = |_: &Record, _: &mut Training<_, _>| std::ops::ControlFlow::Continue(());
        let stopped = match in_blocks {
            true => run.run_in_blocks(&mut chain, until, 3, &mut rng, go_on),
            false => run.run_with(&mut chain, until, &mut rng, go_on),
        };
        assert_eq!(stopped, Ok(false));
        run
    });
    assert_eq!(runs[0], runs[1]);
}

/// F19: an exponential schedule took two logarithms and an exponential at each action, seven times
/// the cost of a linear one.
#[test]
fn an_exponential_schedule_costs_little_more_than_a_linear_one() {
    let linear = Schedule::linear(1.0, 0.1, 1_000_000).unwrap();
    let exponential = Schedule::exponential(1.0, 0.1, 1_000_000).unwrap();
    let time = |schedule: &Schedule| {
        let rounds = (0..5).map(|_| {
            let start = std::time::Instant::now();
            let sum: f64 = (0..200_000)
                .map(|step| schedule.at(std::hint::black_box(step)))
                .sum();
            assert!(sum > 0.0);
            start.elapsed()
        });
        rounds.min().unwrap().as_secs_f64()
    };
    let (linear, exponential) = (time(&linear), time(&exponential));
    assert!(exponential < 6.0 * linear, "{exponential} s and {linear} s");
}

/// F21: learners were generic over the type of values, and concrete ones could not be called.
#[test]
fn methods_of_concrete_learners_need_no_annotations() {
    let mut learner = q_learning(0.5, 0.9);
    learner.begin_episode();
    assert!(!learner.needs_next_action());
}

/// F22: after 600 actions in episodes of two, ε had fallen to 0.1 under SARSA and to 0.4 under
/// Q-learning. The choices after truncated steps count; the documentation of the target says so.
#[test]
fn sarsa_makes_one_choice_more_for_each_truncated_episode() {
    let mut chain = ModelEnvironment::chain(9).unwrap();
    let falling = || EpsilonGreedy::new(Schedule::linear(1.0, 0.1, 900).unwrap()).unwrap();
    let settings = (2, 600, 1);
    let q = trained(
        &mut chain,
        zeros(9, 2),
        q_learning(0.5, 0.9),
        falling(),
        settings,
    );
    let sarsa = NStep::new(Target::Sarsa, 1, constant(0.5), 0.9).unwrap();
    let sarsa = trained(&mut chain, zeros(9, 2), sarsa, falling(), settings);
    assert_near!(q.policy().epsilon(), 0.4, 1e-9);
    assert_near!(sarsa.policy().epsilon(), 0.1, 1e-9);
    let expected = NStep::new(Target::ExpectedSarsa, 1, constant(0.5), 0.9).unwrap();
    let expected = trained(&mut chain, zeros(9, 2), expected, falling(), settings);
    assert_near!(expected.policy().epsilon(), 0.4, 1e-9);
}

/// F25: whoever wanted JSON alone paid for bincode, a checksum and temporary files.
#[test]
fn serialization_alone_pulls_in_no_file_crates() {
    let manifest = include_str!("../../Cargo.toml");
    let feature = |name: &str| {
        let line = manifest.lines().find(|line| line.starts_with(name));
        line.unwrap_or_default().to_owned()
    };
    assert_eq!(feature("serde ="), r#"serde = ["dep:serde", "rand/serde"]"#);
    assert!(feature("files =").contains("dep:bincode"));
}

/// F26: a temperature above 1e6 and thirds in single precision were refused.
#[test]
fn hot_temperatures_and_thirds_in_single_precision_are_accepted() {
    assert!(Boltzmann::new(constant(1e12)).is_ok());
    let table = QTable::filled(1, 3, 1e9).unwrap();
    let cached = CachedBoltzmann::new(&table, 1e12).unwrap();
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
    assert!(cached.choose(State(0), &mut generator).0 < 3);
    let third = f64::from(1.0f32 / 3.0);
    let outcome = |next| Outcome {
        probability: third,
        ..Outcome::certain(State(next), 0.0, false)
    };
    let model = Model::new(3, 1, |_, _| (0..3).map(outcome).collect()).unwrap();
    let start = [0, 1, 2].map(|state| (State(state), third));
    assert!(ModelEnvironment::new(model, &start).is_ok());
    // A certainty that is a sum of thirteenths.
    let certain = Outcome {
        probability: (0..13).map(|_| 1.0 / 13.0).sum::<f64>() + f64::EPSILON,
        ..outcome(0)
    };
    assert!(Model::new(1, 1, |_, _| vec![certain]).is_ok());
}
