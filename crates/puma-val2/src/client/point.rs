//! Points typed to the controller and compared with its display.

use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::wire::Failed;
use crate::error::ArmError;
use crate::joints::Joints;
use crate::transport::Transport;

/// Test of the values displayed, each with its error of rounding, against the values meant.
pub(super) type Fits<'a> = &'a dyn Fn(&[(f64, f64); 6]) -> bool;

impl<T: Transport> Val2Client<T> {
    /// Defines the precision point that the client moves to.
    pub(super) fn define_goal(&mut self, target: &Joints) -> Result<(), Failed> {
        let name = format!("#{}", self.config.point_name);
        let wanted = target.degrees();
        self.define_point(&name, wanted, &|shown| {
            shown
                .iter()
                .zip(wanted)
                .all(|((s, rounding), t)| (s - t).abs() < 0.000_6 + rounding)
        })
    }

    /// Types `POINT name`, the values and an empty line, and compares the display with the values.
    pub(super) fn define_point(
        &mut self,
        name: &str,
        values: [f64; 6],
        fits: Fits<'_>,
    ) -> Result<(), Failed> {
        let mut tries = 0;
        loop {
            let mut outcome = self.define_point_once(name, values, fits);
            // Where nothing is echoed the name itself may have been damaged. A name that has shown
            // its values of before is right; a new one is shown again.
            let proven = self.wire.checks_echo(&self.config) || self.points.contains_key(name);
            if let Ok(shown) = outcome
                && !proven
            {
                outcome = self.show_point(name, fits).map(|()| shown);
            }
            match outcome {
                Err(failed) if self.is_doubtful(&failed.error) && tries < self.config.retries => {
                    tries += 1;
                    self.wire.settle(&self.config).map_err(not_done)?;
                }
                Ok(shown) => {
                    self.points.insert(name.to_owned(), shown);
                    return Ok(());
                }
                Err(failed) => {
                    self.points.remove(name);
                    return Err(failed);
                }
            }
        }
    }

    fn define_point_once(
        &mut self,
        name: &str,
        values: [f64; 6],
        fits: Fits<'_>,
    ) -> Result<[f64; 6], Failed> {
        let before = self.points.get(name).copied();
        let shown = self.ask_point(&format!("POINT {name}"))?;
        let same = |shown: [(f64, f64); 6], before: [f64; 6]| {
            let mut pairs = shown.iter().zip(before);
            pairs.all(|((s, rounding), b)| (s - b).abs() < 0.000_6 + rounding)
        };
        if let (Some(before), Some(shown)) = (before, shown)
            && !same(shown, before)
        {
            // Another point is open, or this one was changed by somebody else.
            self.points.remove(name);
            let error = self
                .wire
                .garbled("POINT", "the values of before displayed", "others");
            return Err(not_done(error));
        }
        let typed = values.map(|v| format!("{v:.3}")).join(",");
        let Some(shown) = self.ask_point(&typed)?.filter(|shown| fits(shown)) else {
            let error = self
                .wire
                .garbled(&typed, "the same values displayed", "others");
            return Err(not_done(error));
        };
        self.leave_point()?;
        Ok(shown.map(|(value, _)| value))
    }

    /// Compares a point with the values that it must have.
    fn show_point(&mut self, name: &str, fits: Fits<'_>) -> Result<(), Failed> {
        let line = format!("POINT {name}");
        if self.ask_point(&line)?.is_some_and(|shown| fits(&shown)) {
            return self.leave_point();
        }
        let error = self
            .wire
            .garbled(&line, "the values just defined displayed", "others");
        Err(not_done(error))
    }

    /// Types a line of the dialogue and returns the values displayed.
    fn ask_point(&mut self, typed: &str) -> Result<Option<[(f64, f64); 6]>, Failed> {
        let reply = self
            .wire
            .exchange(typed, self.config.patience(), &self.config)
            .map_err(|failed| not_done(failed.error))?;
        self.without_message(typed, &reply)?;
        if reply.ending != Ending::Question {
            let error = self
                .wire
                .garbled(typed, "a question for changes", &reply.text);
            return Err(not_done(error));
        }
        let lines = reply.text.split(['\r', '\n']);
        Ok(lines.filter_map(shown_values).next_back())
    }

    fn leave_point(&mut self) -> Result<(), Failed> {
        self.command_once("", self.config.patience())
            .map(drop)
            .map_err(|failed| not_done(failed.error))
    }
}

pub(super) fn not_done(error: ArmError) -> Failed {
    Failed {
        error,
        maybe_done: false,
    }
}

/// Returns the numbers of a line that holds exactly six, each with the greatest error of rounding.
pub(super) fn shown_values(line: &str) -> Option<[(f64, f64); 6]> {
    let numbers: Vec<(f64, f64)> = line
        .split_whitespace()
        .map(|word| {
            let decimals = word.split_once('.').map_or(0, |(_, d)| d.len());
            let rounding = if decimals >= 3 {
                0.0
            } else {
                0.5 / 10_f64.powi(decimals as i32)
            };
            Some((word.parse().ok()?, rounding))
        })
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}
