//! Settings that are read by themselves are checked as those of an agent or a saved run are.

use grasp_agent::{BehaviourPair, CameraModel, HybridSettings, JointLimits, Prior, ServoSettings};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::cell::config;

/// `settings` come back as they were written, and are refused with the value at `place` exchanged,
/// with these words.
fn refused<T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug>(
    settings: &T,
    place: &str,
    value: Value,
    said: &str,
) {
    let mut text = serde_json::to_value(settings).unwrap();
    assert_eq!(
        serde_json::from_value::<T>(text.clone()).unwrap(),
        *settings
    );
    *text.pointer_mut(place).expect("a place in it") = value;
    let refused = serde_json::from_value::<T>(text).unwrap_err().to_string();
    assert!(
        refused.contains(said),
        "{place}: {refused} does not say {said}"
    );
}

#[test]
fn what_cannot_be_used_is_refused_with_the_reason() {
    let hybrid = HybridSettings::paper();
    refused(&hybrid, "/drift", json!(-1.0), "drift is -1");
    refused(&hybrid, "/steps/1", json!(0.0), "longest step of JT2 is 0");
    refused(
        &hybrid,
        "/goal/r",
        json!(-33.0),
        "radius of the goal is -33",
    );
    refused(&hybrid, "/prior/turn", json!(0.0), "prior is 0");
    refused(&hybrid, "/nominal/focal", json!(0.0), "focal length is 0");
    refused(&Prior::by_eye(), "/play", json!(-0.1), "prior is -0.1");
    let servo = ServoSettings::paper();
    refused(&servo, "/gain", json!(0.0), "gain is 0");
    refused(
        &servo,
        "/model/ball_radius",
        json!(0.0),
        "radius of the ball is 0",
    );
    refused(
        &CameraModel::paper(),
        "/focal",
        json!(-1.0),
        "focal length is -1",
    );
    refused(
        &JointLimits::paper(),
        "/2/0",
        json!(9.0),
        "limits of JT3 are 9 to",
    );
    refused(&config(), "/looks", json!(0), "looks is 0");
    refused(
        &config(),
        "/goal/1/low",
        json!(90.0),
        "goal of Y is from 90 to 82",
    );
    refused(
        &config(),
        "/approach_growth",
        json!(0.0),
        "approach_growth is 0",
    );
    let BehaviourPair { centering, .. } = BehaviourPair::paper_mended();
    refused(&centering, "/inputs", json!(["X"]), "1 inputs");
    refused(
        &centering.goal[0],
        "/low",
        json!(500.0),
        "goal of X is from 500",
    );
    refused(
        &centering.moves[0],
        "/degrees",
        json!([]),
        "JT1 has no steps",
    );
    refused(
        &centering.reward,
        "/floor",
        json!(-1.0),
        "floor of its reward is -1",
    );
}
