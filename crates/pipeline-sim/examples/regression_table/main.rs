//! How well each form of the regression simulators describes the cell: fits to many seeds, and the
//! interval that 95 % of fits lie in.
//!
//! ```text
//! cargo run --release -p pipeline-sim --example regression_table [-- SAMPLES [SEEDS]]
//! ```
//!
//! R² and root mean square errors (feature units) are those of as many other samples; the open-loop
//! error is the mean error of y after 1, 3 and 5 moves that the model does not see. For features
//! noisy by 0, 0.125 and 0.5 units. Then two forms linear in y and r that the library does not
//! offer, and the fits to balls in the arm's plane only, or in the task's workspace only, with the
//! standard deviations of the changes. Last, what the README sets beside an independent study: in
//! this cell, and in an earlier one with another mount and another range of the elbow. `SAMPLES`
//! does not apply to that part, which has as many samples as the study; `SEEDS` does.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

mod otherwise;
mod study;

use std::error::Error;

use otherwise::{
    Balls, Form, Linear, Starts, Terms, centring_with_square, sample, to_second_order,
    with_products,
};
use pipeline_sim::rand::SeedableRng;
use pipeline_sim::rand::rngs::Xoshiro256PlusPlus;
use pipeline_sim::{Ball, Cell, CentreModel, ReachForm, ReachModel, sample_moves};
use study::Setting;

/// Runs of five moves for the open-loop error of a fit.
const RUNS: usize = 200;

/// Forms linear in y and r, which the library does not offer.
const OTHER_FORMS: [(&str, Terms); 2] = [
    ("dy, dr with products, 9 terms", with_products),
    ("dy, dr to second order, 22 terms", to_second_order),
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |name: &str, otherwise: u32| {
        let text = arguments.next();
        text.map_or(Ok(otherwise), |text| {
            text.parse().ok().filter(|n| *n > 1).ok_or(text)
        })
        .map_err(|text| {
            format!("{name} is a whole number from 2 on, not {text:?}: regression_table [SAMPLES [SEEDS]]")
        })
    };
    let count = number("SAMPLES", 2083)? as usize;
    let seeds = u64::from(number("SEEDS", 20)?);
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    for noise in [0.0, 0.125, 0.5] {
        println!(
            "\n{count} samples with noise of {noise} units, {seeds} fits: mean ± 1.96 standard deviations\n"
        );
        println!(
            "| form | R² of dy | R² of dr | error of y | error of r | y after 1 | 3 | 5 moves |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        for (name, form, edges) in [
            ("`Linear`, one fit", ReachForm::Linear, &[][..]),
            (
                "`Linear` per elbow interval",
                ReachForm::Linear,
                &ReachModel::PAPER_ELBOW_EDGES[..],
            ),
            (
                "`Rigid8` per elbow interval",
                ReachForm::Rigid8,
                &ReachModel::PAPER_ELBOW_EDGES[..],
            ),
            (
                "`Rigid22` per elbow interval",
                ReachForm::Rigid22,
                &ReachModel::PAPER_ELBOW_EDGES[..],
            ),
            ("`RigidBody`, one fit", ReachForm::RigidBody, &[][..]),
        ] {
            let mut rows = Vec::new();
            for seed in 0..seeds {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let (_, training) = sample_moves(&cell, count, noise, &mut rng);
                let (_, fresh) = sample_moves(&cell, count, noise, &mut rng);
                let model = ReachModel::fit(&training, form, edges)?;
                let quality = model.quality_on(&fresh)?;
                let (y, r) = (&quality[0], &quality[1]);
                let open = model.open_loop_error(&cell, 5, RUNS, &mut rng);
                rows.push([
                    y.r2,
                    r.r2,
                    y.rmse,
                    r.rmse,
                    open[0].y_mean,
                    open[2].y_mean,
                    open[4].y_mean,
                ]);
            }
            println!("| {name} | {} |", spread(&rows).join(" | "));
        }
        let mut rows = Vec::new();
        for seed in 0..seeds {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (training, _) = sample_moves(&cell, count, noise, &mut rng);
            let (plain, full) = (
                CentreModel::fit_without_radius(&training)?,
                CentreModel::fit(&training)?,
            );
            let (plain, full) = (&plain.quality()[0], &full.quality()[0]);
            rows.push([plain.r2, plain.rmse, full.r2, full.rmse]);
        }
        println!(
            "\n| centring: R² of dx on 1, d1 | error | on 1, d1, r d1 | error |\n|---|---|---|---|"
        );
        println!("| {} |", spread(&rows).join(" | "));
    }
    other_forms(&cell, count, seeds)?;
    other_samples(&cell, count, seeds)?;
    Setting::present().print(seeds)?;
    Setting::earlier().print(seeds)
}

/// Forms linear in y and r, which the library does not offer, for noise of 0.125 units.
fn other_forms(cell: &Cell, count: usize, seeds: u64) -> Result<(), Box<dyn Error>> {
    println!("\nOther forms, noise of 0.125 units, per elbow interval\n");
    println!("| form | R² of dy | R² of dr | error of y | error of r | y after 1 | 3 | 5 moves |");
    println!("|---|---|---|---|---|---|---|---|");
    for (name, terms) in OTHER_FORMS {
        let mut rows = Vec::new();
        for seed in 0..seeds {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (_, training) = sample_moves(cell, count, 0.125, &mut rng);
            let (_, fresh) = sample_moves(cell, count, 0.125, &mut rng);
            let form = Form::fit(
                &training,
                Linear::Image,
                terms,
                &ReachModel::PAPER_ELBOW_EDGES,
            )
            .ok_or("no fit")?;
            let [a, b, c, d] = form.quality(&fresh);
            let [e, f, g] =
                form.open_loop(cell, &Starts::paper(Balls::Anywhere), false, RUNS, &mut rng);
            rows.push([a, b, c, d, e, f, g]);
        }
        println!("| {name} | {} |", spread(&rows).join(" | "));
    }
    let mut rows = Vec::new();
    for seed in 0..seeds {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (training, _) = sample_moves(cell, count, 0.125, &mut rng);
        rows.push(centring_with_square(&training).ok_or("no fit")?);
    }
    println!(
        "\ncentring on 1, d1, r d1, r² d1: R², error: {}",
        spread(&rows).join(", ")
    );
    Ok(())
}

/// The library's forms and the others, fitted to and judged on other balls.
fn other_samples(cell: &Cell, count: usize, seeds: u64) -> Result<(), Box<dyn Error>> {
    for (balls, noise) in [
        (Balls::InPlane, 0.125),
        (Balls::InPlane, 0.5),
        (Balls::Within([0.5, 0.8], [-0.2, 0.05]), 0.125),
    ] {
        let starts = Starts::paper(balls);
        println!("\nBalls {balls:?}, noise of {noise} units\n");
        println!("| form | R² of dy | R² of dr | error of y | error of r | spread of dy | of dr |");
        println!("|---|---|---|---|---|---|---|");
        for form in [ReachForm::Linear, ReachForm::Rigid8, ReachForm::Rigid22] {
            let mut rows = Vec::new();
            for seed in 0..seeds {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let (_, training, _) = sample(cell, &starts, count, noise, &mut rng);
                let (_, fresh, _) = sample(cell, &starts, count, noise, &mut rng);
                let model = ReachModel::fit(&training, form, &ReachModel::PAPER_ELBOW_EDGES)?;
                let quality = model.quality_on(&fresh)?;
                let (y, r) = (&quality[0], &quality[1]);
                let of = |rmse: f64, r2: f64| rmse / (1.0 - r2).sqrt();
                rows.push([
                    y.r2,
                    r.r2,
                    y.rmse,
                    r.rmse,
                    of(y.rmse, y.r2),
                    of(r.rmse, r.r2),
                ]);
            }
            println!("| `{form:?}` | {} |", spread(&rows).join(" | "));
        }
        for (name, terms) in OTHER_FORMS {
            let mut rows = Vec::new();
            for seed in 0..seeds {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let (_, training, _) = sample(cell, &starts, count, noise, &mut rng);
                let (_, fresh, _) = sample(cell, &starts, count, noise, &mut rng);
                let form = Form::fit(
                    &training,
                    Linear::Image,
                    terms,
                    &ReachModel::PAPER_ELBOW_EDGES,
                )
                .ok_or("no fit")?;
                rows.push(form.quality(&fresh));
            }
            println!("| {name} | {} | | |", spread(&rows).join(" | "));
        }
        let mut rows = Vec::new();
        for seed in 0..seeds {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (training, _, _) = sample(cell, &starts, count, noise, &mut rng);
            let plain = CentreModel::fit_without_radius(&training)?.quality();
            let full = CentreModel::fit(&training)?.quality();
            rows.push([plain[0].r2, plain[0].rmse, full[0].r2, full[0].rmse]);
        }
        println!(
            "\ncentring on 1, d1 and on 1, d1, r d1: {}",
            spread(&rows).join(", ")
        );
    }
    Ok(())
}

/// Mean and 1.96 standard deviations of each column.
fn spread<const N: usize>(rows: &[[f64; N]]) -> [String; N] {
    let n = rows.len() as f64;
    std::array::from_fn(|k| {
        let mean = rows.iter().map(|row| row[k]).sum::<f64>() / n;
        let squares = rows.iter().map(|row| (row[k] - mean).powi(2)).sum::<f64>();
        let wide = 1.96 * (squares / (n - 1.0).max(1.0)).sqrt();
        format!("{mean:.4} ± {wide:.4}")
    })
}
