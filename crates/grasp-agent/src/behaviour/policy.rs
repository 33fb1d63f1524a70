//! A learned behaviour, and the choice of its actions.

use puma_val2::JointDelta;
use qtable::rand::rngs::Xoshiro256PlusPlus;
use qtable::{Action, Boltzmann, Policy, QLearning, QTable, State, Step};
use serde::{Deserialize, Serialize};

use crate::behaviour::spec::BehaviourSpec;
use crate::error::BehaviourError;
use crate::percept::Percept;

/// A learned behaviour: a specification, and the Q-table over its states and actions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "(BehaviourSpec, QTable)", into = "(BehaviourSpec, QTable)")]
pub struct Behaviour {
    spec: BehaviourSpec,
    table: QTable,
}

impl From<Behaviour> for (BehaviourSpec, QTable) {
    fn from(behaviour: Behaviour) -> Self {
        (behaviour.spec, behaviour.table)
    }
}

impl TryFrom<(BehaviourSpec, QTable)> for Behaviour {
    type Error = BehaviourError;

    fn try_from((spec, table): (BehaviourSpec, QTable)) -> Result<Self, BehaviourError> {
        Self::new(spec, table)
    }
}

impl Behaviour {
    /// Joins a specification and a table that was learned for it.
    ///
    /// # Errors
    /// [`BehaviourError::Settings`] for a specification that cannot be run, and
    /// [`BehaviourError::Shape`] if the table does not have `spec.states()` x `spec.actions()`
    /// entries.
    pub fn new(spec: BehaviourSpec, table: QTable) -> Result<Self, BehaviourError> {
        spec.check()?;
        let expected = (spec.states(), spec.actions());
        let found = (table.states(), table.actions());
        if expected == found {
            return Ok(Self { spec, table });
        }
        Err(BehaviourError::Shape {
            name: spec.name,
            expected,
            found,
        })
    }

    /// Returns the specification.
    pub fn spec(&self) -> &BehaviourSpec {
        &self.spec
    }

    /// Returns the table.
    pub fn table(&self) -> &QTable {
        &self.table
    }

    /// Returns the table without the specification.
    pub(crate) fn into_table(self) -> QTable {
        self.table
    }

    /// Runs the greedy policy in a simulator: `simulate` returns the percept after a move, `None`
    /// if the ball is lost; moves that `admitted` refuses are not chosen. `penalty` is the
    /// repetition penalty, see [`Learned::with_kappa`](crate::Learned::with_kappa).
    ///
    /// Returns the number of steps to the goal.
    ///
    /// # Errors
    /// The state and action that lost the ball; `None` if the goal was not reached within `most`
    /// steps.
    pub fn steps_to_goal(
        &self,
        start: &Percept,
        penalty: f64,
        most: usize,
        mut admitted: impl FnMut(&Percept, &JointDelta) -> bool,
        mut simulate: impl FnMut(&Percept, &JointDelta) -> Option<Percept>,
    ) -> Result<usize, Option<(State, Action)>> {
        let spec = &self.spec;
        let (mut now, mut episode) = (*start, Episode::new(self));
        for step in 0..=most {
            if spec.at_goal(&now) {
                return Ok(step);
            }
            if step == most {
                break;
            }
            let state = spec.state(&now).map_err(|_| None)?;
            let allowed = |action| admitted(&now, &spec.delta(action));
            let action = self.choose(state, &episode, penalty, allowed).ok_or(None)?;
            episode.chose(state, action);
            let after = simulate(&now, &spec.delta(action));
            now = after.ok_or(Some((state, action)))?;
        }
        Err(None)
    }

    /// Returns the action with the highest Q in `state` after the repetition penalty, among those
    /// that `allowed` admits; `None` if there is none. Equal values go to the lowest action.
    pub(crate) fn choose(
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

    /// Draws an action by `policy` (the paper's Eq. 4) from the Q after the repetition penalty,
    /// among those that `allowed` admits; `None` if there is none.
    pub(crate) fn explore(
        &self,
        state: State,
        episode: &Episode,
        kappa: f64,
        policy: &mut Boltzmann,
        rng: &mut Xoshiro256PlusPlus,
        mut allowed: impl FnMut(Action) -> bool,
    ) -> Option<Action> {
        let actions = (0..self.table.actions()).map(Action);
        let admitted: Vec<Action> = actions.filter(|action| allowed(*action)).collect();
        let mut worth = QTable::new(1, admitted.len()).ok()?;
        for (index, action) in admitted.iter().enumerate() {
            let penalty = kappa * f64::from(episode.weight(state, *action));
            let value = self.table.value(state, *action) - penalty;
            worth.set(State(0), Action(index), value).ok()?;
        }
        let Action(index) = policy.choose(&worth, State(0), rng);
        admitted.get(index).copied()
    }

    /// Learns from one step by `learner`; a step that is not finite changes nothing.
    pub(crate) fn learn(
        &mut self,
        learner: &mut QLearning,
        state: State,
        action: Action,
        step: &Step,
    ) {
        // The table refuses values that are not finite and stays as it is.
        let _ = learner.update(&mut self.table, state, action, step);
    }
}

impl Behaviour {
    /// Writes the behaviour to `path`, whole or not at all.
    ///
    /// # Errors
    /// Reason why the file could not be written.
    pub fn save(&self, path: &std::path::Path) -> Result<(), BehaviourError> {
        Ok(qtable::save(path, FILE_KIND, self)?)
    }

    /// Reads a behaviour whose specification is `expected`.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged or of another kind; a behaviour with other states,
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

const FILE_KIND: &str = "grasp-agent behaviour";

/// Repetition penalty unless set otherwise, in units of Q.
pub(crate) const KAPPA: f64 = 20.0;

/// Weight of an action that lost the ball, in ordinary choices: it is not chosen again.
pub(crate) const LOST_WEIGHT: u32 = 50;

/// Choices of one episode, for the repetition penalty.
///
/// A greedy policy on coarse states may go round in circles for ever. The penalty, `kappa` times
/// the weight, is subtracted from the Q of actions that were chosen before in the same state.
#[derive(Clone, Debug)]
pub(crate) struct Episode {
    actions: usize,
    weights: Vec<u32>,
}

impl Episode {
    pub(crate) fn new(behaviour: &Behaviour) -> Self {
        let (states, actions) = (behaviour.table.states(), behaviour.table.actions());
        Self {
            actions,
            weights: vec![0; states * actions],
        }
    }

    fn weight(&self, state: State, action: Action) -> u32 {
        self.weights[state.0 * self.actions + action.0]
    }

    /// Records a choice: the weight of `action` grows from 0 to 1, 3, 7, 15.
    pub(crate) fn chose(&mut self, state: State, action: Action) {
        self.add(state, action, self.weight(state, action).saturating_add(1));
    }

    /// Records that `action` lost the ball.
    pub(crate) fn lost_by(&mut self, state: State, action: Action) {
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
    use crate::behaviour::reward::Reward;

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

    #[test]
    fn a_behaviour_is_validated_on_deserialization() {
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
        assert!(refused(&|text| text[0] = larger.clone()).contains("42x9"));
        assert!(refused(&|text| text[0]["goal"] = serde_json::json!([])).contains("no goal"));
    }

    #[test]
    fn a_saved_behaviour_comes_back_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("centering.policy");
        let behaviour = behaviour();
        behaviour.save(&path).unwrap();
        assert_eq!(Behaviour::load(&path, behaviour.spec()).unwrap(), behaviour);

        let literal = BehaviourSpec::centering().with_reward(Reward::centering_literal());
        let refused = Behaviour::load(&path, &literal).unwrap_err();
        assert!(refused.to_string().contains("reward"), "{refused}");
        let refused = Behaviour::load(&path, &BehaviourSpec::approaching()).unwrap_err();
        assert!(refused.to_string().contains("approaching"), "{refused}");
    }
}
