//! What a refit with few samples expects of itself.

use pipeline_sim::{
    Ball, Cell, CentreModel, CentreSample, ErrorLevel, ReachForm, ReachModel, ReachSample,
    sample_moves,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

/// Cells drawn of each level.
const CELLS: u64 = 200;

/// Samples of wrong cells: first those to learn from, then those to judge on.
type Drawn = [(Vec<CentreSample>, Vec<ReachSample>); 2];

fn drawn(level: ErrorLevel) -> Vec<Drawn> {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let cells = (0..CELLS).map(|seed| {
        let mut rng = rng(100 + seed);
        let errors = level.draw(&mut rng);
        let wrong = errors.apply(&cell).expect("sound errors");
        [40, 100].map(|count| sample_moves(&wrong, count, errors.feature_noise, &mut rng))
    });
    cells.collect()
}

/// What models expect, and what occurs, of y and r on the samples to judge on: pairs of expected
/// standard deviation and error.
fn expectations<'a>(
    models: impl Iterator<Item = (ReachModel, &'a [ReachSample])>,
) -> [Vec<(f64, f64)>; 2] {
    let mut pairs = [Vec::new(), Vec::new()];
    for (model, fresh) in models {
        for s in fresh {
            let at = (&s.before, s.jt3_degrees, s.d2, s.d3);
            let after = model.predict_unbounded(at.0, at.1, at.2, at.3);
            if let (Some(after), Some((y, r))) = (after, model.uncertainty(at.0, at.1, at.2, at.3))
            {
                pairs[0].push((y, (after.y - s.after.y).abs()));
                pairs[1].push((r, (after.r - s.after.r).abs()));
            }
        }
    }
    pairs
}

/// Share of the errors within 1.96 expected standard deviations.
fn covered(pairs: &[(f64, f64)]) -> f64 {
    let within = pairs.iter().filter(|(sd, error)| *error <= 1.96 * sd);
    within.count() as f64 / pairs.len() as f64
}

/// The median expected standard deviation, by the standard deviation that the median error speaks
/// of.
fn excess(pairs: &[(f64, f64)]) -> f64 {
    let median = |pick: fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = pairs.iter().map(pick).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    median(|pair| pair.0) / (median(|pair| pair.1) / 0.6745)
}

/// The same for x.
fn covered_turns(centre: &CentreModel, cells: &[Drawn], n: usize) -> f64 {
    let (mut within, mut all) = (0.0, 0.0);
    for [(few, _), (fresh, _)] in cells {
        let refit = centre.refit(&few[..n], 1e-2).expect("a prior helps out");
        for s in fresh {
            let sd = refit.uncertainty(&s.before, s.d1).expect("finite");
            if let Some(after) = refit.predict(&s.before, s.d1) {
                all += 1.0;
                within += f64::from((after.x - s.after.x).abs() <= 1.96 * sd);
            }
        }
    }
    within / all
}

/// A model of each form, with the power that its refits weigh samples by.
fn priors(samples: &[ReachSample]) -> impl Iterator<Item = (ReachForm, ReachModel, f64)> {
    let forms = [
        ReachForm::Linear,
        ReachForm::Rigid8,
        ReachForm::Rigid22,
        ReachForm::RigidBody,
    ];
    forms.into_iter().map(|form| {
        let model = ReachModel::fit(samples, form, &[]).expect("enough samples");
        (
            form,
            model,
            if form == ReachForm::Linear { 0.0 } else { 3.0 },
        )
    })
}

/// Numbers of samples that models are refitted to.
const COUNTS: [usize; 6] = [1, 3, 5, 10, 20, 40];

#[test]
fn a_refit_to_few_samples_expects_what_occurs() {
    let nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (centring, reaching) = sample_moves(&nominal, 1000, 0.125, &mut rng(1));
    let turns = [
        (
            "with r",
            CentreModel::fit(&centring).expect("enough samples"),
        ),
        (
            "without r",
            CentreModel::fit_without_radius(&centring).expect("enough samples"),
        ),
    ];
    println!("within 1.96 expected standard deviations, after {COUNTS:?} samples");
    for level in ErrorLevel::ALL {
        let cells = drawn(level);
        for (form, reach, power) in priors(&reaching) {
            for ridge in [1e-3, 1e-2] {
                let of_counts = COUNTS.map(|n| {
                    expectations(cells.iter().map(|[(_, few), (_, fresh)]| {
                        let refit = reach.refit(&few[..n], ridge, power);
                        (refit.expect("a prior helps out"), &fresh[..])
                    }))
                });
                let shares = of_counts.each_ref().map(|[y, r]| [covered(y), covered(r)]);
                let excesses = of_counts.each_ref().map(|[y, r]| [excess(y), excess(r)]);
                println!("{level} {form:?}, ridge {ridge}, y and r: {shares:.3?}");
                println!("    expected by actual: {excesses:.1?}");
                let extreme = level == ErrorLevel::Extreme;
                for (n, [y, r]) in COUNTS.into_iter().zip(shares) {
                    let least = match n {
                        1 | 3 if extreme => [0.80, 0.70],
                        1 | 3 => [0.90, 0.80],
                        _ if extreme => [0.88, 0.80],
                        5 => [0.92, 0.85],
                        _ => [0.92, 0.91],
                    };
                    assert!(
                        y >= least[0] && r >= least[1],
                        "{level} {form:?} {ridge} {n}: {y} {r}"
                    );
                }
                // Nor may it be anything as long as it is much.
                for (n, [y, r]) in COUNTS.into_iter().zip(excesses) {
                    let most = match n {
                        1 => 500.0,
                        3 | 5 => 120.0,
                        10 => 30.0,
                        _ => 10.0,
                    };
                    assert!(
                        y <= most && r <= most,
                        "{level} {form:?} {ridge} {n}: {y} {r}"
                    );
                }
            }
        }
        for (name, centre) in &turns {
            let shares = COUNTS.map(|n| covered_turns(centre, &cells, n));
            println!("{level} centring {name}, x: {shares:.3?}");
            assert!(
                shares.iter().all(|x| *x >= 0.93),
                "{level} {name}: {shares:?}"
            );
        }
    }
}

/// Refitting move by move, the usual way on an arm, must neither blow the expected errors up nor
/// let them vanish.
#[test]
fn refits_to_one_sample_after_another_keep_their_measure() {
    let nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (_, reaching) = sample_moves(&nominal, 1000, 0.125, &mut rng(1));
    for level in ErrorLevel::ALL {
        let cells = drawn(level);
        for (form, reach, power) in priors(&reaching) {
            let mut models = vec![reach; cells.len()];
            let mut excesses = Vec::new();
            for k in 0..40 {
                for (model, [(_, few), _]) in models.iter_mut().zip(&cells) {
                    let refit = model.refit(&few[k..=k], 1e-2, power);
                    *model = refit.expect("a prior helps out");
                }
                if COUNTS.contains(&(k + 1)) {
                    let judged = models
                        .iter()
                        .cloned()
                        .zip(cells.iter().map(|[_, (_, fresh)]| &fresh[..]));
                    let [y, r] = expectations(judged);
                    excesses.push([excess(&y), excess(&r)]);
                }
            }
            println!("{level} {form:?}, move by move, expected by actual, y and r: {excesses:.1?}");
            for [y, r] in &excesses[3..] {
                assert!(
                    (0.7..6.0).contains(y) && (0.7..6.0).contains(r),
                    "{level} {form:?}: {y} {r}"
                );
            }
        }
    }
}
