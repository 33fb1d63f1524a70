//! A run under way: the state machine, which links the modules and reports every transition.

use std::mem::discriminant;

use hough_heuristic::image::GrayImage;
use puma_val2::{Gripper, Joint, Joints, Manipulator, ProximitySensor};

use crate::controller::{Controller, Decision, Feedback, GaveUp, Request};
use crate::controllers::hybrid::misfit::Misfit;
use crate::error::AgentError;
use crate::percept::{Percept, Sighting};
use crate::run::config::AgentConfig;
use crate::run::event::{EventKind, RunEvent, RunOutcome};
use crate::run::search::Search;
use crate::run::supervision::Supervision;
use crate::sight::eye::Eye;
use crate::sight::frozen::FrozenCheck;

mod acting;
mod gripping;
mod lag;

use acting::Went;
pub(crate) use acting::{STOP, jaws_order};

/// Number of moves taken back, or of barred ways of the gripper to the ball, that is too many.
const OFTEN: usize = 3;

/// Modules that a user can replace, beside the controller.
#[derive(Clone, Debug)]
pub(crate) struct Modules {
    pub(crate) search: Box<dyn Search>,
    pub(crate) recovery: Box<dyn Search>,
    pub(crate) supervision: Box<dyn Supervision>,
}

/// Devices of a run.
pub(crate) struct Devices<'a> {
    pub(crate) eye: &'a mut dyn Eye,
    pub(crate) arm: &'a mut dyn Manipulator,
    pub(crate) proximity: &'a mut dyn ProximitySensor,
}

/// State of the state machine that the crate documentation draws, and the data that it begins with.
#[derive(Clone, Copy, Debug)]
enum State {
    Search,
    /// The ball is in view.
    Reach(Sighting),
    /// The ball was in view from the pose `from`, and is not any more, or was missed by a grip.
    Recover {
        ball: Sighting,
        from: Joints,
        missed: bool,
    },
    /// The ball is at the goal, or as near to it as can be.
    Grip {
        ball: Sighting,
        at_goal: bool,
    },
    /// The run is over, without a grip if there is a reason.
    End(Option<GaveUp>),
}

impl State {
    /// Returns the event of entering this state from another one.
    fn entry(&self) -> EventKind {
        match *self {
            Self::Search => EventKind::Searching,
            Self::Reach(_) => EventKind::Reaching,
            Self::Recover { missed: false, .. } => EventKind::Lost,
            Self::Recover { missed: true, .. } => EventKind::Missed,
            Self::Grip { at_goal: true, .. } => EventKind::AtGoal,
            Self::Grip { at_goal: false, .. } => EventKind::Cornered,
            Self::End(None) => EventKind::Grasped,
            Self::End(Some(reason)) => EventKind::GaveUp(reason),
        }
    }
}

pub(crate) struct Run<'a> {
    config: &'a AgentConfig,
    controller: &'a mut dyn Controller,
    modules: &'a mut Modules,
    camera: &'a mut FrozenCheck,
    devices: Devices<'a>,
    observe: &'a mut dyn FnMut(&RunEvent<'_>),
    joints: Joints,
    cycles: usize,
    losses: usize,
    last_seen: Option<Sighting>,
    /// `true` if the arm has moved since the last look.
    moved: bool,
    /// `true` once the jaws have closed: looks then verify the grip.
    closed: bool,
    /// Moves in a row that were taken back.
    taken_back: usize,
    /// Moves that were taken back since the search.
    barred: usize,
    /// Moves of the controller that the sensors stopped since the ball was last at the goal.
    short_of_goal: usize,
    /// First sighting since the search began.
    first_seen: Option<Sighting>,
    /// `true` if the ball has shown in more than one place of the image since then.
    wandered: bool,
    /// Barred ways of the gripper to the ball in this run.
    barred_grips: usize,
    /// `true` if the last of them was aimed by the controller.
    own_barred: bool,
    /// `true` while joints are freed from friction.
    freeing: bool,
    /// Grips that missed, and looks from one pose that differed.
    missed: usize,
    unsteady: usize,
    /// Sighting from which the ball has kept its place in the image, and the moves before it.
    kept: Option<(Sighting, usize)>,
    /// Cause reported last for a model that does not fit.
    misfit: Option<Misfit>,
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        config: &'a AgentConfig,
        controller: &'a mut dyn Controller,
        modules: &'a mut Modules,
        camera: &'a mut FrozenCheck,
        devices: Devices<'a>,
        observe: &'a mut dyn FnMut(&RunEvent<'_>),
    ) -> Self {
        Self {
            config,
            controller,
            modules,
            camera,
            devices,
            observe,
            joints: Joints::default(),
            cycles: 0,
            losses: 0,
            last_seen: None,
            moved: false,
            closed: false,
            taken_back: 0,
            barred: 0,
            short_of_goal: 0,
            first_seen: None,
            wandered: false,
            barred_grips: 0,
            own_barred: false,
            freeing: false,
            missed: 0,
            unsteady: 0,
            kept: None,
            misfit: None,
        }
    }

    pub(crate) fn until_done(mut self) -> Result<RunOutcome, AgentError> {
        let result = self.phases();
        if let Err(error) = &result {
            // The first error is the one to report; stopping is all that can still be done.
            let _ = self.devices.arm.stop();
            self.tell(EventKind::Failed(error.to_string()));
        }
        result
    }

    fn phases(&mut self) -> Result<RunOutcome, AgentError> {
        let joints = self.devices.arm.joints()?;
        self.stand_at(joints)?;
        self.set_jaws(Gripper::Open)?;
        self.tell(EventKind::Started);
        let mut state = State::Search;
        self.tell(state.entry());
        loop {
            let next = match state {
                State::Search => self.search()?,
                State::Reach(_) if self.has_to_measure_lag() => self.measure_lag()?,
                State::Reach(ball) => self.reach(&ball)?,
                State::Recover { ball, from, .. } => self.recover(&ball, &from)?,
                State::Grip { ball, at_goal } => self.grip(&ball, at_goal)?,
                State::End(gave_up) => {
                    return Ok(RunOutcome {
                        gave_up,
                        cycles: self.cycles,
                        losses: self.losses,
                        last_seen: self.last_seen,
                        joints: self.joints,
                    });
                }
            };
            let next = self.with_cause(next);
            if discriminant(&next) != discriminant(&state) {
                self.tell(next.entry());
            }
            if let State::Recover { missed, .. } = next {
                self.losses += usize::from(!missed);
                self.cycles += usize::from(missed);
                self.missed += usize::from(missed);
            }
            state = next;
        }
    }

    /// Reports a model that does not fit, and names the cause in a failure without another.
    fn with_cause(&mut self, next: State) -> State {
        let cause = self.controller.misfit();
        if cause != self.misfit {
            self.misfit = cause;
            if let Some(cause) = cause {
                self.tell(EventKind::Misfit(cause));
            }
        }
        let State::End(Some(reason)) = next else {
            return next;
        };
        let named = cause.filter(|cause| *cause != Misfit::Unexplained);
        let replaced = matches!(
            reason,
            GaveUp::OutOfCycles | GaveUp::NotFound | GaveUp::NoMoveLeft
        );
        let reason = match (reason, named) {
            (_, Some(cause)) if replaced => GaveUp::Misfit(cause),
            (GaveUp::OutOfCycles, None) => match (self.out_of_cycles(), cause) {
                (GaveUp::OutOfCycles, Some(cause)) => GaveUp::Misfit(cause),
                (reason, _) => reason,
            },
            (reason, _) => reason,
        };
        State::End(Some(reason))
    }

    /// Looks around until the ball is in view, the search names no more viewpoints, or it has named
    /// the allowed number.
    fn search(&mut self) -> Result<State, AgentError> {
        (self.first_seen, self.wandered, self.barred) = (None, false, 0);
        let (mut barred, mut any_barred, mut looked) = (false, false, false);
        self.modules.search.begin(&self.joints, None);
        // A user-supplied search might never return `None`.
        for _ in 0..self.config.max_views {
            let Some(view) = self.modules.search.next_view(&self.joints, barred) else {
                break;
            };
            match self.look_from(view, EventKind::AtSearchPose(view.0))? {
                View::Ball(ball) => return Ok(State::Reach(ball)),
                came => barred = matches!(came, View::Barred),
            }
            any_barred |= barred;
            looked |= !barred;
        }
        let reason = if any_barred && !looked {
            GaveUp::Obstructed
        } else {
            GaveUp::NotFound
        };
        Ok(State::End(Some(reason)))
    }

    /// Looks from the pose nearest to `pose` within the limits.
    fn look_from(
        &mut self,
        (number, pose): (usize, Joints),
        there: EventKind,
    ) -> Result<View, AgentError> {
        // A user-supplied search might name anything.
        if let Some(joint) = pose.non_finite() {
            let name = self.config.name(joint);
            return Err(AgentError::Viewpoint {
                number,
                joint,
                name,
            });
        }
        let target = self.modules.supervision.limits().nearest(&pose);
        Ok(match self.go_to(target, there)? {
            Went::Back => View::Barred,
            Went::There => self.look()?.map_or(View::Nothing, View::Ball),
        })
    }

    /// Makes one control cycle: decision, one joint move, next sighting.
    fn reach(&mut self, ball: &Sighting) -> Result<State, AgentError> {
        let from = self.joints;
        let percept = Percept {
            features: ball.features,
            theta3: from[Joint::J3].to_degrees() - self.config.theta3_zero,
        };
        let mut goal = self.config.goal.iter();
        if goal.all(|interval| interval.holds(&percept)) {
            self.short_of_goal = 0;
            return self.begin_grip(*ball, true);
        }
        if self.cycles >= self.config.max_cycles {
            return Ok(State::End(Some(GaveUp::OutOfCycles)));
        }
        let request = self.request(false);
        let delta = match self.controller.decide(ball, &request) {
            Ok(Decision::Move(delta)) => delta,
            Ok(Decision::Grip(_)) => {
                // Costs a cycle: a controller could ask for a grip again and again.
                self.cycles += 1;
                return self.begin_grip(*ball, false);
            }
            Err(reason) => return Ok(State::End(Some(reason))),
        };
        // A user-supplied controller might decide on anything.
        if !request.limits.admit(&(from + delta)) {
            return Ok(State::End(Some(GaveUp::NoMoveLeft)));
        }
        self.cycles += 1;
        if self.go_by(delta, EventKind::Moved(delta))? == Went::Back {
            self.short_of_goal += 1;
            return self.after_taking_back(*ball, from);
        }
        let Some(after) = self.look()? else {
            self.controller.notice(&Feedback::Lost);
            return Ok(lost(*ball, from));
        };
        let supervision = &mut self.modules.supervision;
        if supervision.is_too_fast(&ball.features, &after.features) {
            self.tell(EventKind::TooFast);
            self.take_back(from)?;
            return self.after_taking_back(*ball, from);
        }
        self.taken_back = 0;
        self.controller.notice(&Feedback::Seen {
            ball: after,
            joints: self.joints,
        });
        Ok(State::Reach(after))
    }

    /// Begins a grip, unless the image has not changed since another pose: it may be an old one.
    fn begin_grip(&self, ball: Sighting, at_goal: bool) -> Result<State, AgentError> {
        if self.camera.same() > 0 {
            return Err(self.frozen());
        }
        Ok(State::Grip { ball, at_goal })
    }

    /// Looks again from where the last move began.
    ///
    /// After every third move that was taken back, the thing too near may be the ball itself: a
    /// controller that can aim at it from here does. After three in a row without an aim, the
    /// search begins anew.
    fn after_taking_back(&mut self, before: Sighting, from: Joints) -> Result<State, AgentError> {
        self.controller.notice(&Feedback::TakenBack);
        self.taken_back += 1;
        self.barred += 1;
        let Some(ball) = self.look()? else {
            return Ok(lost(before, from));
        };
        let often = self.barred.is_multiple_of(OFTEN) || self.taken_back >= OFTEN;
        Ok(if often {
            State::Grip {
                ball,
                at_goal: false,
            }
        } else {
            State::Reach(ball)
        })
    }

    /// Looks around near where the `ball` was last seen `from`, then leaves it to a new search.
    fn recover(&mut self, ball: &Sighting, from: &Joints) -> Result<State, AgentError> {
        // A recovery without viewpoints costs no cycle, and nor may what led to it.
        if self.cycles >= self.config.max_cycles {
            return Ok(State::End(Some(GaveUp::OutOfCycles)));
        }
        let mut barred = false;
        self.modules
            .recovery
            .begin(&self.joints, Some((ball, from)));
        while let Some(view) = self.modules.recovery.next_view(&self.joints, barred) {
            if self.cycles >= self.config.max_cycles {
                return Ok(State::End(Some(GaveUp::OutOfCycles)));
            }
            self.cycles += 1;
            match self.look_from(view, EventKind::Recovering(view.0))? {
                View::Ball(ball) => return Ok(State::Reach(ball)),
                came => barred = matches!(came, View::Barred),
            }
        }
        Ok(State::Search)
    }

    fn request(&self, grip: bool) -> Request {
        Request {
            joints: self.joints,
            limits: *self.modules.supervision.limits(),
            grip,
        }
    }

    fn frozen(&self) -> AgentError {
        AgentError::FrozenCamera {
            looks: self.camera.same().saturating_add(1),
        }
    }

    fn tell(&mut self, kind: EventKind) {
        (self.observe)(&RunEvent {
            cycle: self.cycles,
            kind,
            joints: self.joints,
            frame: None::<&GrayImage>,
        });
    }

    /// Takes note of a sighting.
    fn saw(&mut self, ball: Sighting) {
        let first = self.first_seen.get_or_insert(ball);
        self.wandered |= !is_same_place(first, &ball);
        self.last_seen = Some(ball);
        if self
            .kept
            .is_none_or(|(kept, _)| !is_same_place(&kept, &ball))
        {
            self.kept = Some((ball, self.cycles));
        }
    }

    /// Returns the reason of a run without moves left.
    fn out_of_cycles(&self) -> GaveUp {
        let counts = [
            (self.missed, GaveUp::KeptMissing),
            (self.losses, GaveUp::KeptLosing),
            (self.unsteady, GaveUp::Unsteady),
            (self.short_of_goal, GaveUp::GoalBarred),
        ];
        let most = counts.into_iter().max_by_key(|(count, _)| *count);
        let kept = self.kept.map_or(0, |(_, since)| self.cycles - since);
        match most {
            Some((count, reason)) if count >= OFTEN => reason,
            _ if kept * 4 >= self.config.max_cycles => GaveUp::NoProgress,
            _ => GaveUp::OutOfCycles,
        }
    }
}

/// Result of a look from a viewpoint.
enum View {
    Ball(Sighting),
    Nothing,
    /// Something too near kept the hand from getting there; nothing was looked at.
    Barred,
}

/// Returns the state after a ball, last seen from the pose `from`, is out of view.
fn lost(ball: Sighting, from: Joints) -> State {
    State::Recover {
        ball,
        from,
        missed: false,
    }
}

/// Returns `true` if two sightings from one pose can be of one ball, given the noise of a camera.
fn is_same_place(a: &Sighting, b: &Sighting) -> bool {
    let (a, b) = (a.features, b.features);
    (a.x - b.x).abs() < 10.0 && (a.y - b.y).abs() < 10.0 && (a.r - b.r).abs() < 6.0
}
