//! Late images: how late they are is measured by a small move, and they are dropped.

use crate::error::AgentError;
use crate::run::event::EventKind;
use crate::run::state_machine::acting::Went;
use crate::run::state_machine::{Run, State, lost};

/// Largest number of looks by which an image can be late.
const LATEST: usize = 8;

/// Least displacement in the image by a small move, feature units.
const DISPLACED: f64 = 5.0;

impl Run<'_> {
    pub(super) fn has_to_measure_lag(&self) -> bool {
        self.config.lag_check.is_some() && self.camera.late.is_none()
    }

    /// Drops the images that may show the pose before the last move.
    pub(super) fn drop_late_images(&mut self) -> Result<(), AgentError> {
        let unknown = self.config.lag_check.map_or(0, |_| LATEST);
        let late = self.camera.late.unwrap_or(unknown);
        for _ in 0..if std::mem::take(&mut self.moved) {
            late
        } else {
            0
        } {
            self.devices.eye.look()?;
            self.tell(EventKind::Dropped);
        }
        Ok(())
    }

    /// Measures by a small move how many looks an image is late, and goes back.
    pub(super) fn measure_lag(&mut self) -> Result<State, AgentError> {
        let (from, delta) = (self.joints, self.config.lag_check.unwrap_or_default());
        let Some(before) = self.look()? else {
            return Ok(State::Search);
        };
        let target = self.modules.supervision.limits().nearest(&(from + delta));
        if self.go_to(target, EventKind::Moved(delta))? == Went::There {
            let mut looks = 0;
            loop {
                let now = self.look_once()?;
                let displaced = now.is_none_or(|now| {
                    let (now, before) = (now.features, before.features);
                    (now.x - before.x).hypot(now.y - before.y) > DISPLACED
                });
                if displaced {
                    break;
                }
                looks += 1;
                if looks > LATEST {
                    return Err(AgentError::Unchanged { looks });
                }
            }
            self.camera.late = Some(looks);
            self.tell(EventKind::Late(looks));
            self.go_to(from, EventKind::TakenBack)?;
        }
        let ball = self.look()?;
        Ok(ball.map_or(lost(before, from), State::Reach))
    }
}
