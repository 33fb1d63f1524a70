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
