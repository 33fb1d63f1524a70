//! Environments: masks, limits, lent and boxed ones, and the check of their contract.

use qtable::*;
use rand::Rng;

use crate::support::{Settings, constant, odd, odd_of, rng, step, zeros};

#[test]
fn a_mask_keeps_its_actions_out_of_everything() {
    // Action 1 of state 0 would be the best by far, and is forbidden.
    let mut environment = odd_of((2, 3), Some(Action(1)), |_, action| {
        assert_ne!(action, Action(1), "a forbidden action was taken");
        Ok(step(1, action.0 as f64, Status::Terminated))
    });
    let table = QTable::filled(2, 3, 50.0).unwrap();
    let settings = Settings {
        alpha: constant(0.5),
        ..Settings::new(500)
    };
    let mut training = settings.begin(&environment, table).unwrap();
    let until = Until::Actions(500);
    training.run(&mut environment, until, &mut rng(5)).unwrap();
    let mut table = training.into_parts().0;
    assert_eq!(table.best(State(0)), Action(2));
    assert_eq!(table.visits(State(0), Action(1)), 0);
    assert_near!(table.value(State(0), Action(1)), 50.0, 1e-12);
    assert!(table.max(State(0)) < 50.0);
    let forbidden = Error::ActionNotAllowed(State(0), Action(1));
    assert_eq!(table.set(State(0), Action(1), 0.0), Err(forbidden));
    assert!(check_env(&mut environment, 100, 0).is_ok());
}

#[test]
fn check_env_tells_what_is_wrong() {
    let mut taxi = TimeLimit::new(ModelEnvironment::taxi().unwrap(), 200).unwrap();
    let report = check_env(&mut taxi, 20_000, 3).unwrap();
    assert_eq!(report.steps, 20_000);
    assert!(
        report.truncated > 50 && report.states_met > 300,
        "{report:?}"
    );
    let endless = check_env(&mut odd(|_| step(0, 0.0, Status::Continuing)), 500, 1);
    assert_eq!(endless, Err(Error::Endless(500)));
    // What it answers depends on all the steps it ever took.
    let mut forgetful = odd(|n| match n % 7 {
        0 => step((n % 3) as usize, 0.0, Status::Terminated),
        _ => step((n % 3) as usize, 0.0, Status::Continuing),
    });
    assert_refused!(
        check_env(&mut forgetful, 500, 1),
        Error::NotReproducible(..)
    );
}

/// An environment whose shape or mask is another one after some steps.
struct Shifting {
    steps: u64,
    grows: bool,
}

impl Environment for Shifting {
    fn states(&self) -> usize {
        if self.grows && self.steps > 40 { 4 } else { 3 }
    }
    fn actions(&self) -> usize {
        2
    }
    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        Ok(State(0))
    }
    fn step(&mut self, _action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
        self.steps += 1;
        Ok(step(1, 0.0, Status::Terminated))
    }
    fn allows(&self, _state: State, action: Action) -> bool {
        self.grows || self.steps <= 40 || action == Action(0)
    }
}

#[test]
fn check_env_tells_what_has_changed() {
    for (grows, wanted) in [(true, "the shape"), (false, "the mask")] {
        let still = check_env(&mut Shifting { steps: 0, grows }, 20, 1);
        assert!(still.is_ok(), "{still:?}");
        match check_env(&mut Shifting { steps: 0, grows }, 100, 1) {
            Err(Error::EnvironmentChanged(what, _)) => assert_eq!(what, wanted),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_lent_or_boxed_environment_is_the_same_environment() {
    let play = |environment: &mut dyn Environment| {
        let settings = Settings {
            episode_limit: 9,
            ..Settings::new(2_000)
        };
        settings.run(environment).unwrap().into_parts().0.to_csv()
    };
    let mut chain = ModelEnvironment::chain(6).unwrap();
    let wanted = play(&mut chain.clone());
    assert_eq!(play(&mut Box::new(chain.clone())), wanted);
    let mut boxed: Box<dyn Environment> = Box::new(chain.clone());
    assert_eq!(play(&mut boxed), wanted);
    assert_eq!(play(&mut TimeLimit::new(&mut chain, 9).unwrap()), wanted);
    // A mask and a word on success come through.
    let cliff: Box<dyn Environment> = Box::new(ModelEnvironment::cliff_walking().unwrap());
    let goal = step(47, -1.0, Status::Terminated);
    assert_eq!(cliff.succeeded(&goal), Some(true));
    let (steps, grows) = (41, false);
    assert!(!Box::new(Shifting { steps, grows }).allows(State(0), Action(1)));
}

#[test]
fn a_time_limit_truncates() {
    let chain = || ModelEnvironment::chain(9).unwrap();
    let mut limited = TimeLimit::new(chain(), 3).unwrap();
    let mut rng = rng(0);
    for _ in 0..2 {
        limited.reset(&mut rng).unwrap();
        let ends = [(); 3].map(|()| limited.step(Action(0), &mut rng).unwrap().status);
        assert_eq!(
            ends,
            [Status::Continuing, Status::Continuing, Status::Truncated]
        );
    }
    assert_refused!(TimeLimit::new(chain(), 0), Error::Setting { .. });
}

#[test]
fn a_failing_environment_ends_the_episode_and_not_the_run() {
    let mut failing = odd_of((1, 1), None, |n, _| match n {
        4 => Err(Error::environment("the serial line is gone")),
        _ => Ok(step(0, 1.0, Status::Continuing)),
    });
    let mut training = Settings::new(100).begin(&failing, zeros(1, 1)).unwrap();
    let failed = training.run(&mut failing, Until::Actions(10), &mut rng(0));
    let text = failed.unwrap_err().to_string();
    assert_eq!(text, "the environment failed: the serial line is gone");
    assert_eq!((training.actions(), training.is_in_episode()), (3, false));
    assert!(training.table().max(State(0)) > 0.0);
    let until = Until::Actions(10);
    training.run(&mut failing, until, &mut rng(0)).unwrap();
    assert_eq!(training.actions(), 10);
}
