//! Fitted models on their way to a file and back.

use pipeline_sim::{
    Ball, Cell, CentreModel, CentreSample, ReachForm, ReachModel, ReachSample, StoredModelError,
    sample_moves,
};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

fn samples(seed: u64, count: usize, noise: f64) -> (Vec<CentreSample>, Vec<ReachSample>) {
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    sample_moves(
        &cell,
        count,
        noise,
        &mut Xoshiro256PlusPlus::seed_from_u64(seed),
    )
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

#[cfg(feature = "serde")]
#[test]
fn a_model_of_another_version_is_refused_by_serde() {
    let (centring, reaching) = samples(11, 300, 0.125);
    let reach = ReachModel::fit(&reaching, ReachForm::Linear, &[]).expect("enough samples");
    let centre = CentreModel::fit(&centring).expect("enough samples");
    let texts = [
        serde_json::to_string(&reach).expect("plain data"),
        serde_json::to_string(&centre).expect("plain data"),
    ];
    for text in texts {
        for other in [
            text.replace("\"version\":1", "\"version\":2"),
            text.replace("\"version\":1,", ""),
        ] {
            assert_ne!(other, text);
            let errors = [
                serde_json::from_str::<ReachModel>(&other).err(),
                serde_json::from_str::<CentreModel>(&other).err(),
            ];
            let said = errors.map(|e| e.expect("refused").to_string());
            assert!(said.iter().any(|said| said.contains("version")), "{said:?}");
        }
    }
}

#[test]
fn models_as_text_come_back_as_they_were_or_not_at_all() {
    let (centring, reaching) = samples(11, 300, 0.125);
    let reach = ReachModel::fit(&reaching, ReachForm::Rigid8, &[185.0]).expect("enough samples");
    let text = reach.to_text();
    assert_eq!(ReachModel::from_text(&text).as_ref(), Ok(&reach));
    for model in [
        CentreModel::fit(&centring),
        CentreModel::fit_without_radius(&centring),
    ] {
        let model = model.expect("enough samples");
        assert_eq!(CentreModel::from_text(&model.to_text()), Ok(model));
    }
    let refused = |text: &str| ReachModel::from_text(text).expect_err("not a stored model");
    assert_eq!(
        refused(&text.replacen("reach-model 1", "reach-model 2", 1)),
        StoredModelError::Version { found: 2, known: 1 }
    );
    for other in [
        "",
        "reach-model 1",
        "{}",
        &text.replacen("reach", "centre", 1),
    ] {
        assert_eq!(
            refused(other),
            StoredModelError::Kind {
                kind: "reach-model"
            }
        );
    }
    assert!(CentreModel::from_text(&text).is_err());
    // Every line is needed, and nothing more.
    let lines: Vec<&str> = text.lines().collect();
    for gone in 1..lines.len() {
        let mut fewer = lines.clone();
        fewer.remove(gone);
        assert!(
            ReachModel::from_text(&fewer.join("\n")).is_err(),
            "{}",
            lines[gone]
        );
    }
    assert!(matches!(
        refused(&format!("{text}more\n")),
        StoredModelError::Contents { .. }
    ));
    assert!(matches!(
        refused(&text.replacen("elbow-edges 185.0", "elbow-edges NaN", 1)),
        StoredModelError::Contents { .. }
    ));
    let word = lines[5].split(' ').nth(1).expect("a number");
    let damaged = refused(&text.replacen(word, "oops", 1));
    assert!(damaged.to_string().contains("line"), "{damaged}");
}
