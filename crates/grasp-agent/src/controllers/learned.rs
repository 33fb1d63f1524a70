//! The paper's controller: two learned behaviours side by side, and learning that goes on while
//! they work.

use puma_val2::JointDelta;
use qtable::rand::rngs::Xoshiro256PlusPlus;
use qtable::rand::{RngExt, SeedableRng};
use qtable::{Action, QTable, State};

use crate::behaviour::policy::{Behaviour, Episode, KAPPA};
use crate::behaviour::spec::BehaviourSpec;
#[cfg(feature = "serde")]
use crate::controller::SavedController;
use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::error::BehaviourError;
use crate::percept::{Percept, Sighting};

/// Centering and approaching (section 3 of the paper), each choosing for its own joints in every
/// cycle.
///
/// Frozen unless [`Learned::learning`] is asked for. Learning is one-step Q-learning on what really
/// happens, by the rewards of the specifications; moves out of the working limits are never tried.
#[derive(Clone, Debug)]
pub struct Learned {
    centering: Half,
    approaching: Half,
    learning: Option<Learning>,
}

/// Learning that goes on, and its random numbers.
#[derive(Clone, Debug)]
struct Learning {
    settings: OnlineLearning,
    rng: Xoshiro256PlusPlus,
    /// Numbers drawn so far.
    draws: u64,
}

impl Learning {
    /// Goes on after so many draws.
    fn after(settings: OnlineLearning, draws: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
        for _ in 0..draws {
            let _: f64 = rng.random();
        }
        Self {
            settings,
            rng,
            draws,
        }
    }

    fn draw(&mut self) -> f64 {
        self.draws += 1;
        self.rng.random()
    }
}

/// How learning goes on at work.
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

/// The same as it comes from a file.
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
    /// With a discount factor, a learning rate, a Boltzmann temperature in units of Q, and the seed
    /// of what is tried.
    ///
    /// # Errors
    /// [`BehaviourError::Learning`] for a `gamma` that is not in 0..1 (at 1 a goal that is kept
    /// would be worth infinitely much), an `alpha` that is not in 0..=1, a `temperature` that is
    /// not a finite number above zero.
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
                temperature.is_finite() && temperature > 0.0,
                "a finite number above 0",
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

    /// Discount factor 0.9, learning rate 0.1, temperature 0.3: careful enough that what was
    /// learned in simulation is not forgotten.
    pub fn careful(seed: u64) -> Self {
        Self {
            gamma: 0.9,
            alpha: 0.1,
            temperature: 0.3,
            seed,
        }
    }

    /// Discount factor, in 0..1.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// Learning rate, in 0..=1.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// Boltzmann temperature in units of Q, above zero; the higher, the more is tried.
    pub fn temperature(&self) -> f64 {
        self.temperature
    }

    /// Seed of what is tried.
    pub fn seed(&self) -> u64 {
        self.seed
    }
}

impl Learned {
    /// Loop breaker of centering unless set otherwise, in units of Q.
    pub const CENTERING_KAPPA: f64 = KAPPA;
    /// Loop breaker of approaching unless set otherwise, in units of Q.
    pub const APPROACHING_KAPPA: f64 = KAPPA;

    /// Two behaviours, frozen, with the loop breaker at [`Learned::CENTERING_KAPPA`] and
    /// [`Learned::APPROACHING_KAPPA`].
    pub fn new(centering: Behaviour, approaching: Behaviour) -> Self {
        Self {
            centering: Half::new(centering, Self::CENTERING_KAPPA),
            approaching: Half::new(approaching, Self::APPROACHING_KAPPA),
            learning: None,
        }
    }

    /// The same with another loop breaker: what choosing an action again in the same state costs,
    /// see [`Behaviour::choose`]. 0 is the plain greedy policy; what is not a finite number above
    /// zero counts as 0.
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

    /// The loop breakers of centering and approaching, units of Q.
    pub fn kappa(&self) -> (f64, f64) {
        (self.centering.kappa, self.approaching.kappa)
    }

    /// The same, learning from what happens.
    #[must_use]
    pub fn learning(mut self, settings: OnlineLearning) -> Self {
        self.learning = Some(Learning::after(settings, 0));
        self
    }

    /// Goes on learning after so many random numbers.
    #[cfg(feature = "serde")]
    pub(crate) fn resumed(mut self, (settings, draws): (OnlineLearning, u64)) -> Self {
        self.learning = Some(Learning::after(settings, draws));
        self
    }

    /// The same, learning nothing more.
    #[must_use]
    pub fn frozen(mut self) -> Self {
        self.learning = None;
        self
    }

    /// Centering as it is now.
    pub fn centering(&self) -> &Behaviour {
        &self.centering.behaviour
    }

    /// Approaching as it is now.
    pub fn approaching(&self) -> &Behaviour {
        &self.approaching.behaviour
    }

    /// The two behaviours, to be saved for example.
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
                    half.learn(self.learning.as_ref(), Some(&now));
                }
                Feedback::Lost | Feedback::TakenBack => {
                    half.learn(self.learning.as_ref(), None);
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
    /// What was perceived, and what was chosen then.
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
            Some(learning) => self.behaviour.explore(
                state,
                &self.episode,
                self.kappa,
                learning.settings.temperature,
                learning.draw(),
                allowed,
            ),
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

    /// Learns from the action chosen last, after which `now` is perceived, or the ball is lost.
    fn learn(&mut self, learning: Option<&Learning>, now: Option<&Percept>) {
        let (Some((before, state, action)), Some(learning)) = (self.last, learning) else {
            return;
        };
        let settings = &learning.settings;
        let value = match now {
            Some(now) => self.worth(settings.gamma, &before, now),
            None => Some(self.behaviour.spec().reward.lost),
        };
        let Some(value) = value else { return };
        let old = self.behaviour.table().value(state, action);
        self.behaviour
            .teach(state, action, old + settings.alpha * (value - old));
    }

    /// The paper's Eq. 3 for a step that kept the ball in view: what it paid and what follows.
    /// `None` where that is no number.
    fn worth(&self, gamma: f64, before: &Percept, after: &Percept) -> Option<f64> {
        let spec: &BehaviourSpec = self.behaviour.spec();
        if spec.at_goal(after) {
            return Some(spec.reward.arrival(gamma));
        }
        let table: &QTable = self.behaviour.table();
        let next = spec.state(after).ok()?;
        Some(spec.reward.step(before, after) + gamma * table.max(next))
    }
}
