//! A run by any controller is saved whole: every move is decided again when it is replayed.

use grasp_agent::hough_heuristic::{Features, FrameError};
use grasp_agent::puma_val2::{Joint, Joints};
use grasp_agent::{
    Agent, AgentError, CameraModel, EventKind, Eye, Hybrid, HybridSettings, JacobianAt, Look,
    Replayed, SavedController, SavedRun, ServoSettings, TaughtGoal,
};

use crate::cell::{Fault, Shared, config};

/// Sees a ball as something that is longer in one direction.
struct Oblong(Shared);

impl Eye for Oblong {
    fn look(&mut self) -> Result<Look, FrameError> {
        let mut look = self.0.look()?;
        look.ball = look.ball.map(|ball| grasp_agent::Sighting {
            long_axis: Some(0.4),
            ..ball
        });
        Ok(look)
    }
}

/// A run by the saved controller, as text.
fn run_by(controller: &SavedController) -> String {
    let mut agent = Agent::with_controller(config(), controller.controller()).unwrap();
    let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::None);
    let mut saved = SavedRun::before(&agent, controller.clone());
    let (mut eye, mut arm, mut sensor) = (Oblong(cell.clone()), cell.clone(), cell.clone());
    let outcome = agent
        .run_and_learn(&mut eye, &mut arm, &mut sensor, &mut |event| {
            saved.note(event)
        })
        .unwrap();
    assert_eq!(outcome.gave_up, None, "{controller:?}");
    saved.to_json()
}

fn controllers() -> Vec<SavedController> {
    let settings = ServoSettings::paper().with_gain(0.7);
    let position_based = SavedController::PositionBased { settings };
    let goal = Features {
        x: 101.0,
        y: 79.0,
        r: 32.8,
    };
    let paper = config();
    let taught = TaughtGoal::new(&paper.goal, goal, Joints::default(), paper.grip).unwrap();
    vec![
        SavedController::ImageBased {
            settings,
            at: JacobianAt::Goal,
        },
        SavedController::ImageBased {
            settings,
            at: JacobianAt::Now,
        },
        SavedController::Fuzzy { settings },
        SavedController::LookAhead { settings },
        SavedController::Retargeted {
            controller: Box::new(position_based.clone()),
            goal: taught,
        },
        SavedController::GripAcross {
            controller: Box::new(position_based.clone()),
            grip: paper.grip,
        },
        position_based,
        SavedController::of_hybrid(&Hybrid::new(HybridSettings::paper())),
    ]
}

#[test]
fn every_controller_comes_back_and_decides_the_same_moves() {
    for controller in controllers() {
        let text = run_by(&controller);
        let read = SavedRun::from_json(&text).unwrap();
        assert_eq!(read.to_json(), text);
        assert!(
            matches!(read.replay().unwrap(), Replayed::Same(Ok(_))),
            "{controller:?}"
        );
        let turned =
            read.log().events.iter().any(
                |event| matches!(event.kind, EventKind::Gripping(delta) if delta[Joint::J6].abs() > 0.1),
            );
        assert_eq!(
            turned,
            matches!(controller, SavedController::GripAcross { .. })
        );
        // Saved before there were these.
        let earlier = text
            .replace(",\"long_axis\":0.4", "")
            .replace(",\"max_views\":1000", "")
            .replace("\"max_views\":1000,", "")
            .replace("\"grip_aside\":0.0,", "");
        for new in ["long_axis", "max_views", "grip_aside"] {
            assert!(!earlier.contains(new), "{new}");
        }
        let replayed = SavedRun::from_json(&earlier).unwrap().replay().unwrap();
        assert_eq!(matches!(replayed, Replayed::Same(Ok(_))), !turned);
    }
}

#[test]
fn another_setting_takes_another_course_and_one_that_cannot_work_is_refused() {
    for controller in controllers() {
        let text = run_by(&controller);
        let other = match controller {
            SavedController::Hybrid { .. } | SavedController::LookAhead { .. } => {
                text.replace("\"x\":103.5,", "\"x\":93.5,")
            }
            _ => text.replace("\"gain\":0.7", "\"gain\":0.6"),
        };
        assert_ne!(other, text);
        let replayed = SavedRun::from_json(&other).unwrap().replay().unwrap();
        assert!(
            matches!(replayed, Replayed::Differs { .. }),
            "{controller:?}"
        );
        let none = text
            .replace("\"gain\":0.7", "\"gain\":0.0")
            .replace("\"drift\":0.2", "\"drift\":-1.0");
        let refused = SavedRun::from_json(&none).unwrap_err();
        assert!(matches!(refused, AgentError::SavedRun(_)), "{refused}");
        let said = refused.to_string();
        assert!(
            said.contains("gain is 0") || said.contains("drift is -1"),
            "{said}"
        );
    }
    let [.., across, _, _] = &controllers()[..] else {
        panic!("a list of them")
    };
    let text = run_by(across).replace("\"grip\":[0.0,", "\"grip\":[\"NaN\",");
    assert!(SavedRun::from_json(&text).is_err());
}
