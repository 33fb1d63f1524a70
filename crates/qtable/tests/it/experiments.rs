//! Policies tried, models estimated, seeds compared.

use qtable::{
    Environment, EpsilonGreedy, Error, Estimate, Greedy, Policy, QTable, State, Status, evaluate,
    over_seeds, toys,
};

use crate::support::{Settings, constant, rng};

#[test]
fn trying_a_policy_agrees_with_its_exact_assessment() {
    let mut lake = toys::frozen_lake(&toys::FROZEN_LAKE_4X4, true).unwrap();
    let table = lake.model().value_iteration(0.99, 1e-10).unwrap().table;
    let exact = lake.assess(&table.greedy(), 0.99, 100).unwrap();
    let tried = evaluate(&mut lake, &table, &mut Greedy, 40_000, 100, &mut rng(9)).unwrap();
    assert!(
        (tried.success_share.unwrap() - exact.success).abs() < 0.01,
        "{tried:?} {exact:?}"
    );
    assert!((tried.mean_steps - exact.steps).abs() < 0.5);
    assert!((tried.mean_steps_to_success.unwrap() - exact.steps_to_success.unwrap()).abs() < 0.5);
    assert!((tried.mean_return - exact.total_reward).abs() < 0.01);
    // The returns are 0 or 1.
    let (p, deviation) = (tried.mean_return, tried.return_deviation.unwrap());
    assert!((deviation - (p * (1.0 - p)).sqrt()).abs() < 1e-4);
}

#[test]
fn a_model_estimated_from_experience_gives_the_optimal_policy() {
    let mut lake = toys::frozen_lake(&toys::FROZEN_LAKE_4X4, true).unwrap();
    let mut estimate = qtable::ModelEstimate::new(16, 4).unwrap();
    let mut rng = rng(4);
    let table = QTable::new(16, 4).unwrap();
    let mut explorer = EpsilonGreedy::new(constant(1.0)).unwrap();
    for _ in 0..20_000 {
        let mut state = lake.reset(&mut rng).unwrap();
        loop {
            let action = explorer.choose(&table, state, &mut rng);
            let step = lake.step(action, &mut rng).unwrap();
            estimate.observe(state, action, &step).unwrap();
            if step.status != Status::Continuing {
                break;
            }
            state = step.observation;
        }
    }
    let plan = estimate
        .to_model(0.0)
        .unwrap()
        .value_iteration(0.95, 1e-10)
        .unwrap();
    let both = lake.compare(&plan.table, 0.95, 1_000).unwrap();
    assert!(both.learned.value > 0.99 * both.optimal.value, "{both:?}");
    let curious = estimate
        .to_model(5.0)
        .unwrap()
        .value_iteration(0.95, 1e-10)
        .unwrap();
    assert!(
        (curious.table.max(State(5)) - 5.0).abs() < 1e-12,
        "a hole was never left: untried"
    );
    assert!(estimate.to_model(f64::NAN).is_err());
}

#[test]
fn seeds_come_back_in_order_and_the_first_failure_is_told() {
    let run = |seed: u64| -> Result<String, Error> {
        let mut chain = toys::chain(6)?;
        let mut training = Settings::new(300).begin(&chain, QTable::new(6, 2)?)?;
        training.run(&mut chain, qtable::Until::Actions(300), &mut rng(seed))?;
        Ok(training.table().to_csv())
    };
    let all = over_seeds(0..24, run).unwrap();
    let one_by_one: Vec<String> = (0..24).map(|seed| run(seed).unwrap()).collect();
    assert_eq!(all, one_by_one);
    assert_ne!(all[0], all[1]);
    assert_eq!(
        over_seeds(0..24, |seed| if seed % 10 == 7 {
            Err(seed)
        } else {
            Ok(())
        }),
        Err(7)
    );
    let estimate = Estimate::of(&[1.0, 2.0, 3.0]);
    assert!((estimate.mean - 2.0).abs() < 1e-12 && (estimate.half_width - 2.484).abs() < 1e-3);
}
