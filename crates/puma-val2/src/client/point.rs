//! Points typed to the controller and compared with its display.

use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::client::wire::{Failed, is_doubt};
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
        let lines = [
            format!("POINT {name}"),
            values.map(|v| format!("{v:.3}")).join(","),
        ];
        let mut tries = 0;
        loop {
            match self.define_point_once(&lines, fits) {
                Err(failed) if is_doubt(&failed.error) && tries < self.config.retries => {
                    tries += 1;
                    self.wire.settle(&self.config).map_err(not_done)?;
                }
                outcome => return outcome,
            }
        }
    }

    fn define_point_once(&mut self, lines: &[String; 2], fits: Fits<'_>) -> Result<(), Failed> {
        let patience = self.config.patience();
        for (typed, are_values) in lines.iter().zip([false, true]) {
            let reply = self
                .wire
                .exchange(typed, patience, &self.config)
                .map_err(|failed| not_done(failed.error))?;
            self.without_message(typed, &reply)?;
            if reply.ending != Ending::Question {
                let error = self
                    .wire
                    .garbled(typed, "a question for changes", &reply.text);
                return Err(not_done(error));
            }
            let shown = reply
                .text
                .split(['\r', '\n'])
                .filter_map(shown_values)
                .next_back();
            if are_values && !shown.is_some_and(|shown| fits(&shown)) {
                let error = self
                    .wire
                    .garbled(typed, "the same values displayed", &reply.text);
                return Err(not_done(error));
            }
        }
        self.command_once("", patience)
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
