//! Models stored through serde.

use pipeline_sim::{Ball, Cell, CentreModel, ReachForm, ReachModel};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use serde_json::{Value, json};

/// Returns a model of each kind in JSON.
fn stored() -> (ReachModel, CentreModel) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let cell = Cell::paper(Ball::at(0.6, 0.0, -0.1));
    let (centering, reaching) = cell
        .sample_moves(300, 0.125, &mut rng)
        .expect("sound noise");
    (
        ReachModel::fit(&reaching, ReachForm::Rigid8, &[185.0]).expect("enough samples"),
        CentreModel::fit(&centering).expect("enough samples"),
    )
}

fn refused<T: serde::de::DeserializeOwned>(mut model: Value, path: &str, value: Value) -> String {
    *model.pointer_mut(path).expect("a path") = value;
    let text = model.to_string();
    let error = serde_json::from_str::<T>(&text).err();
    error.expect(path).to_string()
}

#[test]
fn sound_models_come_back_as_they_were() {
    let (reach, centre) = stored();
    let text = serde_json::to_string(&reach).expect("plain data");
    assert_eq!(
        serde_json::from_str::<ReachModel>(&text).expect("sound"),
        reach
    );
    let text = serde_json::to_string(&centre).expect("plain data");
    assert_eq!(
        serde_json::from_str::<CentreModel>(&text).expect("sound"),
        centre
    );
}

#[test]
fn damaged_models_and_other_versions_are_refused() {
    let (reach, centre) = stored();
    let reach = serde_json::to_value(reach).expect("plain data");
    let centre = serde_json::to_value(centre).expect("plain data");
    for (path, value, says) in [
        ("/version", json!(1), "made by an earlier version"),
        ("/version", json!(9), "made by a later version"),
        ("/edges", json!([190.0, 175.0]), "elbow edges"),
        ("/edges", json!([]), "coefficients"),
        ("/form", json!("Rigid22"), "coefficients"),
        ("/pieces/0/condition", json!(0.5), "coefficients"),
        ("/pieces/1/coefficients/0", json!([1.0]), "coefficients"),
        ("/quality/0/r2", json!(1.5), "accuracy"),
        ("/quality/1/output", json!("dx"), "accuracy"),
    ] {
        let message = refused::<ReachModel>(reach.clone(), path, value);
        assert!(message.contains(says), "{path}: {message}");
    }
    for (path, value, says) in [
        ("/version", json!(1), "made by an earlier version"),
        ("/with_radius", json!(false), "damaged"),
        ("/fit/coefficients/0/2", json!(null), "null"),
        ("/quality/0/samples", json!(0), "damaged"),
    ] {
        let message = refused::<CentreModel>(centre.clone(), path, value);
        assert!(message.contains(says), "{path}: {message}");
    }
    let mut first = reach;
    first.as_object_mut().expect("an object").remove("version");
    let message = serde_json::from_value::<ReachModel>(first)
        .expect_err("no version")
        .to_string();
    assert!(message.contains("made by an earlier version"), "{message}");
}
