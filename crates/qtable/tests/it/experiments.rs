//! Policies tried, models estimated, seeds compared.

use qtable::*;

use crate::support::{Settings, epsilon, rng, zeros};

#[test]
fn trying_a_policy_agrees_with_its_exact_assessment() {
    let mut lake = ModelEnvironment::frozen_lake("4x4", true).unwrap();
    let table = lake.model().value_iteration(0.99, 1e-10).unwrap().table;
    let exact = lake.assess(&table.greedy(), 0.99, 100).unwrap();
    let tried = evaluate(&mut lake, &table, &mut Greedy, 20_000, 100, &mut rng(9)).unwrap();
    assert_near!(tried.success_share.unwrap(), exact.success, 0.015);
    assert_near!(tried.mean_steps, exact.steps, 0.6);
    let (found, wanted) = (tried.mean_steps_to_success, exact.steps_to_success);
    assert_near!(found.unwrap(), wanted.unwrap(), 0.6);
    assert_near!(tried.mean_return, exact.total_reward, 0.015);
    // The returns are 0 or 1.
    let p = tried.mean_return;
    assert_near!(
        tried.return_deviation.unwrap(),
        (p * (1.0 - p)).sqrt(),
        1e-4
    );
}

#[test]
fn a_model_estimated_from_experience_gives_the_optimal_policy() {
    let mut lake = ModelEnvironment::frozen_lake("4x4", true).unwrap();
    let mut estimate = ModelEstimate::new(16, 4).unwrap();
    let (mut rng, mut explorer) = (rng(4), epsilon(1.0));
    for _ in 0..10_000 {
        let mut state = lake.reset(&mut rng).unwrap();
        loop {
            let action = explorer.choose(&zeros(16, 4), state, &mut rng);
            let step = lake.step(action, &mut rng).unwrap();
            estimate.observe(state, action, &step).unwrap();
            if step.status != Status::Continuing {
                break;
            }
            state = step.observation;
        }
    }
    let planned = |untried| estimate.to_model(untried)?.value_iteration(0.95, 1e-10);
    let [learned, optimal] = lake
        .compare(&planned(0.0).unwrap().table, 0.95, 1_000)
        .unwrap();
    assert!(
        learned.value > 0.99 * optimal.value,
        "{learned:?} of {optimal:?}"
    );
    // A hole was never left: untried.
    assert_near!(planned(5.0).unwrap().table.max(State(5)), 5.0, 1e-12);
    assert!(planned(f64::NAN).is_err());
}

#[test]
fn seeds_come_back_in_order_and_the_first_failure_is_told() {
    let run = |seed: u64| -> Result<String, Error> {
        let mut chain = ModelEnvironment::chain(6)?;
        let mut training = Settings::new(300).begin(&chain, zeros(6, 2))?;
        training.run(&mut chain, Until::Actions(300), &mut rng(seed))?;
        Ok(training.table().to_csv())
    };
    let all = over_seeds(0..24, run).unwrap();
    let one_by_one: Vec<String> = (0..24).map(|seed| run(seed).unwrap()).collect();
    assert_eq!(all, one_by_one);
    assert_ne!(all[0], all[1]);
    let fails = |seed| if seed % 10 == 7 { Err(seed) } else { Ok(()) };
    assert_eq!(over_seeds(0..24, fails), Err(7));
    let estimate = Estimate::of(&[1.0, 2.0, 3.0]);
    assert_near!(estimate.mean, 2.0, 1e-12);
    assert_near!(estimate.half_width, 2.484, 1e-3);
}
