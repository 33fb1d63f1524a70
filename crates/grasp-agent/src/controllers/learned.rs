//! The paper's controller: two learned behaviours, frozen or learning at work.

use hough_heuristic::Features;
use puma_val2::{JointDelta, Joints};
use qtable::rand::rngs::Xoshiro256PlusPlus;
use qtable::rand::{RngExt, SeedableRng};
use qtable::{Action, Boltzmann, QLearning, Schedule, State};
use serde::{Deserialize, Serialize};

use crate::behaviour::policy::{Behaviour, Episode, KAPPA};
use crate::controller::SavedController;
use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::controllers::taught_goal::TaughtGoal;
use crate::error::BehaviourError;
use crate::percept::{Percept, Sighting};
use crate::record::policy_json::PolicyJson;

/// The paper's controller (section 3): two learned behaviours, centering and approaching. In every
/// cycle each of them chooses a move for its own joints.
///
/// Near the left and right border of the frame ([`Learned::BORDER`]) centering moves first and
/// approaching waits. A ball that is lost counts against the behaviour that lost it: approaching if
/// it moved, else centering.
///
/// Its tables stay as they are unless [`Learned::learning`] is called. It then goes on learning
/// during the runs: one-step Q-learning by the rewards of the two [`BehaviourSpec`]s. Moves that
/// would leave the working limits are never tried.
///
/// [`BehaviourSpec`]: crate::BehaviourSpec
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(into = "PolicyJson", try_from = "PolicyJson")]
pub struct Learned {
    centering: Half,
    approaching: Half,
    learning: Option<Learning>,
    goal: Option<TaughtGoal>,
}

/// Learning at work: the learner, the policy, and its random numbers.
#[derive(Clone, Debug)]
struct Learning {
    settings: OnlineLearning,
    learner: QLearning,
    policy: Boltzmann,
    rng: Xoshiro256PlusPlus,
    /// Actions drawn so far.
    draws: u64,
}

impl Learning {
    /// Resumes learning after `draws` random numbers were drawn.
    fn after(settings: OnlineLearning, draws: u64) -> Result<Self, qtable::Error> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
        for _ in 0..draws {
            let _: f64 = rng.random();
        }
        let alpha = Schedule::constant(settings.alpha)?;
        Ok(Self {
            settings,
            learner: QLearning::new(alpha, settings.gamma)?,
            policy: Boltzmann::new(Schedule::constant(settings.temperature)?)?,
            rng,
            draws,
        })
    }
}

/// Settings of learning at work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OnlineLearning {
    /// Discount factor, at least 0 and below 1. At 1 the value of an absorbing goal
    /// ([`Reward::absorbing`](crate::Reward::absorbing)) would be infinite.
    pub gamma: f64,
    /// Learning rate, from 0 to 1.
    pub alpha: f64,
    /// Boltzmann temperature, units of Q, from 1e-6 to 1e6.
    pub temperature: f64,
    /// Seed of the exploration.
    pub seed: u64,
}

impl OnlineLearning {
    /// Returns settings that do not forget what was learned in simulation: discount factor 0.9,
    /// learning rate 0.1, temperature 0.3.
    pub fn careful(seed: u64) -> Self {
        Self {
            gamma: 0.9,
            alpha: 0.1,
            temperature: 0.3,
            seed,
        }
    }

    fn check(&self) -> Result<(), String> {
        let (name, value, allowed) = if !(0.0..1.0).contains(&self.gamma) {
            ("gamma", self.gamma, "0 or above, and below 1")
        } else if !(0.0..=1.0).contains(&self.alpha) {
            ("alpha", self.alpha, "from 0 to 1")
        } else if !(1e-6..=1e6).contains(&self.temperature) {
            ("temperature", self.temperature, "from 1e-6 to 1e6")
        } else {
            return Ok(());
        };
        Err(format!(
            "{name} of learning at work is {value}; it must be {allowed}"
        ))
    }
}

impl Learned {
    /// Default repetition penalty of centering, in units of Q.
    pub const CENTERING_KAPPA: f64 = KAPPA;
    /// Default repetition penalty of approaching, in units of Q.
    pub const APPROACHING_KAPPA: f64 = KAPPA;

    /// Distance of the ball from the left or right border of the frame, feature units, within which
    /// only centering moves.
    pub const BORDER: f64 = 20.0;

    /// Creates a controller from two behaviours, frozen, with the repetition penalties
    /// [`Learned::CENTERING_KAPPA`] and [`Learned::APPROACHING_KAPPA`].
    pub fn new(centering: Behaviour, approaching: Behaviour) -> Self {
        Self {
            centering: Half::new(centering, Self::CENTERING_KAPPA),
            approaching: Half::new(approaching, Self::APPROACHING_KAPPA),
            learning: None,
            goal: None,
        }
    }

    /// Sets a goal that was taught on the arm: the ball is moved in the image so that it shows at
    /// the goal of the behaviours when it is at the taught one.
    #[must_use]
    pub fn shown(mut self, goal: &TaughtGoal) -> Self {
        self.goal = Some(*goal);
        self
    }

    /// Returns what the behaviours perceive of a ball.
    fn percept(&self, ball: &Sighting, joints: &Joints) -> Percept {
        let ball = self.goal.map_or(*ball, |goal| goal.as_untaught(ball));
        let spec = self.approaching.behaviour.spec();
        spec.percept(ball.features, joints)
    }

    /// Sets the repetition penalties, units of Q. The penalty is subtracted from the Q of an action
    /// that was chosen before in the same state of this run: once after one choice, 3 times after
    /// two, 7 times after three, 15 times after four, and so on.
    ///
    /// A greedy policy on coarse states may otherwise go round in circles for ever. 0 is the plain
    /// greedy policy; a penalty that is negative or not finite counts as 0.
    #[must_use]
    pub fn with_kappa(mut self, centering: f64, approaching: f64) -> Self {
        let sound = |kappa: f64| {
            Some(kappa)
                .filter(|k| k.is_finite() && *k > 0.0)
                .unwrap_or(0.0)
        };
        (self.centering.kappa, self.approaching.kappa) = (sound(centering), sound(approaching));
        self
    }

    /// Returns the repetition penalties of centering and approaching, units of Q.
    pub fn kappa(&self) -> (f64, f64) {
        (self.centering.kappa, self.approaching.kappa)
    }

    /// Makes the controller go on learning during the runs.
    ///
    /// # Errors
    /// [`BehaviourError::Settings`] for a setting out of its range.
    pub fn learning(self, settings: OnlineLearning) -> Result<Self, BehaviourError> {
        self.resumed(settings, 0)
    }

    /// Goes on learning after so many random numbers.
    pub(crate) fn resumed(
        self,
        settings: OnlineLearning,
        draws: u64,
    ) -> Result<Self, BehaviourError> {
        settings.check()?;
        Ok(Self {
            learning: Some(Learning::after(settings, draws)?),
            ..self
        })
    }

    /// Stops learning.
    #[must_use]
    pub fn frozen(mut self) -> Self {
        self.learning = None;
        self
    }

    /// Returns centering in its present state.
    pub fn centering(&self) -> &Behaviour {
        &self.centering.behaviour
    }

    /// Returns approaching in its present state.
    pub fn approaching(&self) -> &Behaviour {
        &self.approaching.behaviour
    }

    /// Returns both behaviours, for example to save them.
    pub fn into_behaviours(self) -> (Behaviour, Behaviour) {
        (self.centering.behaviour, self.approaching.behaviour)
    }
}

impl Controller for Learned {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        if request.grip {
            return Err(GaveUp::NoMoveLeft);
        }
        let percept = self.percept(ball, &request.joints);
        let admitted = |delta: JointDelta| request.limits.admit(&(request.joints + delta));
        let turn = self
            .centering
            .decide(&percept, self.learning.as_mut(), admitted)?;
        let x = ball.features.x;
        let inside = (Self::BORDER..=Features::WIDTH - Self::BORDER).contains(&x);
        self.approaching.last = None;
        let reach = if inside || turn == JointDelta::default() {
            self.approaching
                .decide(&percept, self.learning.as_mut(), admitted)?
        } else {
            JointDelta::default()
        };
        let both = std::array::from_fn(|i| turn.0[i] + reach.0[i]);
        Ok(Decision::Move(JointDelta(both)))
    }

    fn notice(&mut self, feedback: &Feedback) {
        let now = match feedback {
            Feedback::Seen { ball, joints } => Some(self.percept(ball, joints)),
            _ => None,
        };
        let wrong = matches!(feedback, Feedback::Lost | Feedback::TakenBack);
        let both = [&mut self.approaching, &mut self.centering];
        if wrong {
            // The behaviour that lost the ball: the first of them that moved.
            if let Some(half) = both.into_iter().find(|half| half.has_moved()) {
                half.learn(self.learning.as_mut(), None);
                half.bar_last();
            }
            return;
        }
        for half in both {
            match feedback {
                Feedback::Begin => half.begin(),
                Feedback::Seen { .. } => half.learn(self.learning.as_mut(), now.as_ref()),
                _ => {}
            }
        }
    }

    fn describe(&self) -> &str {
        "learned"
    }

    fn save(&self) -> Option<SavedController> {
        let learning = self.learning.as_ref();
        let learning = learning.map(|learning| (learning.settings, learning.draws));
        SavedController::new("learned", (self, learning, self.goal))
    }
}

/// One behaviour during one run.
#[derive(Clone, Debug)]
struct Half {
    behaviour: Behaviour,
    kappa: f64,
    episode: Episode,
    /// Last percept, its state, and the action chosen.
    last: Option<(Percept, State, Action)>,
}

impl Half {
    fn new(behaviour: Behaviour, kappa: f64) -> Self {
        Self {
            episode: Episode::new(&behaviour),
            behaviour,
            kappa,
            last: None,
        }
    }

    fn begin(&mut self) {
        self.episode = Episode::new(&self.behaviour);
        self.last = None;
    }

    /// Returns the move that the behaviour chooses, none at its goal.
    fn decide(
        &mut self,
        percept: &Percept,
        learning: Option<&mut Learning>,
        admitted: impl Fn(JointDelta) -> bool,
    ) -> Result<JointDelta, GaveUp> {
        self.last = None;
        let spec = self.behaviour.spec();
        if spec.at_goal(percept) {
            return Ok(JointDelta::default());
        }
        let state = spec.state(percept).map_err(|_| GaveUp::NoMoveLeft)?;
        let allowed = |action| admitted(spec.delta(action));
        let action = match learning {
            None => self
                .behaviour
                .choose(state, &self.episode, self.kappa, allowed),
            Some(learning) => {
                let Learning { policy, rng, .. } = learning;
                let drawn =
                    self.behaviour
                        .explore(state, &self.episode, self.kappa, policy, rng, allowed);
                learning.draws += u64::from(drawn.is_some());
                drawn
            }
        };
        let action = action.ok_or(GaveUp::NoMoveLeft)?;
        self.last = Some((*percept, state, action));
        self.episode.chose(state, action);
        Ok(spec.delta(action))
    }

    /// Returns `true` if the action chosen last moves a joint.
    fn has_moved(&self) -> bool {
        let spec = self.behaviour.spec();
        let delta = |(_, _, action)| spec.delta(action);
        self.last
            .map(delta)
            .is_some_and(|d| d != JointDelta::default())
    }

    /// Bars the action chosen last in its state for the rest of this run.
    fn bar_last(&mut self) {
        if let Some((_, state, action)) = self.last {
            self.episode.lost_by(state, action);
        }
    }

    /// Learns from the action chosen last, after which `now` is perceived, or the ball is lost: the
    /// paper's Eq. 3.
    fn learn(&mut self, learning: Option<&mut Learning>, now: Option<&Percept>) {
        let (Some((before, state, action)), Some(learning)) = (self.last, learning) else {
            return;
        };
        let gamma = learning.settings.gamma;
        let step = self.behaviour.spec().outcome((&before, state), now, gamma);
        let learner = &mut learning.learner;
        self.behaviour.learn(learner, state, action, &step);
    }
}
