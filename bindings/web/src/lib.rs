//! The simulated cell, learning and reaching, for the page that `grasp --live` serves, without the
//! program: the camera's frames are rendered, and the arm is moved through VAL II text by an
//! emulated controller, all inside of the browser's tab.
//!
//! The functions are called by number and answer with a text: JSON in the words of the live page.
//! They need no glue between Rust and JavaScript.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::Arc;

use puma_grasp::grasp_agent::{Agent, AgentConfig, BehaviourPair, Learned, Percept, RunEvent};
use puma_grasp::pipeline_sim::{Ball, Cell, MoveForm, Scene, Workspace};
use puma_grasp::{BallDetector, Rig, Simulator};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use serde_json::{Value, json};

/// Moves sampled for the regression, and noise of their features in feature units.
const SAMPLES: (usize, f64) = (2_500, 0.5);
/// Actions to learn from, centering and approaching.
const ACTIONS: (u64, u64) = (60_000, 500_000);
/// Trials in the simulator by which the best table is chosen.
const TRIALS: usize = 500;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// What was learned, and the answer to the last call.
#[derive(Default)]
struct Tab {
    learned: Option<Learned>,
    text: String,
    frames: Vec<Vec<u8>>,
    size: (u32, u32),
}

thread_local! {
    static TAB: RefCell<Tab> = RefCell::default();
}

/// Keeps the answer of a call. Returns 1, or 0 if the answer is an error.
fn answer(act: impl FnOnce(&mut Tab) -> Outcome<Vec<Value>>) -> u32 {
    TAB.with_borrow_mut(|tab| {
        let answered = act(tab);
        let fine = u32::from(answered.is_ok());
        let told = answered.unwrap_or_else(|error| vec![json!({ "error": error.to_string() })]);
        tab.text = Value::from(told).to_string();
        fine
    })
}

/// Samples moves, fits the simulator, and learns both behaviours in it. Tells the learning curves.
#[unsafe(no_mangle)]
pub extern "C" fn learn(seed: u32) -> u32 {
    answer(|tab| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.into());
        let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        let (centering, reaching) = cell.sample_moves(SAMPLES.0, SAMPLES.1, &mut rng)?;
        let simulator = Simulator::fit(&centering, &reaching, MoveForm::Rigid22)?;
        let pair = BehaviourPair::paper_mended();
        let mut told = Vec::new();
        let mut teach = |name, spec, trials: &[Percept], actions, rng: &mut Xoshiro256PlusPlus| {
            simulator.learn(spec, trials, actions, rng, &mut |record| {
                told.push(json!({
                    "type": "curve",
                    "name": name,
                    "actions": record.actions,
                    "success": record.success_share,
                }));
                ControlFlow::Continue(())
            })
        };
        let starts: Vec<_> = (0..TRIALS).map(|_| simulator.start(&mut rng)).collect();
        let centering = teach("centering", pair.centering, &starts, ACTIONS.0, &mut rng)?;
        let found = found_by_search(&mut rng);
        let approaching = teach("approaching", pair.approaching, &found, ACTIONS.1, &mut rng)?;
        tab.learned = Some(Learned::new(centering.behaviour, approaching.behaviour));
        Ok(told)
    })
}

/// Draws percepts of balls that a search has found and centered.
fn found_by_search(rng: &mut Xoshiro256PlusPlus) -> Vec<Percept> {
    let workspace = Workspace::paper();
    let seen = (0..TRIALS).filter_map(|_| {
        let cell = Cell::paper(workspace.sample_ball(rng));
        let mut joints = workspace.search_poses()[0];
        joints.0[0] = cell.goal_pose(Cell::REACHING_JT5_DEGREES).ok()?.0[0];
        Some(Percept::new(cell.features(&joints).ok()?, &joints))
    });
    seen.collect()
}

/// Lays a ball somewhere, and lets the agent search, reach and grasp it. Tells the events, each
/// with the number of its frame from 1.
#[unsafe(no_mangle)]
pub extern "C" fn reach(seed: u32) -> u32 {
    answer(|tab| {
        let learned = tab.learned.clone().ok_or("nothing is learned yet")?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.into());
        let mut rig = Rig::emulated(false, &Scene::bright_ball(), seed.into(), &Arc::default())?;
        let mut detector = BallDetector::AContrario.build(seed.into())?;
        let workspace = Workspace::paper();
        let (ball, _) = workspace
            .sample_seen_ball(&rig.cell().get(), &mut rng)
            .ok_or("no place of the workspace is in view")?;
        rig.place(&ball)?;
        let config = AgentConfig {
            goal: BehaviourPair::paper_mended().goal(),
            ..AgentConfig::paper(workspace.search_poses())
        };
        let mut agent = Agent::with_controller(config, learned)?;
        tab.frames.clear();
        let mut told = Vec::new();
        let mut observe = |event: &RunEvent<'_>| {
            let frame = event.frame.map(|frame| {
                tab.size = frame.dimensions();
                tab.frames.push(frame.as_raw().clone());
                tab.frames.len()
            });
            told.push(json!({ "type": "event", "frame": frame, "event": event }));
        };
        let outcome = rig.run(&mut agent, &mut *detector, &mut observe)?;
        let held = rig.holds_ball();
        let words = match outcome.gave_up {
            None if held => "grasped".to_owned(),
            None => "closed beside the ball".to_owned(),
            Some(reason) => reason.to_string(),
        };
        told.push(json!({ "type": "end", "words": words }));
        Ok(told)
    })
}

/// Returns the address of the last answer.
#[unsafe(no_mangle)]
pub extern "C" fn text() -> *const u8 {
    TAB.with_borrow(|tab| tab.text.as_ptr())
}

/// Returns the length of the last answer, in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn text_length() -> usize {
    TAB.with_borrow(|tab| tab.text.len())
}

/// Returns the address of a frame of the last reach, counted from 1: a byte of gray for each pixel,
/// row by row. Null if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn frame(number: usize) -> *const u8 {
    TAB.with_borrow(|tab| {
        let frame = number
            .checked_sub(1)
            .and_then(|index| tab.frames.get(index));
        frame.map_or(std::ptr::null(), |frame| frame.as_ptr())
    })
}

/// Returns the width of the frames, pixels.
#[unsafe(no_mangle)]
pub extern "C" fn frame_width() -> u32 {
    TAB.with_borrow(|tab| tab.size.0)
}

/// Returns the height of the frames, pixels.
#[unsafe(no_mangle)]
pub extern "C" fn frame_height() -> u32 {
    TAB.with_borrow(|tab| tab.size.1)
}
