//! A run under way: the state machine, which links the modules and tells every transition.

use hough_heuristic::image::GrayImage;
use puma_val2::{Gripper, Joints, Manipulator, ProximitySensor};

use crate::controller::{Consequence, Controller, GaveUp, Situation};
use crate::error::AgentError;
use crate::percept::Percept;
use crate::percept::Sighting;
use crate::run::config::AgentConfig;
use crate::run::event::{Event, EventKind, Outcome, Phase};
use crate::run::gripper::is_same_place;
use crate::run::gripper::{GripEnd, GripperActivation, Hand, Went};
use crate::run::recovery::Recovery;
use crate::run::search::{LastLook, Search, Viewpoint};
use crate::run::supervision::Supervision;
use crate::sight::eye::Eye;
use crate::sight::watch::Watch;

mod acting;

/// So many moves that were taken back are too many.
const OFTEN: usize = 3;

/// The modules that a user can put others in the place of, beside the controller.
#[derive(Clone, Debug)]
pub(crate) struct Modules {
    pub(crate) search: Box<dyn Search>,
    pub(crate) recovery: Box<dyn Recovery>,
    pub(crate) supervision: Box<dyn Supervision>,
}

/// What a run acts on.
pub(crate) struct Devices<'a> {
    pub(crate) eye: &'a mut dyn Eye,
    pub(crate) arm: &'a mut dyn Manipulator,
    pub(crate) proximity: &'a mut dyn ProximitySensor,
}

/// Where the state machine stands: a [`Phase`] and what it begins with.
#[derive(Clone, Copy, Debug)]
enum State {
    Search,
    /// The ball is in view.
    Reach(Sighting),
    /// The ball was in view like this and is not any more.
    Recover {
        seen: Situation,
        why: Gone,
    },
    /// The ball is where it should be, or as near to that as can be.
    Grip {
        seen: Sighting,
        at_goal: bool,
    },
    /// Over, without a grip where there is a reason.
    End(Option<GaveUp>),
}

/// Why a ball has to be recovered.
#[derive(Clone, Copy, Debug)]
enum Gone {
    Lost,
    Missed,
}

impl State {
    fn phase(&self) -> Phase {
        match self {
            Self::Search => Phase::Search,
            Self::Reach(_) => Phase::Reach,
            Self::Recover { .. } => Phase::Recover,
            Self::Grip { .. } => Phase::Grip,
            Self::End(_) => Phase::End,
        }
    }

    /// The event of entering this state from another phase; [`EventKind::enters`] is its inverse.
    fn entry(&self) -> EventKind {
        match *self {
            Self::Search => EventKind::Searching,
            Self::Reach(_) => EventKind::Reaching,
            Self::Recover {
                why: Gone::Lost, ..
            } => EventKind::Lost,
            Self::Recover {
                why: Gone::Missed, ..
            } => EventKind::Missed,
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
    gripper: GripperActivation,
    watch: &'a mut Watch,
    devices: Devices<'a>,
    observe: &'a mut dyn FnMut(&Event<'_>),
    joints: Joints,
    cycles: usize,
    losses: usize,
    last_seen: Option<Sighting>,
    /// Whether the jaws have closed: what is seen says whether they hold the ball.
    closed: bool,
    /// Moves in a row that were taken back.
    taken_back: usize,
    /// All of them since the search.
    barred: usize,
    /// What was seen first since the search began.
    first_seen: Option<Sighting>,
    /// Whether what is seen has shown in more than one place of the image since then.
    wandered: bool,
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        config: &'a AgentConfig,
        controller: &'a mut dyn Controller,
        modules: &'a mut Modules,
        watch: &'a mut Watch,
        devices: Devices<'a>,
        observe: &'a mut dyn FnMut(&Event<'_>),
    ) -> Self {
        Self {
            config,
            controller,
            gripper: GripperActivation::new(config, *modules.supervision.limits()),
            modules,
            watch,
            devices,
            observe,
            joints: Joints::default(),
            cycles: 0,
            losses: 0,
            last_seen: None,
            closed: false,
            taken_back: 0,
            barred: 0,
            first_seen: None,
            wandered: false,
        }
    }

    pub(crate) fn until_done(mut self) -> Result<Outcome, AgentError> {
        let result = self.phases();
        if let Err(error) = &result {
            // The first error is the one to report; stopping is all that can still be done.
            let _ = self.devices.arm.stop();
            self.tell(EventKind::Failed(error.to_string()), None);
        }
        result
    }

    fn phases(&mut self) -> Result<Outcome, AgentError> {
        let joints = self.devices.arm.joints()?;
        self.stand_at(joints)?;
        self.set_jaws(Gripper::Open)?;
        self.tell(EventKind::Started, None);
        let mut state = State::Search;
        self.tell(state.entry(), None);
        loop {
            let next = match state {
                State::Search => self.search()?,
                State::Reach(sighting) => self.reach(&sighting)?,
                State::Recover { seen, .. } => self.recover(&seen)?,
                State::Grip { seen, at_goal } => self.grip(&seen, at_goal)?,
                State::End(gave_up) => return Ok(self.outcome(gave_up)),
            };
            if next.phase() != state.phase() {
                self.tell(next.entry(), None);
            }
            if let State::Recover { why, .. } = next {
                match why {
                    Gone::Lost => self.losses += 1,
                    Gone::Missed => self.cycles += 1,
                }
            }
            state = next;
        }
    }

    fn outcome(&self, gave_up: Option<GaveUp>) -> Outcome {
        Outcome {
            gave_up,
            cycles: self.cycles,
            losses: self.losses,
            last_seen: self.last_seen,
            joints: self.joints,
        }
    }

    /// Looks around until the ball is in view, there is nowhere left to look from, or it has been
    /// looked from often enough.
    fn search(&mut self) -> Result<State, AgentError> {
        (self.first_seen, self.wandered, self.barred) = (None, false, 0);
        let (mut barred, mut looked) = (false, false);
        let mut last = LastLook::None;
        // A module may be anyone's, and a search of its own never end.
        for _ in 0..self.config.max_views {
            let Some(view) = self.modules.search.next_view(&self.joints, last) else {
                break;
            };
            match self.look_from(&view, EventKind::AtSearchPose(view.number))? {
                Ok(ball) => return Ok(State::Reach(ball)),
                Err(came) => last = came,
            }
            barred |= last == LastLook::Barred;
            looked |= last == LastLook::Nothing;
        }
        let reason = if barred && !looked {
            GaveUp::Obstructed
        } else {
            GaveUp::NotFound
        };
        Ok(State::End(Some(reason)))
    }

    /// The ball from the pose nearest to that of `view`, or what came of the look.
    fn look_from(
        &mut self,
        view: &Viewpoint,
        there: EventKind,
    ) -> Result<Result<Sighting, LastLook>, AgentError> {
        // A module may be anyone's.
        if let Some(joint) = view.pose.non_finite() {
            let number = view.number;
            return Err(AgentError::Viewpoint { number, joint });
        }
        let target = self.modules.supervision.limits().nearest(&view.pose);
        Ok(match self.go_to(target, there)? {
            Went::Back => Err(LastLook::Barred),
            Went::There => self.look()?.ok_or(LastLook::Nothing),
        })
    }

    /// One control cycle: sighting, decision, one joint move, next sighting.
    fn reach(&mut self, sighting: &Sighting) -> Result<State, AgentError> {
        let now = self.situation(sighting);
        let percept = Percept::new(sighting.features, &self.joints);
        if self
            .config
            .goal
            .iter()
            .all(|interval| interval.holds(&percept))
        {
            // What is shown from two poses alike is not what is there: no reason to grip.
            if self.watch.same() > 0 {
                return Err(self.frozen());
            }
            return Ok(State::Grip {
                seen: *sighting,
                at_goal: true,
            });
        }
        if self.cycles >= self.config.max_cycles {
            return Ok(State::End(Some(GaveUp::OutOfCycles)));
        }
        let limits = self.modules.supervision.limits();
        let delta = match self.controller.decide(&now, limits) {
            // A controller may be anyone's: what leads out of the limits is not done.
            Ok(delta) if limits.admit(&(self.joints + delta)) => delta,
            Ok(_) => return Ok(State::End(Some(GaveUp::NoMoveLeft))),
            Err(reason) => return Ok(State::End(Some(reason))),
        };

        self.cycles += 1;
        if self.go_by(delta, EventKind::Moved(delta))? == Went::Back {
            return self.after_taking_back(now);
        }
        let Some(after) = self.look()? else {
            self.controller.judge(&Consequence::Lost);
            return Ok(lost(now));
        };
        if self
            .modules
            .supervision
            .is_too_fast(&sighting.features, &after.features)
        {
            self.tell(EventKind::TooFast, None);
            self.take_back(now.joints)?;
            return self.after_taking_back(now);
        }
        self.taken_back = 0;
        let then = self.situation(&after);
        self.controller.judge(&Consequence::Seen(then));
        Ok(State::Reach(after))
    }

    /// Looks again from where the last move began. Where moves come to nothing again and again,
    /// what is too near may be the ball itself, and a controller that can aim at it from here does;
    /// where they do so in a row and it cannot, whatever is seen is not to be had, and the search
    /// begins anew.
    fn after_taking_back(&mut self, before: Situation) -> Result<State, AgentError> {
        self.controller.judge(&Consequence::TakenBack);
        self.taken_back += 1;
        self.barred += 1;
        let Some(seen) = self.look()? else {
            return Ok(lost(before));
        };
        Ok(
            if self.barred.is_multiple_of(OFTEN) || self.taken_back >= OFTEN {
                State::Grip {
                    seen,
                    at_goal: false,
                }
            } else {
                State::Reach(seen)
            },
        )
    }

    /// Looks around where the ball was `seen` last, then leaves it to a new search.
    fn recover(&mut self, seen: &Situation) -> Result<State, AgentError> {
        // A recovery that offers nothing costs no cycle, and what led to it may not have been a
        // move.
        if self.cycles >= self.config.max_cycles {
            return Ok(State::End(Some(GaveUp::OutOfCycles)));
        }
        let mut last = LastLook::None;
        while let Some(view) = self.modules.recovery.next_view(seen, &self.joints, last) {
            if self.cycles >= self.config.max_cycles {
                return Ok(State::End(Some(GaveUp::OutOfCycles)));
            }
            self.cycles += 1;
            match self.look_from(&view, EventKind::Recovering(view.number))? {
                Ok(ball) => return Ok(State::Reach(ball)),
                Err(came) => last = came,
            }
        }
        Ok(State::Search)
    }

    /// Lets the gripper go for the ball, and goes on from what that came to.
    fn grip(&mut self, seen: &Sighting, at_goal: bool) -> Result<State, AgentError> {
        let from = self.joints;
        let (mut gripper, wandered) = (self.gripper.clone(), self.wandered);
        let end = gripper.activate(self, seen, at_goal, wandered);
        self.gripper = gripper;
        let end = end?;
        if !matches!(
            end,
            GripEnd::Unseen | GripEnd::Elsewhere(_) | GripEnd::NoMove(_)
        ) {
            self.taken_back = 0;
        }
        Ok(match end {
            GripEnd::Held(ball) => self.end_with(ball, None),
            GripEnd::Unknown(ball, reason) => self.end_with(ball, Some(reason)),
            GripEnd::Missed(ball) => {
                // What was seen meanwhile was not the ball in its place.
                self.last_seen = Some(ball);
                self.controller.judge(&Consequence::Missed);
                State::Recover {
                    seen: Situation {
                        features: ball.features,
                        joints: from,
                        long_axis: ball.long_axis,
                    },
                    why: Gone::Missed,
                }
            }
            GripEnd::Unseen => {
                // As for two looks that differ.
                self.cycles += 1;
                lost(self.situation(seen))
            }
            GripEnd::Elsewhere(ball) => {
                // Two looks that differ cost a cycle: both can be at the goal, and no move is made
                // between them.
                self.cycles += 1;
                if self.cycles >= self.config.max_cycles {
                    State::End(Some(GaveUp::OutOfCycles))
                } else {
                    State::Reach(ball)
                }
            }
            GripEnd::NoMove(_) if at_goal => State::End(Some(GaveUp::NoMoveLeft)),
            GripEnd::NoMove(ball) => {
                let often = std::mem::take(&mut self.taken_back) >= OFTEN;
                if often {
                    State::Search
                } else {
                    State::Reach(ball)
                }
            }
            GripEnd::Barred | GripEnd::BarredAgain => {
                self.controller.judge(&Consequence::Missed);
                self.cycles += 1;
                if end == GripEnd::BarredAgain {
                    return Ok(State::End(Some(GaveUp::Obstructed)));
                }
                match self.look()? {
                    Some(ball) => State::Reach(ball),
                    None => lost(self.situation(seen)),
                }
            }
        })
    }

    /// The end, with the ball as it was before the jaws closed: what was seen meanwhile was not the
    /// ball in its place.
    fn end_with(&mut self, ball: Sighting, gave_up: Option<GaveUp>) -> State {
        self.last_seen = Some(ball);
        State::End(gave_up)
    }

    fn situation(&self, sighting: &Sighting) -> Situation {
        Situation {
            features: sighting.features,
            joints: self.joints,
            long_axis: sighting.long_axis,
        }
    }

    fn frozen(&self) -> AgentError {
        AgentError::FrozenCamera {
            looks: self.watch.same().saturating_add(1),
        }
    }

    fn tell(&mut self, kind: EventKind, frame: Option<&GrayImage>) {
        (self.observe)(&Event {
            cycle: self.cycles,
            kind,
            joints: self.joints,
            frame,
        });
    }

    /// Takes note of a sighting.
    fn saw(&mut self, sighting: Sighting) {
        let first = self.first_seen.get_or_insert(sighting);
        self.wandered |= !is_same_place(first, &sighting);
        self.last_seen = Some(sighting);
    }
}

/// The ball was in view like this and is not any more.
fn lost(seen: Situation) -> State {
    State::Recover {
        seen,
        why: Gone::Lost,
    }
}
