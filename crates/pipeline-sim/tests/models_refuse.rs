//! What the regression simulators refuse.

use hough_heuristic::Features;
use pipeline_sim::{
    Ball, Cell, CentreModel, CentreSample, MOST_SAMPLES, QuantityError, ReachForm, ReachModel,
    ReachSample, StoredModelError, sample_moves, try_sample_moves, with_noise,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

fn samples(count: usize) -> (Vec<CentreSample>, Vec<ReachSample>) {
    sample_moves(
        &Cell::paper(Ball::at(0.6, 0.0, -0.1)),
        count,
        0.125,
        &mut rng(1),
    )
}

#[test]
fn damaged_numbers_of_a_stored_model_are_refused() {
    let (centring, reaching) = samples(300);
    let reach = ReachModel::fit(&reaching, ReachForm::Linear, &[])
        .expect("enough samples")
        .to_text();
    let centre = CentreModel::fit(&centring)
        .expect("enough samples")
        .to_text();
    let damaged = |text: &str, line: &str| {
        let name = line.split(' ').next().expect("a name");
        let put = |old: &str| {
            if old.split(' ').next() == Some(name) {
                line.to_owned()
            } else {
                old.to_owned()
            }
        };
        text.lines().map(put).collect::<Vec<_>>().join("\n")
    };
    let gram = format!("inverse-gram{}", " -1.0".repeat(9));
    let lopsided = "inverse-gram 1 0.5 0 0 1 0 0 0 1";
    for line in [
        "accuracy NaN 1",
        "accuracy 0.9 -5",
        "accuracy 1.5 1",
        "condition NaN",
        "condition -3",
        "samples 0",
        "judged-on 3 900",
        &gram,
        lopsided,
    ] {
        let said = [
            ReachModel::from_text(&damaged(&reach, line)).err(),
            CentreModel::from_text(&damaged(&centre, line)).err(),
        ];
        for error in said {
            assert!(
                matches!(error, Some(StoredModelError::Contents { .. })),
                "{line}: {error:?}"
            );
        }
    }
    assert!(ReachModel::from_text(&damaged(&reach, "residual -1 1")).is_err());
    assert!(CentreModel::from_text(&damaged(&centre, "residual -1")).is_err());
    assert!(ReachModel::from_text(&reach.replacen("reach-model 1", "reach-model1", 1)).is_err());
}

#[test]
fn a_model_is_not_judged_on_what_is_no_number() {
    let (centring, reaching) = samples(300);
    let reach = ReachModel::fit(&reaching, ReachForm::Rigid8, &[]).expect("enough samples");
    let centre = CentreModel::fit(&centring).expect("enough samples");
    let (mut moved, mut turned) = (reaching.clone(), centring);
    moved[4].after.y = f64::NAN;
    turned[4].after.x = f64::INFINITY;
    for (refused, name) in [
        (reach.quality_on(&moved), "sample 4: y after"),
        (centre.quality_on(&turned), "sample 4: x after"),
    ] {
        assert!(
            matches!(&refused, Err(QuantityError::NotFinite { quantity, .. }) if quantity == name),
            "{refused:?}"
        );
    }
    let mut aside = reaching;
    aside[4].before.x = f64::NAN;
    let refused = ReachModel::fit(&aside, ReachForm::Rigid8, &[]).expect_err("no number");
    assert!(refused.to_string().contains("x before"), "{refused}");
}

#[test]
fn there_is_no_prediction_from_what_is_no_ball_or_no_number() {
    let (centring, reaching) = samples(300);
    let goal = Cell::GOAL;
    for form in [ReachForm::Linear, ReachForm::Rigid8] {
        let model = ReachModel::fit(&reaching, form, &[]).expect("enough samples");
        assert!(model.uncertainty(&goal, 180.0, 2.0, 2.0).is_some());
        let with_radius = |r| Features { r, ..goal };
        for (before, jt3, d2) in [
            (goal, f64::NAN, 2.0),
            (goal, 180.0, f64::INFINITY),
            (with_radius(-20.0), 180.0, 2.0),
            (with_radius(f64::NAN), 180.0, 2.0),
        ] {
            let place = (form, before, jt3, d2);
            assert_eq!(
                model.predict_unbounded(&before, jt3, d2, 2.0),
                None,
                "{place:?}"
            );
            assert_eq!(model.uncertainty(&before, jt3, d2, 2.0), None, "{place:?}");
        }
        let speck = model.uncertainty(&with_radius(1e-300), 180.0, 2.0, 2.0);
        assert!(speck.is_none_or(|(y, r)| y.is_finite() && r.is_finite()));
    }
    let centre = CentreModel::fit(&centring).expect("enough samples");
    assert!(centre.uncertainty(&goal, 2.0).is_some());
    assert_eq!(centre.uncertainty(&goal, f64::NAN), None);
    assert_eq!(
        centre.uncertainty(
            &Features {
                r: f64::NAN,
                ..goal
            },
            2.0
        ),
        None
    );
}

#[test]
fn nothing_is_allocated_by_the_number_asked_for() {
    let (_, reaching) = samples(300);
    let model = ReachModel::fit(&reaching, ReachForm::Rigid8, &[]).expect("enough samples");
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let errors = model.open_loop_error(&cell, usize::MAX, 0, &mut rng(1));
    assert_eq!(errors.len(), 10_000);
    let mut blind = cell;
    blind.sight.min_share = f64::NAN;
    let (turns, moves) = sample_moves(&blind, usize::MAX, 0.1, &mut rng(1));
    assert!(turns.is_empty() && moves.is_empty());
}

#[test]
fn numbers_that_can_only_be_mistakes_are_refused() {
    let (_, reaching) = samples(300);
    let model = ReachModel::fit(&reaching, ReachForm::Rigid8, &[]).expect("enough samples");
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let too_many =
        |refused: Option<QuantityError>| matches!(refused, Some(QuantityError::TooLarge { .. }));
    let moves = ReachModel::MOST_MOVES + 1;
    assert!(too_many(
        model
            .try_open_loop_error(&cell, moves, 1, &mut rng(1))
            .err()
    ));
    let (told, refused) = (
        model.try_open_loop_error(&cell, 2, 5, &mut rng(1)),
        try_sample_moves(&cell, MOST_SAMPLES + 1, 0.1, &mut rng(1)),
    );
    assert_eq!(told, Ok(model.open_loop_error(&cell, 2, 5, &mut rng(1))));
    assert!(too_many(refused.err()));
    assert!(too_many(
        model
            .try_open_loop_error(&cell, 1, usize::MAX, &mut rng(1))
            .err()
    ));
    let none = model.try_open_loop_error(&cell, 1, 0, &mut rng(1));
    assert!(matches!(none, Err(QuantityError::NotPositive { .. })));
}

#[test]
fn the_sign_of_a_standard_deviation_does_not_count() {
    let [above, below] = [1.0, -1.0].map(|sigma| with_noise(Cell::GOAL, sigma, &mut rng(1)));
    assert_eq!(above, below);
    assert!(above != Cell::GOAL);
}
