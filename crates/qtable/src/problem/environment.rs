//! The door to a problem, in Gymnasium's words.

use rand::Rng;

use crate::index::{Action, State};

/// Whether an episode goes on, and if not, why not. The two endings mean different things to a
/// learner: nothing comes after termination, while truncation only stops the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// The episode goes on.
    Continuing,
    /// The task itself ended, in success or failure: the value of what follows is 0.
    Terminated,
    /// The episode was cut short from outside, by a time limit for example. What would have
    /// followed still has its value, so a learner bootstraps from the observation.
    Truncated,
}

/// What an environment answers to an action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The state that the action led to, also when the episode ended there.
    pub observation: State,
    /// The immediate reward, finite.
    pub reward: f64,
    /// Whether the episode goes on.
    pub status: Status,
}

/// A problem with finitely many states and actions.
///
/// An episode starts with [`reset`](Environment::reset) and goes on with
/// [`step`](Environment::step) until its status is other than [`Status::Continuing`]; then only
/// `reset` may follow. All randomness comes from the generator handed in, so that the same seed
/// gives the same episode.
pub trait Environment {
    /// Number of states; every observation is below it. At least 1.
    fn states(&self) -> usize;

    /// Number of actions. At least 1.
    fn actions(&self) -> usize;

    /// Starts an episode and reports its first state.
    fn reset(&mut self, rng: &mut dyn Rng) -> State;

    /// Takes an action.
    fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Step;

    /// Whether a state offers an action: the action mask. Every state must offer at least one, and
    /// the answer must not change. All are offered unless this is overridden.
    fn allows(&self, state: State, action: Action) -> bool {
        let _ = (state, action);
        true
    }

    /// Whether an episode that ended with this step was a success, for reports only. Unless
    /// overridden: it terminated with a positive reward.
    fn succeeded(&self, last: &Step) -> bool {
        last.status == Status::Terminated && last.reward > 0.0
    }
}

/// Lends an environment to whatever takes one by value.
macro_rules! forwarded {
    ($holder:ty) => {
        impl<E: Environment + ?Sized> Environment for $holder {
            fn states(&self) -> usize {
                (**self).states()
            }

            fn actions(&self) -> usize {
                (**self).actions()
            }

            fn reset(&mut self, rng: &mut dyn Rng) -> State {
                (**self).reset(rng)
            }

            fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Step {
                (**self).step(action, rng)
            }

            fn allows(&self, state: State, action: Action) -> bool {
                (**self).allows(state, action)
            }

            fn succeeded(&self, last: &Step) -> bool {
                (**self).succeeded(last)
            }
        }
    };
}

forwarded!(&mut E);
forwarded!(Box<E>);
