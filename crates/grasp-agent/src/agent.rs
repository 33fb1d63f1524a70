//! The controller around the controller: search, reach, recover, grip, supervision, as one explicit state machine.

use hough_heuristic::image::GrayImage;
use puma_val2::{Joints, Manipulator, ProximitySensor};

use crate::run::Run;
use crate::watch::Watch;
use crate::{AgentConfig, AgentError, Behaviour, Controller, Event, Eye, GaveUp, Learned, Sighting};

/// The modules of section 2.2 of the paper around a [`Controller`], which moves the arm while the ball is in view: the paper's two
/// learned behaviours ([`Agent::new`]) or any other ([`Agent::with_controller`]).
#[derive(Clone, Debug)]
pub struct Agent<C = Learned> {
    config: AgentConfig,
    controller: C,
    watch: Watch,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// `None` when the gripper has closed at the goal and, unless [`AgentConfig::lift`] is `None`, what was seen there has been lifted;
    /// otherwise why not. What is lifted is known from the camera alone, see there.
    pub gave_up: Option<GaveUp>,
    /// Moves after the first sighting, recovery moves included, the grip not; and one for each grip that failed, or was not begun because two looks
    /// at the goal differed.
    pub cycles: usize,
    /// How often the ball was lost.
    pub losses: usize,
    /// The ball as it was last seen.
    pub last_seen: Option<Sighting>,
    /// Where the arm stands.
    pub joints: Joints,
}

impl Agent {
    /// An agent with the paper's controller: two learned behaviours, frozen ([`Learned::new`]).
    ///
    /// # Errors
    /// [`AgentError::Config`] for settings that cannot work.
    pub fn new(
        config: AgentConfig,
        centering: Behaviour,
        approaching: Behaviour,
    ) -> Result<Self, AgentError> {
        Self::with_controller(config, Learned::new(centering, approaching))
    }
}

impl<C: Controller> Agent<C> {
    /// An agent that reaches by `controller`.
    ///
    /// # Errors
    /// [`AgentError::Config`] for settings that cannot work.
    pub fn with_controller(config: AgentConfig, controller: C) -> Result<Self, AgentError> {
        config.check()?;
        Ok(Self {
            config,
            controller,
            watch: Watch::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &AgentConfig {
        &self.config
    }

    /// The controller, with what it has learned so far.
    pub fn controller(&self) -> &C {
        &self.controller
    }

    /// The controller, with what it has learned so far.
    pub fn into_controller(self) -> C {
        self.controller
    }

    /// The same, as if the frame seen last had been `frame`: for a replay, which has no frames.
    pub(crate) fn having_seen(mut self, frame: GrayImage) -> Self {
        self.watch.pretend(frame);
        self
    }

    /// Searches the ball, reaches it and closes the gripper on it; what the controller learns on the way is kept.
    ///
    /// Every event goes to `observe` as it happens. The gripper is opened first.
    ///
    /// # Errors
    /// The camera or the arm failing. The arm is told to stop before the error is returned, the reason is the last event, and what
    /// the controller had learned until then is still in [`Agent::controller`].
    pub fn run_and_learn(
        &mut self,
        eye: &mut dyn Eye,
        arm: &mut dyn Manipulator,
        proximity: &mut dyn ProximitySensor,
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Outcome, AgentError> {
        self.controller.begin();
        let run = Run::new(
            &self.config,
            &mut self.controller,
            &mut self.watch,
            eye,
            arm,
            proximity,
            observe,
        );
        let result = run.until_done();
        self.controller.end();
        result
    }

    /// As [`Agent::run_and_learn`], on a copy of the controller: the agent stays as it is, and the same scene gives the same run
    /// again.
    ///
    /// # Errors
    /// As for [`Agent::run_and_learn`].
    pub fn run(
        &self,
        eye: &mut dyn Eye,
        arm: &mut dyn Manipulator,
        proximity: &mut dyn ProximitySensor,
        observe: &mut dyn FnMut(&Event<'_>),
    ) -> Result<Outcome, AgentError>
    where
        C: Clone,
    {
        self.clone().run_and_learn(eye, arm, proximity, observe)
    }
}
