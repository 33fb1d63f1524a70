//! A learned behaviour, and how it is used at run time.

use qtable::{Action, QTable, State};

use crate::behaviour::spec::BehaviourSpec;
use crate::error::BehaviourError;

/// Weight of the loop breaker where no other is asked for.
pub(crate) const KAPPA: f64 = 20.0;

/// A behaviour with what it has learned: the Q-table over its states and actions.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Unchecked")
)]
pub struct Behaviour {
    spec: BehaviourSpec,
    table: QTable,
}

/// The same as it comes from a file.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Unchecked {
    spec: BehaviourSpec,
    table: QTable,
}

#[cfg(feature = "serde")]
impl TryFrom<Unchecked> for Behaviour {
    type Error = BehaviourError;

    fn try_from(Unchecked { spec, table }: Unchecked) -> Result<Self, BehaviourError> {
        spec.check().map_err(|what| BehaviourError::Text { what })?;
        Self::new(spec, table)
    }
}

impl Behaviour {
    /// Joins a specification and a table learned for it.
    ///
    /// # Errors
    /// [`BehaviourError::Shape`] when the table is not one of `spec.states()` x `spec.actions()`.
    pub fn new(spec: BehaviourSpec, table: QTable) -> Result<Self, BehaviourError> {
        let behaviour = Self { spec, table };
        behaviour.check_shape()?;
        Ok(behaviour)
    }

    fn check_shape(&self) -> Result<(), BehaviourError> {
        let (expected, found) = (
            (self.spec.states(), self.spec.actions()),
            (self.table.states(), self.table.actions()),
        );
        if expected == found {
            Ok(())
        } else {
            Err(BehaviourError::Shape {
                name: self.spec.name.clone(),
                expected,
                found,
            })
        }
    }

    /// What the behaviour is.
    pub fn spec(&self) -> &BehaviourSpec {
        &self.spec
    }

    /// What it has learned.
    pub fn table(&self) -> &QTable {
        &self.table
    }

    /// What it has learned, by itself.
    pub fn into_table(self) -> QTable {
        self.table
    }

    /// The action with the highest Q in `state` after the loop breaker, among those that `allowed`
    /// admits.
    ///
    /// The loop breaker takes `kappa` off an action's Q when the same action has already been
    /// chosen in the same state during this episode, three times as much when it has twice, then 7
    /// and 15 times: a greedy policy on coarse states may otherwise go round in circles for ever.
    /// Equal values go to the lowest action. `None` when nothing is allowed.
    pub fn choose(
        &self,
        state: State,
        episode: &Episode,
        kappa: f64,
        mut allowed: impl FnMut(Action) -> bool,
    ) -> Option<Action> {
        let row = self.table.row(state);
        let mut best: Option<(Action, f64)> = None;
        for (index, q) in row.iter().enumerate() {
            let action = Action(index);
            let worth = q - kappa * f64::from(episode.weight(state, action));
            if best.is_none_or(|(_, most)| worth > most) && allowed(action) {
                best = Some((action, worth));
            }
        }
        best.map(|(action, _)| action)
    }

    /// An action drawn from the Boltzmann distribution (the paper's Eq. 4) at `temperature`, over
    /// the Q after the loop breaker (see [`Behaviour::choose`]) of the actions that `allowed`
    /// admits. `chance`, in 0..1, decides the draw. `None` when nothing is allowed.
    pub fn explore(
        &self,
        state: State,
        episode: &Episode,
        kappa: f64,
        temperature: f64,
        chance: f64,
        mut allowed: impl FnMut(Action) -> bool,
    ) -> Option<Action> {
        let best = self.choose(state, episode, kappa, &mut allowed)?;
        let row = self.table.row(state);
        let worth =
            |action: Action| row[action.0] - kappa * f64::from(episode.weight(state, action));
        let weights: Vec<f64> = (0..row.len())
            .map(Action)
            .map(|action| {
                if allowed(action) {
                    ((worth(action) - worth(best)) / temperature).exp()
                } else {
                    0.0
                }
            })
            .collect();
        let mut rest = chance * weights.iter().sum::<f64>();
        let drawn = weights.iter().position(|weight| {
            rest -= weight;
            rest < 0.0
        });
        Some(drawn.map_or(best, Action))
    }

    /// Sets a value learned at work and counts the visit; what is not finite, or not in the table,
    /// changes nothing.
    pub(crate) fn teach(&mut self, state: State, action: Action, value: f64) {
        if self.table.set(state, action, value).is_ok() {
            // The pair is in the table, or `set` would have refused it.
            let _ = self.table.visit(state, action);
        }
    }
}

#[cfg(feature = "serde")]
impl Behaviour {
    /// Writes the behaviour to `path`, whole or not at all.
    ///
    /// # Errors
    /// What kept the file from being written.
    pub fn save(&self, path: &std::path::Path) -> Result<(), BehaviourError> {
        Ok(qtable::save(path, FILE_KIND, self)?)
    }

    /// Reads a behaviour that is exactly `expected`, but for what it has learned.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged or is none of ours; a behaviour with other states,
    /// actions, goal or reward.
    pub fn load(path: &std::path::Path, expected: &BehaviourSpec) -> Result<Self, BehaviourError> {
        let behaviour: Self = qtable::load(path, FILE_KIND)?;
        if behaviour.spec != *expected {
            return Err(BehaviourError::Foreign {
                path: path.to_owned(),
                part: behaviour.spec.difference(expected),
                name: expected.name.clone(),
            });
        }
        Ok(behaviour)
    }
}

#[cfg(feature = "serde")]
const FILE_KIND: &str = "grasp-agent behaviour";

/// What was chosen during one episode, for the loop breaker.
#[derive(Clone, Debug)]
pub struct Episode {
    actions: usize,
    weights: Vec<u32>,
}

/// How much choosing an action that lost the ball weighs, in ordinary choices: enough that it is
/// not chosen again.
pub(crate) const LOST_WEIGHT: u32 = 50;

impl Episode {
    /// The beginning of an episode of `behaviour`.
    pub fn new(behaviour: &Behaviour) -> Self {
        let (states, actions) = (behaviour.table.states(), behaviour.table.actions());
        Self {
            actions,
            weights: vec![0; states * actions],
        }
    }

    /// What the loop breaker takes off the Q of `action` in `state`, in units of its kappa.
    pub fn weight(&self, state: State, action: Action) -> u32 {
        self.weights[state.0 * self.actions + action.0]
    }

    /// Notes that `action` was chosen in `state`: its weight grows from 0 to 1, 3, 7, 15.
    pub fn chose(&mut self, state: State, action: Action) {
        self.add(state, action, self.weight(state, action).saturating_add(1));
    }

    /// Notes that `action`, chosen in `state`, lost the ball.
    pub fn lost_by(&mut self, state: State, action: Action) {
        self.add(state, action, LOST_WEIGHT);
    }

    fn add(&mut self, state: State, action: Action, weight: u32) {
        let slot = &mut self.weights[state.0 * self.actions + action.0];
        *slot = slot.saturating_add(weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn behaviour() -> Behaviour {
        let spec = BehaviourSpec::centering();
        let mut table = QTable::new(spec.states(), spec.actions()).unwrap();
        table.set(State(5), Action(7), 30.0).unwrap();
        table.set(State(5), Action(2), 15.0).unwrap();
        Behaviour::new(spec, table).unwrap()
    }

    #[test]
    fn repeated_choices_give_way_to_the_next_best() {
        let behaviour = behaviour();
        let mut episode = Episode::new(&behaviour);
        assert_eq!(
            behaviour.choose(State(5), &episode, 20.0, |_| true),
            Some(Action(7))
        );
        episode.chose(State(5), Action(7));
        assert_eq!(
            behaviour.choose(State(5), &episode, 20.0, |_| true),
            Some(Action(2))
        );
        assert_eq!(
            behaviour.choose(State(5), &episode, 0.0, |_| true),
            Some(Action(7))
        );
        assert_eq!(
            behaviour.choose(State(5), &episode, 20.0, |a| a != Action(2)),
            Some(Action(7))
        );
        assert_eq!(behaviour.choose(State(5), &episode, 20.0, |_| false), None);
    }

    #[test]
    fn a_table_of_another_shape_is_refused() {
        let refused = Behaviour::new(BehaviourSpec::centering(), QTable::new(42, 81).unwrap());
        assert!(matches!(
            refused,
            Err(BehaviourError::Shape {
                expected: (42, 9),
                found: (42, 81),
                ..
            })
        ));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn what_is_read_is_checked_as_what_is_made() {
        let sound = serde_json::to_value(behaviour()).unwrap();
        assert_eq!(
            serde_json::from_value::<Behaviour>(sound.clone()).unwrap(),
            behaviour()
        );
        let refused = |change: &dyn Fn(&mut serde_json::Value)| {
            let mut text = sound.clone();
            change(&mut text);
            serde_json::from_value::<Behaviour>(text)
                .unwrap_err()
                .to_string()
        };
        let larger = serde_json::to_value(BehaviourSpec::approaching()).unwrap();
        assert!(refused(&|text| text["spec"] = larger.clone()).contains("42x9"));
        assert!(refused(&|text| text["spec"]["goal"] = serde_json::json!([])).contains("no goal"));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_saved_behaviour_comes_back_equal_and_a_foreign_one_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("centering.policy");
        let behaviour = behaviour();
        behaviour.save(&path).unwrap();
        assert_eq!(Behaviour::load(&path, behaviour.spec()).unwrap(), behaviour);

        let literal = BehaviourSpec::centering().with_reward(crate::Reward::centering_literal());
        let refused = Behaviour::load(&path, &literal).unwrap_err();
        assert!(refused.to_string().contains("reward"), "{refused}");
        let refused = Behaviour::load(&path, &BehaviourSpec::approaching()).unwrap_err();
        assert!(refused.to_string().contains("approaching"), "{refused}");
    }
}
