//! The paper's controller: two learned behaviours, frozen or learning at work.

use puma_val2::JointDelta;
use qtable::rand::rngs::Xoshiro256PlusPlus;
use qtable::rand::{RngExt, SeedableRng};
use qtable::{Action, Boltzmann, QLearning, Schedule, State, Status, Step};

use crate::behaviour::policy::{Behaviour, Episode, KAPPA};
#[cfg(feature = "serde")]
use crate::controller::SavedController;
use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::error::BehaviourError;
use crate::percept::{Percept, Sighting};

/// The paper's controller (section 3): centering and approaching, each of which chooses for its own
/// joints in every cycle.
///
/// It is frozen unless [`Learned::learning`] is called. Learning at work is one-step Q-learning by
/// the rewards of the specifications; moves out of the working limits are never tried.
#[derive(Clone, Debug)]
pub struct Learned {
    centering: Half,
    approaching: Half,
    learning: Option<Learning>,
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
    /// Goes on after so many draws; `None` for settings that `qtable` refuses.
    fn after(settings: OnlineLearning, draws: u64) -> Option<Self> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
        for _ in 0..draws {
            let _: f64 = rng.random();
        }
        let alpha = Schedule::constant(settings.alpha).ok()?;
        let temperature = Schedule::constant(settings.temperature).ok()?;
        Some(Self {
            settings,
            learner: QLearning::new(alpha, settings.gamma).ok()?,
            policy: Boltzmann::new(temperature).ok()?,
            rng,
            draws,
        })
    }
}

/// Settings of learning at work.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Untested")
)]
pub struct OnlineLearning {
    gamma: f64,
    alpha: f64,
    temperature: f64,
    seed: u64,
}

/// An [`OnlineLearning`] as it is read.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Untested {
    gamma: f64,
    alpha: f64,
    temperature: f64,
    seed: u64,
}

#[cfg(feature = "serde")]
impl TryFrom<Untested> for OnlineLearning {
    type Error = BehaviourError;

    fn try_from(untested: Untested) -> Result<Self, BehaviourError> {
        let Untested {
            gamma,
            alpha,
            temperature,
            seed,
        } = untested;
        Self::new(gamma, alpha, temperature, seed)
    }
}

impl OnlineLearning {
    /// Creates settings from a discount factor, a learning rate, a Boltzmann temperature in units
    /// of Q, and the seed of the exploration.
    ///
    /// # Errors
    /// [`BehaviourError::Learning`] for a `gamma` outside 0..1 (at 1 a goal that is kept would be
    /// worth infinitely much), an `alpha` outside 0..=1, a `temperature` outside 1e-6..=1e6.
    pub fn new(
        gamma: f64,
        alpha: f64,
        temperature: f64,
        seed: u64,
    ) -> Result<Self, BehaviourError> {
        let sound = [
            (
                "gamma",
                gamma,
                (0.0..1.0).contains(&gamma),
                "0 or above, and below 1",
            ),
            ("alpha", alpha, (0.0..=1.0).contains(&alpha), "from 0 to 1"),
            (
                "temperature",
                temperature,
                (1e-6..=1e6).contains(&temperature),
                "from 1e-6 to 1e6",
            ),
        ];
        match sound.into_iter().find(|(_, _, sound, _)| !sound) {
            Some((quantity, value, _, allowed)) => Err(BehaviourError::Learning {
                quantity,
                value,
                allowed,
            }),
            None => Ok(Self {
                gamma,
                alpha,
                temperature,
                seed,
            }),
        }
    }

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
}

impl Learned {
    /// Default repetition penalty of centering, in units of Q.
    pub const CENTERING_KAPPA: f64 = KAPPA;
    /// Default repetition penalty of approaching, in units of Q.
    pub const APPROACHING_KAPPA: f64 = KAPPA;

    /// Creates a controller from two behaviours, frozen, with the repetition penalties
    /// [`Learned::CENTERING_KAPPA`] and [`Learned::APPROACHING_KAPPA`].
    pub fn new(centering: Behaviour, approaching: Behaviour) -> Self {
        Self {
            centering: Half::new(centering, Self::CENTERING_KAPPA),
            approaching: Half::new(approaching, Self::APPROACHING_KAPPA),
            learning: None,
        }
    }

    /// Sets the repetition penalties: the value subtracted from the Q of an action that was chosen
    /// once before in the same state of this run, 3, 7 and 15 times as much after more choices.
    ///
    /// A greedy policy on coarse states may otherwise go round in circles for ever. 0 is the plain
    /// greedy policy; a penalty that is negative or not finite counts as 0.
    #[must_use]
    pub fn with_kappa(mut self, centering: f64, approaching: f64) -> Self {
        let sound = |kappa: f64| {
            if kappa.is_finite() {
                kappa.max(0.0)
            } else {
                0.0
            }
        };
        (self.centering.kappa, self.approaching.kappa) = (sound(centering), sound(approaching));
        self
    }

    /// Returns the repetition penalties of centering and approaching, units of Q.
    pub fn kappa(&self) -> (f64, f64) {
        (self.centering.kappa, self.approaching.kappa)
    }

    /// Makes the controller learn at work.
    #[must_use]
    pub fn learning(mut self, settings: OnlineLearning) -> Self {
        self.learning = Learning::after(settings, 0);
        self
    }

    /// Goes on learning after so many random numbers.
    #[cfg(feature = "serde")]
    pub(crate) fn resumed(mut self, (settings, draws): (OnlineLearning, u64)) -> Self {
        self.learning = Learning::after(settings, draws);
        self
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
        let percept = Percept::new(ball.features, &request.joints);
        let admitted = |delta: JointDelta| request.limits.admit(&(request.joints + delta));
        let turn = self
            .centering
            .decide(&percept, self.learning.as_mut(), admitted)?;
        let reach = self
            .approaching
            .decide(&percept, self.learning.as_mut(), admitted)?;
        let both = std::array::from_fn(|i| turn.0[i] + reach.0[i]);
        Ok(Decision::Move(JointDelta(both)))
    }

    fn notice(&mut self, feedback: &Feedback) {
        for half in [&mut self.centering, &mut self.approaching] {
            match feedback {
                Feedback::Begin => half.begin(),
                Feedback::Seen { ball, joints } => {
                    let now = Percept::new(ball.features, joints);
                    half.learn(self.learning.as_mut(), Some(&now));
                }
                Feedback::Lost | Feedback::TakenBack => {
                    half.learn(self.learning.as_mut(), None);
                    half.bar_last();
                }
                _ => {}
            }
        }
    }

    fn describe(&self) -> &str {
        "learned"
    }

    #[cfg(feature = "serde")]
    fn save(&self) -> Option<SavedController> {
        let learning = self.learning.as_ref();
        let learning = learning.map(|learning| (learning.settings, learning.draws));
        Some(SavedController::new("learned", (self.clone(), learning)))
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
        let (spec, gamma) = (self.behaviour.spec(), learning.settings.gamma);
        let (observation, reward, status) = match now {
            None => (state, spec.reward.lost, Status::Terminated),
            Some(now) => {
                let Ok(next) = spec.state(now) else { return };
                if spec.at_goal(now) {
                    (next, spec.reward.arrival(gamma), Status::Terminated)
                } else {
                    let paid = spec.reward.step(&before, now);
                    (next, paid, Status::Continuing)
                }
            }
        };
        let step = Step {
            observation,
            reward,
            status,
        };
        let learner = &mut learning.learner;
        self.behaviour.learn(learner, state, action, &step);
    }
}
