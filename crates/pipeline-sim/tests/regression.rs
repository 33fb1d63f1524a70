//! The regression simulators against the geometry they imitate.

use pipeline_sim::{Ball, Cell, CentreModel, FitError, ReachForm, ReachModel, ReachSample, sample_moves};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn samples(seed: u64, count: usize, noise: f64) -> (Vec<pipeline_sim::CentreSample>, Vec<ReachSample>) {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    sample_moves(&cell, count, noise, &mut Xoshiro256PlusPlus::seed_from_u64(seed))
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
        let q = model.quality_on(&fresh);
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
        .map(|s| ReachSample { d3: 0.5 * s.d2, ..*s })
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
    assert!((0.8..1.25).contains(&y) && (0.7..1.4).contains(&r), "{y} {r}");
}

#[test]
fn a_model_believed_for_several_moves_drifts_as_its_form_lets_expect() {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (_, training) = samples(7, 2083, 0.125);
    let mut last = f64::MAX;
    for form in [ReachForm::Linear, ReachForm::Rigid8, ReachForm::Rigid22] {
        let model = ReachModel::fit(&training, form, &ReachModel::PAPER_ELBOW_EDGES).expect("enough samples");
        let errors = model.open_loop_error(&cell, 5, 400, &mut Xoshiro256PlusPlus::seed_from_u64(8));
        for e in [errors[0], errors[2], errors[4]] {
            println!("{form:?}: {e:?}");
        }
        assert!(
            errors[4].y_mean > errors[0].y_mean && errors[4].y_mean < last,
            "{form:?}"
        );
        last = errors[4].y_mean;
    }
    assert!(last < 2.0, "{last}");
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
    let (before, after) = (model.quality_on(&fresh), refitted.quality_on(&fresh));
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

#[cfg(feature = "serde")]
#[test]
fn models_are_stored_and_only_sound_ones_come_back() {
    let (centring, reaching) = samples(11, 300, 0.125);
    let model = ReachModel::fit(&reaching, ReachForm::Rigid8, &[185.0]).expect("enough samples");
    let text = serde_json::to_string(&model).expect("plain data");
    assert_eq!(
        serde_json::from_str::<ReachModel>(&text).expect("its own text"),
        model
    );
    let centre = CentreModel::fit(&centring).expect("enough samples");
    let centre_text = serde_json::to_string(&centre).expect("plain data");
    assert_eq!(
        serde_json::from_str::<CentreModel>(&centre_text).expect("its own text"),
        centre
    );
    // Too few pieces, another form, edges that do not ascend.
    for broken in [
        text.replace("\"edges\":[185.0]", "\"edges\":[]"),
        text.replace("Rigid8", "Rigid22"),
        text.replace("\"edges\":[185.0]", "\"edges\":[190.0,185.0]"),
    ] {
        assert_ne!(broken, text);
        assert!(serde_json::from_str::<ReachModel>(&broken).is_err());
    }
}
