//! Environments that grow, masks that change, games for two.

use qtable::*;
use rand::Rng;

use crate::learners::learners;
use crate::support::{constant, epsilon, q_learning, rng, step, trained, zeros};

/// Words of `a` and `b`: the state is the word, an action adds a letter. A word is never offered
/// the letter that it ends in, and ends at five letters; the more `a`s the better.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Words {
    keys: Keys<String>,
    word: String,
}

impl Words {
    fn new(most: usize) -> Self {
        Self {
            keys: Keys::new(most),
            word: String::new(),
        }
    }
}

impl Environment for Words {
    fn states(&self) -> usize {
        self.keys.states()
    }
    fn actions(&self) -> usize {
        3
    }
    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        self.word.clear();
        self.keys.state(&self.word)
    }
    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
        self.word.push(['a', 'b', 'c'][action.0]);
        let ends = self.word.len() == 5;
        let status = if ends {
            Status::Terminated
        } else {
            Status::Continuing
        };
        let count = self.word.chars().filter(|&letter| letter == 'a').count();
        let reward = if ends { count as f64 } else { 0.0 };
        Ok(step(self.keys.state(&self.word)?.0, reward, status))
    }
    fn allows(&self, state: State, action: Action) -> bool {
        let word = self.keys.key(state).map_or("", String::as_str);
        !word.ends_with(['a', 'b', 'c'][action.0])
    }
    fn is_dynamic(&self) -> bool {
        true
    }
}

#[test]
fn tables_and_learners_grow_with_keys() {
    for (name, learner) in learners(&zeros(1, 3), &constant(0.5), 1.0) {
        let mut words = Words::new(1_000);
        let fading = Schedule::linear(1.0, 0.0, 15_000).unwrap();
        let policy = EpsilonGreedy::new(fading).unwrap();
        let table = QTable::filled(1, 3, 5.0).unwrap();
        // Learners that keep a table begin with the same values.
        let learner = match name {
            "double Q" => Box::new(DoubleQLearning::new(&table, constant(0.5), 1.0).unwrap()),
            _ => learner,
        };
        let training = trained(&mut words, table, learner, policy, (100, 20_000, 1));
        // 1 + 3 + 6 + 12 + 24 + 48 words without a double letter.
        assert_eq!(
            (words.states(), training.table().states()),
            (94, 94),
            "{name}"
        );
        assert_near!(training.table().max(State(0)), 3.0, 0.01, name);
        let tried = evaluate(&mut words, &zeros(1, 3), &mut Greedy, 5, 9, &mut rng(1));
        assert!(tried.is_ok(), "{name}: {tried:?}");
        let table = training.table();
        let tried = evaluate(&mut words, table, &mut Greedy, 5, 9, &mut rng(1)).unwrap();
        assert_near!(tried.mean_return, 3.0, 1e-12, name);
    }
    let report = check_env(&mut Words::new(1_000), 5_000, 1).unwrap();
    assert_eq!((report.states_met, report.terminated), (94, 1_000));
}

#[test]
fn a_key_beyond_the_bound_is_refused_and_the_run_goes_on() {
    let mut words = Words::new(60);
    let mut training =
        Training::new(&words, zeros(1, 3), q_learning(0.5, 1.0), epsilon(1.0)).unwrap();
    let until = Until::Actions(5_000);
    let refused = training.run(&mut words, until, &mut rng(1));
    assert_eq!(refused, Err(Error::TooManyKeys(60)));
    assert_eq!(training.table().states(), 60);
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("the 60 keys allowed"), "{text}");
}

#[cfg(feature = "files")]
#[test]
fn a_growing_run_is_resumed_byte_for_byte() {
    type Run<L> = (
        Training<L, EpsilonGreedy>,
        Words,
        rand::rngs::Xoshiro256PlusPlus,
    );
    fn check<L>(learner: L)
    where
        L: Learner + Clone + serde::Serialize + serde::de::DeserializeOwned,
    {
        let words = Words::new(1_000);
        let training = Training::new(&words, zeros(1, 3), learner, epsilon(0.5)).unwrap();
        let mut whole: Run<L> = (training, words, rng(3));
        let mut bytes = encode("run", &whole).unwrap();
        whole
            .0
            .run(&mut whole.1, Until::Actions(500), &mut whole.2)
            .unwrap();
        for stop in [1, 7, 33, 100, 499, 500] {
            let mut part: Run<L> = decode("run", &bytes).unwrap();
            part.0
                .run(&mut part.1, Until::Actions(stop), &mut part.2)
                .unwrap();
            bytes = encode("run", &part).unwrap();
        }
        assert_eq!(bytes, encode("run", &whole).unwrap());
    }
    let (table, half) = (zeros(1, 3), || constant(0.5));
    check(q_learning(0.5, 1.0));
    check(NStep::new(Target::TreeBackup, 3, half(), 1.0).unwrap());
    check(Traces::new(Target::Sarsa, 0.9, half(), 1.0).unwrap());
    check(DoubleQLearning::new(&table, half(), 1.0).unwrap());
    check(
        DynaQ::new(&table, half(), 1.0)
            .unwrap()
            .with_bonus(0.1)
            .unwrap(),
    );
    check(PrioritizedSweeping::new(&table, 1.0).unwrap());
    let twice = crate::support::forged::<Keys<u8>>("Keys", (9u64, vec![1u8, 1]));
    assert!(matches!(twice, Err(FileError::Contents(_))));
}

/// Two actions, of which only one may be taken at each step, in turns.
struct Turning(usize);

impl Environment for Turning {
    fn states(&self) -> usize {
        1
    }
    fn actions(&self) -> usize {
        2
    }
    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        self.0 = 0;
        Ok(State(0))
    }
    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
        assert!(
            self.allows(State(0), action),
            "a forbidden action was taken"
        );
        self.0 += 1;
        Ok(step(0, 1.0, Status::Continuing))
    }
    fn allows(&self, _state: State, action: Action) -> bool {
        action.0 == self.0 % 2
    }
    fn is_dynamic(&self) -> bool {
        true
    }
}

#[test]
fn a_mask_that_changes_is_asked_at_each_step() {
    for (name, learner) in learners(&zeros(1, 2), &constant(0.5), 0.5) {
        let table = zeros(1, 2);
        let training = trained(&mut Turning(0), table, learner, epsilon(0.5), (7, 200, 1));
        assert_eq!(training.actions(), 200, "{name}");
    }
    let tried = evaluate(
        &mut Turning(0),
        &zeros(1, 2),
        &mut Greedy,
        3,
        9,
        &mut rng(1),
    )
    .unwrap();
    assert_near!(tried.mean_steps, 9.0, 1e-12);
}

/// Nim: from a heap, one or two are taken in turns; who takes the last one wins.
struct Nim {
    heap: usize,
    player: usize,
}

impl Environment for Nim {
    fn states(&self) -> usize {
        11
    }
    fn actions(&self) -> usize {
        2
    }
    fn reset(&mut self, _rng: &mut dyn Rng) -> Result<State, Error> {
        (self.heap, self.player) = (10, 0);
        Ok(State(10))
    }
    fn step(&mut self, action: Action, _rng: &mut dyn Rng) -> Result<Step, Error> {
        self.heap -= action.0 + 1;
        self.player = 1 - self.player;
        Ok(match self.heap {
            0 => step(0, 1.0, Status::Terminated),
            heap => step(heap, 0.0, Status::Continuing),
        })
    }
    fn allows(&self, state: State, action: Action) -> bool {
        action.0 < state.0
    }
    fn player(&self) -> usize {
        self.player
    }
    fn succeeded(&self, last: &Step) -> Option<bool> {
        Some(last.reward > 0.0)
    }
}

/// Multiples of three are lost.
#[test]
fn two_players_learn_a_game_by_playing_each_other() {
    let mut nim = Nim {
        heap: 10,
        player: 0,
    };
    let sarsa = NStep::new(Target::ExpectedSarsa, 1, constant(0.2), 1.0).unwrap();
    let policy = || EpsilonGreedy::new(Schedule::linear(0.5, 0.0, 12_000).unwrap()).unwrap();
    let first = Training::new(&nim, zeros(11, 2), q_learning(0.2, 1.0), policy());
    let mut first = first.unwrap().with_record_every(500).unwrap();
    let mut second = Training::new(&nim, zeros(11, 2), sarsa, policy()).unwrap();
    first
        .run_against(&mut second, &mut nim, 5_000, &mut rng(1))
        .unwrap();
    assert_eq!((first.episodes(), second.episodes()), (5_000, 5_000));
    for (heap, best) in [(10, 0), (8, 1), (7, 0), (5, 1), (4, 0), (2, 1), (1, 0)] {
        let offered = first.table().visits(State(heap), Action(best)) > 100;
        assert!(
            !offered || first.table().best(State(heap)) == Action(best),
            "{heap}"
        );
    }
    assert_eq!(first.table().best(State(10)), Action(0));
    assert_near!(first.table().max(State(10)), 1.0, 0.05);
    assert_near!(second.table().max(State(9)), -1.0, 0.3);
    // At the end the first player always wins.
    assert_eq!(first.curve().last().unwrap().success_share, Some(1.0));
    let lost = second.curve().last().unwrap();
    assert_eq!(
        (lost.success_share, lost.mean_return),
        (Some(0.0), Some(-1.0))
    );
}
