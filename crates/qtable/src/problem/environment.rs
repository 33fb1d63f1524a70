//! The trait of a problem, in Gymnasium's words.

use rand::Rng;

use crate::error::Error;
use crate::step::{Action, State, Step};

/// A problem with finitely many states and actions.
///
/// An episode starts with [`reset`](Environment::reset) and goes on with
/// [`step`](Environment::step) until the status is other than `Continuing`; then only
/// `reset` may follow. All randomness comes from the generator handed in, so that the same seed
/// gives the same episode. The example at the top of this crate implements one.
pub trait Environment {
    /// Returns the number of states, at least 1. Every observation is below it. It stays unless the
    /// environment [is dynamic](Environment::is_dynamic).
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

    /// Returns `true` if a state offers an action (the action mask). A state without any action
    /// must end the episode. By default all actions are offered.
    ///
    /// The answer must not change, unless the environment [is dynamic](Environment::is_dynamic).
    fn allows(&self, state: State, action: Action) -> bool {
        let _ = (state, action);
        true
    }

    /// Returns `true` if the number of states or the actions that a state offers may change. Then
    /// both are asked at each step, and tables and learners grow with the environment
    /// ([`Keys`](crate::Keys) numbers states as they are met). By default `false`.
    fn is_dynamic(&self) -> bool {
        false
    }

    /// Returns the player who acts next, 0 or 1, in a game for two
    /// ([`Training::run_against`](crate::Training::run_against)). By default always 0. All other
    /// drivers take no notice: one learner acts for both, and all rewards are its own.
    fn player(&self) -> usize {
        0
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

            fn is_dynamic(&self) -> bool {
                (**self).is_dynamic()
            }

            fn player(&self) -> usize {
                (**self).player()
            }

            fn succeeded(&self, last: &Step) -> Option<bool> {
                (**self).succeeded(last)
            }
        }
    };
}

forwarded!(&mut E);
forwarded!(Box<E>);
