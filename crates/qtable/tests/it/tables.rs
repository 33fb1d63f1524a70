//! Tables, policies, discretisation and text, by properties and by hand.

use proptest::prelude::*;
use qtable::*;

use crate::support::{constant, epsilon, rng, zeros};

fn row(values: &[f64]) -> QTable {
    let mut table = zeros(1, values.len());
    for (action, &value) in values.iter().enumerate() {
        table.set(State(0), Action(action), value).unwrap();
    }
    table
}

#[test]
fn impossible_tables_are_refused() {
    for (states, actions) in [(0, 3), (3, 0), (usize::MAX, 2), (1 << 40, 1 << 10)] {
        assert_refused!(QTable::new(states, actions), Error::Shape { .. });
    }
    for value in [f64::NAN, f64::INFINITY] {
        assert_refused!(
            QTable::filled(2, 2, value),
            Error::NotFinite { what: "value", .. }
        );
    }
    let mut table = zeros(2, 2);
    let (state, action) = (State(2), Action(2));
    assert_refused!(
        table.set(state, Action(0), 0.0),
        Error::OutOfRange { what: "state", .. }
    );
    assert_refused!(
        table.set(State(0), action, 0.0),
        Error::OutOfRange { what: "action", .. }
    );
    assert_refused!(
        table.visit(state, Action(0)),
        Error::OutOfRange { what: "state", .. }
    );
    assert_eq!(table.get(State(0), Action(5)), None);
    assert_eq!(table.get(State(1), Action(1)), Some(0.0));
}

proptest! {
    #[test]
    fn the_kept_maximum_is_the_maximum(
        writes in prop::collection::vec((0usize..3, 0usize..5, -3i8..4), 1..200),
        forbidden in prop::collection::vec(any::<bool>(), 15),
    ) {
        for masked in [false, true] {
            let mut table = zeros(3, 5);
            table.restrict(|s, a| !masked || a.0 == s.0 || !forbidden[s.0 * 5 + a.0]);
            for &(state, action, value) in &writes {
                let (state, action) = (State(state), Action(action));
                let allowed = table.allows(state, action);
                prop_assert_eq!(table.set(state, action, f64::from(value)).is_ok(), allowed);
                let q = |action| table.value(state, action);
                let offered = table.offered(state);
                let best = offered.fold(None, |best: Option<Action>, action| match best {
                    Some(best) if q(best) >= q(action) => Some(best),
                    _ => Some(action),
                });
                prop_assert_eq!(Some(table.best(state)), best);
            }
        }
    }

    #[test]
    fn boltzmann_is_a_distribution_at_every_temperature(
        values in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::ZERO, 1..30),
        exponent in -6.0f64..6.0,
        seed in any::<u64>(),
    ) {
        let table = row(&values);
        let mut policy = Boltzmann::new(constant(10f64.powf(exponent).clamp(1e-6, 1e6))).unwrap();
        let mut p = vec![0.0; values.len()];
        prop_assert!(policy.probabilities(&table, State(0), &mut p));
        prop_assert!((p.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        prop_assert!(p.iter().all(|p| (0.0..=1.0).contains(p)));
        let best = table.best(State(0)).0;
        prop_assert!(p.iter().all(|&other| other <= p[best]));
        let chosen = policy.choose(&table, State(0), &mut rng(seed));
        prop_assert!(p[chosen.0] > 0.0);
    }

    #[test]
    fn every_value_has_its_bin_and_every_state_its_bins(
        mut edges in prop::collection::vec(-1e6f64..1e6, 0..8),
        value in prop::num::f64::ANY,
    ) {
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let intervals = Intervals::new(&edges).unwrap();
        if value.is_nan() {
            prop_assert_eq!(intervals.index(value), Err(Error::NotANumber(0)));
        } else {
            let bin = intervals.index(value).unwrap();
            let (low, high) = intervals.bounds(bin).unwrap();
            prop_assert!(low <= value && value <= high);
            prop_assert!(value < high || value.is_infinite());
        }
        for (bin, &edge) in edges.iter().enumerate() {
            prop_assert_eq!(intervals.index(edge).unwrap(), bin + 1);
        }
        let halves = Intervals::new(&[0.0]).unwrap();
        let product = Product::new(vec![intervals.clone(), halves, intervals]).unwrap();
        for state in (0..product.states()).map(State) {
            let bins = product.bins(state);
            prop_assert_eq!(product.state(&bins).unwrap(), state);
            let inside: Vec<f64> = bins.iter().zip(product.quantities()).map(|(&bin, of)| {
                match of.bounds(bin).unwrap() {
                    (low, high) if low.is_finite() && high.is_finite() => low + (high - low) / 2.0,
                    (low, _) if low.is_finite() => low + 1.0,
                    (_, high) if high.is_finite() => high - 1.0,
                    _ => 0.0,
                }
            }).collect();
            prop_assert_eq!(product.index(&inside).unwrap(), state);
        }
    }
}

#[test]
fn impossible_discretisations_are_refused() {
    let intervals = Intervals::new;
    assert_refused!(intervals(&[1.0, 1.0]), Error::NotAscending("edge", 1, ..));
    for edge in [f64::NAN, f64::INFINITY] {
        assert_refused!(
            intervals(&[1.0, edge]),
            Error::Setting {
                name: "an edge",
                ..
            }
        );
    }
    let two = intervals(&[1.0]).unwrap();
    let product = Product::new(vec![two.clone(), two.clone()]).unwrap();
    assert_refused!(
        product.index(&[0.0]),
        Error::WrongLength {
            needed: 2,
            found: 1,
            ..
        }
    );
    assert_refused!(product.index(&[0.0, f64::NAN]), Error::NotANumber(1));
    assert_refused!(
        product.state(&[0, 2]),
        Error::OutOfRange {
            what: "bin",
            index: 2,
            count: 2
        }
    );
    assert_refused!(Product::new(vec![two; 64]), Error::Shape { .. });
}

#[test]
fn every_policy_chooses_as_often_as_it_says() {
    const CHOICES: u32 = 100_000;
    let mut table = row(&[1.0, 3.0, -2.0, 3.0, 9.0, 2.5]);
    table.restrict(|_, action| action != Action(4));
    for action in [0, 1, 2, 3, 5].repeat(10) {
        table.visit(State(0), Action(action)).unwrap();
    }
    let ucb = |ties| Ucb::new(1.0).unwrap().with_ties(ties);
    let policies: Vec<Box<dyn Policy>> = vec![
        Box::new(Greedy),
        Box::new(epsilon(0.4).with_ties(Ties::Lowest)),
        Box::new(epsilon(0.4).with_ties(Ties::Random)),
        Box::new(Boltzmann::new(constant(1.5)).unwrap()),
        Box::new(ucb(Ties::Lowest)),
        Box::new(ucb(Ties::Random)),
    ];
    for (index, mut policy) in policies.into_iter().enumerate() {
        let (mut told, mut counts, mut rng) = ([f64::NAN; 6], [0u32; 6], rng(17));
        assert!(policy.probabilities(&table, State(0), &mut told));
        assert_near!(told.iter().sum(), 1.0, 1e-12, index);
        for _ in 0..CHOICES {
            counts[policy.choose(&table, State(0), &mut rng).0] += 1;
        }
        for (p, count) in told.into_iter().zip(counts) {
            // Five standard deviations.
            let off = 5.0 * (p * (1.0 - p) / f64::from(CHOICES)).sqrt() + 1e-12;
            assert_near!(f64::from(count) / f64::from(CHOICES), p, off, index);
        }
        assert!(
            told[4].abs() < 1e-300,
            "policy {index} would take what is forbidden"
        );
    }
}

#[test]
fn boltzmann_has_the_probabilities_of_its_formula() {
    let told = |values: &[f64], temperature| {
        let mut p = [0.0; 3];
        let policy = Boltzmann::new(constant(temperature)).unwrap();
        policy.probabilities(&row(values), State(0), &mut p);
        p
    };
    let e = [0.5f64, 1.0, 2.0].map(f64::exp);
    for (found, weight) in told(&[1.0, 2.0, 4.0], 2.0).into_iter().zip(e) {
        assert_near!(found, weight / e.iter().sum::<f64>(), 1e-15);
    }
    // The extremes: a hair's breadth decides when cold, nothing does when hot.
    let p = told(&[0.0, 1e-4, f64::MIN], 1e-6);
    assert!(
        p[1] > 1.0 - 1e-15 && p[0] < 1e-40 && p[2].abs() < 1e-300,
        "{p:?}"
    );
    for p in told(&[0.0, 1.0, -1.0], 1e6) {
        assert_near!(p, 1.0 / 3.0, 1e-6);
    }
    let p = told(&[f64::MAX, f64::MIN, f64::MAX], 1e6);
    assert_near!(p[0], 0.5, 1e-15);
    assert_near!(p[2], 0.5, 1e-15);
}

#[test]
fn ucb_tries_everything_once_and_then_by_its_bound() {
    let mut table = row(&[0.0, 5.0, 0.0]);
    let mut ucb = Ucb::new(2.0).unwrap().with_ties(Ties::Lowest);
    for expected in [0, 1, 2] {
        let action = ucb.choose(&table, State(0), &mut rng(0));
        assert_eq!(action, Action(expected));
        table.visit(State(0), action).unwrap();
    }
    assert_eq!(ucb.choose(&table, State(0), &mut rng(0)), Action(1));
    for _ in 0..1000 {
        table.visit(State(0), Action(1)).unwrap();
    }
    // 5 + 2 sqrt(ln 1003 / 1001) = 5.17 and 2 sqrt(ln 1003 / 1) = 5.26.
    assert_eq!(ucb.choose(&table, State(0), &mut rng(0)), Action(0));
    assert!(Ucb::new(-1.0).is_err() && Ucb::new(f64::NAN).is_err());
}
