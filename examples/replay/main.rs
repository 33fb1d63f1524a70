//! Replays saved runs and compares them with their logs.
//!
//! ```text
//! cargo run --release --example replay -- out/grasp/failures/run003.json
//! ```

#![allow(clippy::print_stderr, reason = "a program for a terminal")]

use example_support::prelude::*;
use std::path::{Path, PathBuf};

use clap::Parser;
use grasp_agent::{AgentError, RunEvent, SavedRun};

/// Replays runs that `grasp` (failures/, with --save-runs saved/), `track`, `compare_controllers`
/// (--logs) or `ellipse_object` have saved, and reports whether they take the same course.
///
/// A file holds the settings, the controller before the run, and every event. Arm, sensors and
/// camera answer as logged; the controller and the state machine decide anew.
#[derive(Parser, Debug)]
struct Options {
    /// Saved runs
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print every event too
    #[arg(long)]
    events: bool,
}

fn main() -> ExitCode {
    start(run)
}

fn run(options: &Options) -> Outcome {
    let (mut others, mut unread) = (0, 0);
    for file in &options.files {
        // The other files can still be replayed.
        let saved = match read(file) {
            Ok(saved) => saved,
            Err(error) => {
                unread += 1;
                eprintln!("{}: {error}", file.display());
                continue;
            }
        };
        let events = &saved.log().events;
        if options.events {
            for (number, event) in events.iter().enumerate() {
                say!("{number:5} {}", told(event));
            }
        }
        let name = file.display();
        let end = match saved.replay() {
            Ok(outcome) => outcome.gave_up.map_or_else(
                || "grasped (verified by camera only)".into(),
                |reason| reason.to_string(),
            ),
            Err(AgentError::Replay { event, then, now }) => {
                others += 1;
                let told = |event: Option<Box<RunEvent<'static>>>| {
                    event.as_deref().map_or("the end".into(), told)
                };
                say!("{name}: another course from event {event} on");
                say!("  then: {}\n  now:  {}", told(then), told(now));
                continue;
            }
            Err(error @ (AgentError::SavedRun(_) | AgentError::Config(_))) => {
                unread += 1;
                eprintln!("{name}: {error}");
                continue;
            }
            Err(cause) => cause.to_string(),
        };
        say!("{name}: the same {} events; {end}", events.len());
    }
    if others + unread == 0 {
        return Ok(());
    }
    let files = options.files.len();
    Err(format!("{others} of {files} runs took another course, {unread} cannot be replayed").into())
}

/// Reads a run.
fn read(file: &Path) -> Outcome<SavedRun> {
    Ok(SavedRun::from_json(&std::fs::read_to_string(file)?)?)
}

/// Formats an event: its cycle, its kind, and the pose of the arm.
fn told(event: &RunEvent<'_>) -> String {
    format!("{:4} {:?} at {}", event.cycle, event.kind, event.joints)
}
