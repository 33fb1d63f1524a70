//! The regression simulators against the geometry they imitate.

use hough_heuristic::Features;
use pipeline_sim::{
    Ball, Cell, ErrorLevel, Errors, MoveForm, MoveModel, MoveSample, QuantityError,
};

use crate::rng;

fn samples(seed: u64, count: usize, noise: f64) -> (Vec<MoveSample>, Vec<MoveSample>) {
    let mut rng = rng(seed);
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    cell.sample_moves(count, noise, &mut rng)
        .expect("sound noise")
}

fn fitted(samples: &[MoveSample], form: MoveForm) -> MoveModel {
    MoveModel::fit(samples, form, &[]).expect("enough samples")
}

/// Fits a form to samples that it refuses, and returns the reason.
fn refused(samples: &[MoveSample], form: MoveForm) -> String {
    let refused = MoveModel::fit(samples, form, &[]);
    refused.expect_err("not usable").to_string()
}

#[test]
fn forms_explain_their_known_share() {
    let (_, training) = samples(1, 2083, 0.125);
    let (_, fresh) = samples(2, 2083, 0.125);
    let edges = MoveModel::PAPER_ELBOW_EDGES;
    for (form, edges, dy, dr) in [
        (MoveForm::Linear, &edges[..], (0.85, 0.95), (0.45, 0.65)),
        (MoveForm::Rigid8, &edges[..], (0.96, 1.0), (0.97, 1.0)),
        (MoveForm::Rigid22, &edges[..], (0.995, 1.0), (0.995, 1.0)),
        (MoveForm::RigidBody, &[][..], (0.995, 1.0), (0.995, 1.0)),
    ] {
        let model = MoveModel::fit(&training, form, edges).expect("enough samples");
        let q = model.quality_on(&fresh).expect("samples");
        assert!(dy.0 < q[0].r2 && q[0].r2 < dy.1, "{form:?} {q:?}");
        assert!(dr.0 < q[1].r2 && q[1].r2 < dr.1, "{form:?} {q:?}");
    }
}

#[test]
fn centering_needs_the_product_of_radius_and_move() {
    let (training, _) = samples(3, 2000, 0.5);
    let r2 = |form| fitted(&training, form).quality()[0].r2;
    let (plain, full) = (r2(MoveForm::CenteringLinear), r2(MoveForm::Centering));
    assert!(
        (0.7..0.9).contains(&plain) && (0.92..0.99).contains(&full),
        "{plain} {full}"
    );
}

#[test]
fn samples_that_determine_no_model_are_refused() {
    let (centering, reaching) = samples(4, 60, 0.0);
    let few = refused(&reaching[..20], MoveForm::Rigid22);
    assert!(few.contains("at least 22, but is 20"), "{few}");
    assert!(refused(&centering[..2], MoveForm::Centering).contains("at least 3, but is 2"));
    assert!(refused(&[], MoveForm::Rigid8).contains("at least 8, but is 0"));
    let mut line = reaching.clone();
    line.iter_mut().for_each(|s| s.turns[2] = 0.5 * s.turns[1]);
    // So small that its square is nothing: a column that does not vary.
    let mut tiny = reaching.clone();
    tiny.iter_mut().for_each(|s| s.turns[1] *= 1e-200);
    for flat in [line, tiny] {
        let refused = MoveModel::fit(&flat, MoveForm::Linear, &[]);
        let Err(QuantityError::Undetermined {
            rank: 2, terms: 3, ..
        }) = refused
        else {
            panic!("{refused:?}");
        };
    }
    let mut broken = reaching.clone();
    broken[7].after.r = f64::NAN;
    assert!(refused(&broken, MoveForm::Linear).starts_with("sample 7: r after"));
    let edges = MoveModel::fit(&reaching, MoveForm::Linear, &[190.0, 175.0]);
    assert!(matches!(edges, Err(QuantityError::Range { .. })));
    for form in [MoveForm::Linear, MoveForm::Rigid8] {
        let judged = fitted(&reaching, form).quality_on(&[]);
        let judged = judged.expect_err("nothing to judge on").to_string();
        assert!(judged.contains("number of samples"), "{form:?}: {judged}");
    }
}

#[test]
fn numbers_too_large_to_be_squared_are_named() {
    let (centering, reaching) = samples(4, 60, 0.0);
    type Spoil = fn(&mut MoveSample);
    let spoilt: [(&[MoveSample], Spoil, MoveForm, &str); 7] = [
        (
            &reaching,
            |s| s.before.r = 1e-310,
            MoveForm::Rigid8,
            "the term Za",
        ),
        (
            &reaching,
            |s| s.turns[1] = 1e200,
            MoveForm::Linear,
            "the term d2",
        ),
        (
            &reaching,
            |s| s.turns[2] = -1e80,
            MoveForm::Rigid22,
            "the term b²",
        ),
        (
            &reaching,
            |s| s.after.y = 1e300,
            MoveForm::Linear,
            "the change of y",
        ),
        (
            &reaching,
            |s| s.after.r = 1e-200,
            MoveForm::RigidBody,
            "the change of Z = 33 / r",
        ),
        (
            &centering,
            |s| (s.before.r, s.turns[0]) = (1e200, 1.0),
            MoveForm::Centering,
            "the term r d1",
        ),
        (
            &centering,
            |s| s.before.r = -1.0,
            MoveForm::Centering,
            "r before",
        ),
    ];
    for (samples, spoil, form, named) in spoilt {
        let mut broken = samples.to_vec();
        spoil(&mut broken[9]);
        let refused = refused(&broken, form);
        assert!(
            refused.starts_with(&format!("sample 9: {named} must")),
            "{named}: {refused}"
        );
    }
}

#[test]
fn refits_take_any_power_and_refuse_impossible_ridges() {
    let (_, nominal) = samples(9, 800, 0.125);
    let (_, few) = samples(10, 100, 0.5);
    let model = fitted(&nominal, MoveForm::Rigid22);
    let s = few[0];
    let y = |model: &MoveModel| {
        let after = model.predict_unbounded(&s.before, s.jt3_degrees, s.turns);
        after.expect("finite").y
    };
    let refit = |power| y(&model.refit(&few, 0.01, power).expect("a prior helps out"));
    for power in [0.0, 4.0, 200.0, 1e6, -1e6, 1e300] {
        assert!((refit(power) - y(&model)).abs() < 20.0, "{power}");
    }
    assert!((refit(1.0) - refit(8.0)).abs() > 1e-6, "weights do count");
    for (ridge, power, named) in [
        (f64::INFINITY, 2.0, "ridge"),
        (f64::NAN, 2.0, "ridge"),
        (-1.0, 2.0, "ridge"),
        (1e200, 2.0, "ridge"),
        (0.1, f64::INFINITY, "power of the radius"),
    ] {
        let refused = model
            .refit(&few, ridge, power)
            .expect_err("no such prior")
            .to_string();
        assert!(refused.contains(named), "{refused}");
    }
    assert_eq!(
        model.refit(&[], 0.01, 2.0),
        Ok(model.clone()),
        "nothing to learn from"
    );
    let mut broken = few.clone();
    broken[3].after.x = f64::NAN;
    assert!(model.refit(&broken, 0.01, 2.0).is_err());
}

#[test]
fn samples_without_a_prediction_count_as_errors() {
    let (_, training) = samples(1, 2000, 0.125);
    let model = fitted(&training, MoveForm::Rigid8);
    // Large balls that come nearer still: the model soon has them behind the camera.
    let behind = |s: &MoveSample| {
        let after = model.predict_unbounded(&s.before, s.jt3_degrees, s.turns);
        after.is_none()
    };
    let lost = |s: &MoveSample| {
        let after = Features {
            y: s.before.y + 10.0,
            ..s.before
        };
        MoveSample {
            turns: [0.0, 200.0, s.turns[2]],
            after,
            ..*s
        }
    };
    let large = training.iter().filter(|s| s.before.r > 20.0);
    let lost: Vec<MoveSample> = large.map(lost).filter(behind).take(100).collect();
    let judged = |samples: &[MoveSample]| model.quality_on(samples).expect("samples");
    let q = judged(&lost);
    assert_eq!((q[0].samples, q[0].unpredicted), (100, 100));
    assert!((q[0].rmse - 10.0).abs() < 1e-9, "{q:?}");
    let mixed: Vec<MoveSample> = training[..900].iter().chain(&lost).copied().collect();
    let (with, without) = (judged(&mixed), judged(&training[..900]));
    assert_eq!((with[1].samples, with[1].unpredicted), (1000, 100));
    assert_eq!(without[0].unpredicted, 0);
    assert!(
        (with[0].rmse - without[0].rmse).abs() > 0.01,
        "{with:?} {without:?}"
    );
}

#[test]
fn refit_learns_a_wrong_arm_from_few_moves() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (centering, reaching) = samples(9, 1500, 0.125);
    let mut rng = rng(10);
    let heavy = ErrorLevel::Heavy.draw(&mut rng);
    let larger = Errors {
        radius_factor: 1.5,
        ..Errors::none()
    };
    for (form, nominal, errors, ridge, power, count, gain) in [
        (MoveForm::Rigid22, reaching, heavy, 0.001, 2.0, 200, 0.5),
        (MoveForm::Centering, centering, larger, 0.01, 0.0, 30, 0.8),
    ] {
        let model = fitted(&nominal, form);
        let wrong = errors.apply(&cell).expect("sound errors");
        let mut drawn = |count, noise| {
            let (centering, reaching) = wrong
                .sample_moves(count, noise, &mut rng)
                .expect("sound noise");
            if form == MoveForm::Centering {
                centering
            } else {
                reaching
            }
        };
        let (few, fresh) = (drawn(count, 0.5), drawn(1000, 0.0));
        let rmse = |model: &MoveModel| model.quality_on(&fresh).expect("samples")[0].rmse;
        let refit = |samples: &[MoveSample], ridge| {
            rmse(
                &model
                    .refit(samples, ridge, power)
                    .expect("a prior helps out"),
            )
        };
        let (before, after) = (rmse(&model), refit(&few, ridge));
        assert!(after < gain * before, "{form:?}: {before} {after}");
        // So strong a prior leaves all as it was; without one, two samples have no answer, and
        // many give a fit of their own.
        assert!((refit(&few, 1e12) - before).abs() < 1e-3, "{form:?}");
        assert!(model.refit(&few[..2], 0.0, power).is_err());
        assert!(refit(&few[..2], 0.5) < 1.5 * before, "{form:?}");
        let own = rmse(&fitted(&few, form));
        assert!(
            power > 0.0 || (refit(&few, 0.0) - own).abs() < 1e-9,
            "{form:?}"
        );
    }
}

#[test]
fn predictions_from_impossible_arguments_are_none() {
    let (centering, reaching) = samples(4, 300, 0.1);
    for (samples, form) in [
        (reaching, MoveForm::Rigid8),
        (centering, MoveForm::Centering),
    ] {
        let model = fitted(&samples, form);
        let sound = Cell::GOAL;
        assert!(model.predict(&sound, 180.0, [1.0; 3]).is_some());
        for (x, y, r) in [
            (f64::NAN, 72.0, 30.0),
            (96.0, f64::INFINITY, 30.0),
            (96.0, 72.0, 0.0),
        ] {
            let before = Features { x, y, r };
            assert_eq!(model.predict_unbounded(&before, 180.0, [1.0; 3]), None);
        }
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(model.predict_unbounded(&sound, bad, [1.0; 3]), None);
            assert_eq!(model.predict(&sound, 180.0, [bad, 1.0, bad]), None);
        }
    }
}
