//! Fitted models as text, and what is checked before a stored one is believed.

use std::fmt::{Debug, Write as _};
use std::str::{FromStr, Lines};

use crate::regression::least_squares::Fit;
use crate::regression::least_squares::Quality;
use crate::regression::reach_form::ReachForm;
use crate::regression::reach_noise::Noise;

/// Version of the stored form of models that is written, and the only one that is read.
pub(crate) const VERSION: u32 = 1;

/// What a stored model begins with.
const SIGNATURE: &str = "pipeline-sim";

/// Why a stored model does not come back.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StoredModelError {
    /// The text does not begin as a stored model of this kind does.
    #[error("this is no stored {kind}: its first line must be \"{SIGNATURE} {kind} {VERSION}\"")]
    Kind {
        /// What was to be read.
        kind: &'static str,
    },
    /// Stored in another version of the form. A newer one needs a newer version of this crate;
    /// after an older one the model has to be fitted again.
    #[error(
        "the model is stored in version {found} of the form, and only version {known} is read here"
    )]
    Version {
        /// Version of the stored model; 0 if it has none.
        found: u32,
        /// Version that is read.
        known: u32,
    },
    /// A line is missing, or does not hold what it should.
    #[error("line {line} must hold \"{name}\" with {wanted}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What it begins with.
        name: &'static str,
        /// What comes after.
        wanted: String,
    },
    /// The parts do not belong together, or a number is not one that a fit gives.
    #[error("the stored model is damaged: {what}")]
    Contents {
        /// What is wrong.
        what: &'static str,
    },
}

/// Refuses any version but the one that is written.
pub(crate) fn known(found: u32) -> Result<(), StoredModelError> {
    if found == VERSION {
        Ok(())
    } else {
        Err(StoredModelError::Version {
            found,
            known: VERSION,
        })
    }
}

/// Writes a model line by line: a name, and values that read back exactly.
pub(crate) struct Writer(String);

impl Writer {
    pub(crate) fn new(kind: &str) -> Self {
        Self(format!("{SIGNATURE} {kind} {VERSION}\n"))
    }

    pub(crate) fn line<T: Debug>(&mut self, name: &str, values: &[T]) {
        self.0.push_str(name);
        for value in values {
            let _ = write!(self.0, " {value:?}");
        }
        self.0.push('\n');
    }

    pub(crate) fn fit(&mut self, fit: &Fit) {
        self.line("samples", &[fit.samples]);
        self.line("condition", &[fit.condition]);
        for coefficients in &fit.coefficients {
            self.line("coefficients", coefficients);
        }
        self.line("residual", &fit.residual);
        self.line("inverse-gram", &fit.inverse_gram);
    }

    pub(crate) fn noise(&mut self, noise: &Noise) {
        self.line("noise", &[noise.residual, noise.observed, noise.fitted]);
    }

    pub(crate) fn quality(&mut self, quality: &[Quality]) {
        for q in quality {
            self.line("accuracy", &[q.r2, q.rmse]);
            self.line("judged-on", &[q.samples, q.unpredicted]);
        }
    }

    pub(crate) fn finish(self) -> String {
        self.0
    }
}

/// Reads what [`Writer`] wrote.
pub(crate) struct Reader<'a> {
    lines: Lines<'a>,
    line: usize,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(kind: &'static str, text: &'a str) -> Result<Self, StoredModelError> {
        let mut lines = text.lines();
        let version =
            lines.next().and_then(
                |line| match line.split_whitespace().collect::<Vec<_>>()[..] {
                    [signature, found, version] if signature == SIGNATURE && found == kind => {
                        version.parse().ok()
                    }
                    _ => None,
                },
            );
        known(version.ok_or(StoredModelError::Kind { kind })?)?;
        Ok(Self { lines, line: 1 })
    }

    /// The values of the next line, which must be called `name`; `count` of them, if that is given.
    pub(crate) fn line<T: FromStr>(
        &mut self,
        name: &'static str,
        count: Option<usize>,
    ) -> Result<Vec<T>, StoredModelError> {
        self.line += 1;
        let mut words = self.lines.next().unwrap_or_default().split_whitespace();
        let named = words.next() == Some(name);
        let values: Option<Vec<T>> = words.map(|word| word.parse().ok()).collect();
        values
            .filter(|values| named && count.is_none_or(|count| values.len() == count))
            .ok_or_else(|| StoredModelError::Line {
                line: self.line,
                name,
                wanted: match count {
                    Some(count) => format!("{count} numbers"),
                    None => "numbers".to_owned(),
                },
            })
    }

    /// The only value of the next line.
    pub(crate) fn one<T: FromStr>(&mut self, name: &'static str) -> Result<T, StoredModelError> {
        let mut values: Vec<T> = self.line(name, Some(1))?;
        Ok(values.swap_remove(0))
    }

    pub(crate) fn form(&mut self) -> Result<ReachForm, StoredModelError> {
        let name: String = self.one("form")?;
        let all = [
            ReachForm::Linear,
            ReachForm::Rigid8,
            ReachForm::Rigid22,
            ReachForm::RigidBody,
        ];
        let found = all.into_iter().find(|form| format!("{form:?}") == name);
        found.ok_or_else(|| StoredModelError::Line {
            line: self.line,
            name: "form",
            wanted: format!("one of {all:?}"),
        })
    }

    pub(crate) fn fit(&mut self, targets: usize, terms: usize) -> Result<Fit, StoredModelError> {
        let fit = Fit {
            samples: self.one("samples")?,
            condition: self.one("condition")?,
            coefficients: (0..targets)
                .map(|_| self.line("coefficients", Some(terms)))
                .collect::<Result<_, _>>()?,
            residual: self.line("residual", Some(targets))?,
            inverse_gram: self.line("inverse-gram", Some(terms * terms))?,
        };
        Ok(fit)
    }

    pub(crate) fn noise(&mut self) -> Result<Noise, StoredModelError> {
        let values: Vec<f64> = self.line("noise", Some(3))?;
        Ok(Noise {
            residual: values[0],
            observed: values[1],
            fitted: values[2],
        })
    }

    pub(crate) fn quality(&mut self, outputs: &[&str]) -> Result<Vec<Quality>, StoredModelError> {
        let mut one = |output: &&str| {
            let accuracy: Vec<f64> = self.line("accuracy", Some(2))?;
            let counts: Vec<usize> = self.line("judged-on", Some(2))?;
            Ok(Quality {
                output: (*output).to_owned(),
                r2: accuracy[0],
                rmse: accuracy[1],
                samples: counts[0],
                unpredicted: counts[1],
            })
        };
        outputs.iter().map(&mut one).collect()
    }

    /// Whether there is nothing more to read.
    pub(crate) fn end(mut self) -> Result<(), StoredModelError> {
        match self.lines.find(|line| !line.trim().is_empty()) {
            None => Ok(()),
            Some(_) => Err(StoredModelError::Contents {
                what: "there is more text after its end",
            }),
        }
    }
}
