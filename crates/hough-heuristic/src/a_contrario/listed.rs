//! The edges of one size of the frame: all of them, and those that are searched.

use std::time::{Duration, Instant};

use super::directions::UnitCircle;
use super::level::Level;
use super::polar::{Gray, Ring};
use super::search::Outline;
use super::small;
use super::thin::Thinning;
use crate::clock;
use crate::edges::{Candidate, Maxima};

/// Deviation of the Gaussian that smooths each size, its pixels.
pub(super) const SMOOTHING: f32 = 0.8;
/// Time to list the edges of a frame, in units of the time to find them: a constant, and a factor
/// of the fraction of pixels that are edges.
const LISTING: (f64, f64) = (0.3, 8.0);
/// Least number of circles found since the last listing for another.
const MANY: usize = 4;
/// Length of the outlines found per edge point listed from which on the rest is listed.
const LEAST_FOUND: f32 = 0.5;

/// The edges of a size.
#[derive(Clone, Debug)]
pub(super) struct Edges {
    pub(super) maxima: Maxima,
    pub(super) thinning: Thinning,
    pub(super) level: Level,
    /// Set once a deadline has left out edges of the frame.
    pub(super) late: bool,
    /// Set if small closed outlines are seen.
    pub(super) small: bool,
    /// Set if not all edges are listed.
    thinned: bool,
    /// The outlines found so far, pixels of this size.
    pub(super) found: Vec<Ring>,
    /// Edges on none of them.
    rest: Vec<Candidate>,
    /// Foreseen time of listing all edges.
    listing: Duration,
}

impl Edges {
    pub(super) fn new() -> Self {
        Self {
            maxima: Maxima::new(SMOOTHING),
            thinning: Thinning::default(),
            level: Level::default(),
            late: false,
            small: false,
            thinned: false,
            found: Vec::new(),
            rest: Vec::new(),
            listing: Duration::ZERO,
        }
    }

    /// Finds the edges of a size, and lists those that are searched; looks for small closed
    /// outlines if asked to.
    pub(super) fn find(
        &mut self,
        gray: Gray<'_>,
        threshold: f32,
        deadline: Option<Instant>,
        asked: Option<(&Outline, f32)>,
    ) {
        let (begun, size) = (clock::now(), (gray.width, gray.height));
        let points = self
            .maxima
            .find(gray.pixels, gray.width, threshold, deadline);
        // Listing them takes the longer, the more of the pixels are among them.
        let share = points.len() as f64 / gray.pixels.len().max(1) as f64;
        let spent = clock::between(begun, clock::now());
        self.listing = spent.mul_f64(LISTING.0 + LISTING.1 * share);
        let is_late = clock::is_past(deadline.and_then(|time| time.checked_sub(self.listing)));
        self.late |= is_late;
        if is_late {
            self.thinned = false;
            self.level.fill(0, 0, &[]);
            return;
        }
        let time = deadline.and_then(|time| time.checked_sub(3 * self.listing));
        if let Some((outline, mirror_slack)) = asked
            && !clock::is_past(time)
        {
            // Small outlines are dense: all of their points are needed.
            self.level.fill(size.0, size.1, points);
            self.small = small::shows_small(outline, &self.level, mirror_slack, time);
        }
        let kept = self.thinning.strongest(points, size);
        self.thinned = kept.len() < points.len();
        self.level.fill(size.0, size.1, kept);
    }

    /// Lists the edges on none of the outlines found, if some were left out before and many circles
    /// were found since that hold a good part of those listed: many strong circles do not crowd out
    /// weak ones.
    pub(super) fn list_rest(
        &mut self,
        (outline, circle): (&Outline, &UnitCircle),
        news: impl Iterator<Item = Ring>,
        deadline: Option<Instant>,
        looks: &mut u64,
    ) -> bool {
        let add =
            |(count, length), ring: Ring| (count + 1, length + std::f32::consts::TAU * ring.r);
        let (count, length) = news.fold((0, 0.0), add);
        let is_much = count >= MANY && length > LEAST_FOUND * self.level.free.len() as f32;
        let time = deadline.and_then(|time| time.checked_sub(2 * self.listing));
        if !self.thinned || !is_much || clock::is_past(time) {
            return false;
        }
        let (points, size) = (self.maxima.found(), (self.level.width, self.level.height));
        self.level.fill(size.0, size.1, points);
        for ring in &self.found {
            outline.explain(circle, &mut self.level, ring, looks);
        }
        let free = points.iter().zip(&self.level.free);
        self.rest.clear();
        self.rest
            .extend(free.filter(|(_, free)| **free).map(|(point, _)| *point));
        let kept = self.thinning.strongest(&self.rest, size);
        self.thinned = kept.len() < self.rest.len();
        self.level.fill(size.0, size.1, kept);
        true
    }
}
