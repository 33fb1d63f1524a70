//! Prints how well each form of the regression simulators describes the cell: mean and 1.96
//! standard deviations of fits to several seeds, judged on fresh samples.
//!
//! ```text
//! cargo run --release -p pipeline-sim --example regression_table
//! ```

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use pipeline_sim::rand::SeedableRng;
use pipeline_sim::rand::rngs::Xoshiro256PlusPlus;
use pipeline_sim::{Ball, Cell, MoveForm, MoveModel, Quality};

const SAMPLES: usize = 2083;
const SEEDS: u64 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let edges = &MoveModel::PAPER_ELBOW_EDGES[..];
    println!("{SAMPLES} samples, {SEEDS} fits, errors in feature units");
    for noise in [0.125, 0.5] {
        println!("\nnoise of {noise} units");
        for (name, form, edges) in [
            ("Linear", MoveForm::Linear, edges),
            ("Rigid8", MoveForm::Rigid8, edges),
            ("Rigid22", MoveForm::Rigid22, edges),
            ("RigidBody", MoveForm::RigidBody, &[]),
        ] {
            print(name, |seed| {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let (_, training) = cell.sample_moves(SAMPLES, noise, &mut rng)?;
                let (_, fresh) = cell.sample_moves(SAMPLES, noise, &mut rng)?;
                Ok(MoveModel::fit(&training, form, edges)?.quality_on(&fresh)?)
            })?;
        }
        print("centering", |seed| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let (training, _) = cell.sample_moves(SAMPLES, noise, &mut rng)?;
            let (fresh, _) = cell.sample_moves(SAMPLES, noise, &mut rng)?;
            Ok(MoveModel::fit(&training, MoveForm::Centering, &[])?.quality_on(&fresh)?)
        })?;
    }
    Ok(())
}

/// Prints a row per output of the fits to all seeds.
fn print(
    name: &str,
    fit: impl Fn(u64) -> Result<Vec<Quality>, Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let fits = (0..SEEDS).map(fit).collect::<Result<Vec<_>, _>>()?;
    for (k, first) in fits[0].iter().enumerate() {
        let [r2, error] = [|q: &Quality| q.r2, |q: &Quality| q.rmse].map(|of| {
            let values = || fits.iter().map(|fit| of(&fit[k]));
            let mean = values().sum::<f64>() / SEEDS as f64;
            let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / (SEEDS - 1) as f64;
            format!("{mean:.4} ± {:.4}", 1.96 * variance.sqrt())
        });
        println!("{name:10} {}: R² {r2}, error {error}", first.output);
    }
    Ok(())
}
