//! The trait of a problem, in Gymnasium's words.

use rand::Rng;

use crate::error::Error;
use crate::step::{Action, State, Step};

/// A problem with finitely many states and actions.
///
/// An episode starts with [`reset`](Environment::reset) and goes on with
/// [`step`](Environment::step) until the status is other than `Continuing`; then only
/// `reset` may follow. All randomness comes from the generator handed in, so that the same seed
/// gives the same episode.
///
/// ```
/// use qtable::rand::Rng;
/// use qtable::{Action, Environment, Error, State, Status, Step};
///
/// /// Five cells in a row; the right end pays 1.
/// struct Row(usize);
///
/// impl Environment for Row {
///     fn states(&self) -> usize {
///         5
///     }
///     fn actions(&self) -> usize {
///         2
///     }
///     fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
///         self.0 = 0;
///         Ok(State(self.0))
///     }
///     fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
///         self.0 = if action == Action(1) { self.0 + 1 } else { self.0.saturating_sub(1) };
///         let done = self.0 == 4;
///         Ok(Step {
///             observation: State(self.0),
///             reward: if done { 1.0 } else { 0.0 },
///             status: if done { Status::Terminated } else { Status::Continuing },
///         })
///     }
/// }
/// ```
pub trait Environment {
    /// Returns the number of states, at least 1. Every observation is below it.
    fn states(&self) -> usize;

    /// Returns the number of actions, at least 1.
    fn actions(&self) -> usize;

    /// Starts an episode and returns its first state.
    ///
    /// # Errors
    /// A failure of the environment, for example a lost connection ([`Error::environment`]).
    fn reset(&mut self, rng: &mut dyn Rng) -> Result<State, Error>;

    /// Takes an action.
    ///
    /// # Errors
    /// A failure of the environment. Training gives the episode up and keeps what it has learned.
    fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Result<Step, Error>;

    /// Returns `true` if a state offers an action (the action mask). The answer must not change,
    /// and a state without any action must end the episode. By default all actions are offered.
    fn allows(&self, state: State, action: Action) -> bool {
        let _ = (state, action);
        true
    }

    /// Returns whether an episode that ended with this step was a success, for reports only. By
    /// default `None`: the environment does not tell.
    fn succeeded(&self, last: &Step) -> Option<bool> {
        let _ = last;
        None
    }
}

/// Implements the trait for a pointer to an environment.
macro_rules! forwarded {
    ($pointer:ty) => {
        impl<E: Environment + ?Sized> Environment for $pointer {
            fn states(&self) -> usize {
                (**self).states()
            }

            fn actions(&self) -> usize {
                (**self).actions()
            }

            fn reset(&mut self, rng: &mut dyn Rng) -> Result<State, Error> {
                (**self).reset(rng)
            }

            fn step(&mut self, action: Action, rng: &mut dyn Rng) -> Result<Step, Error> {
                (**self).step(action, rng)
            }

            fn allows(&self, state: State, action: Action) -> bool {
                (**self).allows(state, action)
            }

            fn succeeded(&self, last: &Step) -> Option<bool> {
                (**self).succeeded(last)
            }
        }
    };
}

forwarded!(&mut E);
forwarded!(Box<E>);
