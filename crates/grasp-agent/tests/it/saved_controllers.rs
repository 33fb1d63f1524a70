//! A run by any controller is saved whole: every move is decided again when it is replayed.

use grasp_agent::hough_heuristic::Features;
use grasp_agent::puma_val2::Joints;
use grasp_agent::qtable::QTable;
use grasp_agent::{
    Agent, AgentError, Behaviour, BehaviourPair, BehaviourSpec, CameraModel, Controller, Decision,
    GaveUp, Hybrid, HybridSettings, Learned, Request, SavedController, SavedRun, Servo, ServoLaw,
    ServoSettings, Sighting, TaughtGoal,
};

use crate::cell::{Fault, Shared, config, servo};

/// A run by this controller, as text.
fn run_by(controller: impl Controller) -> String {
    let mut agent = Agent::with_controller(config(), controller).unwrap();
    let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::None);
    let mut saved = SavedRun::before(&agent);
    let (mut eye, mut arm, mut sensor) = (cell.clone(), cell.clone(), cell.clone());
    let outcome = agent
        .run_and_learn(&mut eye, &mut arm, &mut sensor, &mut |event| {
            saved.note(event);
        })
        .unwrap();
    let learned = saved
        .controller()
        .is_some_and(|saved| saved.kind() == "learned");
    assert!(outcome.gave_up.is_none() || learned);
    saved.to_json()
}

fn learned() -> Learned {
    let blank = |spec: BehaviourSpec| {
        let table = QTable::new(spec.states(), spec.actions()).unwrap();
        Behaviour::new(spec, table).unwrap()
    };
    let pair = BehaviourPair::paper_mended();
    Learned::new(blank(pair.centering), blank(pair.approaching))
}

fn controllers() -> Vec<Box<dyn Controller>> {
    let settings = ServoSettings::paper().with_gain(0.7);
    let goal = Features {
        x: 101.0,
        y: 79.0,
        r: 32.8,
    };
    let paper = config();
    let taught = TaughtGoal::new(&paper.goal, goal, Joints::default(), paper.grip).unwrap();
    let servo = |law| Servo::new(law, settings);
    vec![
        Box::new(servo(ServoLaw::PositionBased)),
        Box::new(servo(ServoLaw::ImageBased)),
        Box::new(servo(ServoLaw::ImageBasedAtGoal)),
        Box::new(servo(ServoLaw::Fuzzy)),
        Box::new(servo(ServoLaw::LookAhead)),
        Box::new(learned().shown(&taught)),
        Box::new(Hybrid::new(HybridSettings::paper())),
    ]
}

#[test]
fn every_controller_comes_back_and_decides_the_same_moves() {
    for controller in controllers() {
        let text = run_by(controller);
        let read = SavedRun::from_json(&text).unwrap();
        assert_eq!(read.to_json(), text);
        let kind = read.controller().map(SavedController::kind);
        let same = read.replay().is_ok();
        assert!(same, "{kind:?}");
    }
}

#[test]
fn other_settings_take_another_course_or_are_refused() {
    for controller in controllers() {
        let text = run_by(controller);
        let other = if text.contains("LookAhead") || text.contains("hybrid") {
            text.replace("\"x\":103.5,", "\"x\":93.5,")
        } else if text.contains("\"learned\"") {
            text.replace("\"centering\":20.0", "\"centering\":21.0")
                .replace("\"r\":32.8", "\"r\":12.8")
        } else {
            text.replace("\"gain\":0.7", "\"gain\":0.6")
        };
        assert_ne!(other, text);
        let replayed = SavedRun::from_json(&other).unwrap().replay();
        assert!(
            matches!(replayed, Err(AgentError::Replay { .. })),
            "{replayed:?}"
        );
        let none = text
            .replace("\"gain\":0.7", "\"gain\":0.0")
            .replace("\"drift\":0.2", "\"drift\":-1.0")
            .replace("\"r\":32.8", "\"r\":-1.0");
        let refused = SavedRun::from_json(&none).unwrap().replay().unwrap_err();
        assert!(matches!(refused, AgentError::SavedRun(_)), "{refused}");
        let said = refused.to_string();
        assert!(
            said.contains("gain is 0")
                || said.contains("drift is -1")
                || said.contains("taught goal"),
            "{said}"
        );
    }
}

/// A controller of a user's own, with data or without.
#[derive(Clone)]
struct Own(Servo, Option<f64>);

impl Controller for Own {
    fn decide(&mut self, ball: &Sighting, request: &Request) -> Result<Decision, GaveUp> {
        self.0.decide(ball, request)
    }

    fn describe(&self) -> &str {
        "own"
    }

    fn save(&self) -> Option<SavedController> {
        SavedController::new("own", self.1?)
    }
}

#[test]
fn runs_of_a_users_own_controller_are_saved_and_replayed() {
    for data in [None, Some(0.5)] {
        let text = run_by(Own(servo(), data));
        let read = SavedRun::from_json(&text).unwrap();
        assert!(matches!(read.replay(), Err(AgentError::SavedRun(_))));
        let saved = read.controller().map(|saved| saved.data::<f64>().unwrap());
        assert_eq!(saved, data);
        assert!(read.replay_with(Own(servo(), saved)).is_ok());
    }
}
