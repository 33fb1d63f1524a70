//! A run that is complete in itself: settings, controller, and every event.

use serde::{Deserialize, Serialize};

use crate::controller::Controller;
use crate::error::{AgentError, BehaviourError};
use crate::record::export::{check_format, plain_text_of};
use crate::record::log::{EventLog, LoggedEvent};
use crate::record::log::{Played, numbered};
use crate::record::saved_controller::ControllerText;
use crate::record::saved_controller::SavedController;
use crate::run::agent::Agent;
use crate::run::config::AgentConfig;
use crate::run::event::{Event, EventKind, Outcome};
use crate::sight::watch::{Shown, Watch};

/// A run, saved: all that it takes to make it again, and to see whether it comes out the same.
///
/// ```
/// # use std::cell::RefCell;
/// # use grasp_agent::puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};
/// # use grasp_agent::hough_heuristic::FrameError;
/// use grasp_agent::{Agent, AgentConfig, Eye, Hybrid, HybridSettings, Look, Replayed, SavedController, SavedRun};
/// # struct Arm(Joints);
/// # impl Manipulator for Arm {
/// #     fn joints(&mut self) -> Result<Joints, ArmError> { Ok(self.0) }
/// #     fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> { self.move_to(self.0 + delta) }
/// #     fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> { self.0 = target; Ok(target) }
/// #     fn set_gripper(&mut self, _: Gripper) -> Result<(), ArmError> { Ok(()) }
/// #     fn stop(&mut self) -> Result<(), ArmError> { Ok(()) }
/// # }
/// # struct Free;
/// # impl ProximitySensor for Free {
/// #     fn object_near(&mut self) -> Result<bool, ArmError> { Ok(false) }
/// # }
/// # struct Dark;
/// # impl Eye for Dark {
/// #     fn look(&mut self) -> Result<Look, FrameError> { Ok(Look::default()) }
/// # }
///
/// let pose = Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0]);
/// let mut agent = Agent::with_controller(AgentConfig::paper([pose]), Hybrid::new(HybridSettings::paper()).frozen())?;
/// let mut saved = SavedRun::before(&agent, SavedController::of_hybrid(agent.controller()));
/// # let (mut eye, mut arm, mut sensor) = (Dark, Arm(pose), Free);
/// let outcome = agent.run_and_learn(&mut eye, &mut arm, &mut sensor, &mut |event| saved.note(event))?;
///
/// let text = saved.to_json();
/// // Another day, in another program:
/// let replayed = SavedRun::from_json(&text)?.replay()?;
/// assert!(matches!(replayed, Replayed::Same(Ok(again)) if again == outcome));
/// # Ok::<(), grasp_agent::AgentError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SavedRun {
    config: AgentConfig,
    controller: SavedController,
    camera: Camera,
    log: EventLog,
}

/// What came of a replay.
#[derive(Clone, Debug, PartialEq)]
pub enum Replayed {
    /// The same events, and this end: the outcome, or what the run failed with.
    Same(Result<Outcome, String>),
    /// Another course.
    Differs {
        /// The first event that differs, counted from 0.
        event: usize,
        /// That event in the saved run; `None` if it had ended there.
        then: Option<LoggedEvent>,
        /// That event in the replay; `None` if it had ended there.
        now: Option<LoggedEvent>,
    },
}

/// What the camera had shown before the run: whether a look shows the same again is counted on from
/// run to run.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Camera {
    from: puma_val2::Joints,
    showed: bool,
    same: usize,
}

impl SavedRun {
    /// A run that is about to be made by `agent`, with its controller as `controller` says.
    /// [`SavedRun::note`] takes down what happens then.
    ///
    /// Modules that the agent has in the place of those of its settings are not part of it: such a
    /// run is replayed by [`EventLog::replay`].
    pub fn before<C: Controller>(agent: &Agent<C>, controller: SavedController) -> Self {
        let watch = agent.watch();
        Self {
            config: agent.config().clone(),
            controller,
            camera: Camera {
                from: watch.from,
                showed: watch.shown.is_some(),
                same: watch.same(),
            },
            log: EventLog::default(),
        }
    }

    /// Takes down an event.
    pub fn note(&mut self, event: &Event<'_>) {
        self.log.note(event);
    }

    /// What happened.
    pub fn log(&self) -> &EventLog {
        &self.log
    }

    /// The settings of the agent.
    pub fn config(&self) -> &AgentConfig {
        &self.config
    }

    /// The controller before the run.
    pub fn controller(&self) -> &SavedController {
        &self.controller
    }

    /// Makes the run again, with the arm, the sensors and the eye answering as they did then.
    ///
    /// # Errors
    /// [`AgentError::Config`] for settings that cannot work.
    pub fn replay(&self) -> Result<Replayed, AgentError> {
        let watch = Watch {
            from: self.camera.from,
            shown: self.camera.showed.then(|| Shown::Frame(numbered(0))),
            same: self.camera.same,
        };
        let agent = Agent::with_controller(self.config.clone(), self.controller.controller())?
            .watching(watch);
        let Played { end, log, differs } = self.log.play(agent);
        Ok(match differs {
            // The replayed devices fail in words of their own.
            None => Replayed::Same(end.map_err(|error| match self.log.events.last() {
                Some(LoggedEvent {
                    kind: EventKind::Failed(cause),
                    ..
                }) => cause.clone(),
                _ => error.to_string(),
            })),
            Some(event) => Replayed::Differs {
                event,
                then: self.log.events.get(event).cloned(),
                now: log.events.get(event).cloned(),
            },
        })
    }

    /// The run as JSON: its format, settings, controller, what the camera had shown, and the
    /// events, one after the other. Numbers that are not finite are written as the texts `"NaN"`,
    /// `"inf"` and `"-inf"`.
    pub fn to_json(&self) -> String {
        let controller = ControllerText::of(&self.controller, &self.config.limits);
        // The values of a policy in one line, an event in one line each.
        let events: Vec<String> = self.log.events.iter().map(plain_text_of).collect();
        format!(
            "{{\n\"format\": {},\n\"config\": {},\n\"controller\": {},\n\"camera\": {},\n\"log\": {{\"events\": [\n{}\n]}}\n}}\n",
            plain_text_of(&FORMAT),
            plain_text_of(&self.config),
            plain_text_of(&controller),
            plain_text_of(&self.camera),
            events.join(",\n")
        )
    }

    /// Reads what [`SavedRun::to_json`] wrote.
    ///
    /// # Errors
    /// [`AgentError::SavedRun`], with the place where there is one: no JSON, another format, a
    /// missing part, a policy that [`Learned::from_json`](crate::Learned::from_json) refuses, a
    /// belief that is not finite, settings that cannot work.
    pub fn from_json(text: &str) -> Result<Self, AgentError> {
        let refused = |error: BehaviourError| AgentError::SavedRun(error.to_string());
        let document: Document =
            serde_json::from_str(text).map_err(|error| AgentError::SavedRun(error.to_string()))?;
        check_format(&document.format, FORMAT).map_err(refused)?;
        let controller = document.controller.into_controller().map_err(refused)?;
        Ok(Self {
            config: document.config,
            controller,
            camera: document.camera,
            log: document.log,
        })
    }
}

const FORMAT: &str = "grasp-agent run 1";

/// What the JSON holds.
#[derive(Debug, Deserialize)]
struct Document {
    format: String,
    #[serde(deserialize_with = "crate::record::numbers::deserialize")]
    config: AgentConfig,
    #[serde(deserialize_with = "crate::record::numbers::deserialize")]
    controller: ControllerText,
    #[serde(deserialize_with = "crate::record::numbers::deserialize")]
    camera: Camera,
    log: EventLog,
}
