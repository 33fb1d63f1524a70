//! Updates per second of tabular Q-learning, qtable beside rurel, in one run.
//!
//! `cargo run --release` prints a table: millions of updates per second of CPU time (of wall time
//! where the system does not tell CPU time), the median over the rounds with their range, and the
//! median over the rounds of the ratio to rurel within the round.
//! `cargo run --release -- 9 4000000 500x4` sets the rounds, the updates in each, and a word that
//! the names of the rows contain.
//!
//! The problem is the same for all: 90 states and 81 actions, the shape of the approaching
//! behaviour of the paper, and a transition that costs next to nothing. rurel explores at random
//! only, and so it is given no choice to make; its agent draws from the same generator as ours and
//! only the action needed, which is the fastest that its interface allows.

mod by_hand;

use by_hand::{by_hand, by_hand_alike, softmax_by_hand};
use qtable::{
    Action, Boltzmann, CachedBoltzmann, Environment, EpsilonGreedy, Error, Learner, Policy,
    QLearning, QTable, Schedule, State, Status, Step, Target, Traces, Training, Until,
};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, RngExt, SeedableRng};
use rurel::mdp::{Agent, State as _};
use rurel::strategy::explore::RandomExploration;
use rurel::strategy::learn::QLearning as RurelQLearning;
use rurel::strategy::terminate::FixedIterations;
use std::hint::black_box;
use std::ops::ControlFlow;

const STATES: usize = 90;
const ACTIONS: usize = 81;
const ALPHA: f64 = 0.1;
const GAMMA: f64 = 0.9;
const TEMPERATURE: f64 = 1.0;

/// Next state and reward: scattered, and the same for everyone.
#[inline(always)]
fn transition(state: usize, action: usize) -> (usize, f64) {
    let mixed = (state * ACTIONS + action).wrapping_mul(2_654_435_761) >> 7;
    (mixed % STATES, if mixed & 63 == 0 { 1.0 } else { 0.0 })
}

#[inline(always)]
fn step(state: State, action: Action) -> Step {
    let (next, reward) = transition(state.0, action.0);
    Step {
        observation: State(next),
        reward,
        status: Status::Continuing,
    }
}

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

/// CPU time of this thread in seconds, or the time since the first call where that is not told.
fn seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    nanoseconds.map_or_else(
        || {
            START
                .get_or_init(std::time::Instant::now)
                .elapsed()
                .as_secs_f64()
        },
        |ns| ns * 1e-9,
    )
}

/// Millions of updates per second.
fn rate(updates: u64, run: impl FnOnce() -> Result<()>) -> Result<f64> {
    let start = seconds();
    run()?;
    Ok(updates as f64 / (seconds() - start) / 1e6)
}

#[derive(Clone)]
struct RurelState {
    index: usize,
    reward: f64,
}

impl PartialEq for RurelState {
    fn eq(&self, other: &Self) -> bool {
        self.index == other.index
    }
}

impl Eq for RurelState {}

impl std::hash::Hash for RurelState {
    fn hash<H: std::hash::Hasher>(&self, hasher: &mut H) {
        self.index.hash(hasher);
    }
}

impl rurel::mdp::State for RurelState {
    type A = usize;
    fn reward(&self) -> f64 {
        self.reward
    }
    fn actions(&self) -> Vec<usize> {
        (0..ACTIONS).collect()
    }
}

struct RurelAgent {
    state: RurelState,
    rng: Xoshiro256PlusPlus,
}

impl Agent<RurelState> for RurelAgent {
    fn current_state(&self) -> &RurelState {
        &self.state
    }
    fn take_action(&mut self, &action: &usize) {
        let (index, reward) = transition(self.state.index, action);
        self.state = RurelState { index, reward };
    }
    fn pick_random_action(&mut self) -> usize {
        let action = self.rng.random_range(0..ACTIONS);
        self.take_action(&action);
        action
    }
}

fn rurel(updates: u64) -> Result<f64> {
    let mut agent = RurelAgent {
        state: RurelState {
            index: 0,
            reward: 0.0,
        },
        rng: rng(1),
    };
    let mut trainer = rurel::AgentTrainer::new();
    let learning = RurelQLearning::new(ALPHA, GAMMA, 0.0);
    // Once without the clock, so that its maps have their size.
    for warm_up in [true, false] {
        let n = if warm_up { updates / 10 } else { updates };
        let measured = rate(n, || {
            trainer.train(
                &mut agent,
                &learning,
                &mut FixedIterations::new(u32::try_from(n)?),
                &RandomExploration::new(),
            );
            Ok(())
        })?;
        if !warm_up {
            black_box(trainer.expected_value(&agent.state, &agent.state.actions()[0]));
            return Ok(measured);
        }
    }
    Ok(f64::NAN)
}

fn epsilon_greedy(updates: u64, epsilon: f64) -> Result<f64> {
    let mut policy = EpsilonGreedy::new(Schedule::constant(epsilon)?)?;
    follow(updates, &mut policy)
}

fn plain_boltzmann(updates: u64) -> Result<f64> {
    let mut policy = Boltzmann::new(Schedule::constant(TEMPERATURE)?)?;
    follow(updates, &mut policy)
}

fn follow<P: Policy>(updates: u64, policy: &mut P) -> Result<f64> {
    follow_in(updates, policy, (STATES, ACTIONS), step)
}

/// A loop of choices and updates in a problem of a shape.
#[inline(always)]
fn follow_in<P: Policy>(
    updates: u64,
    policy: &mut P,
    (states, actions): (usize, usize),
    step: impl Fn(State, Action) -> Step,
) -> Result<f64> {
    let table = &mut QTable::new(states, actions)?;
    let mut learner = QLearning::new(Schedule::constant(ALPHA)?, GAMMA)?;
    let (mut rng, mut state) = (rng(1), State(0));
    let measured = rate(updates, || {
        for _ in 0..updates {
            let action = policy.choose(table, state, &mut rng);
            let step = step(state, action);
            learner.update(table, state, action, &step)?;
            state = step.observation;
        }
        Ok(())
    });
    black_box(table.max(state));
    measured
}

/// `LEARNERS` independent ones, one update of each in turn.
fn cached<const LEARNERS: usize>(updates: u64, seed: u64) -> Result<f64> {
    let table = QTable::new(STATES, ACTIONS)?;
    let mut learners = Vec::new();
    for learner in 0..LEARNERS as u64 {
        learners.push((
            CachedBoltzmann::new(&table, TEMPERATURE)?,
            rng(seed + learner),
            State(0),
        ));
    }
    let mut learners: [_; LEARNERS] = learners.try_into().map_err(|_| "a learner is missing")?;
    let measured = rate(updates, || {
        for _ in 0..updates / LEARNERS as u64 {
            // All choose, then all learn: a choice waits for memory most of the time, and these
            // wait together.
            let mut actions = [Action(0); LEARNERS];
            for ((cached, rng, state), action) in learners.iter_mut().zip(&mut actions) {
                *action = cached.choose(*state, rng);
            }
            for ((cached, _, state), action) in learners.iter_mut().zip(actions) {
                let step = step(*state, action);
                cached.update(*state, action, &step, ALPHA, GAMMA)?;
                *state = step.observation;
            }
        }
        Ok(())
    });
    black_box(
        learners
            .iter()
            .map(|(cached, _, state)| cached.max(*state))
            .sum::<f32>(),
    );
    measured
}

/// Next state and reward of a problem of 500 states and 4 actions.
#[inline(always)]
fn small_transition(state: usize, action: usize) -> (usize, f64) {
    let mixed = (state * 4 + action).wrapping_mul(2_654_435_761) >> 7;
    (mixed % 500, if mixed & 63 == 0 { 1.0 } else { 0.0 })
}

#[inline(always)]
fn small_step(state: State, action: Action) -> Step {
    let (next, reward) = small_transition(state.0, action.0);
    Step::new(State(next), reward, Status::Continuing)
}

/// Environment of this problem for `qtable`.
struct Small(State);

impl Environment for Small {
    fn states(&self) -> usize {
        500
    }
    fn actions(&self) -> usize {
        4
    }
    fn reset(&mut self, rng: &mut dyn Rng) -> std::result::Result<State, Error> {
        self.0 = State(rng.random_range(0..500));
        Ok(self.0)
    }
    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> std::result::Result<Step, Error> {
        let step = small_step(self.0, action);
        self.0 = step.observation;
        Ok(step)
    }
}

/// A run at 500 states and 4 actions, in episodes of 60 steps.
fn small_training<L: Learner, P: Policy>(updates: u64, learner: L, policy: P) -> Result<f64> {
    let mut problem = Small(State(0));
    let training = Training::new(&problem, QTable::new(500, 4)?, learner, policy)?;
    let mut training = training.with_episode_limit(60)?;
    let (mut rng, until) = (rng(3), Until::Actions(updates));
    let measured = rate(updates, || {
        Ok(training.run(&mut problem, until, &mut rng)?)
    });
    black_box(training.table().max(State(0)));
    measured
}

fn small_q(updates: u64, alpha: Schedule, epsilon: Schedule) -> Result<f64> {
    let learner = QLearning::new(alpha, GAMMA)?;
    small_training(updates, learner, EpsilonGreedy::new(epsilon)?)
}

fn small_sarsa_lambda(updates: u64) -> Result<f64> {
    let learner = Traces::new(Target::Sarsa, 0.8, Schedule::constant(ALPHA)?, GAMMA)?;
    small_training(
        updates,
        learner,
        EpsilonGreedy::new(Schedule::constant(0.1)?)?,
    )
}

/// The loop of the softmax by hand.
fn small_softmax(updates: u64, temperature: f64) -> Result<f64> {
    let mut policy = Boltzmann::new(Schedule::constant(temperature)?)?;
    follow_in(updates, &mut policy, (500, 4), small_step)
}

fn small_boltzmann(updates: u64, temperature: f64) -> Result<f64> {
    let policy = Boltzmann::new(Schedule::constant(temperature)?)?;
    small_training(
        updates,
        QLearning::new(Schedule::constant(ALPHA)?, GAMMA)?,
        policy,
    )
}

/// The sum of what two threads do, each by its own CPU time.
fn cached_on_two_threads(updates: u64) -> Result<f64> {
    let one = |seed| cached::<1>(updates / 2, seed).map_err(|error| error.to_string());
    let rates = std::thread::scope(|scope| {
        let other = scope.spawn(|| one(10));
        let here = one(20);
        other.join().map(|other| Ok::<_, String>(here? + other?))
    });
    Ok(rates.map_err(|_| "a thread broke off")??)
}

/// Implements the problem as an environment, in episodes of 60 steps.
struct Problem(State);

impl Environment for Problem {
    fn states(&self) -> usize {
        STATES
    }
    fn actions(&self) -> usize {
        ACTIONS
    }
    fn reset(&mut self, rng: &mut dyn Rng) -> std::result::Result<State, Error> {
        self.0 = State(rng.random_range(0..STATES));
        Ok(self.0)
    }
    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> std::result::Result<Step, Error> {
        let step = step(self.0, action);
        self.0 = step.observation;
        Ok(step)
    }
}

/// Exponential schedules, 60 actions to an episode, 100 records.
fn whole_training(updates: u64, in_blocks: bool) -> Result<f64> {
    let learner = QLearning::new(Schedule::exponential(0.6, 0.02, updates)?, GAMMA)?;
    let policy = Boltzmann::new(Schedule::exponential(1000.0, 0.1, updates)?)?;
    let mut problem = Problem(State(0));
    let table = QTable::new(STATES, ACTIONS)?;
    let mut training = Training::new(&problem, table, learner, policy)?
        .with_episode_limit(60)?
        .with_record_every(updates / 100)?;
    let (mut rng, until) = (rng(3), Until::Actions(updates));
    let measured = rate(updates, || {
        match in_blocks {
            true => training
                .run_in_blocks(&mut problem, until, 5, &mut rng, |_, _| {
                    ControlFlow::Continue(())
                })
                .map(|_| ())?,
            false => training.run(&mut problem, until, &mut rng)?,
        }
        Ok(())
    });
    black_box(training.table().max(State(0)));
    measured
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let rounds: usize = arguments.next().map_or(Ok(5), |text| text.parse())?;
    let updates: u64 = arguments
        .next()
        .map_or(Ok(4_000_000), |text| text.parse())?;
    type Entry = (&'static str, fn(u64) -> Result<f64>);
    let entries: [Entry; 23] = [
        ("rurel 0.6.0, random actions, f64", rurel),
        ("random actions, f64", |n| epsilon_greedy(n, 1.0)),
        ("epsilon-greedy 0.1, f64", |n| epsilon_greedy(n, 0.1)),
        ("the same by hand", |n| {
            by_hand_alike::<STATES, ACTIONS>(n, u64::MAX, |_| 0.1, transition)
        }),
        ("the same by hand, least work", by_hand),
        ("Boltzmann, plain, f64", |n| plain_boltzmann(n / 8)),
        ("Boltzmann, cached, f32", |n| cached::<1>(n, 1)),
        ("Boltzmann, cached, 2 interleaved", |n| cached::<2>(n, 1)),
        ("Boltzmann, cached, 4 interleaved", |n| cached::<4>(n, 1)),
        ("Boltzmann, cached, on 2 threads", |n| {
            cached_on_two_threads(n)
        }),
        ("Training::run, 500 000 actions", |_| {
            whole_training(500_000, false)
        }),
        ("run_in_blocks, 500 000 actions", |_| {
            whole_training(500_000, true)
        }),
        ("500x4: run, constant eps", |n| {
            small_q(n, Schedule::constant(ALPHA)?, Schedule::constant(0.1)?)
        }),
        ("500x4: run, linear eps", |n| {
            small_q(
                n,
                Schedule::constant(ALPHA)?,
                Schedule::linear(1.0, 0.1, n)?,
            )
        }),
        ("500x4: constant eps by hand", |n| {
            by_hand_alike::<500, 4>(n, 60, |_| 0.1, small_transition)
        }),
        ("500x4: linear eps by hand", |n| {
            let by_step = 0.9 / n as f64;
            by_hand_alike::<500, 4>(
                n,
                60,
                |update| 1.0 - by_step * update as f64,
                small_transition,
            )
        }),
        ("500x4: run, both exponential", |n| {
            small_q(
                n,
                Schedule::exponential(0.6, 0.02, n)?,
                Schedule::exponential(1.0, 0.1, n)?,
            )
        }),
        ("500x4: run, SARSA(0.8)", |n| small_sarsa_lambda(n / 4)),
        ("500x4: run, Boltzmann", |n| small_boltzmann(n / 2, 1.0)),
        ("500x4: Boltzmann", |n| small_softmax(n / 2, 1.0)),
        ("500x4: the same by hand, std exp", |n| {
            softmax_by_hand(n / 2, 1.0)
        }),
        ("500x4: Boltzmann, T = 0.05", |n| small_softmax(n / 2, 0.05)),
        ("500x4: the same by hand, T = 0.05", |n| {
            softmax_by_hand(n / 2, 0.05)
        }),
    ];
    let word = arguments.next().unwrap_or_default();
    let entries = entries.iter().filter(|(name, _)| name.contains(&word));
    let entries: Vec<_> = entries.collect();
    let mut rates = vec![Vec::new(); entries.len()];
    for _ in 0..rounds.max(1) {
        for ((_, run), rates) in entries.iter().zip(&mut rates) {
            rates.push(run(updates)?);
        }
    }
    println!(
        "{:36} {:>9} {:>17} {:>9}",
        "M updates/s of CPU time", "median", "range", "x rurel"
    );
    for ((name, _), measured) in entries.iter().zip(&rates) {
        let ratios = measured
            .iter()
            .zip(&rates[0])
            .map(|(ours, rurel)| ours / rurel)
            .collect();
        let least = measured.iter().copied().fold(f64::INFINITY, f64::min);
        let most = measured.iter().copied().fold(0.0, f64::max);
        let median_rate = median(measured.clone());
        println!(
            "{name:36} {median_rate:9.1} {:>17} {:9.1}",
            format!("{least:.1} .. {most:.1}"),
            median(ratios)
        );
    }
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
