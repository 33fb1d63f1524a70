//! The regression simulators against the geometry they imitate.

use hough_heuristic::Features;
use pipeline_sim::{
    Ball, Cell, CentreModel, CentreSample, ErrorLevel, Errors, FitError, ReachForm, ReachModel,
    ReachSample,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn samples(seed: u64, count: usize, noise: f64) -> (Vec<CentreSample>, Vec<ReachSample>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    cell.sample_moves(count, noise, &mut rng)
        .expect("sound noise")
}

#[test]
fn forms_explain_their_known_share() {
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
fn centering_needs_the_product_of_radius_and_move() {
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
fn samples_that_determine_no_model_are_refused() {
    let (centering, reaching) = samples(4, 60, 0.0);
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
        CentreModel::fit(&centering[..2]),
        Err(FitError::TooFewSamples { .. })
    ));
    assert!(matches!(
        ReachModel::fit(&[], ReachForm::Rigid8, &[]),
        Err(FitError::TooFewSamples { got: 0, .. })
    ));
}

#[test]
fn numbers_too_large_or_too_small_are_named() {
    let (centering, reaching) = samples(4, 60, 0.0);
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
    let mut broken = centering;
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
fn refits_take_any_power_and_refuse_impossible_ridges() {
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
            after: Features {
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
fn refit_learns_a_wrong_arm_from_few_moves() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (_, nominal) = samples(9, 1500, 0.125);
    let model = ReachModel::fit(&nominal, ReachForm::Rigid22, &[]).expect("enough samples");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(10);
    let wrong = ErrorLevel::Heavy
        .draw(&mut rng)
        .apply(&cell)
        .expect("sound errors");
    let (_, few) = wrong.sample_moves(200, 0.5, &mut rng).expect("sound noise");
    let (_, fresh) = wrong
        .sample_moves(1000, 0.0, &mut rng)
        .expect("sound noise");
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
fn predictions_from_impossible_arguments_are_none() {
    let (centering, reaching) = samples(4, 300, 0.1);
    let reach = ReachModel::fit(&reaching, ReachForm::Rigid8, &[]).expect("enough samples");
    let centre = CentreModel::fit(&centering).expect("enough samples");
    let sound = Cell::GOAL;
    assert!(reach.predict(&sound, 180.0, 1.0, 1.0).is_some());
    assert!(centre.predict(&sound, 1.0).is_some());
    for (x, y, r) in [
        (f64::NAN, 72.0, 30.0),
        (96.0, f64::INFINITY, 30.0),
        (96.0, 72.0, 0.0),
    ] {
        let before = Features { x, y, r };
        assert_eq!(reach.predict_unbounded(&before, 180.0, 1.0, 1.0), None);
        assert_eq!(centre.predict(&before, 1.0), None);
    }
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(reach.predict_unbounded(&sound, bad, 1.0, 1.0), None);
        assert_eq!(reach.predict_unbounded(&sound, 180.0, 1.0, bad), None);
        assert_eq!(centre.predict(&sound, bad), None);
    }
}

#[test]
fn models_are_not_judged_without_samples() {
    let (centering, reaching) = samples(4, 60, 0.0);
    let reach = ReachModel::fit(&reaching, ReachForm::Linear, &[]).expect("enough samples");
    let centre = CentreModel::fit(&centering).expect("enough samples");
    for refused in [reach.quality_on(&[]), centre.quality_on(&[])] {
        let refused = refused.expect_err("nothing").to_string();
        assert!(refused.contains("number of samples"), "{refused}");
    }
}

#[test]
fn refit_of_centering_learns_a_wrong_arm_from_few_moves() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (nominal, _) = samples(9, 1500, 0.125);
    let model = CentreModel::fit(&nominal).expect("enough samples");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(10);
    let mut errors = Errors::none();
    errors.radius_factor = 1.5;
    let wrong = errors.apply(&cell).expect("sound errors");
    let (few, _) = wrong.sample_moves(30, 0.5, &mut rng).expect("sound noise");
    let (fresh, _) = wrong
        .sample_moves(1000, 0.0, &mut rng)
        .expect("sound noise");
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
