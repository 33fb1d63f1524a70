//! The agent: a controller, and the modules around it.

use hough_heuristic::image::GrayImage;
use puma_val2::{Manipulator, ProximitySensor};

use crate::controller::{Controller, Feedback};
use crate::controllers::learned::Learned;
use crate::error::AgentError;
use crate::run::config::AgentConfig;
use crate::run::event::{RunEvent, RunOutcome};
use crate::run::search::{PoseSearch, RecoveryMoves, Search};
use crate::run::state_machine::{Devices, Modules, Run};
use crate::run::supervision::Supervision;
use crate::sight::eye::Eye;
use crate::sight::frozen::FrozenCheck;

/// The modules of section 2.2 of the paper, and the state machine that links them.
///
/// Rotation and reaching are done by a [`Controller`]: the paper's two learned behaviours
/// ([`Learned`]) or any other. Search, recovery and supervision follow [`AgentConfig`];
/// [`Agent::searching_by`], [`Agent::recovering_by`] and [`Agent::supervised_by`] replace them.
#[derive(Clone, Debug)]
pub struct Agent<C = Learned> {
    config: AgentConfig,
    controller: C,
    modules: Modules,
    camera: FrozenCheck,
}

impl<C: Controller> Agent<C> {
    /// Creates an agent whose arm reaches for the ball by the moves of `controller`.
    ///
    /// # Errors
    /// [`AgentError::Config`] for settings that cannot work.
    pub fn with_controller(config: AgentConfig, controller: C) -> Result<Self, AgentError> {
        config.check().map_err(AgentError::Config)?;
        let modules = Modules {
            search: Box::new(PoseSearch::new(
                config.search_poses.clone(),
                config.search_again.clone(),
            )),
            recovery: Box::new(RecoveryMoves::new(config.recovery.clone())),
            supervision: Box::new(config.clone()),
        };
        Ok(Self {
            config,
            controller,
            modules,
            camera: FrozenCheck::default(),
        })
    }

    /// Uses `search` instead of the search from [`AgentConfig::search_poses`].
    #[must_use]
    pub fn searching_by(mut self, search: impl Search + 'static) -> Self {
        self.modules.search = Box::new(search);
        self
    }

    /// Uses `recovery` instead of the moves of [`AgentConfig::recovery`].
    #[must_use]
    pub fn recovering_by(mut self, recovery: impl Search + 'static) -> Self {
        self.modules.recovery = Box::new(recovery);
        self
    }

    /// Uses `supervision` instead of the bounds in [`AgentConfig`].
    #[must_use]
    pub fn supervised_by(mut self, supervision: impl Supervision + 'static) -> Self {
        self.modules.supervision = Box::new(supervision);
        self
    }

    /// Returns the settings.
    pub fn config(&self) -> &AgentConfig {
        &self.config
    }

    /// Returns the controller with what it has learned so far.
    pub fn controller(&self) -> &C {
        &self.controller
    }

    /// Returns the controller, to change it between two runs.
    pub fn controller_mut(&mut self) -> &mut C {
        &mut self.controller
    }

    /// Returns the controller with what it has learned so far.
    pub fn into_controller(self) -> C {
        self.controller
    }

    /// Returns the memory of the last image.
    pub(crate) fn camera(&self) -> &FrozenCheck {
        &self.camera
    }

    /// Replaces the memory of the last image.
    pub(crate) fn with_camera(mut self, camera: FrozenCheck) -> Self {
        self.camera = camera;
        self
    }

    /// Replaces the frame seen last by `frame`: for a replay, which has no frames.
    pub(crate) fn having_seen(mut self, frame: GrayImage) -> Self {
        self.camera.pretend(frame);
        self
    }

    /// Searches for the ball, reaches it and closes the gripper on it. The controller keeps what it
    /// learns on the way.
    ///
    /// Every event goes to `observe` as it happens. The gripper is opened first.
    ///
    /// # Errors
    /// A fault of the camera or the arm. The arm is told to stop before the error is returned, and
    /// the reason is the last event. The controller keeps what it had learned until then.
    pub fn run_and_learn(
        &mut self,
        eye: &mut dyn Eye,
        arm: &mut dyn Manipulator,
        proximity: &mut dyn ProximitySensor,
        observe: &mut dyn FnMut(&RunEvent<'_>),
    ) -> Result<RunOutcome, AgentError> {
        self.controller.notice(&Feedback::Begin);
        let devices = Devices {
            eye,
            arm,
            proximity,
        };
        let run = Run::new(
            &self.config,
            &mut self.controller,
            &mut self.modules,
            &mut self.camera,
            devices,
            observe,
        );
        let result = run.until_done();
        self.controller.notice(&Feedback::End);
        result
    }

    /// Does the same as [`Agent::run_and_learn`] on a copy of the agent, so that the same scene
    /// gives the same run again.
    ///
    /// # Errors
    /// The errors of [`Agent::run_and_learn`].
    pub fn run(
        &self,
        eye: &mut dyn Eye,
        arm: &mut dyn Manipulator,
        proximity: &mut dyn ProximitySensor,
        observe: &mut dyn FnMut(&RunEvent<'_>),
    ) -> Result<RunOutcome, AgentError>
    where
        C: Clone,
    {
        self.clone().run_and_learn(eye, arm, proximity, observe)
    }
}
