//! Fits the regression simulator of approaching to samples of moves and predicts a move with it.
//!
//! ```text
//! cargo run --release -p pipeline-sim --example fit_regression
//! ```

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;

use pipeline_sim::rand::SeedableRng;
use pipeline_sim::rand::rngs::Xoshiro256PlusPlus;
use pipeline_sim::{Ball, Cell, ErrorLevel, MoveForm, MoveModel};

fn main() -> Result<(), Box<dyn Error>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (_, samples) = cell.sample_moves(2_000, 0.125, &mut rng)?;
    let model = MoveModel::fit(&samples, MoveForm::Rigid22, &[])?;
    for quality in model.quality() {
        println!(
            "{}: R² {:.4}, error {:.2} units",
            quality.output, quality.r2, quality.rmse
        );
    }

    let sample = &samples[0];
    let after = model.predict(&sample.before, sample.jt3_degrees, sample.turns);
    println!(
        "before {:?}\npredicted {after:?}\nobserved {:?}",
        sample.before, sample.after
    );

    // A few moves of an arm that differs from the nominal one improve the model for that arm.
    let wrong = ErrorLevel::Heavy.draw(&mut rng).apply(&cell)?;
    let (_, few) = wrong.sample_moves(50, 0.5, &mut rng)?;
    let (_, fresh) = wrong.sample_moves(1_000, 0.0, &mut rng)?;
    let refitted = model.refit(&few, 0.001, 2.0)?;
    let errors = [model.quality_on(&fresh)?, refitted.quality_on(&fresh)?];
    println!(
        "another arm: error of y {:.2}, refitted {:.2}",
        errors[0][0].rmse, errors[1][0].rmse
    );
    Ok(())
}
