//! The command line.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Parser, ValueEnum};
use grasp_agent::YGoal;
use puma_grasp::BallDetector;

/// Learn to reach a ball in simulation, then see, reach and grasp it with a (simulated) PUMA 560
/// through VAL II.
///
/// Without options everything runs here: a controller emulator is started on a pseudo-terminal,
/// opened like a serial line, and the camera's frames are rendered from the pose of the emulated
/// arm.
#[derive(Parser, Debug)]
pub(crate) struct Options {
    /// Folder for the results, among them each run that failed, for the example replay (failures/);
    /// made if need be, files of an earlier run in it are replaced
    #[arg(long, value_name = "DIR", default_value = "out/grasp")]
    pub(crate) out: PathBuf,

    /// Seed of everything random; the same seed gives the same run
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub(crate) seed: u64,

    /// How many balls to go for
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = at_least_one)]
    pub(crate) runs: usize,

    /// Serial device of a VAL II controller (or of an emulator), 9600 8N1, instead of starting one
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    pub(crate) port: Option<String>,

    /// Socket of a VAL II controller behind a terminal server (or of an emulator), as HOST:PORT
    #[arg(long, value_name = "ADDR")]
    pub(crate) tcp: Option<String>,

    /// What was learned before: a folder with centering.policy and approaching.policy of an earlier
    /// run, or a file written by --export; skips training. A folder is read with the --fine and
    /// --reward that it was learned with; a file says itself what is in it
    #[arg(long, value_name = "PATH", conflicts_with = "simulator")]
    pub(crate) policy: Option<PathBuf>,

    /// Write the policy as JSON that other programs can run, as docs/run_policy.py does
    #[arg(long, value_name = "FILE")]
    pub(crate) export: Option<PathBuf>,

    /// Keep every run for the example replay (saved/), not only those that fail
    #[arg(long)]
    pub(crate) save_runs: bool,

    /// Go on learning at work, and save what was learned to the output folder
    #[arg(long)]
    pub(crate) keep_learning: bool,

    /// How the circle is found
    #[arg(long, value_name = "NAME", default_value_t, value_parser = detectors())]
    pub(crate) detector: BallDetector,

    /// Reward while learning: the paper's formulas as printed do not teach the goal [default:
    /// mended]
    #[arg(long, value_enum)]
    pub(crate) reward: Option<RewardName>,

    /// Learn approaching on 540 states instead of 90: fewer moves, longer training
    #[arg(long)]
    pub(crate) fine: bool,

    /// Which of the paper's two goal intervals of y
    #[arg(long, value_enum, default_value_t = YGoalName::Equation6)]
    pub(crate) y_goal: YGoalName,

    /// Form of the regression simulator [default: rigid22]
    #[arg(long, value_enum)]
    pub(crate) simulator: Option<FormName>,

    /// Let the emulated arm take the time that a real one would
    #[arg(long, conflicts_with_all = ["port", "tcp"])]
    pub(crate) realtime: bool,

    /// Print the final table only
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl Options {
    /// The reward asked for.
    pub(crate) fn reward(&self) -> RewardName {
        self.reward.unwrap_or(RewardName::Mended)
    }

    /// Refuses what would have no effect.
    pub(crate) fn check(&self) -> Result<(), String> {
        match &self.policy {
            Some(path) if path.is_file() && (self.fine || self.reward.is_some()) => Err(format!(
                "{}: an exported policy says itself how it was learned; leave out --fine and --reward",
                path.display()
            )),
            _ => Ok(()),
        }
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least one ball is needed".into()),
        Ok(count) => Ok(count),
        Err(error) => Err(format!("{error}")),
    }
}

fn detectors() -> impl TypedValueParser<Value = BallDetector> {
    let names = BallDetector::ALL.map(BallDetector::name);
    PossibleValuesParser::new(names).try_map(|name| name.parse())
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum YGoalName {
    /// 74 to 82
    Equation6,
    /// 74 to 92: the hand stops farther from where the grip is aimed
    Section4,
}

impl YGoalName {
    pub(crate) fn goal(self) -> YGoal {
        match self {
            Self::Equation6 => YGoal::Equation6,
            Self::Section4 => YGoal::Section4,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum RewardName {
    /// Eq. 5 and 6 with denominators of at least 1 and an absorbing goal
    Mended,
    /// Eq. 5 and 6 as printed
    Literal,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum FormName {
    /// Changes of y and r, linear in the joint moves, per elbow interval (the paper's)
    Linear,
    /// Changes of 1/r and y/r, 8 terms
    Rigid8,
    /// Changes of 1/r and y/r, 22 terms
    Rigid22,
}
