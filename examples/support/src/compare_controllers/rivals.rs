//! The compared controllers.

use grasp_agent::{
    BehaviourSpec, Controller, Hybrid, HybridSettings, Learned, Servo, ServoLaw as Law,
    ServoSettings, TaughtGoal,
};
use pipeline_sim::MoveForm;
use puma_val2::Arm;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use crate::learning::{
    ACTIONS, ACTIONS_FINE, ArmName, TRIALS, anywhere, learned_whole, paper_cell, simulators,
    until_stopped,
};
use crate::plane::{ExactPlane, search_percepts};
use crate::prelude::*;
use crate::trial::TrialCell;

use crate::compare_controllers::{Options, seed_of};

/// A controller in the comparison.
pub(crate) enum Rival {
    /// A law with its gain, and that far from the goal with the slope between them.
    Servo(Law, f64, Option<[f64; 2]>),
    Learned(Box<Learned>),
    Untaught,
    /// The hybrid, which learns each cell first.
    Hybrid,
}

impl Rival {
    /// Makes the controller for the taught goal if there is one.
    pub(crate) fn controller(
        &self,
        nominal: &TrialCell,
        goal: Option<&TaughtGoal>,
    ) -> Box<dyn Controller> {
        match (self, goal) {
            (Self::Servo(law, gain, adaptive), _) => {
                let paper = ServoSettings::paper();
                let settings = ServoSettings {
                    model: nominal.believed(),
                    poses: match nominal.believed().arm {
                        Arm::Puma(_) => paper.poses,
                        Arm::Serial { .. } => nominal.poses_on_the_way(),
                    },
                    goal: goal.map_or(paper.goal, TaughtGoal::features),
                    gain: *gain,
                    adaptive: *adaptive,
                    ..paper
                };
                Box::new(Servo::new(*law, settings))
            }
            (Self::Learned(learned), None) => learned.clone(),
            (Self::Learned(learned), Some(goal)) => Box::new((**learned).clone().shown(goal)),
            (Self::Untaught | Self::Hybrid, _) => Box::new(new_hybrid(nominal, goal).frozen()),
        }
    }
}

/// Returns all controllers whose names contain the text asked for, with their names.
pub(crate) fn rivals(options: &Options) -> Outcome<Vec<(&'static str, Rival)>> {
    let servos = [
        ("position-based, gain 1", Law::PositionBased, 1.0),
        ("image-based goal J, gain 1", Law::ImageBasedAtGoal, 1.0),
        ("image-based current J, gain 1", Law::ImageBased, 1.0),
        ("position-based, gain 0.5", Law::PositionBased, 0.5),
        ("image-based goal J, gain 0.5", Law::ImageBasedAtGoal, 0.5),
        ("image-based current J, gain 0.5", Law::ImageBased, 0.5),
        ("image-based sphere, gain 1", Law::Sphere, 1.0),
        ("image-based sphere, gain 0.5", Law::Sphere, 0.5),
        ("image-based sphere, adaptive", Law::Sphere, 1.0),
        ("Broyden, gain 1", Law::Broyden, 1.0),
        ("Broyden, gain 0.5", Law::Broyden, 0.5),
        ("gain-scheduled, gain 1", Law::GainScheduled, 1.0),
        ("gain-scheduled, gain 0.7", Law::GainScheduled, 0.7),
        ("gain-scheduled, gain 0.5", Law::GainScheduled, 0.5),
        ("fuzzy rules, gain 1", Law::FuzzyRules, 1.0),
        ("fuzzy rules, gain 0.7", Law::FuzzyRules, 0.7),
        ("look-ahead", Law::LookAhead, 1.0),
    ];
    let servos = servos.map(|(name, law, gain)| {
        let adaptive = name.ends_with("adaptive").then_some([0.4, 1.0]);
        (name, Rival::Servo(law, gain, adaptive))
    });
    let learned = learned(options)?.into_iter();
    let learned = learned.map(|(name, learned)| (name, Rival::Learned(Box::new(learned))));
    let hybrids = [
        ("hybrid, untaught", Rival::Untaught),
        ("hybrid", Rival::Hybrid),
    ];
    let mut rivals: Vec<_> = servos.into_iter().chain(learned).chain(hybrids).collect();
    rivals.retain(|(name, rival)| {
        let degrees = matches!(rival, Rival::Servo(Law::FuzzyRules, ..));
        name.contains(&options.only) && (options.arm == ArmName::Puma || !degrees)
    });
    if rivals.is_empty() {
        return Err(format!("no controller has {:?} in its name", options.only).into());
    }
    Ok(rivals)
}

/// Returns the hybrid before its first move in a cell that is meant to be `nominal`.
pub(crate) fn new_hybrid(nominal: &TrialCell, goal: Option<&TaughtGoal>) -> Hybrid {
    let hybrid = Hybrid::new(HybridSettings {
        nominal: nominal.believed(),
        ..HybridSettings::paper()
    });
    match goal {
        Some(goal) => hybrid.shown(goal),
        None => hybrid,
    }
}

/// Learns the paper's controller without errors, in the regression simulator and in the exact
/// plane. Learns nothing if none of them is compared.
fn learned(options: &Options) -> Outcome<Vec<(&'static str, Learned)>> {
    const NAMES: [&str; 5] = [
        "Q 90, linear regression",
        "Q 90, rigid regression",
        "Q 540, rigid regression",
        "Q 90, exact plane",
        "Q 540, exact plane",
    ];
    let named = NAMES.iter().any(|name| name.contains(&options.only));
    if options.arm != ArmName::Puma || !named {
        return Ok(Vec::new());
    }
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed_of(options.seed, &[0]));
    let forms = [MoveForm::Rigid22, MoveForm::Linear];
    let [rigid, linear] = simulators(&paper_cell(), forms, rng)?;
    let plane = ExactPlane::new(20_000, rng);
    let starts = anywhere(&rigid, TRIALS, rng);
    let found = search_percepts(TRIALS, seed_of(options.seed, &[4]));
    let centering = BehaviourSpec::centering();
    let centering = rigid
        .learn(centering, &starts, ACTIONS.0, rng, &mut until_stopped)?
        .behaviour;
    let (paper, fine) = (BehaviourSpec::approaching, BehaviourSpec::approaching_fine);
    let approaching = [
        linear.learn(paper(), &found, ACTIONS.1, rng, &mut until_stopped)?,
        rigid.learn(paper(), &found, ACTIONS.1, rng, &mut until_stopped)?,
        rigid.learn(fine(), &found, ACTIONS_FINE, rng, &mut until_stopped)?,
        plane.learn(paper(), &found, ACTIONS.1, rng, &mut until_stopped)?,
        plane.learn(fine(), &found, ACTIONS_FINE, rng, &mut until_stopped)?,
    ];
    learned_whole()?;
    let both = approaching.map(|lesson| Learned::new(centering.clone(), lesson.behaviour));
    Ok(NAMES.into_iter().zip(both).collect())
}
