//! Points typed to the controller, compared with its display, and moved to.

use std::time::Duration;

use crate::client::dialogue::RESIDENT_QUESTION;
use crate::client::hand::apart;
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::wire::{Failed, Reply};
use crate::error::ArmError;
use crate::kinematics::xyzoat::Xyzoat;
use crate::transport::Transport;

/// Six values displayed, each with its error of rounding.
type Shown = [(f64, f64); 6];

/// Test of the values displayed against the values meant.
type Fits<'a> = &'a dyn Fn(&Shown) -> bool;

/// Program that moves to a point where nothing is echoed.
const GOAL: &str = "PGMOVE";

/// Answer that makes a program of [`shown_first`] move the arm.
const GO: &str = "7";

impl<T: Transport> Val2Client<T> {
    /// Defines a location: a precision point if its name begins with `#`, otherwise a pose.
    pub(super) fn define_place(&mut self, name: &str, values: [f64; 6]) -> Result<(), ArmError> {
        self.define_point(name, values, !self.wire.checks_echo())
    }

    /// Types `POINT name`, the values and an empty line, and compares the display with the values.
    ///
    /// Where nothing is echoed the name may have been damaged, or a value and its display by the
    /// same bit. A point that is not shown by the program that moves to it is shown `again`.
    fn define_point(&mut self, name: &str, values: [f64; 6], again: bool) -> Result<(), ArmError> {
        let fits = fits(name, values);
        for tries in 0.. {
            let mut outcome = self.define_point_once(name, values, &fits);
            if let Ok(shown) = outcome
                && again
            {
                outcome = self.show_point(name, &fits).map(|()| shown);
            }
            match outcome {
                Ok(shown) => {
                    self.points.insert(name.to_owned(), shown);
                    break;
                }
                Err(error) if !self.is_doubtful(&error) || tries >= self.wire.config.retries => {
                    self.points.remove(name);
                    return Err(error);
                }
                Err(_) => self.wire.settle().map(drop)?,
            }
        }
        Ok(())
    }

    /// Defines a location and moves there by `word`, `MOVE` or `MOVES`, under guard if one is
    /// armed, at `speed` percent of the monitor's speed.
    ///
    /// Without an echo a damaged name could be that of a point that another damaged line has made.
    /// There a stored program, whose listing has been compared, shows a sum of the point's values
    /// and then moves to it.
    pub(super) fn move_to_point(
        &mut self,
        word: &str,
        name: &str,
        values: [f64; 6],
        speed: Option<f64>,
        limit: Duration,
    ) -> Result<(), Failed> {
        self.define_point(name, values, false)?;
        let motion = format!("{word} {name}");
        let shows = !self.wire.checks_echo();
        let program = if self.guard.is_some() {
            self.guarding(speed, &motion)?
        } else if shows {
            if self.goal_program.as_ref() != Some(&motion) {
                self.goal_program = None;
                self.type_program(GOAL, &shown_first(&motion))?;
                self.goal_program = Some(motion);
            }
            GOAL
        } else {
            return self.command_once(&format!("DO {motion}"), limit).map(drop);
        };
        let mut line = format!("EXECUTE {program}");
        if shows {
            let patience = self.wire.config.patience();
            let reply = self.wire.exchange_to_end(&line, patience);
            // Nothing moves before the answer.
            let reply = reply.map_err(ArmError::from)?;
            self.shown(&line, &reply)?;
            let numbers = reply.text.split(['\r', '\n']);
            let sum = numbers
                .filter_map(|l| l.trim().parse::<f64>().ok())
                .next_back();
            // A pose may be shown by other angles, and both are rounded.
            let (meant, rounding) = match self.points.get(name) {
                Some(shown) if !name.starts_with('#') => (weighted(shown), 0.5),
                _ => (weighted(&values), 0.05),
            };
            if !sum.is_some_and(|sum| (sum - meant).abs() < rounding) {
                let expected = "the sum of the values just defined";
                return Err(self.wire.garbled(&line, expected, &reply.text).into());
            }
            line = GO.to_owned();
        }
        self.run(&line, limit).map(drop)
    }

    /// Returns the line that starts a program of the user.
    ///
    /// Without an echo a damaged name could be that of another program. There a stored program,
    /// whose listing has been compared, asks first and then calls it.
    pub(super) fn line_to_start(&mut self, name: &str, cycles: i32) -> Result<String, ArmError> {
        if self.wire.checks_echo() {
            return Ok(format!("EXECUTE {name},{cycles}"));
        }
        let runs = if cycles < 0 {
            vec![format!("20 CALL {name}"), "GOTO 20".to_owned()]
        } else {
            let first = format!("FOR PGI = 1 TO {cycles}");
            vec![first, format!("CALL {name}"), "END".to_owned()]
        };
        self.goal_program = None;
        self.type_program(GOAL, &asked_first(runs))?;
        let line = format!("EXECUTE {GOAL}");
        let patience = self.wire.config.patience();
        let reply = self.wire.exchange_to_end(&line, patience)?;
        self.shown(&line, &reply)?;
        Ok(GO.to_owned())
    }

    /// Returns the steps of a motion to a point, for a program.
    pub(super) fn steps_to_point(&self, motion: &str) -> Vec<String> {
        if self.wire.checks_echo() {
            vec![motion.to_owned()]
        } else {
            shown_first(motion)
        }
    }

    fn define_point_once(
        &mut self,
        name: &str,
        values: [f64; 6],
        fits: Fits<'_>,
    ) -> Result<[f64; 6], ArmError> {
        let before = self.points.get(name).copied();
        let shown = self.ask_point(&format!("POINT {name}"))?;
        if let (Some(before), Some(shown)) = (before, shown)
            && !same(&shown, before)
        {
            // Another point is open, or this one was changed by somebody else.
            self.points.remove(name);
            let expected = "the values of before displayed";
            return Err(self.wire.garbled("POINT", expected, "others"));
        }
        let typed = values.map(|v| format!("{v:.3}")).join(",");
        let Some(shown) = self.ask_point(&typed)?.filter(|shown| fits(shown)) else {
            let expected = "the same values displayed";
            return Err(self.wire.garbled(&typed, expected, "others"));
        };
        self.leave_point()?;
        Ok(shown.map(|(value, _)| value))
    }

    /// Compares a point with the values that it must have.
    fn show_point(&mut self, name: &str, fits: Fits<'_>) -> Result<(), ArmError> {
        let line = format!("POINT {name}");
        if self.ask_point(&line)?.is_some_and(|shown| fits(&shown)) {
            return self.leave_point();
        }
        let expected = "the values just defined displayed";
        Err(self.wire.garbled(&line, expected, "others"))
    }

    /// Types a line of the dialogue and returns the values displayed.
    pub(super) fn ask_point(&mut self, typed: &str) -> Result<Option<Shown>, ArmError> {
        let reply = self.say(typed)?;
        self.shown(typed, &reply)
    }

    /// Returns the values of a reply that ends with a question.
    fn shown(&self, typed: &str, reply: &Reply) -> Result<Option<Shown>, ArmError> {
        self.without_message(typed, reply)?;
        if reply.ending != Ending::Question {
            let expected = "a question for changes";
            return Err(self.wire.garbled(typed, expected, &reply.text));
        }
        let lines = reply.text.split(['\r', '\n']);
        Ok(lines.filter_map(shown_values).next_back())
    }

    pub(super) fn leave_point(&mut self) -> Result<(), ArmError> {
        let left = self.command_once("", self.wire.config.patience());
        left.map(drop).map_err(ArmError::from)
    }
}

/// Returns the sum of six values that [`shown_first`] shows. It tells a changed digit of any value;
/// only another fault of the line could hide one.
fn weighted(values: &[f64; 6]) -> f64 {
    values
        .iter()
        .zip(7_u8..)
        .map(|(value, weight)| value * f64::from(weight))
        .sum()
}

/// Returns the steps that show a sum of the place's values and carry out `motion` after [`GO`]. A
/// damaged answer makes them ask again.
fn shown_first(motion: &str) -> Vec<String> {
    let name = motion.rsplit(' ').next().unwrap_or_default();
    let mut steps = vec![
        format!("DECOMPOSE PGQ[1] = {name}"),
        "TYPE /F1.2,7*PGQ[1]+8*PGQ[2]+9*PGQ[3]+10*PGQ[4]+11*PGQ[5]+12*PGQ[6]".to_owned(),
    ];
    steps.extend(asked_first(vec![motion.to_owned()]));
    steps
}

/// Returns the steps that ask and carry out `steps` after [`GO`].
fn asked_first(steps: Vec<String>) -> Vec<String> {
    let question = [
        format!("10 PROMPT \"{RESIDENT_QUESTION}\",PGK"),
        "IF PGK <> 7 AND PGK <> 914 GOTO 10".to_owned(),
        "IF PGK == 7 THEN".to_owned(),
    ];
    let end = ["END".to_owned()];
    question.into_iter().chain(steps).chain(end).collect()
}

/// Returns the test of a display of the place `name` that was given these values.
fn fits(name: &str, values: [f64; 6]) -> impl Fn(&Shown) -> bool {
    let is_point = name.starts_with('#');
    let pose = Xyzoat::from_val(values).pose();
    move |shown| {
        if is_point {
            return same(shown, values);
        }
        let shown = Xyzoat::from_val(shown.map(|(value, _)| value));
        let (off, turned) = apart(&pose, &shown.pose());
        off < 2e-5 && turned < 0.02
    }
}

fn same(shown: &Shown, values: [f64; 6]) -> bool {
    let mut pairs = shown.iter().zip(values);
    pairs.all(|((s, rounding), value)| (s - value).abs() < 0.000_6 + rounding)
}

/// Returns the numbers of a line that holds exactly six, each with the greatest error of rounding.
pub(super) fn shown_values(line: &str) -> Option<Shown> {
    let number = |word: &str| {
        let decimals = word.split_once('.').map_or(0, |(_, d)| d.len());
        let rounding = if decimals >= 3 {
            0.0
        } else {
            0.5 / 10_f64.powi(decimals as i32)
        };
        Some((word.parse().ok()?, rounding))
    };
    let numbers: Option<Vec<_>> = line.split_whitespace().map(number).collect();
    numbers?.try_into().ok()
}
