//! Knowledge of the controllers: goals shown on the arm, policies and beliefs, learned or read.

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use grasp_agent::{
    AgentConfig, Behaviour, BehaviourPair, BehaviourSpec, Belief, CameraEye, CameraModel,
    Controller, Decision, Eye, Feedback, GaveUp, Hybrid, HybridSettings, JointLimits, Learned,
    Lesson, Percept, Request, SavedController, ServoSettings, Sighting, TaughtGoal,
};
use hough_heuristic::{CircleDetector, Features};
use pipeline_sim::{MoveSample, Workspace};
use puma_grasp::{Rig, RigParts, Simulator};
use puma_val2::Joints;
use rand::Rng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::files::writable_folder;
use example_support::learning::{
    ACTIONS, ACTIONS_FINE, FEATURE_NOISE, SAMPLES, TRIALS, anywhere, paper_cell, until_stopped,
};
use example_support::live::Live;
use example_support::plane::search_percepts;
use example_support::prelude::*;
use example_support::program::stopped;
use example_support::trial::ball_in_view;

use crate::options::{Options, RewardName};

/// Controllers that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ControllerName {
    /// The two learned behaviours of the paper
    Learned,
    /// A servo that calibrates its own camera model from run to run, as in camera.belief
    Hybrid,
}

/// A controller of either kind.
#[derive(Clone, Debug)]
pub(crate) enum Mind {
    Learned(Box<Learned>),
    Hybrid(Box<Hybrid>),
}

impl Controller for Mind {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        match self {
            Self::Learned(mind) => mind.decide(ball, request),
            Self::Hybrid(mind) => mind.decide(ball, request),
        }
    }

    fn notice(&mut self, feedback: &Feedback) {
        match self {
            Self::Learned(mind) => mind.notice(feedback),
            Self::Hybrid(mind) => mind.notice(feedback),
        }
    }

    fn describe(&self) -> &str {
        match self {
            Self::Learned(mind) => mind.describe(),
            Self::Hybrid(mind) => mind.describe(),
        }
    }

    fn save(&self) -> Option<SavedController> {
        match self {
            Self::Learned(mind) => mind.save(),
            Self::Hybrid(mind) => mind.save(),
        }
    }
}

/// A rig and the detector for its frames.
pub(crate) type Seeing<'a> = (&'a mut Rig, &'a mut dyn CircleDetector);

/// Returns the goal of the ball: shown on the arm if asked for, otherwise the paper's for a ball of
/// another size; `None` for the paper's own.
pub(crate) fn goal(options: &Options, seeing: &mut Seeing<'_>) -> Outcome<Option<TaughtGoal>> {
    let paper = AgentConfig::paper(Workspace::paper().search_poses());
    let from = Joints::from_degrees(ServoSettings::GOAL_POSE);
    if !options.teach_goal {
        return options.real.goal(&paper);
    }
    let features = seen_after_the_grip(options, &paper, from, seeing)?;
    let goal = TaughtGoal::new(&paper.goal, features, from, paper.grip);
    Ok(Some(goal.ok_or("the goal has no radius")?))
}

/// Takes the grip's turn back from a ball between the open jaws, and returns what the camera then
/// sees, the median of several looks.
fn seen_after_the_grip(
    options: &Options,
    paper: &AgentConfig,
    from: Joints,
    (rig, detector): &mut Seeing<'_>,
) -> Outcome<Features> {
    /// Number of looks; half of them have to show a ball.
    const LOOKS: usize = 9;
    rig.clear_for(from + paper.grip)?;
    if rig.is_simulated() {
        let pose = rig.pose()();
        rig.cell()
            .with(|cell| cell.place_ball(cell.tool_point(&pose)));
    } else {
        options
            .real
            .ask("Put the ball between the open jaws, then press Enter. ")?;
    }
    let RigParts { camera, arm, .. } = rig.parts();
    arm.move_to(from)?;
    let mut eye = CameraEye::new(camera, &mut **detector);
    let mut seen: Vec<Features> = Vec::new();
    for _ in 0..LOOKS {
        seen.extend(eye.look()?.map(|seen| seen.features));
    }
    if 2 * seen.len() < LOOKS {
        let (count, all) = (seen.len(), LOOKS);
        return Err(format!(
            "the ball shows in {count} of {all} frames after the grip's turn was taken back; \
             check the light, --ball-radius, and that the camera looks along the jaws"
        )
        .into());
    }
    let mut median = |of: fn(&Features) -> f64| {
        seen.sort_by(|a, b| of(a).total_cmp(&of(b)));
        of(&seen[seen.len() / 2])
    };
    let shown = Features::new(median(|f| f.x), median(|f| f.y), median(|f| f.r));
    let (x, y, r) = (shown.x, shown.y, shown.r);
    options.say(format_args!(
        "goal shown on the arm: x {x:.1} y {y:.1} r {r:.1}"
    ));
    Ok(shown)
}

/// Samples moves to fit the simulator to: on the arm if asked for, otherwise in the cell.
fn samples(
    options: &Options,
    goal: Option<&TaughtGoal>,
    (rig, detector): &mut Seeing<'_>,
    rng: &mut Xoshiro256PlusPlus,
) -> Outcome<(Vec<MoveSample>, Vec<MoveSample>)> {
    let cell = rig.cell().get();
    let Some(count) = options.sample else {
        options.say(format_args!("sampling {SAMPLES} moves in the cell"));
        return Ok(cell.sample_moves(SAMPLES, FEATURE_NOISE, rng)?);
    };
    options.say(format_args!(
        "sampling {count} moves of JT1, and as many of JT2 and JT3, on the arm"
    ));
    if rig.is_simulated() {
        let ball = ball_in_view(rig.cell(), rng)?;
        rig.place(&ball)?;
    } else {
        rig.clear_for(Joints::READY)?;
        options
            .real
            .ask("Put the ball on its stand, then press Enter. ")?;
    }
    let bar = progress_bar(2 * count as u64, "moves", options.quiet);
    let RigParts { camera, arm, .. } = rig.parts();
    let mut eye = CameraEye::new(camera, &mut **detector);
    let path = options.out.join("samples.csv");
    let columns = "x,y,r,jt3,d1,d2,d3,x_after,y_after,r_after";
    let (mut table, mut written) = (Table::create(path.clone(), columns)?, Ok(()));
    let taken = Simulator::sample_on_arm(&mut eye, arm, &cell, count, rng, &mut |sample| {
        bar.inc(1);
        written = table.row(row_of(sample));
        match written.is_err() || stopped() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    bar.finish_and_clear();
    written?;
    if stopped() {
        let (count, path) = (bar.position(), path.display());
        return Err(
            format!("stopped by a signal; the {count} samples so far are in {path}").into(),
        );
    }
    let mut taken = taken?;
    // The behaviours are learned at the paper's goal, to which those of the ball are moved.
    let there = |features| {
        let seen = Sighting::new(features);
        goal.map_or(seen, |goal| goal.as_untaught(&seen)).features
    };
    for sample in taken.0.iter_mut().chain(&mut taken.1) {
        (sample.before, sample.after) = (there(sample.before), there(sample.after));
    }
    Ok(taken)
}

fn row_of(sample: &MoveSample) -> String {
    let (f, after) = (sample.before, sample.after);
    let [d1, d2, d3] = sample.turns;
    format!(
        "{:.2},{:.2},{:.2},{:.3},{d1:.3},{d2:.3},{d3:.3},{:.2},{:.2},{:.2}",
        f.x, f.y, f.r, sample.jt3_degrees, after.x, after.y, after.r
    )
}

/// Learned behaviours.
pub(crate) struct Taught {
    pub(crate) learned: Learned,
    pub(crate) limits: JointLimits,
}

/// The training so far; empty if the behaviours were read from files.
#[derive(Default)]
pub(crate) struct Training {
    /// Centering and approaching as they were learned.
    pub(crate) lessons: Vec<Lesson>,
    /// Fit of each output of the simulator.
    pub(crate) r2: BTreeMap<String, f64>,
}

impl Training {
    /// Adds a lesson. If a signal has ended it, saves all that was learned to a folder of its own.
    ///
    /// # Errors
    /// A signal.
    fn add(&mut self, options: &Options, lesson: Lesson, planned: u64) -> Outcome {
        let (name, made) = (
            lesson.behaviour.spec().name.clone(),
            lesson.curve.last().map_or(0, |record| record.actions),
        );
        self.lessons.push(lesson);
        if !stopped() {
            return Ok(());
        }
        let folder = options.out.join("unfinished");
        writable_folder(&folder)?;
        for lesson in &self.lessons {
            let path = policy_path(&folder, lesson.behaviour.spec());
            lesson.behaviour.save(&path)?;
        }
        let folder = folder.display();
        Err(format!(
            "stopped by a signal after {made} of {planned} actions of {name}; what was learned is \
             in {folder}"
        )
        .into())
    }
}

impl Taught {
    /// Samples moves, fits the regression simulator, learns both behaviours in it, and saves them.
    pub(crate) fn train(
        options: &Options,
        live: &Live,
        pair: &BehaviourPair,
        goal: Option<&TaughtGoal>,
        seeing: &mut Seeing<'_>,
        training: &mut Training,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Outcome<Self> {
        for spec in [&pair.centering, &pair.approaching] {
            let _ = fs::remove_file(policy_path(&options.out.join("unfinished"), spec));
        }
        let (centering, reaching) = samples(options, goal, seeing, rng)?;
        let fitted = Simulator::fit(&centering, &reaching, options.form());
        let mut simulator = fitted.map_err(|error| match options.sample {
            Some(count) => format!("{error}; more than --sample {count} are needed"),
            None => error.to_string(),
        })?;
        if options.sample.is_some() {
            let (_, anywhere) = paper_cell().sample_moves(SAMPLES, FEATURE_NOISE, rng)?;
            simulator = simulator.starting_from(&anywhere);
        }
        for quality in simulator.quality() {
            let (output, fit, rmse) = (quality.output, quality.r2, quality.rmse);
            options.say(format_args!(
                "  {output:<16} R² {fit:.4}   rmse {rmse:.2} units"
            ));
            training.r2.insert(output, fit);
        }
        // With the literal rewards the last table is kept.
        let trials = match options.reward() {
            RewardName::Literal => 0,
            RewardName::Mended => TRIALS,
        };
        let starts = anywhere(&simulator, trials, rng);
        let mut teach = |spec: &BehaviourSpec, trials: &[Percept], actions| {
            teach((options, live), spec, &simulator, trials, actions, rng)
        };
        let first = teach(&pair.centering, &starts, ACTIONS.0)?;
        training.add(options, first, ACTIONS.0)?;
        let found = search_percepts(trials, options.seed);
        let actions = if options.fine {
            ACTIONS_FINE
        } else {
            ACTIONS.1
        };
        let second = teach(&pair.approaching, &found, actions)?;
        training.add(options, second, actions)?;

        // Uses the policies as saved.
        for lesson in &training.lessons {
            let path = policy_path(&options.out, lesson.behaviour.spec());
            lesson.behaviour.save(&path)?;
        }
        options.say(format_args!("policies saved to {}", options.out.display()));
        Self::load(&options.out, pair)
    }

    /// Reads saved policies: a folder with two of them, or an exported file.
    pub(crate) fn load(path: &Path, pair: &BehaviourPair) -> Outcome<Self> {
        let (learned, limits) = if path.is_file() {
            let name = path.display();
            let text = fs::read_to_string(path)
                .map_err(|error| format!("{name}: cannot be read: {error}"))?;
            let (learned, config) =
                Learned::from_json(&text).map_err(|error| format!("{name}: {error}"))?;
            let found = [learned.centering(), learned.approaching()].map(Behaviour::spec);
            let asked = [&pair.centering, &pair.approaching];
            if found.map(|spec| &spec.goal) != asked.map(|spec| &spec.goal) {
                let advice = "learned for another goal; give the --y-goal it was learned with";
                return Err(format!("{name}: {advice}").into());
            }
            (learned, config.limits)
        } else {
            let [centering, approaching] = [&pair.centering, &pair.approaching]
                .map(|spec| Behaviour::load(&policy_path(path, spec), spec));
            (Learned::new(centering?, approaching?), JointLimits::paper())
        };
        Ok(Self { learned, limits })
    }
}

/// Saves both policies to the output folder.
pub(crate) fn save(options: &Options, learned: &Learned) -> Outcome {
    for behaviour in [learned.centering(), learned.approaching()] {
        behaviour.save(&policy_path(&options.out, behaviour.spec()))?;
    }
    Ok(())
}

/// Writes the policy as JSON if asked for.
pub(crate) fn export(options: &Options, learned: &Learned, config: &AgentConfig) -> Outcome {
    let Some(path) = &options.export else {
        return Ok(());
    };
    let made_by = options.made_by();
    let text = learned.to_json(config, &CameraModel::paper(), &made_by);
    write_whole(path, text.as_bytes())?;
    options.say(format_args!("policy exported to {}", path.display()));
    Ok(())
}

fn policy_path(folder: &Path, spec: &BehaviourSpec) -> PathBuf {
    folder.join(format!("{}.policy", spec.name))
}

pub(crate) fn behaviours(options: &Options) -> Outcome<BehaviourPair> {
    let mut pair = match options.reward() {
        RewardName::Mended => BehaviourPair::paper_mended(),
        RewardName::Literal => BehaviourPair::paper_literal(),
    };
    if options.fine {
        let (paper, fine) = (pair, BehaviourPair::fine());
        pair = fine;
        pair.centering.reward = paper.centering.reward;
        pair.approaching.reward = paper.approaching.reward;
    }
    Ok(pair.with_y_goal(options.y_goal.goal())?)
}

fn teach(
    (options, live): (&Options, &Live),
    spec: &BehaviourSpec,
    simulator: &Simulator,
    trials: &[Percept],
    actions: u64,
    rng: &mut dyn Rng,
) -> Outcome<Lesson> {
    let bar = progress_bar(actions, &format!("{} actions", spec.name), options.quiet);
    let lesson = simulator.learn(spec.clone(), trials, actions, rng, &mut |progress| {
        bar.set_position(progress.actions);
        live.curve(&spec.name, progress);
        until_stopped(progress)
    })?;
    bar.finish_and_clear();
    let success = lesson.curve.last().and_then(|record| record.success_share);
    let success = success.map_or("-".into(), |share| format!("{:.1} %", 100.0 * share));
    options.say(format_args!(
        "learned {}: {} states x {} actions, {actions} actions; goal reached in the last \
         episodes: {success}",
        spec.name,
        spec.states(),
        spec.actions()
    ));
    Ok(lesson)
}

/// Creates the hybrid controller, with the belief of an earlier run if there is one.
pub(crate) fn hybrid(options: &Options, goal: Option<&TaughtGoal>) -> Outcome<Hybrid> {
    let mut settings = HybridSettings::paper();
    settings.nominal.ball_radius = options.real.ball_radius / 1000.0;
    settings.goal.r *= options.real.ball_size();
    let hybrid = match &options.belief {
        Some(path) => Hybrid::with_belief(settings, Belief::load(path)?),
        None => Hybrid::new(settings),
    };
    let shown = goal.filter(|_| options.teach_goal);
    Ok(shown.map_or_else(|| hybrid.clone(), |goal| hybrid.clone().shown(goal)))
}
