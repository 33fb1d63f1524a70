//! The best policies under the rewards of Eq. 5 and 6, by value iteration. As printed, the rewards
//! pay more for cycling than for arriving, and Eq. 6 divides by zero (the pole of Eq. 5 lies within
//! its goal). With floored denominators and an absorbing goal, the best policies arrive.
//!
//! `cargo test --test it literal_reward -- --nocapture` prints the figures.

use example_support::plane::ExactPlane;
use grasp_agent::{BehaviourPair, BehaviourSpec, Percept, Reward};
use hough_heuristic::Features;
use qtable::{Action, Model, ModelEnvironment, ModelEstimate, Outcome, State, Status, Step};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

const GAMMA: f64 = 0.9;

fn at_x(x: usize) -> Percept {
    Percept {
        features: Features {
            x: x as f64,
            y: 78.0,
            r: 33.0,
        },
        theta3: 10.0,
    }
}

/// Centering at a fixed distance as a decision process of its own: 192 columns of the image, 6.1 of
/// which a degree of `JT1` is worth where balls are first seen (r about 10).
fn centering(reward: &Reward) -> Model {
    const COLUMNS_PER_DEGREE: f64 = 6.1;
    let spec = BehaviourSpec::centering();
    let steps = spec.moves[0].degrees.clone();
    Model::new(192, steps.len(), |State(x), Action(a)| {
        let next = x as f64 + (COLUMNS_PER_DEGREE * steps[a]).round();
        vec![if !(0.0..192.0).contains(&next) {
            Outcome::certain(State(x), reward.lost, true)
        } else if spec.at_goal(&at_x(next as usize)) {
            Outcome::certain(State(next as usize), reward.arrival(GAMMA), true)
        } else {
            let paid = reward.step(&at_x(x), &at_x(next as usize));
            Outcome::certain(State(next as usize), paid, false)
        }]
    })
    .expect("finite rewards")
}

/// Returns the share of `starts` from which the best policy of `model` arrives within 60 steps, and
/// the values of these states.
fn best(model: Model, starts: &[State]) -> (f64, Vec<f64>) {
    let plan = model.value_iteration(GAMMA, 1e-7).expect("converges");
    let share = 1.0 / starts.len() as f64;
    let drawn: Vec<(State, f64)> = starts.iter().map(|state| (*state, share)).collect();
    let assessed = ModelEnvironment::new(model, &drawn)
        .and_then(|environment| environment.assess(&plan.table.greedy(), GAMMA, 60))
        .expect("a policy of the model");
    let worth = starts.iter().map(|state| plan.table.max(*state)).collect();
    (assessed.success, worth)
}

/// Returns the share of the columns outside the goal from which the best policy under `reward`
/// arrives, and the highest value of a column.
fn best_centering(reward: &Reward) -> (f64, f64) {
    let spec = BehaviourSpec::centering();
    let outside = (0..192).filter(|x| !spec.at_goal(&at_x(*x))).map(State);
    let (success, worth) = best(centering(reward), &outside.collect::<Vec<_>>());
    (success, worth.into_iter().fold(f64::MIN, f64::max))
}

#[test]
fn equation_5_cycles_and_mended_it_centres() {
    let literal = Reward::centering_literal();
    let (arrives, most) = best_centering(&literal);
    println!(
        "Eq. 5: the best policy arrives from {:.0} % of the columns; a column is worth up to \
         {most:.0} (arriving: 100)",
        100.0 * arrives
    );
    assert!(arrives < 0.005 && most > 100.0, "{arrives} {most}");

    let (arrives, most) = best_centering(&literal.mended());
    println!(
        "Eq. 5, mended: it arrives from {:.0} %; a column is worth up to {most:.0} (arriving: \
         1000)",
        100.0 * arrives
    );
    assert!(arrives > 0.999 && most < 1000.001, "{arrives} {most}");
}

/// Estimates approaching as a decision process on its 90 states from moves tried in the arm's plane
/// under `reward`. Returns the share of states from which the best policy arrives, the mean value
/// of a state, and the number of rewards that are infinite with whole pixels.
fn best_approaching(
    plane: &ExactPlane,
    mut rng: Xoshiro256PlusPlus,
    reward: &Reward,
) -> (f64, f64, usize) {
    let spec = BehaviourPair::paper_mended().approaching;
    let mut estimate = ModelEstimate::new(spec.states(), spec.actions()).expect("a small model");
    let mut infinite = 0;
    let whole = |percept: &Percept| {
        let mut percept = *percept;
        percept.features.y = percept.features.y.round();
        percept.features.r = percept.features.r.round();
        percept
    };
    for _ in 0..200_000 {
        let before = plane.start(&mut rng);
        let action = Action(rng.random_range(0..spec.actions()));
        let Ok(state) = spec.state(&before) else {
            continue;
        };
        let after = plane.after(&before, &spec.delta(action));
        let next = after.and_then(|after| Some((after, spec.state(&after).ok()?)));
        let step = match next {
            None => Step {
                observation: state,
                reward: reward.lost,
                status: Status::Terminated,
            },
            Some((after, observation)) if spec.at_goal(&after) => Step {
                observation,
                reward: reward.arrival(GAMMA),
                status: Status::Terminated,
            },
            Some((after, observation)) => {
                infinite += usize::from(!reward.step(&whole(&before), &whole(&after)).is_finite());
                Step {
                    observation,
                    reward: reward.step(&before, &after),
                    status: Status::Continuing,
                }
            }
        };
        estimate
            .observe(state, action, &step)
            .expect("finite rewards");
    }
    let model = estimate.to_model(reward.lost).expect("a finite reward");
    let states: Vec<State> = (0..spec.states()).map(State).collect();
    let (success, worth) = best(model, &states);
    (
        success,
        worth.iter().sum::<f64>() / states.len() as f64,
        infinite,
    )
}

#[test]
fn equation_6_divides_by_zero_and_mended_it_approaches() {
    let literal = Reward::approaching_literal();
    let floored = Reward {
        floor: 1.0,
        ..literal.clone()
    };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let plane = ExactPlane::new(20_000, &mut rng);
    let best = |reward: &Reward| best_approaching(&plane, rng.clone(), reward);
    let (_, _, infinite) = best(&literal);
    let (cycling, worth, none) = best(&floored);
    let (arriving, kept, _) = best(&literal.mended());
    println!(
        "Eq. 6: {infinite} of 200000 moves between whole pixels have an infinite reward; floored, \
         the best policy arrives from {:.0} % and is worth {worth:.0} (arriving: 100); mended, it \
         arrives from {:.0} % and is worth {kept:.0}",
        100.0 * cycling,
        100.0 * arriving
    );
    assert!(infinite > 100 && none == 0, "{infinite} {none}");
    assert!(cycling < 0.5 && worth > 150.0, "{cycling} {worth}");
    assert!(arriving > 0.9, "{arriving}");
}
