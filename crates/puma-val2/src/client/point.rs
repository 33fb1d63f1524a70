//! Points typed to the controller and compared with its display.

use crate::client::hand::apart;
use crate::client::reader::Ending;
use crate::client::val2_client::Val2Client;
use crate::error::ArmError;
use crate::joints::Joints;
use crate::kinematics::xyzoat::Xyzoat;
use crate::transport::Transport;

/// Six values displayed, each with its error of rounding.
type Shown = [(f64, f64); 6];

/// Test of the values displayed against the values meant.
type Fits<'a> = &'a dyn Fn(&Shown) -> bool;

impl<T: Transport> Val2Client<T> {
    /// Defines the precision point that the client moves to.
    pub(super) fn define_goal(&mut self, target: &Joints) -> Result<(), ArmError> {
        let name = format!("#{}", self.wire.config.point_name);
        self.define_place(&name, target.degrees())
    }

    /// Defines a location: a precision point if its name begins with `#`, otherwise a pose.
    pub(super) fn define_place(&mut self, name: &str, values: [f64; 6]) -> Result<(), ArmError> {
        if name.starts_with('#') {
            return self.define_point(name, values, &|shown| same(shown, values));
        }
        let pose = Xyzoat::from_val(values).pose();
        self.define_point(name, values, &|shown| {
            let shown = Xyzoat::from_val(shown.map(|(value, _)| value));
            let (off, turned) = apart(&pose, &shown.pose());
            off < 2e-5 && turned < 0.02
        })
    }

    /// Types `POINT name`, the values and an empty line, and compares the display with the values.
    fn define_point(
        &mut self,
        name: &str,
        values: [f64; 6],
        fits: Fits<'_>,
    ) -> Result<(), ArmError> {
        for tries in 0.. {
            let mut outcome = self.define_point_once(name, values, fits);
            // Where nothing is echoed the name may have been damaged, or a value and its display by
            // the same bit: the point is shown again.
            let proven = self.wire.checks_echo();
            if let Ok(shown) = outcome
                && !proven
            {
                outcome = self.show_point(name, fits).map(|()| shown);
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
        self.without_message(typed, &reply)?;
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
