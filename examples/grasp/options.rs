//! The command line.

use std::path::PathBuf;

use example_support::prelude::*;

use clap::{Parser, ValueEnum};
use grasp_agent::GoalInterval;
use pipeline_sim::MoveForm;
use puma_grasp::BallDetector;

use example_support::real::RealOptions;

use crate::taught::ControllerName;

/// Learns to reach a ball in simulation, then sees, reaches and grasps balls with a PUMA 560
/// through VAL II.
///
/// Without options no hardware is needed: a controller emulator is started on a pseudo-terminal and
/// opened like a serial line, and camera frames are rendered from the pose of the emulated arm.
#[derive(Parser, Debug)]
pub(crate) struct Options {
    /// Folder for the results, created if missing. Failed runs go to failures/ for the example
    /// replay; files of an earlier run are replaced
    #[arg(long, value_name = "DIR", default_value = "out/grasp")]
    pub(crate) out: PathBuf,
    /// Seed of all random draws; the same seed gives the same run
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub(crate) seed: u64,
    /// Number of balls [default: 20, with --camera 1]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    runs: Option<usize>,
    #[command(flatten)]
    pub(crate) real: RealOptions,
    /// Controller of the arm
    #[arg(long, value_enum, default_value_t = ControllerName::Learned)]
    pub(crate) controller: ControllerName,
    /// Show the goal on the arm first: the ball is put between the open jaws
    #[arg(long)]
    pub(crate) teach_goal: bool,
    /// Sample N moves of each behaviour on the arm for the regression simulator, as the paper did,
    /// instead of 2500 in the simulated cell
    #[arg(long, value_name = "N", conflicts_with = "policy", value_parser = enough)]
    pub(crate) sample: Option<usize>,
    /// Start the hybrid controller from the camera.belief of an earlier run
    #[arg(long, value_name = "FILE")]
    pub(crate) belief: Option<PathBuf>,
    /// Policy of an earlier run; skips training. A folder with centering.policy and
    /// approaching.policy is read with the --fine and --reward it was learned with; a file written
    /// by --export needs neither
    #[arg(long, value_name = "PATH", conflicts_with = "simulator")]
    pub(crate) policy: Option<PathBuf>,
    /// Write the policy as JSON for other programs; docs/run_policy.py runs it
    #[arg(long, value_name = "FILE")]
    pub(crate) export: Option<PathBuf>,
    /// Keep every run in saved/ for the example replay, not only failed ones
    #[arg(long)]
    pub(crate) save_runs: bool,
    /// Write the frames of the first N runs and of runs that fail; a frame takes about 130 kB, a
    /// run 20 to 30 of them
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub(crate) frames_of: usize,
    /// Go on learning during the runs, and save the policies to the output folder
    #[arg(long)]
    pub(crate) keep_learning: bool,
    /// Circle detector: a-contrario, heuristic, rht, sht
    #[arg(long, value_name = "NAME", default_value_t)]
    pub(crate) detector: BallDetector,
    /// Reward during training; the paper's formulas as printed do not teach the goal [default:
    /// mended]
    #[arg(long, value_enum)]
    pub(crate) reward: Option<RewardName>,
    /// Learn approaching on 540 states instead of 90: fewer moves, longer training
    #[arg(long)]
    pub(crate) fine: bool,
    /// Goal interval of y; the paper gives two
    #[arg(long, value_enum, default_value_t = YGoalName::Equation6)]
    pub(crate) y_goal: YGoalName,
    /// Form of the regression simulator [default: rigid22]
    #[arg(long, value_enum)]
    pub(crate) simulator: Option<FormName>,
    /// Run the emulated arm at the speed of a real one
    #[arg(long, conflicts_with_all = ["port", "tcp"])]
    pub(crate) realtime: bool,
    /// Show the run in a browser while it lasts, with a Stop button (cargo's --features live).
    /// Other machines can look only at another ADDR than this one, and stop only with the token
    /// that is then printed
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1:8000")]
    pub(crate) live: Option<String>,
    /// Print the final table only
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl Options {
    /// Returns the reward, by default the mended one.
    pub(crate) fn reward(&self) -> RewardName {
        self.reward.unwrap_or(RewardName::Mended)
    }

    /// Returns the program, its version and its command line, as the origin of an exported policy.
    pub(crate) fn made_by(&self) -> String {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let (version, seed) = (env!("CARGO_PKG_VERSION"), self.seed);
        format!(
            "puma-grasp {version}, grasp {}, seed {seed}",
            arguments.join(" ")
        )
    }

    /// Returns the form of the regression simulator, by default that of 22 terms.
    pub(crate) fn form(&self) -> MoveForm {
        match self.simulator {
            Some(FormName::Linear) => MoveForm::Linear,
            Some(FormName::Rigid8) => MoveForm::Rigid8,
            Some(FormName::Rigid22) | None => MoveForm::Rigid22,
        }
    }

    /// Prints a line unless --quiet is given.
    pub(crate) fn say(&self, words: impl std::fmt::Display) {
        if !self.quiet {
            say!("{words}");
        }
    }

    /// Returns the number of balls.
    pub(crate) fn runs(&self) -> usize {
        let usual = if self.real.camera.is_some() { 1 } else { 20 };
        self.runs.unwrap_or(usual)
    }

    /// Refuses options that would have no effect.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.real.check()?;
        let of_learned = [
            ("--policy", self.policy.is_some()),
            ("--export", self.export.is_some()),
            ("--sample", self.sample.is_some()),
            ("--reward", self.reward.is_some()),
            ("--simulator", self.simulator.is_some()),
            ("--fine", self.fine),
        ];
        match self.controller {
            ControllerName::Learned if self.belief.is_some() => {
                return Err("--belief is for --controller hybrid".into());
            }
            ControllerName::Hybrid => {
                if let Some((name, _)) = of_learned.iter().find(|(_, given)| *given) {
                    return Err(format!("{name} is for --controller learned"));
                }
            }
            ControllerName::Learned => {}
        }
        match &self.policy {
            Some(path) if path.is_file() && (self.fine || self.reward.is_some()) => Err(format!(
                "{}: an exported policy records how it was learned; leave out --fine and --reward",
                path.display()
            )),
            _ => Ok(()),
        }
    }
}

/// Parses a number of samples that a simulator can be fitted to.
fn enough(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 20..) => Ok(count),
        Ok(few) => Err(format!(
            "{few} samples are too few; give 20 or more, the paper 300"
        )),
        Err(error) => Err(format!("{error}")),
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum YGoalName {
    /// 74 to 82
    Equation6,
    /// 74 to 92; the hand stops farther from the point the grip aims at
    Section4,
}

impl YGoalName {
    pub(crate) fn goal(self) -> GoalInterval {
        match self {
            Self::Equation6 => GoalInterval::Y,
            Self::Section4 => GoalInterval::Y_SECTION_4,
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
