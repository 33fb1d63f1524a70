//! Runs saved with everything that a replay needs: settings, controller, every event.

use serde::{Deserialize, Serialize};

use crate::controller::{Controller, SavedController};
use crate::error::AgentError;
use crate::record::behaviour_json::check_format;
use crate::record::log::{EventLog, numbered};
use crate::run::agent::Agent;
use crate::run::config::AgentConfig;
use crate::run::event::{RunEvent, RunOutcome};
use crate::sight::frozen::{FrozenCheck, Shown};

/// One run with everything needed to repeat it and to compare the results.
///
/// The example `run_agent` of this crate, with `SavedRun::before(&agent)` before the run and
/// `saved.note(event)` for each event, gives a run that is complete in itself:
///
/// ```
/// use grasp_agent::puma_val2::Joints;
/// use grasp_agent::{Agent, AgentConfig, AgentError, Hybrid, HybridSettings, SavedRun};
///
/// fn main() -> Result<(), AgentError> {
///     let pose = Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0]);
///     let hybrid = Hybrid::new(HybridSettings::paper());
///     let agent = Agent::with_controller(AgentConfig::paper([pose]), hybrid)?;
///     let text = SavedRun::before(&agent).to_json();
///     // In another program:
///     let saved = SavedRun::from_json(&text)?;
///     assert_eq!(saved.config(), agent.config());
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SavedRun {
    config: AgentConfig,
    controller: Option<SavedController>,
    camera: Camera,
    log: EventLog,
}

/// State of the frozen-camera check before the run. The agent counts equal frames across runs.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Camera {
    from: puma_val2::Joints,
    showed: bool,
    same: usize,
    late: Option<usize>,
}

impl SavedRun {
    /// Starts the record of a run that `agent` is about to make. [`SavedRun::note`] then records
    /// each event.
    ///
    /// Search, recovery and supervision modules that replace the configured ones are not saved;
    /// use [`EventLog::replay`] for such a run.
    pub fn before<C: Controller>(agent: &Agent<C>) -> Self {
        let camera = agent.camera();
        Self {
            config: agent.config().clone(),
            controller: agent.controller().save(),
            camera: Camera {
                from: camera.from,
                showed: camera.shown.is_some(),
                same: camera.same(),
                late: camera.late,
            },
            log: EventLog::default(),
        }
    }

    /// Records an event.
    pub fn note(&mut self, event: &RunEvent<'_>) {
        self.log.note(event);
    }

    /// Returns the events.
    pub fn log(&self) -> &EventLog {
        &self.log
    }

    /// Returns the settings of the agent.
    pub fn config(&self) -> &AgentConfig {
        &self.config
    }

    /// Returns the controller in its state before the run; `None` for one that cannot be saved.
    pub fn controller(&self) -> Option<&SavedController> {
        self.controller.as_ref()
    }

    /// Repeats the run with the saved controller and the recorded answers of arm, sensors and
    /// camera. Returns the outcome of the run.
    ///
    /// # Errors
    /// [`AgentError::SavedRun`] if the controller cannot be made again, and those of
    /// [`SavedRun::replay_with`].
    pub fn replay(&self) -> Result<RunOutcome, AgentError> {
        let Some(controller) = &self.controller else {
            let what = "its controller was not saved; replay it with a controller of yours";
            return Err(AgentError::SavedRun(what.into()));
        };
        let controller = controller.controller();
        self.replay_with(controller.map_err(|error| AgentError::SavedRun(error.to_string()))?)
    }

    /// Repeats the run with this controller and the recorded answers of arm, sensors and camera.
    ///
    /// # Errors
    /// [`AgentError::Config`] if the settings are invalid, [`AgentError::Replay`] at the first
    /// event that differs; otherwise the error that the run ended with, if any.
    pub fn replay_with(&self, controller: impl Controller) -> Result<RunOutcome, AgentError> {
        let camera = FrozenCheck {
            from: self.camera.from,
            shown: self.camera.showed.then(|| Shown::Frame(numbered(0))),
            same: self.camera.same,
            late: self.camera.late,
        };
        let agent = Agent::with_controller(self.config.clone(), controller)?.with_camera(camera);
        Ok(self.log.replay_by(agent)?.0)
    }

    /// Returns the run as JSON: format, settings, controller, camera state, and one event per line.
    /// A joint angle that is not finite becomes `null`.
    pub fn to_json(&self) -> String {
        let events: Vec<String> = self.log.events.iter().map(line).collect();
        format!(
            "{{\n\"format\": {},\n\"config\": {},\n\"controller\": {},\n\"camera\": {},\n\
             \"log\": {{\"events\": [\n{}\n]}}\n}}\n",
            line(&FORMAT),
            line(&self.config),
            line(&self.controller),
            line(&self.camera),
            events.join(",\n")
        )
    }

    /// Reads a run that [`SavedRun::to_json`] has written.
    ///
    /// # Errors
    /// [`AgentError::SavedRun`] names the fault and its place: text that is not JSON, another or an
    /// earlier format, a missing part, invalid settings.
    pub fn from_json(text: &str) -> Result<Self, AgentError> {
        let refused = |error: serde_json::Error| AgentError::SavedRun(error.to_string());
        // The format comes first, since another one may lack the other parts.
        let head: Head = serde_json::from_str(text).map_err(refused)?;
        let format = check_format(&head.format, FORMAT);
        format.map_err(|error| AgentError::SavedRun(error.to_string()))?;
        let run: Self = serde_json::from_str(text).map_err(refused)?;
        run.config.check().map_err(AgentError::SavedRun)?;
        Ok(run)
    }
}

const FORMAT: &str = "grasp-agent run 7";

#[derive(Debug, Deserialize)]
struct Head {
    format: String,
}

/// Returns JSON in one line. The documents here have text keys only, so writing cannot fail.
fn line(document: &impl Serialize) -> String {
    serde_json::to_string(document).unwrap_or_default()
}
