//! Ten figures and examples of Sutton and Barto, "Reinforcement Learning" (2nd edition, 2018), run
//! again: their values with 95 % intervals beside the book's, and their curves as SVG.
//!
//! `cargo run --release -p qtable --features parallel --example sutton_barto -- FOLDER`
//!
//! Numbers that the book shows only as a curve are read off the figure ("about").
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

mod blackjack;
mod figure;
mod worlds;

use std::path::Path;

use qtable::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    Action, DoubleQLearning, DynaQ, Environment, EpsilonGreedy, Error, Estimate, Learner, Model,
    NStep, Outcome, QLearning, QTable, Schedule, State, Target, Training, Until, over_seeds,
};

use crate::figure::{Curves, draw};
use crate::worlds::World;

/// Values of one run, one a point of its curve.
type Run = Result<Vec<f64>, Error>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "sutton_barto".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let here = "here, 95 % interval";
    row("figure", "quantity", "book", here);
    let save = |name: &str, svg: String| std::fs::write(folder.join(name), svg);
    save("2.2-bandits.svg", bandits()?)?;
    gambler()?;
    save("5.2-blackjack.svg", blackjack::blackjack()?)?;
    save("6.5-windy-grid.svg", windy()?)?;
    save("6.6-cliff.svg", cliff()?)?;
    save("6.7-maximization-bias.svg", bias()?)?;
    save("7.2-random-walk.svg", walk()?)?;
    save("8.2-dyna-maze.svg", dyna_maze()?)?;
    save(
        "8.4-blocking-maze.svg",
        changing("Figure 8.4: blocking maze", worlds::blocking_maze)?,
    )?;
    save(
        "8.5-shortcut-maze.svg",
        changing("Figure 8.5: shortcut maze", worlds::shortcut_maze)?,
    )?;
    Ok(())
}

fn row(figure: &str, quantity: &str, book: &str, here: impl std::fmt::Display) {
    println!("{figure:31} {quantity:39} {book:>11}  {here}");
}

/// Prints a quantity as its mean over the runs.
fn measured(figure: &str, quantity: &str, book: &str, here: Estimate) {
    row(
        figure,
        quantity,
        book,
        format!("{here}, {} runs", here.count),
    );
}

fn constant(value: f64) -> Result<Schedule, Error> {
    Schedule::constant(value)
}

fn training<L: Learner>(
    world: &World,
    learner: L,
    epsilon: f64,
) -> Result<Training<L, EpsilonGreedy>, Error> {
    let policy = EpsilonGreedy::new(constant(epsilon)?)?;
    Training::new(
        world,
        QTable::new(world.states(), world.actions())?,
        learner,
        policy,
    )
}

/// Runs a learner for a number of episodes and measures each.
fn episodes<L: Learner>(
    world: &mut World,
    learner: L,
    epsilon: f64,
    (count, seed): (u64, u64),
    measure: impl Fn(&World, u64, f64) -> f64,
) -> Run {
    let mut training = training(world, learner, epsilon)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut values = Vec::new();
    for episode in 1..=count {
        let (before, paid) = (training.actions(), world.paid);
        training.run(world, Until::Episodes(episode), &mut rng)?;
        values.push(measure(
            world,
            training.actions() - before,
            world.paid - paid,
        ));
    }
    Ok(values)
}

/// Estimates the mean over a part of the curves, one value a run.
fn mean_of(runs: &[Vec<f64>], part: std::ops::Range<usize>) -> Estimate {
    let mean = |run: &Vec<f64>| run[part.clone()].iter().sum::<f64>() / part.len() as f64;
    Estimate::of(&runs.iter().map(mean).collect::<Vec<_>>())
}

/// Returns the mean curve of several runs, with every point averaged over its neighbours.
fn curve(name: &str, runs: &[Vec<f64>], window: usize) -> (String, Vec<(f64, f64)>) {
    let length = runs[0].len();
    let point = |at: usize| {
        let part = at.saturating_sub(window)..(at + window + 1).min(length);
        (at as f64 + 1.0, mean_of(runs, part).mean)
    };
    (name.into(), (0..length).map(point).collect())
}

/// Figure 2.2: the ten-armed testbed.
fn bandits() -> Result<String, Error> {
    let mut curves = Curves::new();
    for (epsilon, book) in [
        (0.0, "about 1.05"),
        (0.01, "about 1.25"),
        (0.1, "about 1.4"),
    ] {
        let runs = over_seeds(0..2_000, |seed| {
            let mut world = worlds::bandit(&mut Xoshiro256PlusPlus::seed_from_u64(!seed));
            let learner = QLearning::new(Schedule::inverse_visits(1.0, 1.0)?, 1.0)?;
            episodes(&mut world, learner, epsilon, (1_000, seed), |_, _, paid| {
                paid
            })
        })?;
        let name = format!("ε = {epsilon}");
        measured(
            "figure 2.2, bandits",
            &format!("reward at step 1000, {name}"),
            book,
            mean_of(&runs, 950..1_000),
        );
        curves.push(curve(&name, &runs, 5));
    }
    let axes = ["step", "mean reward"];
    Ok(draw(
        "Figure 2.2: ten-armed bandits",
        axes,
        &curves,
        (0.0, 1.6),
    ))
}

/// Figure 4.3: the gambler's problem, exactly.
fn gambler() -> Result<(), Error> {
    let model = Model::new(101, 51, |State(capital), Action(stake)| {
        if capital == 0 || capital == 100 || stake == 0 || stake > capital.min(100 - capital) {
            return vec![];
        }
        let won = Outcome::certain(
            State(capital + stake),
            f64::from(u8::from(capital + stake == 100)),
            false,
        );
        let lost = Outcome::certain(State(capital - stake), 0.0, false);
        vec![
            Outcome {
                probability: 0.4,
                ..won
            },
            Outcome {
                probability: 0.6,
                ..lost
            },
        ]
    })?;
    let plan = model.value_iteration(1.0, 1e-12)?;
    for (capital, value, stake) in [
        (25, "0.16", 25),
        (50, "0.4", 50),
        (51, "-", 1),
        (75, "0.64", 25),
    ] {
        let state = State(capital);
        let name = format!("value and stake {stake} at {capital}");
        let is_best = plan.table.value(state, Action(stake)) > plan.table.max(state) - 1e-9;
        let best = if is_best { "best" } else { "not best" };
        row(
            "figure 4.3, gambler",
            &name,
            value,
            format!("{:.4} {best}", plan.table.max(state)),
        );
    }
    Ok(())
}

/// Example 6.5: SARSA on the windy grid.
///
/// The book draws one run, and its 17 steps are those of the best policy with ε = 0.1. A constant α
/// of 0.5 keeps the values moving, which costs SARSA four steps more.
fn windy() -> Result<String, Error> {
    let steps = |alpha: Schedule, count| {
        over_seeds(0..100, move |seed| {
            let learner = NStep::new(Target::Sarsa, 1, alpha.clone(), 1.0)?;
            let measure = |_: &World, steps, _| steps as f64;
            episodes(&mut worlds::windy(), learner, 0.1, (count, seed), measure)
        })
    };
    let runs = steps(constant(0.5)?, 400)?;
    let by_8000 = |run: &Vec<f64>| {
        let mut time = 0.0;
        run.iter()
            .take_while(|steps| {
                time += **steps;
                time <= 8_000.0
            })
            .count() as f64
    };
    let figure = "example 6.5, windy grid";
    let counts: Vec<f64> = runs.iter().map(by_8000).collect();
    measured(
        figure,
        "episodes in 8000 steps",
        "about 170",
        Estimate::of(&counts),
    );
    let range = |pick: fn(f64, f64) -> f64| counts.iter().copied().reduce(pick).unwrap_or(0.0);
    let range = format!("{} to {}", range(f64::min), range(f64::max));
    row(figure, "the same, in single runs", "one of 170", range);
    let late = mean_of(&runs, 300..400);
    measured(figure, "steps of a late episode, α = 0.5", "about 17", late);
    let falling = Schedule::exponential(0.5, 0.01, 4_000)?.by_episode();
    let late = mean_of(&steps(falling, 4_000)?, 3_900..4_000);
    measured(figure, "the same, α falling to 0.01", "about 17", late);
    row(
        figure,
        "least possible with ε = 0.1",
        "about 17",
        format!("{:.3}, exact", least(0.1)?),
    );
    let curves = vec![curve("SARSA", &runs, 2)];
    let axes = ["episode", "steps"];
    Ok(draw(
        "Example 6.5: windy grid world",
        axes,
        &curves,
        (0.0, 200.0),
    ))
}

/// Returns the fewest steps that a policy with an ε takes over the windy grid on the average: in
/// its model every action is replaced by a random one with probability ε.
fn least(epsilon: f64) -> Result<f64, Error> {
    let model = Model::new(70, 4, |State(cell), Action(action)| {
        let outcome = |taken: usize| {
            let next = worlds::blown(cell, taken);
            let asked_for = if taken == action { 1.0 - epsilon } else { 0.0 };
            Outcome {
                probability: asked_for + epsilon / 4.0,
                ..Outcome::certain(State(next), -1.0, next == 37)
            }
        };
        (0..4).map(outcome).collect()
    })?;
    Ok(-model.value_iteration(1.0, 1e-12)?.table.max(State(30)))
}

/// Example 6.6: SARSA and Q-learning on the cliff.
fn cliff() -> Result<String, Error> {
    let measure = |_: &World, _, paid: f64| paid;
    let q = over_seeds(0..200, |seed| {
        let learner = QLearning::new(constant(0.5)?, 1.0)?;
        episodes(&mut worlds::cliff(), learner, 0.1, (500, seed), measure)
    })?;
    let sarsa = over_seeds(0..200, |seed| {
        let learner = NStep::new(Target::Sarsa, 1, constant(0.5)?, 1.0)?;
        episodes(&mut worlds::cliff(), learner, 0.1, (500, seed), measure)
    })?;
    let quantity = "return of a late episode";
    measured(
        "example 6.6, cliff: SARSA",
        quantity,
        "about -25",
        mean_of(&sarsa, 400..500),
    );
    measured(
        "example 6.6, cliff: Q-learning",
        quantity,
        "about -50",
        mean_of(&q, 400..500),
    );
    let curves = vec![curve("SARSA", &sarsa, 5), curve("Q-learning", &q, 5)];
    let axes = ["episode", "sum of rewards"];
    Ok(draw(
        "Example 6.6: cliff walking",
        axes,
        &curves,
        (-100.0, 0.0),
    ))
}

/// Figure 6.5: maximization bias.
fn bias() -> Result<String, Error> {
    let left = |world: &World, _, _| if world.first == 0 { 100.0 } else { 0.0 };
    let q = over_seeds(0..2_000, |seed| {
        let learner = QLearning::new(constant(0.1)?, 1.0)?;
        episodes(&mut worlds::bias(), learner, 0.1, (300, seed), left)
    })?;
    let double = over_seeds(0..2_000, |seed| {
        let learner = DoubleQLearning::new(&QTable::new(2, 10)?, constant(0.1)?, 1.0)?;
        episodes(&mut worlds::bias(), learner, 0.1, (300, seed), left)
    })?;
    let quantity = "% left in the last 10 of 300";
    measured(
        "figure 6.5, bias: Q-learning",
        quantity,
        "about 10",
        mean_of(&q, 290..300),
    );
    measured(
        "figure 6.5, bias: Double Q",
        quantity,
        "about 6",
        mean_of(&double, 290..300),
    );
    let curves = vec![
        curve("Q-learning", &q, 0),
        curve("Double Q-learning", &double, 0),
    ];
    let axes = ["episode", "% left actions from A"];
    Ok(draw(
        "Figure 6.5: maximization bias",
        axes,
        &curves,
        (0.0, 100.0),
    ))
}

/// Figure 7.2: n-step returns on a random walk of 19 states.
fn walk() -> Result<String, Error> {
    let mut curves = Curves::new();
    for n in [1, 2, 4, 8, 16, 32] {
        let (mut points, mut best) = (Vec::new(), Estimate::of(&[]));
        for alpha in [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0] {
            let errors = over_seeds(0..100, |seed| {
                let mut world = worlds::walk();
                let learner = NStep::new(Target::Sarsa, n, constant(alpha)?, 1.0)?;
                let mut training = training(&world, learner, 0.0)?;
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let mut sum = 0.0;
                for episode in 1..=10 {
                    training.run(&mut world, Until::Episodes(episode), &mut rng)?;
                    let error = |state: usize| {
                        let wanted = (state as f64 - 9.0) / 10.0;
                        (training.table().max(State(state)) - wanted).powi(2)
                    };
                    sum += ((0..19).map(error).sum::<f64>() / 19.0).sqrt() / 10.0;
                }
                Ok::<_, Error>(sum)
            })?;
            let error = Estimate::of(&errors);
            points.push((alpha, error.mean));
            if best.mean.is_nan() || error.mean < best.mean {
                best = error;
            }
        }
        let book = if n == 4 { "about 0.25" } else { "-" };
        measured(
            "figure 7.2, random walk",
            &format!("least error, n = {n}"),
            book,
            best,
        );
        curves.push((format!("n = {n}"), points));
    }
    let axes = ["α", "error over the first 10 episodes"];
    Ok(draw(
        "Figure 7.2: n-step returns on a random walk",
        axes,
        &curves,
        (0.2, 0.6),
    ))
}

/// Figure 8.2: planning steps in the Dyna maze.
fn dyna_maze() -> Result<String, Error> {
    let mut curves = Curves::new();
    for (steps, book) in [(0, "about 25"), (5, "about 5"), (50, "about 3")] {
        let runs = over_seeds(0..30, |seed| {
            let learner = DynaQ::new(&QTable::new(54, 4)?, constant(0.1)?, 0.95)?;
            let learner = learner.with_planning_steps(steps).with_last_outcome();
            let measure = |_: &World, steps, _| steps as f64;
            episodes(&mut worlds::dyna_maze(), learner, 0.1, (50, seed), measure)
        })?;
        let name = format!("{steps} planning steps");
        let near = |run: &Vec<f64>| {
            let late = run
                .windows(3)
                .position(|steps| steps.iter().all(|&steps| steps < 25.0));
            late.map_or(50.0, |episode| episode as f64 + 1.0)
        };
        let first = Estimate::of(&runs.iter().map(near).collect::<Vec<_>>());
        measured(
            "figure 8.2, Dyna maze",
            &format!("first short episode, {name}"),
            book,
            first,
        );
        curves.push(curve(&name, &runs, 0));
    }
    let axes = ["episode", "steps"];
    Ok(draw(
        "Figure 8.2: planning in the Dyna maze",
        axes,
        &curves,
        (0.0, 800.0),
    ))
}

/// Figures 8.4 and 8.5: mazes that change. The book tells neither α nor κ; with α = 1 Dyna-Q+ comes
/// nearest to its curves.
fn changing(title: &str, world: fn() -> World) -> Result<String, Error> {
    let blocking = title.contains("blocking");
    let (end, planning) = if blocking { (3_000, 10) } else { (6_000, 50) };
    let mut curves = Curves::new();
    for (name, kappa, book) in [
        (
            "Dyna-Q",
            0.0,
            if blocking { "about 110" } else { "about 280" },
        ),
        (
            "Dyna-Q+",
            1e-3,
            if blocking { "about 150" } else { "about 400" },
        ),
    ] {
        let runs = over_seeds(0..100, |seed| {
            let mut world = world();
            let learner = DynaQ::new(&QTable::new(54, 4)?, constant(1.0)?, 0.95)?;
            let mut learner = learner.with_planning_steps(planning).with_last_outcome();
            if kappa > 0.0 {
                learner = learner.with_bonus(kappa)?;
            }
            let mut training = training(&world, learner, 0.1)?;
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut paid = Vec::new();
            for time in 1..=end / 50 {
                training.run(&mut world, Until::Actions(time * 50), &mut rng)?;
                paid.push(world.paid);
            }
            Ok::<_, Error>(paid)
        })?;
        let last = runs[0].len() - 1;
        measured(
            &title.to_lowercase(),
            &format!("reward by step {end}, {name}"),
            book,
            mean_of(&runs, last..last + 1),
        );
        let (name, points) = curve(name, &runs, 0);
        curves.push((
            name,
            points
                .into_iter()
                .map(|(at, paid)| (at * 50.0, paid))
                .collect(),
        ));
    }
    let high = if blocking { 200.0 } else { 500.0 };
    Ok(draw(
        title,
        ["step", "sum of rewards"],
        &curves,
        (0.0, high),
    ))
}
