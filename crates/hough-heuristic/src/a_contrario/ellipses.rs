//! The search for ellipses, beside that for circles.

use image::GrayImage;

use super::candidate::Candidate;
use super::chains::{self, places};
use super::chance::log10;
use super::measure::Measured;
use super::measurement::{MeasuredEllipse, Measurement};
use super::patch::Patch;
use super::proof::Proof;
use super::prover::{Prover, Pyramid};
use super::report::Measuring;
use super::search::Support;
use super::strongest::RAYS;
use super::{AContrario, CANDIDATES, NOISE_FACTOR, RADII, ROUNDING, STEP_GAIN};
use crate::circle::Circle;
use crate::curve::{Curve, Ellipse};
use crate::edges::widest;

/// Largest radius of the circle that an ellipse is drawn as, pixels.
const MOST_RADIUS: f64 = 100.0;
/// Radius down to which the first round takes the frame halved once more, pixels.
const COARSE: f64 = 24.0;
/// Decimal logarithm of the number of shapes that an ellipse may have at a place.
const SHAPES: f32 = 2.0;
/// Rounds of drawing and measuring; each ends in an ellipse that the next one starts from.
const ROUNDS: usize = 4;
/// Movement below which they end, pixels.
const RESTS: f64 = 0.15;
/// Least distance within which an edge belongs to an outline, pixels and shorter half-axes.
const NEAR: (f64, f64) = (1.5, 0.03);

/// That distance for a circle whose edges are not known, radii.
const ROUGH: f64 = 0.05;

/// An ellipse that was proven.
struct Found {
    measurement: Measurement,
    ellipse: Ellipse,
    /// Places in the frame of the edges on the outline.
    edges: Vec<(f64, f64)>,
    /// Largest distance of them from it, pixels.
    slack: f64,
}

impl AContrario {
    /// Finds the ellipses of a frame whose circles were found, and puts those that no surer outline
    /// explains into `measurements`, circles and ellipses alike.
    pub(super) fn find_ellipses(&mut self, frame: &GrayImage, radii: (f64, f64), noise: f32) {
        let mut found: Vec<Found> = Vec::new();
        for measurement in std::mem::take(&mut self.measurements) {
            found.push(self.as_ellipse(frame, measurement, noise));
        }
        let mut candidates = self.candidates(frame, radii, noise);
        candidates.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut tried: Vec<Ellipse> = Vec::new();
        for (candidate, _) in candidates {
            if self.budget.is_late() {
                break;
            }
            let known = |other: &Ellipse| are_near(&candidate, other);
            if tried.iter().any(known) || found.iter().any(|found| known(&found.ellipse)) {
                continue;
            }
            if tried.len() == CANDIDATES {
                self.budget.spent = true;
                break;
            }
            tried.push(candidate);
            let proven = self.prove_ellipse(frame, &candidate, noise);
            found.extend(proven.filter(|proven| {
                let ellipse = &proven.ellipse;
                self.is_round(proven) && ellipse.major >= radii.0 && ellipse.minor <= radii.1
            }));
        }
        found.sort_by(|a, b| {
            let by = |found: &Found| found.measurement.log_false_alarms;
            by(a).total_cmp(&by(b))
        });
        let mut kept: Vec<Found> = Vec::new();
        for one in found {
            let on = |place: &&(f64, f64)| {
                let near = |other: &Found| {
                    let reach = NEAR.0.max(NEAR.1 * other.ellipse.minor);
                    other.ellipse.distance(place.0, place.1) <= reach.max(one.slack)
                };
                kept.iter().any(near)
            };
            let region = self.config.region.as_ref();
            let held = region.is_none_or(|region| region.holds(&one.measurement.circle));
            if held && 2 * one.edges.iter().filter(on).count() < one.edges.len() {
                kept.push(one);
            }
        }
        self.measurements
            .extend(kept.iter().map(|found| found.measurement));
    }

    /// Returns `true` if the axes have the least ratio, within two standard errors.
    fn is_round(&self, found: &Found) -> bool {
        let errors = found.measurement.ellipse.map_or(0.0, |m| m.minor_error);
        let Ellipse { major, minor, .. } = found.ellipse;
        minor + 2.0 * errors >= self.config.min_axis_ratio * major
    }

    /// The outlines that run along edges, in pixels of the frame, with the length on which they do.
    fn candidates(
        &mut self,
        frame: &GrayImage,
        radii: (f64, f64),
        noise: f32,
    ) -> Vec<(Ellipse, f64)> {
        let pyramid = Pyramid {
            frame,
            sizes: &self.sizes[..self.depth],
        };
        let mut candidates = Vec::new();
        for depth in (0..=self.depth).rev() {
            let edges = &mut self.edges[0];
            let gray = pyramid.gray(depth);
            let scale = f64::from(1 << depth);
            let noise = noise / scale as f32 + ROUNDING;
            let threshold = (STEP_GAIN * self.config.contrast as f32)
                .max(NOISE_FACTOR * noise * edges.maxima.noise_gain());
            let deadline = self.budget.deadline;
            let points = edges
                .maxima
                .find(gray.pixels, gray.width, threshold, deadline);
            if self.budget.is_late() {
                break;
            }
            let points = edges.thinning.strongest(points, (gray.width, gray.height));
            edges.level.fill(gray.width, gray.height, points);
            let corner = 0.5 * (scale - 1.0);
            let found = chains::ellipses(&edges.level, &mut self.budget.looks);
            let grown = found.into_iter().map(|(ellipse, length)| {
                let ellipse = Ellipse {
                    x: ellipse.x * scale + corner,
                    y: ellipse.y * scale + corner,
                    major: ellipse.major * scale,
                    minor: ellipse.minor * scale,
                    ..ellipse
                };
                (ellipse, length)
            });
            // The shape is measured later; here it may be somewhat wrong.
            let slack = 0.8;
            candidates.extend(grown.filter(|(ellipse, _)| {
                ellipse.minor >= slack * self.config.min_axis_ratio * ellipse.major
                    && ellipse.major >= slack * radii.0
                    && slack * ellipse.minor <= radii.1
            }));
        }
        candidates
    }

    /// Measures the ellipse of a circle that was found. The circle stays what it is where that
    /// fails.
    fn as_ellipse(&mut self, frame: &GrayImage, measurement: Measurement, noise: f32) -> Found {
        let Circle { x, y, radius } = measurement.circle;
        let circle = Ellipse {
            x,
            y,
            major: radius,
            minor: radius,
            angle: 0.0,
        };
        if let Some(mut found) = self.prove_ellipse(frame, &circle, noise)
            && self.is_round(&found)
        {
            // A circle is the simpler hypothesis, of which fewer are tested.
            if measurement.log_false_alarms < found.measurement.log_false_alarms {
                found.measurement.log_false_alarms = measurement.log_false_alarms;
                found.measurement.score = measurement.score;
            }
            return found;
        }
        let ellipse = Some(MeasuredEllipse {
            ellipse: circle,
            centre_error: measurement.centre_error,
            major_error: measurement.radius_error,
            minor_error: measurement.radius_error,
            angle_error: ANY_ANGLE,
        });
        Found {
            measurement: Measurement {
                ellipse,
                ..measurement
            },
            ellipse: circle,
            edges: places(&circle, RAYS)
                .map(|place| (place.x, place.y))
                .collect(),
            slack: ROUGH * radius,
        }
    }

    /// Proves and measures an ellipse where it is a circle.
    fn prove_ellipse(&mut self, frame: &GrayImage, start: &Ellipse, noise: f32) -> Option<Found> {
        let mut ellipse = *start;
        let mut last = None;
        for round in 0..ROUNDS {
            let radius = (ellipse.major * ellipse.minor).sqrt();
            let usable = radius.is_finite() && ellipse.minor > 3.0 && ellipse.major < 1e5;
            if !usable || ellipse.minor < 0.5 * self.config.min_axis_ratio * ellipse.major {
                return None;
            }
            let mut depth = usize::from(round == 0 && radius >= 2.0 * COARSE);
            while depth < self.depth && radius > MOST_RADIUS * f64::from(1 << depth) {
                depth += 1;
            }
            let depth = depth.min(self.depth);
            let pyramid = Pyramid {
                frame,
                sizes: &self.sizes[..self.depth],
            };
            let patch = Patch::new(pyramid, &ellipse, depth);
            self.budget.looks += patch.gray.len() as u64 / 4;
            let noise = noise / (1 << depth) as f32;
            let measured = self.measure_patch(&patch, noise)?;
            let before = std::mem::replace(&mut ellipse, patch.ellipse(&measured));
            last = Some((patch, measured, noise));
            if round > 0 && moved(&before, &ellipse) < RESTS {
                break;
            }
        }
        let (patch, measured, noise) = last?;
        let mut proofs = Vec::new();
        let mut prover = Prover {
            pyramid: patch.pyramid(),
            circle: &self.circle,
            polar: &mut self.polar,
            noise,
            tests: log10((frame.len() * RADII * (self.depth + 1)) as f32) + SHAPES,
            proofs: &mut proofs,
        };
        let candidate = Candidate::new(&measured.ring, 1.0, Support::default());
        prover.prove(&candidate, &mut self.budget.looks);
        let proof = proofs.pop()?;
        let score = proof.score();
        if score < self.config.min_score {
            return None;
        }
        let inside = |place: (f64, f64)| {
            let within = |at: f64, length: u32| at >= 0.5 && at <= f64::from(length) - 1.5;
            within(place.0, frame.width()) && within(place.1, frame.height())
        };
        let outline = places(&ellipse, RAYS).filter(|place| inside((place.x, place.y)));
        let visible = outline.count() as f64 / RAYS as f64;
        let ring = proof.in_frame();
        let radius = (ellipse.major * ellipse.minor).sqrt();
        let rays = self.circle.rays(RAYS);
        let edges: Vec<_> = (0..RAYS)
            .filter(|ray| proof.hits >> ray & 1 == 1)
            .map(|ray| {
                let (x, y) = (ring.x + ring.r * rays.x[ray], ring.y + ring.r * rays.y[ray]);
                patch.in_frame(x.into(), y.into())
            })
            .filter(|&place| inside(place))
            .collect();
        let measured = errors(&ellipse, &measured);
        Some(Found {
            measurement: Measurement {
                circle: Circle {
                    x: ellipse.x,
                    y: ellipse.y,
                    radius,
                },
                score,
                log_false_alarms: -f64::from(proof.certainty),
                centre_error: measured.centre_error,
                radius_error: measured.major_error / 3f64.sqrt()
                    * (ellipse.minor / ellipse.major).sqrt(),
                axis_ratio: ellipse.minor / ellipse.major,
                visible,
                covered: edges.len() as f64 / (visible * RAYS as f64).max(1.0),
                ellipse: Some(measured),
            },
            slack: f64::from(proof.slack_in_frame()) * radius / f64::from(ring.r),
            ellipse,
            edges,
        })
    }

    /// Measures the circle of a patch.
    fn measure_patch(&mut self, patch: &Patch, noise: f32) -> Option<Measured> {
        let mut depth = 0;
        let mut ring = patch.ring();
        while depth < patch.sizes.len() && ring.r >= COARSE as f32 {
            ring = ring.shrunk(2.0);
            depth += 1;
        }
        let proof = Proof {
            ring,
            depth,
            ..Proof::default()
        };
        widest(Measuring {
            pyramid: patch.pyramid(),
            proof: &proof,
            circle: &self.circle,
            polar: &mut self.polar,
            noise,
        })
    }
}

/// Standard error of an angle of which nothing is known, radians: `pi / sqrt(12)`.
const ANY_ANGLE: f64 = 0.907;

/// The standard errors of an ellipse, from those of the circle that it was measured as.
fn errors(ellipse: &Ellipse, measured: &Measured) -> MeasuredEllipse {
    let r = f64::from(measured.ring.r);
    let (centre, radius) = (
        f64::from(measured.centre_error) / r,
        f64::from(measured.radius_error) / r,
    );
    let Ellipse { major, minor, .. } = *ellipse;
    // A half-axis is the radius and a second harmonic, of twice the variance of the radius.
    let axis = 3f64.sqrt() * radius;
    let turned = 0.5 * (major / minor - minor / major);
    MeasuredEllipse {
        ellipse: *ellipse,
        centre_error: centre * (0.5 * (major * major + minor * minor)).sqrt(),
        major_error: axis * major,
        minor_error: axis * minor,
        angle_error: (2f64.sqrt() * radius / turned).min(ANY_ANGLE),
    }
}

/// Returns `true` if two candidates are one outline.
fn are_near(a: &Ellipse, b: &Ellipse) -> bool {
    moved(a, b) < 0.08 * a.minor.min(b.minor) + 0.75
}

/// Distance of the centres and difference of the half-axes, pixels.
fn moved(a: &Ellipse, b: &Ellipse) -> f64 {
    let off = (a.x - b.x).abs() + (a.y - b.y).abs();
    off + (a.major - b.major).abs() + (a.minor - b.minor).abs()
}
