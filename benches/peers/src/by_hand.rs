//! The loops that one would write by hand.

use qtable::{Action, State};
use rand::RngExt;
use std::hint::black_box;

use crate::{ACTIONS, ALPHA, GAMMA, Result, STATES, rate, rng, small_step, transition};

/// The loop that one would write by hand for this problem alone: the maximum of each row kept, ties
/// by the lowest index, and no checks.
pub fn by_hand(updates: u64) -> Result<f64> {
    let mut table = vec![[0.0f64; ACTIONS]; STATES];
    let mut best = [0usize; STATES];
    let (mut rng, mut state) = (rng(1), 0);
    let measured = rate(updates, || {
        for _ in 0..updates {
            let action = match rng.random::<f64>() < 0.1 {
                true => rng.random_range(0..ACTIONS),
                false => best[state],
            };
            let (next, reward) = transition(state, action);
            let target = reward + GAMMA * table[next][best[next]];
            let row = &mut table[state];
            let old = row[action];
            row[action] = old + ALPHA * (target - old);
            if action == best[state] && row[action] < old {
                for (other, value) in row.iter().enumerate() {
                    if *value > row[best[state]] {
                        best[state] = other;
                    }
                }
            } else if row[action] > row[best[state]] {
                best[state] = action;
            }
            state = next;
        }
        Ok(())
    });
    black_box(table[state][best[state]]);
    measured
}

/// The loop by hand that does what the table does: it counts visits, draws among equally good
/// actions, and stops at a value that is not finite. An episode begins every `limit` steps.
#[inline(always)]
pub fn by_hand_alike<const S: usize, const A: usize>(
    updates: u64,
    limit: u64,
    epsilon: impl Fn(u64) -> f64,
    transition: impl Fn(usize, usize) -> (usize, f64),
) -> Result<f64> {
    let mut table = vec![[0.0f64; A]; S];
    let mut visits = vec![[0u32; A]; S];
    // Highest value, its first action, and how many share it.
    let mut best = [(0.0, 0usize, A); S];
    let (mut rng, mut state, mut left) = (rng(1), 0, limit);
    let measured = rate(updates, || {
        for update in 0..updates {
            if left == 0 {
                (state, left) = (rng.random_range(0..S), limit);
            }
            left -= 1;
            let (highest, first, equals) = best[state];
            let action = match rng.random::<f64>() < epsilon(update) {
                true => rng.random_range(0..A),
                false if equals == 1 => first,
                false => {
                    let drawn = rng.random_range(0..equals);
                    let mut ties = (0..A).filter(|&action| table[state][action] >= highest);
                    ties.nth(drawn).unwrap_or(first)
                }
            };
            let (next, reward) = transition(state, action);
            let target = reward + GAMMA * best[next].0;
            let row = &mut table[state];
            let old = row[action];
            let value = old + ALPHA * (target - old);
            if !value.is_finite() {
                return Err("a value is not finite".into());
            }
            row[action] = value;
            visits[state][action] += 1;
            let (highest, first, equals) = &mut best[state];
            if value > *highest {
                (*highest, *first, *equals) = (value, action, 1);
            } else if value < old && old >= *highest {
                *highest = row.iter().copied().fold(f64::MIN, f64::max);
                *equals = row.iter().filter(|&value| value >= highest).count();
                *first = row.iter().position(|value| value >= highest).unwrap_or(0);
            } else if value >= *highest && old < value {
                *equals += 1;
                *first = action.min(*first);
            }
            state = next;
        }
        Ok(())
    });
    black_box((table[state][0], visits[state][0]));
    measured
}

/// A softmax by hand with the exponential of the standard library, at 500 states and 4 actions. It
/// counts visits and stops at a value that is not finite, as the table does.
pub fn softmax_by_hand(updates: u64, temperature: f64) -> Result<f64> {
    let mut table = vec![[0.0f64; 4]; 500];
    let mut visits = vec![[0u32; 4]; 500];
    let (mut rng, mut state) = (rng(1), 0);
    let measured = rate(updates, || {
        for _ in 0..updates {
            let highest = table[state].iter().copied().fold(f64::MIN, f64::max);
            let weights = table[state].map(|value| ((value - highest) / temperature).exp());
            let mut rest = rng.random::<f64>() * weights.iter().sum::<f64>();
            let action = weights.iter().position(|weight| {
                rest -= weight;
                rest < 0.0
            });
            let action = action.unwrap_or(3);
            let step = small_step(State(state), Action(action));
            let next = step.observation.0;
            let highest = table[next].iter().copied().fold(f64::MIN, f64::max);
            let old = table[state][action];
            let value = old + ALPHA * (step.reward + GAMMA * highest - old);
            if !value.is_finite() {
                return Err("a value is not finite".into());
            }
            table[state][action] = value;
            visits[state][action] += 1;
            state = next;
        }
        Ok(())
    });
    black_box((table[state][0], visits[state][0]));
    measured
}
