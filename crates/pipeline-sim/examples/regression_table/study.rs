//! The rows of an independent study of the cell, fitted and judged as it seems to have done: in
//! this cell, and in an earlier one.

use std::error::Error;

use pipeline_sim::nalgebra::{Isometry3, Translation3};
use pipeline_sim::rand::SeedableRng;
use pipeline_sim::rand::rngs::Xoshiro256PlusPlus;
use pipeline_sim::{Ball, Cell, CentreModel, Mount, ReachForm, ReachModel, ReachSample};
use puma_val2::Joints;

use super::otherwise::{
    Balls, Form, Linear, Starts, Terms, as_rigid22, centring_with_square, elbow_to_second_order,
    in_plane, linear, sample, to_second_order, with_products,
};
use super::spread;

/// Runs for the open-loop error of a fit, where a run ends with the move that loses the ball: few
/// have five moves.
const RUNS: usize = 2000;

/// The study's noise if its half pixel is one of the frame, units.
const NOISE: f64 = 0.125;

/// The study's noise if its half pixel is a unit's half.
const NOISE_IN_UNITS: f64 = 0.5;

/// A form of the library or another.
#[derive(Clone, Copy)]
enum Kind {
    Library(ReachForm),
    Other(Linear, Terms),
}

/// The forms, and whether there is a fit for each interval of the elbow.
const FORMS: [(&str, Kind, bool); 9] = [
    (
        "dy, dr on the moves, one fit",
        Kind::Other(Linear::Image, linear),
        false,
    ),
    (
        "the same per elbow interval",
        Kind::Other(Linear::Image, linear),
        true,
    ),
    (
        "with products, 9 terms",
        Kind::Other(Linear::Image, with_products),
        true,
    ),
    (
        "to second order, 22 terms",
        Kind::Other(Linear::Image, to_second_order),
        true,
    ),
    (
        "those of `Rigid22` with r, y",
        Kind::Other(Linear::Image, as_rigid22),
        true,
    ),
    (
        "elbow to second order",
        Kind::Other(Linear::Image, elbow_to_second_order),
        true,
    ),
    (
        "the same for Z and V",
        Kind::Other(Linear::Plane, elbow_to_second_order),
        true,
    ),
    ("`Rigid8`", Kind::Library(ReachForm::Rigid8), true),
    ("`Rigid22`", Kind::Library(ReachForm::Rigid22), true),
];

/// A fit of such a form.
enum Fitted {
    Library(ReachModel),
    Other(Form),
}

impl Kind {
    fn fit(self, samples: &[ReachSample], edges: &[f64]) -> Result<Fitted, Box<dyn Error>> {
        Ok(match self {
            Self::Library(form) => Fitted::Library(ReachModel::fit(samples, form, edges)?),
            Self::Other(linear, terms) => {
                Fitted::Other(Form::fit(samples, linear, terms, edges).ok_or("no fit")?)
            }
        })
    }
}

impl Fitted {
    /// R² of dy and dr, and their errors.
    fn quality(&self, on: &[ReachSample]) -> Result<[f64; 4], Box<dyn Error>> {
        Ok(match self {
            Self::Library(model) => {
                let q = model.quality_on(on)?;
                [q[0].r2, q[1].r2, q[0].rmse, q[1].rmse]
            }
            Self::Other(form) => form.quality(on),
        })
    }
}

/// A cell, the starts of its samples, the elbow's intervals and how many samples the study had.
pub(crate) struct Setting {
    name: &'static str,
    cell: Cell,
    starts: Starts,
    edges: [f64; 2],
    count: usize,
    /// `JT3` at which the changes of y and r per degree are printed, degrees.
    gains_at: f64,
}

impl Setting {
    /// The cell used throughout.
    pub(crate) fn present() -> Self {
        Self {
            name: "this cell",
            cell: Cell::paper(Ball::at(0.6, 0.0, -0.1)),
            starts: Starts::paper(Balls::InPlane),
            edges: ReachModel::PAPER_ELBOW_EDGES,
            count: 2083,
            gains_at: 184.0,
        }
    }

    /// An earlier one: the camera looks along the forearm, 490 mm past the elbow and 37 mm above
    /// it, `JT3` goes to 280 degrees, there is no table, and a ball is lost only where its centre
    /// leaves the frame or its radius 5..=68 units.
    ///
    /// Camera and elbow follow from the changes of y and r per degree that the study gives;
    /// intervals, ranges and rule are those with which its spreads of dy and dr and its R² come
    /// out.
    pub(crate) fn earlier() -> Self {
        let mut cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
        let hand = |jt5| {
            cell.params
                .wrist(&Joints::from_degrees([0.0, 0.0, 0.0, 0.0, jt5, 0.0]))
        };
        let bent = hand(Cell::REACHING_JT5_DEGREES);
        // The elbow's own offset of 20.32 mm is part of the 37.
        let place = Translation3::new(-0.037 + 0.02032, 0.0045, 0.490 - cell.params.d4);
        let along = Isometry3::from_parts(place, Mount::paper().0.rotation);
        cell.mount = Mount(bent.inv_mul(&(hand(0.0) * along)));
        cell.limits.min[2] = 160.0_f64.to_radians();
        cell.limits.max[2] = 280.0_f64.to_radians();
        cell.sight.min_share = 0.0;
        cell.table = -10.0;
        Self {
            name: "the earlier cell",
            cell,
            starts: Starts {
                jt3: [180.0, 270.0],
                ..Starts::paper(Balls::InPlane)
            },
            edges: [200.0, 225.0],
            count: 3331,
            gains_at: 203.0,
        }
    }

    /// Changes of y and r per degree of study's +th2 (-`JT2`), +e (-`JT3`) and both in turn, with
    /// the ball at y = 78 and the two radii.
    fn print_gains(&self) -> Result<(), Box<dyn Error>> {
        for r in [33.0, 10.0] {
            let at = |d2: f64, d3: f64| {
                Joints::from_degrees([
                    0.0,
                    -55.0 - d2,
                    self.gains_at - d3,
                    0.0,
                    Cell::REACHING_JT5_DEGREES,
                    0.0,
                ])
            };
            let mut cell = self.cell;
            let goal = hough_heuristic::Features {
                x: in_plane(&cell, r),
                y: 78.0,
                r,
            };
            cell.place_ball(cell.ball_showing(&at(0.0, 0.0), &goal).ok_or("no ball")?);
            let step = 0.01;
            for (name, d2, d3) in [("J2", 1.0, 0.0), ("J3", 0.0, 1.0), ("-J2+J3", -1.0, 1.0)] {
                let seen = |k: f64| cell.features(&at(k * d2, k * d3)).ok_or("not in sight");
                let (before, after) = (seen(-step)?, seen(step)?);
                let per_degree = |a: f64, b: f64| (b - a) / (2.0 * step);
                println!(
                    "at r = {r}, {name}: dy {:.2}, dr {:.2}",
                    per_degree(before.y, after.y),
                    per_degree(before.r, after.r)
                );
            }
        }
        Ok(())
    }

    /// All rows, on the samples they were fitted to and on as many others.
    pub(crate) fn print(&self, seeds: u64) -> Result<(), Box<dyn Error>> {
        println!(
            "\n# {}: {} samples, {seeds} fits, noise of {NOISE} units\n",
            self.name, self.count
        );
        self.print_gains()?;
        let (mut own, mut fresh) = (Vec::new(), Vec::new());
        let mut kept = Vec::new();
        for seed in 0..seeds {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (_, samples, share) = sample(&self.cell, &self.starts, self.count, NOISE, &mut rng);
            own.push(samples);
            let (_, samples, _) = sample(&self.cell, &self.starts, self.count, NOISE, &mut rng);
            fresh.push(samples);
            kept.push([share]);
        }
        println!("\nshare of moves kept: {}", spread(&kept).join(""));
        let spreads: Vec<_> = own.iter().map(|samples| changes(samples)).collect();
        println!("spread of dy and dr: {}", spread(&spreads).join(", "));
        let mut strict = self.cell;
        strict.sight.min_share = Cell::paper(self.cell.ball).sight.min_share;
        let spreads: Vec<_> = (0..seeds)
            .map(|seed| {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                changes(&sample(&strict, &self.starts, self.count, NOISE, &mut rng).1)
            })
            .collect();
        println!(
            "with 60 % of the outline inside: {}",
            spread(&spreads).join(", ")
        );
        println!(
            "\n| form | R² of dy | R² of dr | error of y | error of r | on others: R² of dy | of dr | error of y | of r | runs end: y after 1 | 3 | 5 | runs go on: 1 | 3 | 5 |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
        for (name, kind, per_interval) in FORMS {
            let (mut qualities, mut runs) = (Vec::new(), Vec::new());
            for (seed, (own, fresh)) in (0..seeds).zip(own.iter().zip(&fresh)) {
                let fit = kind.fit(own, self.edges(per_interval))?;
                qualities.push(joined::<8>(&[&fit.quality(own)?, &fit.quality(fresh)?]));
                if let Fitted::Other(form) = fit {
                    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                    let [ends, goes_on] =
                        [(true, RUNS), (false, RUNS / 10)].map(|(at_loss, runs)| {
                            form.open_loop(&self.cell, &self.starts, at_loss, runs, &mut rng)
                        });
                    runs.push(joined::<6>(&[&ends, &goes_on]));
                }
            }
            let mut row = spread(&qualities).to_vec();
            if !runs.is_empty() {
                row.extend(spread(&runs));
            }
            println!("| {name} | {} |", row.join(" | "));
        }
        self.print_in_units(seeds)?;
        self.print_centring(seeds)
    }

    /// The same forms, fitted to samples with half a unit of noise and judged on others without
    /// any.
    fn print_in_units(&self, seeds: u64) -> Result<(), Box<dyn Error>> {
        let mut samples = Vec::new();
        for seed in 0..seeds {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut draw = |noise| sample(&self.cell, &self.starts, self.count, noise, &mut rng).1;
            samples.push((draw(NOISE_IN_UNITS), draw(0.0)));
        }
        println!("\nFitted with noise of {NOISE_IN_UNITS} units, judged on others without noise\n");
        println!("| form | R² of dy | R² of dr | error of y | error of r |");
        println!("|---|---|---|---|---|");
        for (name, kind, per_interval) in FORMS {
            let mut rows = Vec::new();
            for (noisy, exact) in &samples {
                rows.push(kind.fit(noisy, self.edges(per_interval))?.quality(exact)?);
            }
            println!("| {name} | {} |", spread(&rows).join(" | "));
        }
        Ok(())
    }

    /// The elbow's intervals of a form that has them.
    fn edges(&self, per_interval: bool) -> &[f64] {
        if per_interval { &self.edges } else { &[] }
    }

    /// Centring with balls anywhere, and in spaces of several widths.
    fn print_centring(&self, seeds: u64) -> Result<(), Box<dyn Error>> {
        println!(
            "\n| balls | dx on 1, d1: R² | error | and r d1: R² | error | and r² d1: R² | error |"
        );
        println!("|---|---|---|---|---|---|---|");
        for balls in [
            Balls::Anywhere,
            Balls::Within([0.5, 0.8], [-0.2, 0.05]),
            Balls::Within([0.3, 0.7], [-0.2, 0.05]),
            Balls::Within([0.2, 0.9], [-0.4, 0.3]),
        ] {
            let starts = Starts {
                balls,
                ..self.starts
            };
            let mut rows = Vec::new();
            for seed in 0..seeds {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let (samples, _, _) = sample(&self.cell, &starts, self.count, NOISE, &mut rng);
                let plain = CentreModel::fit_without_radius(&samples)?.quality();
                let full = CentreModel::fit(&samples)?.quality();
                let [r2, error] = centring_with_square(&samples).ok_or("no fit")?;
                rows.push([
                    plain[0].r2,
                    plain[0].rmse,
                    full[0].r2,
                    full[0].rmse,
                    r2,
                    error,
                ]);
            }
            println!("| {balls:?} | {} |", spread(&rows).join(" | "));
        }
        Ok(())
    }
}

fn joined<const N: usize>(parts: &[&[f64]]) -> [f64; N] {
    let all = parts.concat();
    std::array::from_fn(|k| all[k])
}

/// Standard deviations of the changes of y and r.
fn changes(samples: &[ReachSample]) -> [f64; 2] {
    let spread = |change: fn(&ReachSample) -> f64| {
        let n = samples.len() as f64;
        let mean = samples.iter().map(change).sum::<f64>() / n;
        let squares = samples
            .iter()
            .map(|s| (change(s) - mean).powi(2))
            .sum::<f64>();
        (squares / n).sqrt()
    };
    [
        spread(|s| s.after.y - s.before.y),
        spread(|s| s.after.r - s.before.r),
    ]
}
