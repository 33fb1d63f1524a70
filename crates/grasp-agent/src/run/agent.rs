//! The controller around the controller: search, reach, recover, grip, supervision, as one explicit
//! state machine.

use hough_heuristic::image::GrayImage;
use puma_val2::{Manipulator, ProximitySensor};

use crate::behaviour::policy::Behaviour;
use crate::controller::Controller;
use crate::controllers::learned::Learned;
use crate::error::AgentError;
use crate::run::config::AgentConfig;
use crate::run::event::{Event, Outcome};
use crate::run::recovery::{Recovery, RecoveryMoves};
use crate::run::search::{PoseSearch, Search};
use crate::run::state_machine::{Devices, Modules, Run};
use crate::run::supervision::{Guard, Supervision};
use crate::sight::eye::Eye;
use crate::sight::watch::Watch;

/// The modules of section 2.2 of the paper, and the state machine that links them.
///
/// Rotation and reaching are a [`Controller`]'s, the paper's two learned behaviours
/// ([`Agent::new`]) or any other ([`Agent::with_controller`]). Search, recovery and supervision are
/// those of the settings, or others: [`Agent::searching_by`], [`Agent::recovering_by`],
/// [`Agent::supervised_by`].
#[derive(Clone, Debug)]
pub struct Agent<C = Learned> {
    config: AgentConfig,
    controller: C,
    modules: Modules,
    watch: Watch,
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
        let modules = Modules {
            search: Box::new(PoseSearch::new(
                config.search_poses.clone(),
                config.search_again.clone(),
            )),
            recovery: Box::new(RecoveryMoves::new(config.recovery.clone())),
            supervision: Box::new(Guard::of(&config)),
        };
        Ok(Self {
            config,
            controller,
            modules,
            watch: Watch::default(),
        })
    }

    /// The same with another search, in the place of the one from [`AgentConfig::search_poses`].
    #[must_use]
    pub fn searching_by(mut self, search: impl Search + 'static) -> Self {
        self.modules.search = Box::new(search);
        self
    }

    /// The same with another recovery, in the place of [`AgentConfig::recovery`].
    #[must_use]
    pub fn recovering_by(mut self, recovery: impl Recovery + 'static) -> Self {
        self.modules.recovery = Box::new(recovery);
        self
    }

    /// The same with another supervision, in the place of the one by [`AgentConfig::limits`],
    /// [`AgentConfig::approach`] and [`AgentConfig::reach_tolerance`].
    #[must_use]
    pub fn supervised_by(mut self, supervision: impl Supervision + 'static) -> Self {
        self.modules.supervision = Box::new(supervision);
        self
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

    /// The controller, to be changed from outside between two runs.
    pub fn controller_mut(&mut self) -> &mut C {
        &mut self.controller
    }

    /// What the camera showed last.
    #[cfg(feature = "serde")]
    pub(crate) fn watch(&self) -> &Watch {
        &self.watch
    }

    /// The same, with another memory of what the camera showed last.
    #[cfg(feature = "serde")]
    pub(crate) fn watching(mut self, watch: Watch) -> Self {
        self.watch = watch;
        self
    }

    /// The same, as if the frame seen last had been `frame`: for a replay, which has no frames.
    pub(crate) fn having_seen(mut self, frame: GrayImage) -> Self {
        self.watch.pretend(frame);
        self
    }

    /// Searches the ball, reaches it and closes the gripper on it; what the controller learns on
    /// the way is kept.
    ///
    /// Every event goes to `observe` as it happens. The gripper is opened first.
    ///
    /// # Errors
    /// The camera or the arm failing. The arm is told to stop before the error is returned, the
    /// reason is the last event, and what the controller had learned until then is still in
    /// [`Agent::controller`].
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
            &mut self.modules,
            &mut self.watch,
            Devices {
                eye,
                arm,
                proximity,
            },
            observe,
        );
        let result = run.until_done();
        self.controller.end();
        result
    }

    /// As [`Agent::run_and_learn`], on a copy of the controller: the agent stays as it is, and the
    /// same scene gives the same run again.
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
