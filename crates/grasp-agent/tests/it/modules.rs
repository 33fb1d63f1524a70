//! Other modules in the place of the paper's search, recovery and supervision.

use grasp_agent::hough_heuristic::Features;
use grasp_agent::puma_val2::{Joint, Joints};
use grasp_agent::{
    Agent, AgentConfig, CameraModel, EventKind, EventLog, GaveUp, JointLimits, Search, Servo,
    Sighting, Supervision,
};

use crate::cell::{Fault, Shared, agent_of, config, servo};
use crate::faults::words_from;

/// Looks from one pose, and from there only.
#[derive(Clone, Debug)]
struct FromThere {
    pose: Joints,
    named: bool,
}

impl Search for FromThere {
    fn begin(&mut self, _at: &Joints, _lost: Option<(&Sighting, &Joints)>) {
        self.named = false;
    }

    fn next_view(&mut self, _at: &Joints, _barred: bool) -> Option<(usize, Joints)> {
        let named = std::mem::replace(&mut self.named, true);
        (!named).then_some((7, self.pose))
    }

    fn boxed(&self) -> Box<dyn Search> {
        Box::new(self.clone())
    }
}

/// Looks for the ball where it was, and nowhere else.
#[derive(Clone, Debug, Default)]
struct WhereItWas(Option<Joints>);

impl Search for WhereItWas {
    fn begin(&mut self, _at: &Joints, lost: Option<(&Sighting, &Joints)>) {
        self.0 = lost.map(|(_, from)| *from);
    }

    fn next_view(&mut self, _at: &Joints, _barred: bool) -> Option<(usize, Joints)> {
        Some((0, self.0.take()?))
    }

    fn boxed(&self) -> Box<dyn Search> {
        Box::new(self.clone())
    }
}

/// Finds the moves with these numbers too near.
#[derive(Clone, Debug)]
struct Nervous {
    bounds: AgentConfig,
    moves: usize,
    near: fn(usize) -> bool,
}

impl Supervision for Nervous {
    fn limits(&self) -> &JointLimits {
        self.bounds.limits()
    }

    fn is_too_near(&mut self, _reached: &Joints, near: bool) -> bool {
        self.moves += 1;
        near || (self.near)(self.moves)
    }

    fn stuck(&mut self, target: &Joints, reached: &Joints) -> Option<Joint> {
        self.bounds.stuck(target, reached)
    }

    fn is_too_fast(&mut self, before: &Features, after: &Features) -> bool {
        self.bounds.is_too_fast(before, after)
    }

    fn boxed(&self) -> Box<dyn Supervision> {
        Box::new(self.clone())
    }
}

fn agent() -> Agent<Servo> {
    agent_of(servo())
}

#[test]
fn a_search_of_ones_own_is_what_is_searched_by() {
    let pose = Joints::from_degrees([8.0, -110.0, 210.0, 0.0, 45.0, 0.0]);
    let agent = agent().searching_by(FromThere { pose, named: false });
    for (y, found) in [(0.1, true), (-0.5, false)] {
        let cell = Shared::new(CameraModel::paper(), [0.6, y, -0.1], Fault::None);
        let mut log = EventLog::default();
        let outcome = cell.run(&mut agent.clone(), &mut log).unwrap();
        assert_eq!(outcome.gave_up, (!found).then_some(GaveUp::NotFound));
        let searched = log
            .events
            .iter()
            .filter(|event| matches!(event.kind, EventKind::AtSearchPose(_)));
        let searched: Vec<_> = searched.map(|event| (&event.kind, event.joints)).collect();
        assert_eq!(searched, [(&EventKind::AtSearchPose(7), pose)]);
        // It belongs to what is replayed.
        assert_eq!(log.replay(&agent).unwrap().1, log);
    }
}

#[test]
fn a_viewpoint_out_of_the_limits_is_cut_to_them() {
    let agent = agent().searching_by(FromThere {
        pose: Joints::from_degrees([400.0; 6]),
        named: false,
    });
    let cell = Shared::paper(Fault::None);
    let mut log = EventLog::default();
    cell.run(&mut agent.clone(), &mut log).unwrap();
    assert!(
        log.events[2..]
            .iter()
            .all(|event| config().limits.admit(&event.joints))
    );
}

#[test]
fn a_recovery_of_ones_own_is_what_is_recovered_by() {
    let mut agent = agent().recovering_by(WhereItWas(None));
    let cell = Shared::paper(Fault::PhantomOnce);
    let mut log = EventLog::default();
    cell.run(&mut agent, &mut log).unwrap();
    let words = words_from(&log, "lost");
    assert_eq!(
        words[..5],
        ["lost", "recover", "not-seen", "not-seen", "searching"],
        "{words:?}"
    );
}

#[test]
fn a_supervision_of_ones_own_is_what_takes_moves_back() {
    let log_of = |near| {
        let (bounds, moves) = (config(), 0);
        let mut agent = agent().supervised_by(Nervous {
            bounds,
            moves,
            near,
        });
        let cell = Shared::paper(Fault::None);
        let mut log = EventLog::default();
        cell.run(&mut agent, &mut log).unwrap();
        assert!(cell.0.borrow().stops > 0);
        log
    };
    let log = log_of(|number| number == 3);
    let near = words_from(&log, "too-near");
    assert_eq!(near[..3], ["too-near", "taken-back", "seen"], "{near:?}");
    // Every move after the ball was found: three in a row, and a servo controller cannot aim; nor
    // can it be searched for again.
    let log = log_of(|number| number > 1);
    let cornered = words_from(&log, "cornered");
    assert_eq!(
        cornered[..3],
        ["cornered", "seen", "searching"],
        "{cornered:?}"
    );
    assert_eq!(
        log.events.last().unwrap().kind,
        EventKind::GaveUp(GaveUp::Obstructed)
    );
}
