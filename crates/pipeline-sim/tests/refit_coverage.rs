//! What a refit with few samples expects of itself.

use pipeline_sim::{
    Ball, Cell, CentreModel, CentreSample, ErrorLevel, ReachForm, ReachModel, ReachSample, sample_moves,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

/// Cells drawn of each level.
const CELLS: u64 = 40;

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

/// Shares of the errors of y and r within 1.96 expected standard deviations, for refits to the first `n` samples.
fn covered(reach: &ReachModel, cells: &[Drawn], n: usize, ridge: f64, power: f64) -> [f64; 2] {
    let (mut within, mut all) = ([0.0; 2], 0.0);
    for [(_, few), (_, fresh)] in cells {
        let refit = reach.refit(&few[..n], ridge, power).expect("a prior helps out");
        for s in fresh {
            let at = (&s.before, s.jt3_degrees, s.d2, s.d3);
            let after = refit.predict_unbounded(at.0, at.1, at.2, at.3);
            if let (Some(after), Some((y, r))) = (after, refit.uncertainty(at.0, at.1, at.2, at.3)) {
                all += 1.0;
                within[0] += f64::from((after.y - s.after.y).abs() <= 1.96 * y);
                within[1] += f64::from((after.r - s.after.r).abs() <= 1.96 * r);
            }
        }
    }
    within.map(|w| w / all)
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

/// Numbers of samples that models are refitted to.
const COUNTS: [usize; 6] = [1, 3, 5, 10, 20, 40];

#[test]
fn a_refit_to_few_samples_expects_what_occurs() {
    let nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (centring, reaching) = sample_moves(&nominal, 1000, 0.125, &mut rng(1));
    let turns = [
        ("with r", CentreModel::fit(&centring).expect("enough samples")),
        (
            "without r",
            CentreModel::fit_without_radius(&centring).expect("enough samples"),
        ),
    ];
    println!("within 1.96 expected standard deviations, after {COUNTS:?} samples");
    for level in [ErrorLevel::None, ErrorLevel::Moderate, ErrorLevel::Heavy] {
        let cells = drawn(level);
        for form in [
            ReachForm::Linear,
            ReachForm::Rigid8,
            ReachForm::Rigid22,
            ReachForm::RigidBody,
        ] {
            let reach = ReachModel::fit(&reaching, form, &[]).expect("enough samples");
            let power = if form == ReachForm::Linear { 0.0 } else { 3.0 };
            for ridge in [1e-3, 1e-2] {
                let shares = COUNTS.map(|n| covered(&reach, &cells, n, ridge, power));
                println!("{level} {form:?}, ridge {ridge}, y and r: {shares:.3?}");
                for (n, [y, r]) in COUNTS.into_iter().zip(shares) {
                    let least = match n {
                        1 | 3 => [0.92, 0.84],
                        5 => [0.93, 0.88],
                        _ => [0.92, 0.92],
                    };
                    assert!(
                        y >= least[0] && r >= least[1],
                        "{level} {form:?} {ridge} {n}: {y} {r}"
                    );
                }
            }
        }
        for (name, centre) in &turns {
            let shares = COUNTS.map(|n| covered_turns(centre, &cells, n));
            println!("{level} centring {name}, x: {shares:.3?}");
            assert!(shares.iter().all(|x| *x >= 0.93), "{level} {name}: {shares:?}");
        }
    }
}

/// Refitting move by move, the usual way on an arm, must neither blow the expected errors up nor let them vanish.
#[test]
fn refits_to_one_sample_after_another_keep_their_measure() {
    let nominal = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (_, reaching) = sample_moves(&nominal, 1000, 0.125, &mut rng(1));
    for level in [ErrorLevel::None, ErrorLevel::Moderate, ErrorLevel::Heavy] {
        let cells = drawn(level);
        for form in [
            ReachForm::Linear,
            ReachForm::Rigid8,
            ReachForm::Rigid22,
            ReachForm::RigidBody,
        ] {
            let reach = ReachModel::fit(&reaching, form, &[]).expect("enough samples");
            let power = if form == ReachForm::Linear { 0.0 } else { 3.0 };
            let mut ratios = Vec::new();
            for n in [1, 5, 10, 20, 40] {
                let (mut expected, mut errors) = (Vec::new(), Vec::new());
                for [(_, few), (_, fresh)] in &cells {
                    let refit = few[..n].iter().fold(reach.clone(), |model, sample| {
                        let one = std::slice::from_ref(sample);
                        model.refit(one, 1e-2, power).expect("a prior helps out")
                    });
                    for s in fresh {
                        let at = (&s.before, s.jt3_degrees, s.d2, s.d3);
                        let after = refit.predict_unbounded(at.0, at.1, at.2, at.3);
                        if let (Some(after), Some((y, _))) =
                            (after, refit.uncertainty(at.0, at.1, at.2, at.3))
                        {
                            expected.push(y);
                            errors.push((after.y - s.after.y).abs());
                        }
                    }
                }
                let median = |values: &mut Vec<f64>| {
                    values.sort_by(f64::total_cmp);
                    values[values.len() / 2]
                };
                let sd = median(&mut errors) / 0.6745;
                ratios.push((n, median(&mut expected) / sd, sd));
            }
            println!("{level} {form:?}: {ratios:.2?}");
        }
    }
}
