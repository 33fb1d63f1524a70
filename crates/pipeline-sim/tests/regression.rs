//! The regression simulators against the geometry they imitate.
#![allow(clippy::print_stdout)] // Measured qualities, shown with --nocapture.

use pipeline_sim::{
    Ball, Cell, CentreModel, FitError, ReachForm, ReachModel, ReachSample, sample_moves,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn samples(
    seed: u64,
    count: usize,
    noise: f64,
) -> (Vec<pipeline_sim::CentreSample>, Vec<ReachSample>) {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    sample_moves(
        &cell,
        count,
        noise,
        &mut Xoshiro256PlusPlus::seed_from_u64(seed),
    )
}

#[test]
fn every_form_explains_what_it_is_known_to_explain() {
    let (_, training) = samples(1, 2083, 0.125);
    let (_, fresh) = samples(2, 2083, 0.125);
    let edges = ReachModel::PAPER_ELBOW_EDGES;
    for (form, edges, dy, dr) in [
        (ReachForm::Linear, &edges[..], (0.85, 0.95), (0.45, 0.65)),
        (ReachForm::Rigid8, &edges[..], (0.96, 1.0), (0.97, 1.0)),
        (ReachForm::Rigid22, &edges[..], (0.995, 1.0), (0.995, 1.0)),
        (ReachForm::RigidBody, &[][..], (0.995, 1.0), (0.995, 1.0)),
    ] {
        let model = ReachModel::fit(&training, form, edges).expect("enough samples");
        let q = model.quality_on(&fresh).expect("samples");
        println!(
            "{form:?}: training {:?} fresh {q:?} condition {:?}",
            model.quality(),
            model.condition_numbers()
        );
        assert!(dy.0 < q[0].r2 && q[0].r2 < dy.1, "{form:?} {q:?}");
        assert!(dr.0 < q[1].r2 && q[1].r2 < dr.1, "{form:?} {q:?}");
    }
}

#[test]
fn centring_needs_the_product_of_radius_and_move() {
    let (training, _) = samples(3, 2000, 0.5);
    let plain = CentreModel::fit_without_radius(&training).expect("enough samples");
    let full = CentreModel::fit(&training).expect("enough samples");
    println!("{:?} {:?}", plain.quality(), full.quality());
    let (plain, full) = (plain.quality()[0].r2, full.quality()[0].r2);
    assert!(
        (0.7..0.9).contains(&plain) && (0.92..0.99).contains(&full),
        "{plain} {full}"
    );
}

#[test]
fn samples_that_do_not_determine_a_model_are_refused() {
    let (centring, reaching) = samples(4, 60, 0.0);
    assert!(matches!(
        ReachModel::fit(&reaching[..20], ReachForm::Rigid22, &[]),
        Err(FitError::TooFewSamples {
            got: 20,
            needed: 22,
            ..
        })
    ));
    let line: Vec<ReachSample> = reaching
        .iter()
        .map(|s| ReachSample {
            d3: 0.5 * s.d2,
            ..*s
        })
        .collect();
    assert!(matches!(
        ReachModel::fit(&line, ReachForm::Linear, &[]),
        Err(FitError::RankDeficient {
            rank: 2,
            terms: 3,
            ..
        })
    ));
    let mut broken = reaching.clone();
    broken[7].after.r = f64::NAN;
    assert!(matches!(
        ReachModel::fit(&broken, ReachForm::Linear, &[]),
        Err(FitError::NotFinite {
            index: 7,
            quantity: "r after",
            ..
        })
    ));
    assert!(matches!(
        ReachModel::fit(&reaching, ReachForm::Linear, &[190.0, 175.0]),
        Err(FitError::Edges { .. })
    ));
    assert!(matches!(
        CentreModel::fit(&centring[..2]),
        Err(FitError::TooFewSamples { .. })
    ));
    assert!(matches!(
        ReachModel::fit(&[], ReachForm::Rigid8, &[]),
        Err(FitError::TooFewSamples { got: 0, .. })
    ));
}

#[test]
fn the_expected_error_of_a_prediction_is_the_one_that_occurs() {
    let (_, training) = samples(5, 1500, 0.5);
    let (_, fresh) = samples(6, 1500, 0.5);
    let model = ReachModel::fit(&training, ReachForm::Linear, &ReachModel::PAPER_ELBOW_EDGES)
        .expect("enough samples");
    let (mut y, mut r) = (0.0, 0.0);
    for s in &fresh {
        let after = model
            .predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3)
            .expect("finite");
        let (sy, sr) = model
            .uncertainty(&s.before, s.jt3_degrees, s.d2, s.d3)
            .expect("finite");
        y += ((after.y - s.after.y) / sy).powi(2) / fresh.len() as f64;
        r += ((after.r - s.after.r) / sr).powi(2) / fresh.len() as f64;
    }
    assert!(
        (0.8..1.25).contains(&y) && (0.7..1.4).contains(&r),
        "{y} {r}"
    );
}

/// Mean squared errors of y and of r over the expected variance, for each third of `samples`
/// ordered by `key`.
fn calibration(
    model: &ReachModel,
    samples: &[ReachSample],
    key: impl Fn(&ReachSample) -> f64,
) -> Vec<(f64, f64)> {
    let mut sorted = samples.to_vec();
    sorted.sort_by(|a, b| key(a).total_cmp(&key(b)));
    let third = sorted.len() / 3;
    let of = |part: &[ReachSample]| {
        let mut sums = (0.0, 0.0);
        for s in part {
            let after = model
                .predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3)
                .expect("finite");
            let (sy, sr) = model
                .uncertainty(&s.before, s.jt3_degrees, s.d2, s.d3)
                .expect("finite");
            sums.0 += ((after.y - s.after.y) / sy).powi(2) / part.len() as f64;
            sums.1 += ((after.r - s.after.r) / sr).powi(2) / part.len() as f64;
        }
        sums
    };
    sorted.chunks_exact(third).take(3).map(of).collect()
}

#[test]
fn it_is_so_near_and_far_whatever_the_form() {
    let mut wrong = Vec::new();
    for noise in [0.125, 0.5] {
        let (_, training) = samples(5, 3000, noise);
        let (_, fresh) = samples(6, 3000, noise);
        let edges = ReachModel::PAPER_ELBOW_EDGES;
        for (form, edges, least, most) in [
            (ReachForm::Linear, &edges[..], 0.3, 3.0),
            // What this form cannot express is not noise; its size is told, its pattern only
            // roughly.
            (ReachForm::Rigid8, &edges[..], 0.15, 2.5),
            (ReachForm::Rigid22, &edges[..], 0.5, 2.0),
            (ReachForm::RigidBody, &[][..], 0.5, 2.0),
        ] {
            let model = ReachModel::fit(&training, form, edges).expect("enough samples");
            let near = calibration(&model, &fresh, |s| s.before.r);
            let nearer = calibration(&model, &fresh, |s| s.after.r / s.before.r);
            println!("{form:?} {noise}: by r {near:.2?} by approach {nearer:.2?}");
            for (y, r) in near.into_iter().chain(nearer) {
                let sound = (least..most).contains(&y) && (least..most).contains(&r);
                wrong.extend((!sound).then_some((form, noise, y, r)));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn what_a_fit_leaves_is_reported() {
    let (centring, reaching) = samples(12, 2000, 0.125);
    let linear = ReachModel::fit(&reaching, ReachForm::Linear, &[]).expect("enough samples");
    let [(y, r)] = linear.residual_noise()[..] else {
        panic!("one interval");
    };
    let q = linear.quality();
    // The same residuals, but for three degrees of freedom out of two thousand.
    assert!(
        (y / q[0].rmse - 1.0).abs() < 0.002 && y > q[0].rmse,
        "{y} {q:?}"
    );
    assert!(
        (r / q[1].rmse - 1.0).abs() < 0.002 && r > q[1].rmse,
        "{r} {q:?}"
    );
    let by_elbow = ReachModel::fit(
        &reaching,
        ReachForm::Rigid22,
        &ReachModel::PAPER_ELBOW_EDGES,
    );
    assert_eq!(by_elbow.expect("enough samples").residual_noise().len(), 3);
    let centre = CentreModel::fit(&centring).expect("enough samples");
    let rmse = centre.quality()[0].rmse;
    assert!((centre.residual_noise() / rmse - 1.0).abs() < 0.002 && centre.residual_noise() > rmse);
}

#[test]
fn numbers_too_large_or_too_small_are_named() {
    let (centring, reaching) = samples(4, 60, 0.0);
    let quantity = |change: &dyn Fn(&mut ReachSample), form| {
        let mut broken = reaching.clone();
        change(&mut broken[9]);
        let refused = ReachModel::fit(&broken, form, &[]).expect_err("not usable");
        let FitError::NotFinite {
            index: 9, quantity, ..
        } = refused
        else {
            panic!("{refused}");
        };
        quantity
    };
    assert_eq!(
        quantity(&|s| s.before.r = 1e-310, ReachForm::Rigid8),
        "the term Za"
    );
    assert_eq!(
        quantity(&|s| s.d2 = 1e200, ReachForm::Linear),
        "the term d2"
    );
    assert_eq!(
        quantity(&|s| s.d3 = -1e80, ReachForm::Rigid22),
        "the term b²"
    );
    assert_eq!(
        quantity(&|s| s.after.y = 1e300, ReachForm::Linear),
        "the change of y"
    );
    assert_eq!(
        quantity(&|s| s.after.r = 1e-200, ReachForm::RigidBody),
        "the change of Z = 33 / r"
    );
    let mut broken = centring;
    broken[5].before.r = 1e200;
    broken[5].d1 = 1.0;
    assert!(matches!(
        CentreModel::fit(&broken),
        Err(FitError::NotFinite {
            index: 5,
            quantity: "the term r d1",
            ..
        })
    ));
    broken[5].before.r = -1.0;
    assert!(matches!(
        CentreModel::fit(&broken),
        Err(FitError::NotFinite {
            quantity: "r before",
            ..
        })
    ));
    // So small that its square is nothing: a column that does not vary.
    let mut tiny = reaching;
    for s in &mut tiny {
        s.d2 *= 1e-200;
    }
    assert!(matches!(
        ReachModel::fit(&tiny, ReachForm::Linear, &[]),
        Err(FitError::RankDeficient { rank: 2, .. })
    ));
}

#[test]
fn no_power_of_the_radius_and_no_ridge_is_too_much_for_a_refit() {
    let (_, nominal) = samples(9, 800, 0.125);
    let (_, few) = samples(10, 100, 0.5);
    let model = ReachModel::fit(&nominal, ReachForm::Rigid22, &[]).expect("enough samples");
    let s = few[0];
    let y = |model: &ReachModel| {
        model
            .predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3)
            .expect("finite")
            .y
    };
    for power in [0.0, 4.0, 200.0, 1e6, -1e6, 1e300] {
        let refitted = model.refit(&few, 0.01, power).expect("a prior helps out");
        assert!(
            (y(&refitted) - y(&model)).abs() < 20.0,
            "{power}: {}",
            y(&refitted)
        );
        let (sy, sr) = refitted
            .uncertainty(&s.before, s.jt3_degrees, s.d2, s.d3)
            .expect("finite");
        assert!(
            sy.is_finite() && sr.is_finite() && sy > 0.0,
            "{power}: {sy} {sr}"
        );
    }
    // Powers only tell samples apart: a thousandfold radius throughout would change nothing.
    let [a, b] =
        [1.0, 8.0].map(|power| y(&model.refit(&few, 0.01, power).expect("a prior helps out")));
    assert!((a - b).abs() > 1e-6, "weights do count");
    for (ridge, power) in [
        (f64::INFINITY, 2.0),
        (-1.0, 2.0),
        (1e200, 2.0),
        (0.1, f64::INFINITY),
    ] {
        assert!(matches!(
            model.refit(&few, ridge, power),
            Err(FitError::Prior { .. })
        ));
    }
    let same = model.refit(&[], 0.01, 2.0).expect("nothing to learn from");
    assert_eq!(same, model);
}

#[test]
fn samples_without_a_prediction_count_as_errors() {
    let (_, training) = samples(1, 2000, 0.125);
    let model = ReachModel::fit(&training, ReachForm::Rigid8, &[]).expect("enough samples");
    // Large balls that come nearer still: the model soon has them behind the camera.
    let lost: Vec<ReachSample> = training
        .iter()
        .filter(|s| s.before.r > 20.0)
        .map(|s| ReachSample {
            d2: 200.0,
            after: hough_heuristic::Features {
                y: s.before.y + 10.0,
                ..s.before
            },
            ..*s
        })
        .filter(|s| {
            model
                .predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3)
                .is_none()
        })
        .take(100)
        .collect();
    assert_eq!(lost.len(), 100);
    let q = model.quality_on(&lost).expect("samples");
    assert_eq!((q[0].samples, q[0].unpredicted), (100, 100));
    assert!((q[0].rmse - 10.0).abs() < 1e-9, "{q:?}");
    let mixed: Vec<ReachSample> = training[..900].iter().chain(&lost).copied().collect();
    let (with, without) = (
        model.quality_on(&mixed).expect("samples"),
        model.quality_on(&training[..900]).expect("samples"),
    );
    assert_eq!((with[1].samples, with[1].unpredicted), (1000, 100));
    assert_eq!(without[0].unpredicted, 0);
    assert!(
        (with[0].rmse - without[0].rmse).abs() > 0.01,
        "{with:?} {without:?}"
    );
}

#[test]
fn a_model_believed_for_several_moves_drifts_as_its_form_lets_expect() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (_, training) = samples(7, 2083, 0.125);
    let mut last = f64::MAX;
    for form in [
        ReachForm::Linear,
        ReachForm::Rigid8,
        ReachForm::Rigid22,
        ReachForm::RigidBody,
    ] {
        let edges = match form {
            ReachForm::RigidBody => &[][..],
            _ => &ReachModel::PAPER_ELBOW_EDGES[..],
        };
        let model = ReachModel::fit(&training, form, edges).expect("enough samples");
        let errors =
            model.open_loop_error(&cell, 5, 400, &mut Xoshiro256PlusPlus::seed_from_u64(8));
        for e in [errors[0], errors[2], errors[4]] {
            println!("{form:?}: {e:?}");
        }
        assert!(
            errors[4].y_mean > errors[0].y_mean && errors[4].y_mean < last,
            "{form:?}"
        );
        assert!(errors.iter().all(|e| e.runs + e.lost <= 400));
        last = errors[4].y_mean;
    }
    assert!(last < 1.0, "{last}");
}

#[test]
fn a_refit_learns_a_wrong_arm_from_few_moves() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (_, nominal) = samples(9, 1500, 0.125);
    let model = ReachModel::fit(&nominal, ReachForm::Rigid22, &[]).expect("enough samples");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(10);
    let wrong = pipeline_sim::ErrorLevel::Heavy
        .draw(&mut rng)
        .apply(&cell)
        .expect("sound errors");
    let (_, few) = sample_moves(&wrong, 200, 0.5, &mut rng);
    let (_, fresh) = sample_moves(&wrong, 1000, 0.0, &mut rng);
    let refitted = model.refit(&few, 0.001, 2.0).expect("a prior helps out");
    let (before, after) = (
        model.quality_on(&fresh).expect("samples"),
        refitted.quality_on(&fresh).expect("samples"),
    );
    println!("{before:?} {after:?}");
    assert!(after[0].rmse < 0.5 * before[0].rmse && after[1].rmse < before[1].rmse);
    // So strong a prior that nothing moves, and none at all with too few samples.
    let held = model.refit(&few, 1e12, 2.0).expect("a prior helps out");
    let s = few[0];
    let (p, q) = (
        held.predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3)
            .expect("finite"),
        model
            .predict_unbounded(&s.before, s.jt3_degrees, s.d2, s.d3)
            .expect("finite"),
    );
    assert!((p.y - q.y).abs() < 1e-3 && (p.r - q.r).abs() < 1e-3);
    assert!(model.refit(&few[..5], 0.0, 2.0).is_err() && model.refit(&few[..5], 0.02, 2.0).is_ok());
    assert!(matches!(
        model.refit(&few, f64::NAN, 2.0),
        Err(FitError::Prior { .. })
    ));
}

#[test]
fn no_model_is_judged_on_nothing() {
    let (centring, reaching) = samples(4, 60, 0.0);
    let reach = ReachModel::fit(&reaching, ReachForm::Linear, &[]).expect("enough samples");
    let centre = CentreModel::fit(&centring).expect("enough samples");
    for refused in [reach.quality_on(&[]), centre.quality_on(&[])] {
        let refused = refused.expect_err("nothing").to_string();
        assert!(refused.contains("number of samples"), "{refused}");
    }
}

#[test]
fn a_refit_of_centring_learns_a_wrong_arm_from_few_moves() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (nominal, _) = samples(9, 1500, 0.125);
    let model = CentreModel::fit(&nominal).expect("enough samples");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(10);
    let mut errors = pipeline_sim::Errors::none();
    errors.radius_factor = 1.5;
    let wrong = errors.apply(&cell).expect("sound errors");
    let (few, _) = sample_moves(&wrong, 30, 0.5, &mut rng);
    let (fresh, _) = sample_moves(&wrong, 1000, 0.0, &mut rng);
    let rmse = |model: &CentreModel| model.quality_on(&fresh).expect("samples")[0].rmse;
    let (before, after) = (
        rmse(&model),
        rmse(&model.refit(&few, 0.01).expect("a prior helps out")),
    );
    println!("{before} {after}");
    assert!(after < 0.8 * before, "{before} {after}");
    // A single move leaves most as it was, where a fit of its own has no answer; so strong a prior
    // leaves all.
    assert!(model.refit(&few[..1], 0.0).is_err() && CentreModel::fit(&few[..1]).is_err());
    let one = rmse(&model.refit(&few[..1], 0.5).expect("a prior helps out"));
    assert!(one < 1.5 * before, "{before} {one}");
    let held = rmse(&model.refit(&few, 1e12).expect("a prior helps out"));
    assert!((held - before).abs() < 1e-3, "{before} {held}");
    // Without a prior to speak of it is a fit.
    let (loose, fitted) = (model.refit(&few, 0.0), CentreModel::fit(&few));
    assert!((rmse(&loose.expect("enough")) - rmse(&fitted.expect("enough"))).abs() < 1e-9);
    assert_eq!(
        model.refit(&[], 0.01).expect("nothing to learn from"),
        model
    );
    for ridge in [f64::NAN, -1.0, f64::INFINITY, 1e200] {
        assert!(
            matches!(model.refit(&few, ridge), Err(FitError::Prior { .. })),
            "{ridge}"
        );
    }
    let mut broken = few;
    broken[3].after.x = f64::NAN;
    assert!(matches!(
        model.refit(&broken, 0.01),
        Err(FitError::NotFinite { index: 3, .. })
    ));
}

#[test]
fn the_expected_error_of_centring_is_the_one_that_occurs_near_and_far() {
    let mut wrong = Vec::new();
    for noise in [0.125, 0.5] {
        let (training, _) = samples(5, 3000, noise);
        let (mut fresh, _) = samples(6, 3000, noise);
        for (name, model) in [
            ("1, d1", CentreModel::fit_without_radius(&training)),
            ("1, d1, r d1", CentreModel::fit(&training)),
        ] {
            let model = model.expect("enough samples");
            let mut by = |key: &dyn Fn(&pipeline_sim::CentreSample) -> f64| -> Vec<f64> {
                fresh.sort_by(|a, b| key(a).total_cmp(&key(b)));
                let squared = |s: &pipeline_sim::CentreSample| {
                    let change = s.after.x - s.before.x;
                    let predicted =
                        model.quality_on(std::slice::from_ref(s)).expect("a sample")[0].rmse;
                    assert!(predicted.is_finite() && change.is_finite());
                    (predicted / model.uncertainty(&s.before, s.d1).expect("finite")).powi(2)
                };
                let thirds = fresh.chunks_exact(fresh.len() / 3).take(3);
                thirds
                    .map(|part| part.iter().map(squared).sum::<f64>() / part.len() as f64)
                    .collect()
            };
            let (near, far) = (by(&|s| s.before.r), by(&|s| s.d1.abs()));
            println!("{name} {noise}: by r {near:.2?} by d1 {far:.2?}");
            for ratio in near.into_iter().chain(far) {
                // What the form without r cannot express is not noise, and least where r is near
                // its mean.
                let (least, most) = if name.contains('r') {
                    (0.5, 2.0)
                } else {
                    (0.1, 4.0)
                };
                wrong.extend((!(least..most).contains(&ratio)).then_some((name, noise, ratio)));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
