//! Figure 5.2: the policy of blackjack.

use qtable::rand::{Rng, RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use qtable::{
    Action, Environment, Error, Estimate, ModelEnvironment, NStep, Policy, QTable, Schedule, State,
    Target, Training, Until, over_seeds,
};

use crate::figure::{Curves, draw};
use crate::measured;

/// Chooses at random first, then the best action: the exploring starts of the book's section 5.3.
struct ExploringStarts(bool);

impl Policy for ExploringStarts {
    fn begin_episode(&mut self) {
        self.0 = true;
    }

    fn choose(&mut self, table: &QTable, state: State, rng: &mut dyn Rng) -> Action {
        match std::mem::take(&mut self.0) {
            true => Action(rng.random_range(0..table.actions())),
            false => table.best(state),
        }
    }
}

/// Figure 5.2: blackjack by Monte Carlo control with exploring starts.
pub(crate) fn blackjack() -> Result<String, Error> {
    let game = ModelEnvironment::blackjack()?;
    let optimum = game.model().value_iteration(1.0, 1e-12)?.table;
    // Every sum from 12 to 21, card of the dealer and kind of hand, equally often.
    let state = |sum: usize, card: usize, ace: usize| State((sum * 11 + card) * 2 + ace);
    let cells = (0..200).map(|n| (n / 20 + 12, n / 2 % 10 + 1, n % 2));
    let cells: Vec<State> = cells
        .map(|(sum, card, ace)| state(sum, card, ace))
        .collect();
    let start: Vec<_> = cells.iter().map(|&cell| (cell, 1.0 / 200.0)).collect();
    let learned = over_seeds(0..20, |seed| {
        let mut cards = ModelEnvironment::new(game.model().clone(), &start)?;
        let means = Schedule::inverse_visits(1.0, 1.0)?;
        let learner = NStep::new(Target::Sarsa, usize::MAX, means, 1.0)?;
        let table = QTable::new(cards.states(), cards.actions())?;
        let mut training = Training::new(&cards, table, learner, ExploringStarts(true))?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        training.run(&mut cards, Until::Episodes(2_000_000), &mut rng)?;
        Ok::<_, Error>(training.into_parts().0)
    })?;
    let figure = "figure 5.2, blackjack";
    let over = |quantity: &dyn Fn(&QTable) -> f64| {
        Estimate::of(&learned.iter().map(quantity).collect::<Vec<_>>())
    };
    // What an action costs is the difference of the optimum's values.
    let cost = |table: &QTable, cell| optimum.max(cell) - optimum.value(cell, table.best(cell));
    let wrong = |table: &QTable| {
        cells
            .iter()
            .filter(|&&cell| cost(table, cell) > 0.0)
            .count() as f64
    };
    let worst = |table: &QTable| {
        cells
            .iter()
            .map(|&cell| cost(table, cell))
            .fold(0.0, f64::max)
    };
    measured(
        figure,
        "decisions of 200 off the optimum",
        "0",
        over(&wrong),
    );
    measured(
        figure,
        "reward lost by the worst of them",
        "0",
        over(&worst),
    );
    let mut curves = Curves::new();
    for (ace, name) in [(0, "no usable ace"), (1, "usable ace")] {
        for (table, whose) in [(&optimum, "optimum"), (&learned[0], "learned")] {
            let sticks = |card: usize| {
                let lowest = (12..=21).find(|&sum| table.best(state(sum, card, ace)) == Action(0));
                (card as f64, lowest.unwrap_or(22) as f64)
            };
            curves.push((format!("{name}, {whose}"), (1..=10).map(sticks).collect()));
        }
    }
    let axes = ["card of the dealer", "lowest sum to stick at"];
    Ok(draw("Figure 5.2: blackjack", axes, &curves, (11.0, 21.0)))
}
