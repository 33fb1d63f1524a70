//! Models stored through serde.

use pipeline_sim::{Ball, Cell, MoveForm, MoveModel};
use serde_json::{Value, json};

use crate::rng;

/// Returns a model of each behaviour.
fn models() -> [MoveModel; 2] {
    let mut rng = rng(11);
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let drawn = cell.sample_moves(300, 0.125, &mut rng);
    let (centering, reaching) = drawn.expect("sound noise");
    [
        MoveModel::fit(&reaching, MoveForm::Rigid8, &[185.0]).expect("enough samples"),
        MoveModel::fit(&centering, MoveForm::Centering, &[]).expect("enough samples"),
    ]
}

#[test]
fn sound_models_come_back_as_they_were() {
    for model in models() {
        let text = serde_json::to_string(&model).expect("plain data");
        assert_eq!(
            serde_json::from_str::<MoveModel>(&text).expect("sound"),
            model
        );
    }
}

#[test]
fn damaged_models_and_other_versions_are_refused() {
    let [reach, centre] = models().map(|model| serde_json::to_value(model).expect("plain data"));
    let refused = |model: Value, says: &str| {
        let error = serde_json::from_str::<MoveModel>(&model.to_string());
        let message = error.expect_err(says).to_string();
        assert!(message.contains(says), "{says}: {message}");
    };
    for (model, path, value, says) in [
        (&reach, "/version", json!(2), "made by an earlier version"),
        (&reach, "/version", json!(9), "made by a later version"),
        (&reach, "/edges", json!([190.0, 175.0]), "elbow edges"),
        (&reach, "/edges", json!([]), "coefficients"),
        (&reach, "/form", json!("Rigid22"), "coefficients"),
        (&reach, "/pieces/0/condition", json!(0.5), "coefficients"),
        (
            &reach,
            "/pieces/1/coefficients/0",
            json!([1.0]),
            "coefficients",
        ),
        (&reach, "/quality/0/r2", json!(1.5), "accuracy"),
        (&reach, "/quality/1/output", json!("dx"), "accuracy"),
        (&centre, "/form", json!("CenteringLinear"), "damaged"),
        (&centre, "/pieces/0/coefficients/0/2", json!(null), "null"),
        (&centre, "/quality/0/samples", json!(0), "damaged"),
    ] {
        let mut wrong = model.clone();
        *wrong.pointer_mut(path).expect("a path") = value;
        refused(wrong, says);
    }
    // Models of earlier versions: of centering, and without a number.
    refused(
        json!({ "version": 2, "with_radius": true, "fit": {} }),
        "made by an earlier version",
    );
    refused(json!({ "form": "Rigid8" }), "made by an earlier version");
}
