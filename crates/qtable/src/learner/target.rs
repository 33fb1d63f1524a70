//! The values that a return may end in.

use crate::error::Error;
use crate::policy::Policy;
use crate::scratch::Scratch;
use crate::step::{Action, State};
use crate::table::QTable;

/// The value of the state in which a return ends, and with it the policy that is learned.
///
/// `Sarsa` and `ExpectedSarsa` learn the value of the policy that acts, exploration included, and
/// so keep away from cliffs; the others learn the optimal policy as long as everything is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Target {
    /// The best action's value, as in Q-learning. A return is cut before an exploratory action
    /// (Watkins 1989): what comes after it is not what the greedy policy would have met.
    Q,
    /// The best action's value without the cut: quicker while much is explored, and biased toward
    /// the policy that acts as long as it is (Peng and Williams 1996; Mnih and others 2016).
    UncutQ,
    /// The value of the action that the policy takes next, as in SARSA (Rummery and Niranjan 1994).
    /// The action after a truncated step is chosen for the update only: it advances a policy's
    /// schedule by one choice more than with the other targets.
    Sarsa,
    /// The mean over the policy's next action, as in Expected SARSA (van Seijen and others 2009).
    ExpectedSarsa,
    /// The mean over the policy's actions at every step of the return, of which only the one taken
    /// leads further: tree backup (Precup and others 2000), off-policy without a cut.
    TreeBackup,
}

impl Target {
    /// Returns the value of a state in which a return ends.
    #[inline]
    pub(super) fn value(
        self,
        table: &QTable,
        state: State,
        next_action: Option<Action>,
        policy: &dyn Policy,
        scratch: &mut Scratch,
    ) -> Result<f64, Error> {
        match self {
            Self::Q | Self::UncutQ => Ok(table.max(state)),
            Self::Sarsa => {
                let action = next_action.ok_or(Error::NextActionMissing(state))?;
                table.check(state, action)?;
                Ok(table.value(state, action))
            }
            Self::ExpectedSarsa | Self::TreeBackup => {
                let probabilities = probabilities(table, state, policy, scratch)?;
                // Forbidden actions have probability 0 and, being finite, no part in the sum.
                let row = table.row(state);
                Ok(probabilities.iter().zip(row).map(|(p, q)| p * q).sum())
            }
        }
    }
}

/// Returns the probabilities of a policy's actions.
pub(super) fn probabilities<'a>(
    table: &QTable,
    state: State,
    policy: &dyn Policy,
    scratch: &'a mut Scratch,
) -> Result<&'a [f64], Error> {
    let probabilities = scratch.of_length(table.actions());
    if policy.probabilities(table, state, probabilities) {
        return Ok(probabilities);
    }
    Err(Error::NoProbabilities)
}
