//! Runs that have to end, and with the right word: by eyes, sensors and modules that are of no use.

use crate::cell::servo;
use grasp_agent::hough_heuristic::image::{GrayImage, Luma};
use grasp_agent::hough_heuristic::{Features, FrameError};
use grasp_agent::puma_val2::{
    ArmError, Gripper, Joint, JointDelta, Joints, Manipulator, ProximitySensor,
};
use grasp_agent::{
    Agent, AgentConfig, AgentError, EventKind, EventLog, Eye, GaveUp, RunEvent, RunOutcome, Search,
    Servo, Sighting,
};

const AT_GOAL: Features = Features::new(103.0, 78.0, 33.0);
const ASIDE: Features = Features::new(60.0, 60.0, 20.0);

/// An arm that goes where it is sent.
struct Arm(Joints);

impl Manipulator for Arm {
    fn joints(&mut self) -> Result<Joints, ArmError> {
        Ok(self.0)
    }

    fn move_by(&mut self, delta: JointDelta) -> Result<Joints, ArmError> {
        self.move_to(self.0 + delta)
    }

    fn move_to(&mut self, target: Joints) -> Result<Joints, ArmError> {
        assert!(target.non_finite().is_none(), "{target}");
        self.0 = target;
        Ok(target)
    }

    fn set_gripper(&mut self, _: Gripper) -> Result<(), ArmError> {
        Ok(())
    }

    fn stop(&mut self) -> Result<(), ArmError> {
        Ok(())
    }
}

/// A sensor that always says this.
struct Sensor(bool);

impl ProximitySensor for Sensor {
    fn object_near(&mut self) -> Result<bool, ArmError> {
        Ok(self.0)
    }
}

/// Scripted sightings, by the number of the look from 0. All frames differ; an excess of looks
/// panics.
struct Scene {
    looks: u32,
    finds: fn(u32) -> Option<Features>,
    frame: GrayImage,
}

impl Eye for Scene {
    fn look(&mut self) -> Result<Option<Sighting>, FrameError> {
        let bytes = self.looks.to_le_bytes();
        self.frame = GrayImage::from_fn(4, 1, |x, _| Luma([bytes[x as usize]]));
        let ball = (self.finds)(self.looks).map(Sighting::new);
        self.looks += 1;
        assert!(self.looks < 5000, "the run does not end");
        Ok(ball)
    }

    fn frame(&self) -> Option<&GrayImage> {
        Some(&self.frame)
    }
}

fn pose() -> Joints {
    Joints::from_degrees([0.0, -110.0, 210.0, 0.0, 45.0, 0.0])
}

fn agent(poses: usize) -> Agent<Servo> {
    let config = AgentConfig::paper(vec![pose(); poses]);
    Agent::with_controller(config, servo()).unwrap()
}

fn run(
    mut agent: Agent<Servo>,
    near: bool,
    finds: fn(u32) -> Option<Features>,
) -> (Result<RunOutcome, AgentError>, EventLog) {
    let mut log = EventLog::default();
    let (mut arm, mut sensor) = (Arm(pose()), Sensor(near));
    let mut eye = Scene {
        looks: 0,
        finds,
        frame: GrayImage::new(4, 1),
    };
    let end = agent.run_and_learn(&mut eye, &mut arm, &mut sensor, &mut |event| {
        log.note(event);
    });
    (end, log)
}

/// Names this viewpoint once, or none.
#[derive(Clone, Debug)]
struct Once {
    pose: Option<Joints>,
    named: bool,
}

fn once(pose: Option<Joints>) -> Once {
    Once { pose, named: false }
}

impl Search for Once {
    fn begin(&mut self, _at: &Joints, _lost: Option<(&Sighting, &Joints)>) {
        self.named = false;
    }

    fn next_view(&mut self, _at: &Joints, _barred: bool) -> Option<(usize, Joints)> {
        let pose = self.pose.filter(|_| !self.named)?;
        self.named = true;
        Some((3, pose))
    }

    fn boxed(&self) -> Box<dyn Search> {
        Box::new(self.clone())
    }
}

#[test]
fn a_circle_that_keeps_its_place_in_the_image_is_no_grasp() {
    let never_before = |n: u32| (n > 12).then_some(AT_GOAL);
    let once_before = |n: u32| match n {
        0 => Some(ASIDE),
        1..=12 => None,
        _ => Some(AT_GOAL),
    };
    for (name, finds) in [
        ("never", never_before as fn(u32) -> Option<Features>),
        ("once", once_before),
    ] {
        let (end, log) = run(agent(12), false, finds);
        assert_eq!(end.unwrap().gave_up, Some(GaveUp::KeptMissing), "{name}");
        let searches = log.events.iter().filter(|e| e.kind == EventKind::Searching);
        assert_eq!(searches.count() > 1, name == "once", "{name}");
    }
}

#[test]
fn a_recovery_that_offers_nothing_ends_with_the_cycles() {
    // At the goal in the first look, and not in the next ones.
    let (end, _) = run(agent(1).recovering_by(once(None)), false, |n| {
        n.is_multiple_of(3).then_some(AT_GOAL)
    });
    let outcome = end.unwrap();
    assert_eq!(
        (outcome.gave_up, outcome.cycles),
        (Some(GaveUp::KeptLosing), 60)
    );
    // At the goal, gripped, and missed each time.
    let (end, log) = run(agent(1).recovering_by(once(None)), false, |_| Some(AT_GOAL));
    assert_eq!(end.unwrap().gave_up, Some(GaveUp::KeptMissing));
    assert!(log.events.iter().any(|e| e.kind == EventKind::Missed));
}

#[test]
fn a_viewpoint_that_is_not_finite_is_an_error_and_no_pose() {
    for number in [f64::NAN, f64::INFINITY] {
        let mut nowhere = pose();
        nowhere.0[1] = number;
        let searching = agent(1).searching_by(once(Some(nowhere)));
        let recovering = agent(1).recovering_by(once(Some(nowhere)));
        for agent in [searching, recovering] {
            let (end, log) = run(agent, false, |n| (n == 0).then_some(ASIDE));
            let error = end.unwrap_err();
            assert!(
                matches!(
                    error,
                    AgentError::Viewpoint {
                        number: 3,
                        joint: Joint::J2,
                        ..
                    }
                ),
                "{error}"
            );
            assert_eq!(
                log.events.last().unwrap().kind,
                EventKind::Failed(error.to_string())
            );
        }
    }
}

/// Looks from the same pose for ever.
#[derive(Clone, Debug)]
struct Endless;

impl Search for Endless {
    fn begin(&mut self, _at: &Joints, _lost: Option<(&Sighting, &Joints)>) {}

    fn next_view(&mut self, _at: &Joints, _barred: bool) -> Option<(usize, Joints)> {
        Some((0, pose()))
    }

    fn boxed(&self) -> Box<dyn Search> {
        Box::new(self.clone())
    }
}

#[test]
fn an_endless_search_ends_after_so_many_viewpoints() {
    let (end, log) = run(agent(1).searching_by(Endless), false, |_| None);
    let outcome = end.unwrap();
    assert_eq!(
        (outcome.gave_up, outcome.cycles),
        (Some(GaveUp::NotFound), 0)
    );
    let views = |log: &EventLog| {
        let at_pose = |e: &&RunEvent<'_>| matches!(e.kind, EventKind::AtSearchPose(_));
        log.events.iter().filter(at_pose).count()
    };
    assert_eq!(views(&log), 1000);
    // Nor is it ever over where every way is barred, or when the ball shows now and then.
    let few = |max_views| {
        let config = AgentConfig {
            max_views,
            ..AgentConfig::paper([pose()])
        };
        let servo = servo();
        let agent = Agent::with_controller(config, servo).unwrap();
        agent.searching_by(Endless).recovering_by(once(None))
    };
    let (end, log) = run(few(7), true, |_| None);
    assert_eq!(
        (end.unwrap().gave_up, views(&log)),
        (Some(GaveUp::Obstructed), 7)
    );
    let (end, log) = run(few(20), false, |n| n.is_multiple_of(21).then_some(ASIDE));
    let outcome = end.unwrap();
    assert_eq!(
        (outcome.gave_up, outcome.cycles),
        (Some(GaveUp::KeptLosing), 60)
    );
    assert!(views(&log) <= 20 * 61, "{}", views(&log));
}

#[test]
fn a_search_that_never_got_to_look_was_obstructed() {
    let (end, _) = run(agent(3), true, |_| Some(ASIDE));
    assert_eq!(end.unwrap().gave_up, Some(GaveUp::Obstructed));
    let (end, _) = run(agent(3), false, |_| None);
    assert_eq!(end.unwrap().gave_up, Some(GaveUp::NotFound));
    let (end, _) = run(agent(3).searching_by(once(None)), true, |_| None);
    assert_eq!(end.unwrap().gave_up, Some(GaveUp::NotFound));
}
