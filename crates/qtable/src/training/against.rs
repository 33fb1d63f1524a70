//! Games for two.

use rand::Rng;

use crate::error::Error;
use crate::learner::Learner;
use crate::policy::Policy;
use crate::problem::Environment;
use crate::step::{Action, State, Status, Step};
use crate::training::course::{Actor, Running};
use crate::training::driver::Training;
use crate::training::episode::check_fit;

/// A turn of a player, whose reward grows until the player's next turn.
struct Turn {
    running: Running,
    action: Action,
    reward: f64,
}

impl<L: Learner, P: Policy> Training<L, P> {
    /// Plays episodes of a game for two against another run, and both learn: self play.
    ///
    /// [`Environment::player`] says whose turn it is: 0 is this run, 1 the other one. The reward of
    /// a step is that of the player who acted; the other one gets its negative. For each player a
    /// step is all that happens from one turn of theirs to the next. Both see the last step of an
    /// episode, and [`Environment::succeeded`] is asked with the reward of each. The example
    /// `tic_tac_toe` plays so.
    ///
    /// # Errors
    /// [`run`](Training::run) lists them. The episode is given up.
    pub fn run_against<L2: Learner, P2: Policy, E: Environment + ?Sized, R: Rng + ?Sized>(
        &mut self,
        other: &mut Training<L2, P2>,
        environment: &mut E,
        episodes: u64,
        mut rng: &mut R,
    ) -> Result<(), Error> {
        check_fit(environment, &self.table)?;
        check_fit(environment, &other.table)?;
        for _ in 0..episodes {
            (self.course.running, other.course.running) = (None, None);
            let played = self.play_against(other, environment, &mut rng);
            (self.course.running, other.course.running) = (None, None);
            played?;
        }
        Ok(())
    }

    fn play_against<L2: Learner, P2: Policy, E: Environment + ?Sized>(
        &mut self,
        other: &mut Training<L2, P2>,
        environment: &mut E,
        rng: &mut dyn Rng,
    ) -> Result<(), Error> {
        let mut open = [None, None];
        self.parts().1.begin_episode();
        other.parts().1.begin_episode();
        let mut state = environment.reset(rng)?;
        loop {
            let player = environment.player().min(1);
            let action = match player {
                0 => self.take_turn(environment, &mut open[0], state, rng)?,
                _ => other.take_turn(environment, &mut open[1], state, rng)?,
            };
            let step = environment.step(action, rng)?;
            for (place, turn) in open.iter_mut().enumerate() {
                let reward = if place == player {
                    step.reward
                } else {
                    -step.reward
                };
                if let Some(turn) = turn {
                    turn.reward += reward;
                }
            }
            state = step.observation;
            if step.status != Status::Continuing {
                self.answer(environment, open[0].take(), state, step.status, rng)?;
                return other.answer(environment, open[1].take(), state, step.status, rng);
            }
        }
    }

    /// Learns from a player's last turn, and chooses the next action.
    fn take_turn<E: Environment + ?Sized>(
        &mut self,
        environment: &E,
        open: &mut Option<Turn>,
        state: State,
        rng: &mut dyn Rng,
    ) -> Result<Action, Error> {
        self.answer(environment, open.take(), state, Status::Continuing, rng)?;
        let (course, mut pair) = self.parts();
        if environment.is_dynamic() {
            pair.meet(environment, state)?;
        }
        let running = course.running.take().unwrap_or(Running::at(state));
        let action = pair.choose(state, running.action, rng)?;
        let reward = 0.0;
        *open = Some(Turn {
            running,
            action,
            reward,
        });
        Ok(action)
    }

    /// Learns from a turn, if there was one, that led to a state.
    fn answer<E: Environment + ?Sized>(
        &mut self,
        environment: &E,
        turn: Option<Turn>,
        observation: State,
        status: Status,
        rng: &mut dyn Rng,
    ) -> Result<(), Error> {
        if let Some(turn) = turn {
            let step = Step::new(observation, turn.reward, status);
            let (course, mut pair) = self.parts();
            let taken = (turn.running, turn.action);
            let record = course.learn(environment, &mut pair, taken, step, rng)?;
            self.curve.extend(record);
        }
        Ok(())
    }
}
