//! Learning from one run to the next, and the doubt in what was learned.

use crate::controllers::hybrid::belief::Belief;
use crate::controllers::hybrid::controller::{HELD, Hybrid};
use crate::controllers::hybrid::evidence::Evidence;
use crate::controllers::hybrid::fit::Fit;
use crate::controllers::hybrid::misfit::{ENOUGH, Misfit, misfit};
use crate::controllers::hybrid::settings::HybridSettings;

/// Slip of the camera in two runs: least number of sightings in each, least cost that a new mount
/// saves, and largest cost of a residual after it.
const SLIP_SHOWS: (usize, f64, f64) = (3, 80.0, 3.0);
/// Number of runs in order without a misfit, after which another one can show a slip.
const CALM: usize = 3;
/// Number of own aims that may miss in one run before arm and older runs are in doubt.
const OFTEN: usize = 3;
/// Least number of sightings that are judged after losses.
const FEW: usize = 4;
/// Number of causes that are remembered.
const VOTES: usize = 12;

impl Hybrid {
    /// Creates a controller that decides by a belief as it is, and learns nothing. The marks say
    /// that a goal was taught, and that the camera has slipped; the rest is the run before, the
    /// number of runs that fitted, and the causes found last.
    pub(crate) fn restored(
        settings: HybridSettings,
        belief: Belief,
        [shown, slipped]: [bool; 2],
        (recent, calm, causes): (Evidence, usize, Vec<Misfit>),
    ) -> Self {
        Self {
            learning: false,
            shown,
            slipped,
            recent,
            calm,
            causes,
            ..Self::beginning(settings, belief)
        }
    }

    /// Keeps the sightings of one ball in one place as evidence for later runs.
    pub(super) fn remember(&mut self) {
        // A single sighting determines the ball's place and nothing of the camera.
        if self.learning && self.run.evidence.tells() {
            self.remembered.push(self.run.evidence.clone());
            self.news = true;
            let taught = usize::from(self.shown);
            let least = self.settings.memory + taught;
            let forgotten = self.remembered.len().saturating_sub(least);
            self.remembered.drain(taught..taught + forgotten);
        }
    }

    /// Looks for the cause of residuals that are too large: each time that the sightings have
    /// doubled.
    pub(super) fn judge(&mut self) {
        let number = self.run.record.len();
        if number >= ENOUGH && number.is_power_of_two() {
            self.find_cause();
        }
        if self.run.misses > OFTEN && self.run.sure {
            self.run.misfit = self.run.misfit.or(Some(Misfit::Arm));
        }
    }

    /// Looks for the cause of losses, each time that they have doubled: few sightings are made
    /// then. Without it, the cause is the one of the runs before.
    pub(super) fn judge_loss(&mut self) {
        self.run.losses = self.run.losses.map(|losses| losses + 1);
        let losses = self.run.losses[1];
        if losses < 2 || !losses.is_power_of_two() {
            return;
        }
        if self.run.record.len() >= FEW {
            self.find_cause();
        }
        self.run.misfit = self.run.misfit.or_else(|| self.usual_cause());
    }

    fn find_cause(&mut self) {
        let (record, settings) = (&self.run.record, &self.settings);
        let (prior, nominal, calm) = (&settings.prior, &settings.nominal, self.calm >= CALM);
        let Some(cause) = misfit([&self.recent, record], &self.belief, prior, nominal, calm) else {
            return;
        };
        if cause != Misfit::Unexplained {
            self.causes.push(cause);
            self.causes.drain(..self.causes.len().saturating_sub(VOTES));
        }
        self.run.misfit = Some(self.usual_cause().unwrap_or(cause));
    }

    /// Returns the most frequent of the causes found last, the latest of equally frequent ones.
    fn usual_cause(&self) -> Option<Misfit> {
        let votes = |cause: &&Misfit| self.causes.iter().filter(|c| c == cause).count();
        self.causes.iter().max_by_key(votes).copied()
    }

    /// Returns `true` if the last two runs contradict the belief and agree on another mount of the
    /// camera.
    fn has_slipped(&self) -> bool {
        let last = [&self.recent, &self.run.record];
        let fit =
            |belief: &Belief| Fit::of(belief, &belief.numbers(), &self.settings.nominal, &last);
        let slipped = self.belief.clone().slipped(&self.settings.prior);
        let (Some(before), Some(after)) = (fit(&self.belief), fit(&slipped)) else {
            return false;
        };
        let count = last.map(Evidence::len);
        let residuals = 3.0 * (count[0] + count[1]) as f64;
        count.iter().all(|count| *count >= SLIP_SHOWS.0)
            && before.cost - after.cost > SLIP_SHOWS.1
            && after.cost < SLIP_SHOWS.2 * residuals
    }

    /// Learns from the run that is over.
    pub(super) fn learn(&mut self) {
        self.remember();
        self.slipped = self.learning && self.calm >= CALM && self.has_slipped();
        match self.run.misfit {
            None | Some(Misfit::CameraSlipped) => self.calm += 1,
            Some(Misfit::Unexplained) => {}
            Some(_) => self.calm = 0,
        }
        if self.run.misfit.is_none() {
            self.causes.drain(..self.causes.len().min(1));
        }
        let record = std::mem::take(&mut self.run.record);
        let recent = std::mem::replace(&mut self.recent, record.clone());
        if self.slipped {
            // The older runs, and the taught grip, are of another mount.
            self.before = self.belief.clone().slipped(&self.settings.prior);
            self.remembered = vec![recent, record];
            self.shown = false;
        } else if self.learning && self.shown && self.run.misses > OFTEN {
            // The cell may have changed little by little.
            let older = (self.remembered.len() - 1) / 2;
            self.remembered.drain(1..=older);
            self.before = self.belief.fresh(&self.settings.prior);
        }
        if !self.learning || !std::mem::take(&mut self.news) {
            return;
        }
        // Grips by one belief miss alike: together, they are as sure as one.
        let taught = usize::from(self.shown);
        let grips = self.remembered.iter().skip(taught).filter(|e| e.is_held());
        let deviation = HELD * (grips.count() as f64).sqrt();
        for evidence in self.remembered.iter_mut().skip(taught) {
            evidence.hold_within(deviation);
        }
        let all: Vec<&Evidence> = self.remembered.iter().collect();
        let before = self.before.clone().with_noise(self.belief.noise());
        if let Some(fit) = Fit::of(
            &before,
            &self.belief.numbers(),
            &self.settings.nominal,
            &all,
        ) {
            let noise = fit.noise().unwrap_or(self.belief.noise());
            let fit = fit.over_all_places(&self.settings.nominal, &all);
            self.belief = fit.belief(noise);
        }
    }
}
