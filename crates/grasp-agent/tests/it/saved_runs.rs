//! A run is saved whole: every move is decided again when it is replayed from its text.

use grasp_agent::hough_heuristic::Features;
use grasp_agent::puma_val2::{Joint, Joints};
use grasp_agent::qtable::{Action, QTable, State};
use grasp_agent::{
    Agent, AgentError, Behaviour, BehaviourPair, CameraModel, Controller, Decision, EventLog,
    GaveUp, Hybrid, HybridSettings, Learned, OnlineLearning, Request, SavedController, SavedRun,
    Servo, ServoLaw, ServoSettings, Sighting, TaughtGoal,
};

use crate::cell::{Fault, Shared, agent_of, blank, config, hybrid, learned, servo};
use crate::log::FAULTS;

/// Makes a run, saves it, and reads it again: all that the replay gets is the text.
fn saved<C: Controller + Clone>(agent: &mut Agent<C>, cell: &Shared) -> String {
    let mut saved = SavedRun::before(agent);
    let end = agent.run_and_learn(
        &mut cell.clone(),
        &mut cell.clone(),
        &mut cell.clone(),
        &mut |event| {
            saved.note(event);
        },
    );
    let text = saved.to_json();
    let read = SavedRun::from_json(&text).unwrap();
    assert_eq!(read.log(), saved.log());
    assert_eq!(read.to_json(), text);
    match (end, read.replay()) {
        (Ok(then), Ok(now)) => assert_eq!(then, now),
        (Err(then), Err(now)) => assert_eq!(then.to_string(), now.to_string()),
        (then, now) => panic!("{then:?} and {now:?}"),
    }
    text
}

#[test]
fn saved_runs_replay_from_their_text_alone() {
    let more = [
        Fault::NoFrame(3),
        Fault::FrozenPicture(2),
        Fault::LineDead(4),
        Fault::StopDead(3),
    ];
    for fault in FAULTS.into_iter().chain(more) {
        let cell = || Shared::new(CameraModel::paper(), [0.55, -0.2, -0.05], fault);
        let mut agent = agent_of(learned());
        saved(&mut agent, &cell());

        // Learning, in the third run: what was learned in the first two is part of it.
        let mut agent = agent_of(learned());
        for run in 0..3 {
            let learning = OnlineLearning::careful(run);
            let now = agent.controller().clone().learning(learning).unwrap();
            *agent.controller_mut() = now;
            saved(&mut agent, &cell());
        }

        // Not the paper's settings, which belong to it too.
        let bold = HybridSettings {
            caution: 1.0,
            nominal: CameraModel {
                focal: 1.1 * CameraModel::paper().focal,
                ..CameraModel::paper()
            },
            ..HybridSettings::paper()
        };
        let mut agent = agent_of(Hybrid::new(bold));
        for _ in 0..3 {
            saved(&mut agent, &cell());
        }
    }
}

#[test]
fn a_camera_that_froze_before_the_run_is_part_of_it() {
    let cell = Shared::new(
        CameraModel::paper(),
        [0.6, 0.1, -0.1],
        Fault::FrozenPicture(usize::MAX),
    );
    let mut agent = agent_of(hybrid());
    cell.run(&mut agent, &mut EventLog::default()).unwrap();
    let looks = cell.0.borrow().looks;
    cell.0.borrow_mut().fault = Fault::FrozenPicture(looks);
    assert!(saved(&mut agent, &cell).contains("frozen"));
}

#[test]
fn another_course_is_told_with_the_event() {
    let cell = Shared::paper(Fault::None);
    let mut agent = agent_of(learned());
    let text = saved(&mut agent, &cell);
    let differs = |text: &str| match SavedRun::from_json(text).unwrap().replay() {
        Err(AgentError::Replay { event, then, now }) => (event, then, now),
        same => panic!("{same:?}"),
    };
    // Other settings: of the bound on moves.
    let shorter = text.replace("\"max_cycles\":60", "\"max_cycles\":3");
    let (event, then, now) = differs(&shorter);
    let now = now.unwrap().kind;
    assert_eq!(
        (now.word(), event > 5),
        ("gave-up", true),
        "{event}: {now:?} for {then:?}"
    );
    // Other knowledge.
    let mut table = QTable::new(42, 9).unwrap();
    table.set(State(0), Action(0), 1.0).unwrap();
    (0..42).for_each(|state| table.set(State(state), Action(8), 2.0).unwrap());
    let pair = BehaviourPair::paper_mended();
    let other = Learned::new(
        Behaviour::new(pair.centering, table).unwrap(),
        blank(pair.approaching),
    );
    *agent.controller_mut() = other;
    let mut saved = SavedRun::before(&agent);
    let mut log = EventLog::default();
    cell.run(&mut agent_of(learned()), &mut log).unwrap();
    for event in &log.events {
        saved.note(&grasp_agent::RunEvent {
            cycle: event.cycle,
            kind: event.kind.clone(),
            joints: event.joints,
            frame: None,
        });
    }
    assert!(matches!(saved.replay(), Err(AgentError::Replay { .. })));
}

#[test]
fn damaged_saved_runs_are_refused_with_the_reason() {
    let cell = Shared::paper(Fault::None);
    let mut agent = agent_of(learned());
    let text = saved(&mut agent, &cell);
    let cases = [
        ("grasp-agent run 7", "grasp-agent run 9", "run 9"),
        ("grasp-agent run 7", "grasp-agent run 2", "earlier version"),
        ("\"looks\":2", "\"looks\":0", "looks is 0"),
        (
            "\"lost_weight\":50",
            "\"lost_weight\":5",
            "lost_weight is 5",
        ),
        ("\"camera\"", "\"kamera\"", "camera"),
        ("\"events\"", "\"evens\"", "events"),
    ];
    for (old, new, said) in cases {
        let changed = text.replace(old, new);
        assert_ne!(changed, text, "{old}");
        let read = SavedRun::from_json(&changed);
        let refused = read.and_then(|saved| saved.replay()).unwrap_err();
        assert!(
            refused.to_string().contains(said),
            "{refused} does not say {said}"
        );
    }
    let half = SavedRun::from_json(&text[..text.len() / 2]);
    assert!(matches!(half, Err(AgentError::SavedRun(_))));
}

#[test]
fn a_pose_that_is_not_finite_is_kept_and_replayed() {
    let hybrid = hybrid().frozen();
    let agent = agent_of(hybrid);
    let mut saved = SavedRun::before(&agent);
    let cell = Shared::new(CameraModel::paper(), [0.6, 0.1, -0.1], Fault::Nowhere(3));
    let mut log = EventLog::default();
    let end = cell.run(&mut agent.clone(), &mut log);
    assert!(matches!(
        end,
        Err(AgentError::Pose {
            joint: Joint::J2,
            ..
        })
    ));
    for event in &log.events {
        saved.note(event);
    }
    let text = saved.to_json();
    assert!(text.contains("null"));
    let read = SavedRun::from_json(&text).unwrap();
    assert_eq!(read.to_json(), text);
    for run in [saved, read] {
        assert!(matches!(run.replay(), Err(AgentError::Pose { .. })));
    }
}

#[test]
fn a_hybrid_that_cannot_work_is_refused() {
    let hybrid = hybrid().frozen();
    let agent = agent_of(hybrid);
    let text = SavedRun::before(&agent).to_json();
    let cases = [
        ("\"mean\":[0.0,", "\"mean\":[", "invalid length 17"),
        ("\"noise\":1.0", "\"noise\":0.0", "noise of the belief is 0"),
        ("\"turn\":0.17", "\"turn\":0.0", "prior"),
        ("\"play\":0.015", "\"play\":null", "null"),
        ("\"caution\":2.0", "\"caution\":-1.0", "caution"),
    ];
    for (old, new, said) in cases {
        let changed = text.replace(old, new);
        assert_ne!(changed, text, "{old}");
        let read = SavedRun::from_json(&changed).unwrap();
        let refused = read.replay().unwrap_err().to_string();
        assert!(refused.contains(said), "{refused} does not say {said}");
    }
}

/// A run by this controller, as text.
fn run_by(controller: impl Controller) -> String {
    let mut agent = agent_of(controller);
    let cell = Shared::paper(Fault::None);
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

fn controllers() -> Vec<Box<dyn Controller>> {
    let settings = ServoSettings::paper().with_gain(0.7);
    let goal = Features::new(101.0, 79.0, 32.8);
    let paper = config();
    let taught = TaughtGoal::new(&paper.goal, goal, Joints::default(), paper.grip).unwrap();
    let servo = |law| Servo::new(law, settings);
    vec![
        Box::new(servo(ServoLaw::PositionBased)),
        Box::new(servo(ServoLaw::ImageBased)),
        Box::new(servo(ServoLaw::ImageBasedAtGoal)),
        Box::new(servo(ServoLaw::Sphere)),
        Box::new(servo(ServoLaw::Broyden)),
        Box::new(servo(ServoLaw::GainScheduled)),
        Box::new(servo(ServoLaw::FuzzyRules)),
        Box::new(servo(ServoLaw::LookAhead)),
        Box::new(learned().shown(&taught)),
        Box::new(hybrid()),
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
