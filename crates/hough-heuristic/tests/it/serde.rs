use std::fmt::Debug;

use hough_heuristic::{
    AContrarioConfig, Acceptance, CannyConfig, Circle, CurveSearchConfig, Detection, Ellipse,
    Features, HeuristicConfig, Line, RandomizedHoughConfig, Region, StandardHoughConfig,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let stored = serde_json::to_string(value).unwrap();
    assert_eq!(
        serde_json::from_str::<T>(&stored).unwrap(),
        *value,
        "{stored}"
    );
}

#[test]
fn what_is_stored_comes_back() {
    let circle = Circle {
        x: 12.25,
        y: -3.5,
        radius: 40.125,
    };
    comes_back(&circle);
    comes_back(&Features::from_circle(&circle, 768));
    comes_back(&Detection {
        circle,
        score: 0.875,
    });
    comes_back(&Line {
        cos: 0.6,
        sin: 0.8,
        rho: -7.5,
    });
    comes_back(&Ellipse {
        x: 60.0,
        y: 45.5,
        major: 25.0,
        minor: 15.0,
        angle: 0.25,
    });
}

#[test]
fn settings_come_back() {
    let accept = Acceptance {
        region: Some(Region {
            left: 5,
            top: 6,
            width: 70,
            height: 80,
        }),
        theta: 0.5,
        ..Acceptance::default()
    };
    comes_back(&accept);
    comes_back(&CannyConfig::default());
    comes_back(&CurveSearchConfig {
        reach: Some(30.0),
        ..CurveSearchConfig::default()
    });
    comes_back(&HeuristicConfig {
        accept,
        anywhere: true,
        ..HeuristicConfig::default()
    });
    comes_back(&RandomizedHoughConfig {
        accept,
        ..RandomizedHoughConfig::default()
    });
    comes_back(&StandardHoughConfig {
        accept,
        ..StandardHoughConfig::default()
    });
    comes_back(&AContrarioConfig {
        region: accept.region,
        milliseconds_per_megapixel: Some(6.0),
        ..AContrarioConfig::default()
    });
}

/// A stored configuration of no fields is the default, and a field that there is not is named.
fn may_be_partial<T: Default + DeserializeOwned + PartialEq + Debug>() {
    assert_eq!(serde_json::from_str::<T>("{}").unwrap(), T::default());
    let error = serde_json::from_str::<T>(r#"{"thetta":0.5}"#).unwrap_err();
    assert!(error.to_string().contains("thetta"), "{error}");
}

#[test]
fn what_is_not_stored_is_the_default() {
    may_be_partial::<Acceptance>();
    may_be_partial::<CannyConfig>();
    may_be_partial::<CurveSearchConfig>();
    may_be_partial::<HeuristicConfig>();
    may_be_partial::<RandomizedHoughConfig>();
    may_be_partial::<StandardHoughConfig>();
    may_be_partial::<AContrarioConfig>();
    let stored = r#"{"accept":{"theta":0.5,"max_circles":3},"cell":3.0}"#;
    let expected = StandardHoughConfig {
        accept: Acceptance {
            theta: 0.5,
            max_circles: 3,
            ..Acceptance::default()
        },
        cell: 3.0,
        ..StandardHoughConfig::default()
    };
    assert_eq!(
        serde_json::from_str::<StandardHoughConfig>(stored).unwrap(),
        expected
    );
}
