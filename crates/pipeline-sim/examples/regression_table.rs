//! Prints how well each form of the regression simulators describes the cell: mean and 1.96
//! standard deviations of fits to several seeds, judged on fresh samples.
//!
//! ```text
//! cargo run --release -p pipeline-sim --example regression_table
//! ```
//!
//! An argument is the number of seeds, at least 2 (default 20).

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use pipeline_sim::rand::SeedableRng;
use pipeline_sim::rand::rngs::Xoshiro256PlusPlus;
use pipeline_sim::{Ball, Cell, MoveForm, MoveModel, Quality};

const SAMPLES: usize = 2083;
const EDGES: &[f64] = &MoveModel::PAPER_ELBOW_EDGES;
const FORMS: [(&str, MoveForm, &[f64]); 5] = [
    ("Linear", MoveForm::Linear, EDGES),
    ("Rigid8", MoveForm::Rigid8, EDGES),
    ("Rigid22", MoveForm::Rigid22, EDGES),
    ("RigidBody", MoveForm::RigidBody, &[]),
    ("centering", MoveForm::Centering, &[]),
];

fn main() -> Result<(), Box<dyn Error>> {
    let seeds = std::env::args()
        .nth(1)
        .map_or(Ok(20), |seeds| seeds.parse())?;
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    println!("{SAMPLES} samples, {seeds} fits, errors in feature units");
    for noise in [0.125, 0.5] {
        println!("\nnoise of {noise} units");
        let mut fits = [const { Vec::new() }; FORMS.len()];
        for seed in 0..seeds {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let training = cell.sample_moves(SAMPLES, noise, &mut rng)?;
            let fresh = cell.sample_moves(SAMPLES, noise, &mut rng)?;
            for ((_, form, edges), fits) in FORMS.into_iter().zip(&mut fits) {
                let (training, fresh) = match form {
                    MoveForm::Centering => (&training.0, &fresh.0),
                    _ => (&training.1, &fresh.1),
                };
                fits.push(MoveModel::fit(training, form, edges)?.quality_on(fresh)?);
            }
        }
        for ((name, ..), fits) in FORMS.iter().zip(&fits) {
            print(name, fits);
        }
    }
    Ok(())
}

/// Prints a row per output of the fits to all seeds.
fn print(name: &str, fits: &[Vec<Quality>]) {
    let seeds = fits.len() as f64;
    for (k, first) in fits.first().into_iter().flatten().enumerate() {
        let [r2, error] = [|q: &Quality| q.r2, |q: &Quality| q.rmse].map(|of| {
            let values = || fits.iter().map(|fit| of(&fit[k]));
            let mean = values().sum::<f64>() / seeds;
            let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / (seeds - 1.0);
            format!("{mean:.4} ± {:.4}", 1.96 * variance.sqrt())
        });
        println!("{name:10} {}: R² {r2}, error {error}", first.output);
    }
}
