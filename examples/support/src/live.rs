//! A page that shows a run while it lasts (feature `live`), to any number of viewers.
//!
//! Without the feature, and without `--live`, nothing is served and the calls do nothing.

#[cfg(feature = "live")]
mod server;

use grasp_agent::{GoalInterval, RunEvent};
use image::RgbImage;
use qtable::Record;

use crate::program::Outcome;

/// The page of a program, if it has one.
#[derive(Debug, Default)]
pub struct Live {
    #[cfg(feature = "live")]
    server: Option<server::Server>,
}

impl Live {
    /// Serves the page at `address` (HOST:PORT) if there is one.
    ///
    /// # Errors
    /// An address that cannot be served at.
    pub fn at(address: Option<&str>) -> Outcome<Self> {
        #[cfg(feature = "live")]
        return Ok(Self {
            server: address.map(server::Server::start).transpose()?,
        });
        #[cfg(not(feature = "live"))]
        match address {
            None => Ok(Self::default()),
            Some(_) => Err("built without the page: give cargo --features live".into()),
        }
    }

    /// Returns the address of the page for a browser, with the token that its Stop button needs.
    pub fn url(&self) -> Option<&str> {
        #[cfg(feature = "live")]
        return self.server.as_ref().map(server::Server::url);
        #[cfg(not(feature = "live"))]
        None
    }

    /// Shows how far the learning of the behaviour `name` has come.
    pub fn curve(&self, name: &str, record: &Record) {
        #[cfg(feature = "live")]
        if let Some(server) = &self.server {
            server.tell(&serde_json::json!({
                "type": "curve",
                "name": name,
                "actions": record.actions,
                "success": record.success_share,
            }));
        }
        #[cfg(not(feature = "live"))]
        let _ = (name, record);
    }

    /// Shows the goal of the runs to come.
    pub fn goal(&self, goal: &[GoalInterval]) {
        #[cfg(feature = "live")]
        if let Some(server) = &self.server {
            server.tell(&serde_json::json!({ "type": "goal", "goal": goal }));
        }
        #[cfg(not(feature = "live"))]
        let _ = goal;
    }

    /// Shows an event of run number `run`, with its frame if there is one.
    pub fn event(&self, run: usize, event: &RunEvent<'_>, frame: Option<&RgbImage>) {
        #[cfg(feature = "live")]
        if let Some(server) = &self.server {
            let frame = frame.and_then(|frame| server.show(frame));
            server.tell(&serde_json::json!({
                "type": "event",
                "run": run,
                "frame": frame,
                "event": event,
            }));
        }
        #[cfg(not(feature = "live"))]
        let _ = (run, event, frame);
    }

    /// Shows the end of the program in words, and gives viewers time to read it.
    pub fn end(&self, words: &str) {
        #[cfg(feature = "live")]
        if let Some(server) = &self.server {
            server.tell(&serde_json::json!({ "type": "end", "words": words }));
            server.leave();
        }
        #[cfg(not(feature = "live"))]
        let _ = words;
    }
}
