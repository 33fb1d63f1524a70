//! Blackjack-v1.

use std::cmp::Ordering;

use crate::error::Error;
use crate::model::{Model, ModelEnvironment, Outcome};
use crate::step::{Action, State};

/// The sum that stands for a natural: an ace and a ten as the first two cards.
const NATURAL: usize = 22;

/// Sum of a hand, and 1 if it holds an ace that counts 11.
type Hand = (usize, usize);

/// Probability of each final sum of the dealer; 0 stands for a bust.
type Dealt = [f64; NATURAL + 1];

impl ModelEnvironment {
    /// Creates Blackjack-v1 by the rules of Sutton and Barto (example 5.1), Gymnasium's default:
    /// come closer to 21 than a dealer who draws up to 17.
    ///
    /// States are `(sum * 11 + dealer) * 2 + ace`: the player's sum, the dealer's card, 1 to 10
    /// with 1 for an ace, and 1 if the player holds an ace that counts 11. A natural, which
    /// Gymnasium shows as 21 with an ace, has the sum 22 with an ace, because only a natural of the
    /// dealer equals it. Actions: 0 stick, 1 hit. Cards are drawn with replacement. A hand pays 1
    /// if won, 0 if drawn and -1 if lost; only a hand won is a success.
    ///
    /// # Errors
    /// None for this game; the type is that of all presets.
    pub fn blackjack() -> Result<Self, Error> {
        let mut dealt = [[0.0; NATURAL + 1]; 11];
        for (shown, dealt) in dealt.iter_mut().enumerate().skip(1) {
            deal(dealt, with_card((0, 0), shown), true, 1.0);
        }
        let model = Model::new(32 * 11 * 2, 2, |State(state), Action(action)| {
            let (sum, shown, ace) = (state / 22, state / 2 % 11, state % 2);
            let sums = [4..=21, 12..=NATURAL];
            match action {
                _ if shown == 0 || !sums[ace].contains(&sum) => vec![],
                0 => stick(State(state), sum, &dealt[shown]),
                _ => (1..=10)
                    .map(|card| hit(shown, (sum.min(21), ace), card))
                    .collect(),
            }
        })?;
        let mut start = vec![0.0; model.states()];
        for deal in 0..1000 {
            let [shown, first, second] = [deal / 100, deal / 10 % 10, deal % 10].map(|n| n + 1);
            let hand = match with_card(with_card((0, 0), first), second) {
                (21, ace) => (NATURAL, ace),
                other => other,
            };
            start[state(shown, hand).0] += share(shown) * share(first) * share(second);
        }
        let start = start.into_iter().enumerate();
        let start = start.map(|(state, share)| (State(state), share));
        let start: Vec<_> = start.filter(|&(_, share)| share > 0.0).collect();
        Ok(Self::new(model, &start)?.with_success_by_reward())
    }
}

fn state(shown: usize, (sum, ace): Hand) -> State {
    State((sum * 11 + shown) * 2 + ace)
}

/// Returns the probability of a card.
fn share(card: usize) -> f64 {
    if card == 10 { 4.0 / 13.0 } else { 1.0 / 13.0 }
}

fn with_card((sum, ace): Hand, card: usize) -> Hand {
    let low = sum - 10 * ace + card;
    match low <= 11 && (ace == 1 || card == 1) {
        true => (low + 10, 1),
        false => (low, 0),
    }
}

/// Adds the probability of every way in which the dealer may draw on from a hand.
fn deal(dealt: &mut Dealt, hand: Hand, is_first: bool, probability: f64) {
    for card in 1..=10 {
        let (next, probability) = (with_card(hand, card), probability * share(card));
        match next.0 {
            21 if is_first => dealt[NATURAL] += probability,
            17..=21 => dealt[next.0] += probability,
            22.. => dealt[0] += probability,
            _ => deal(dealt, next, false, probability),
        }
    }
}

/// Returns the possible ends of a hand: lost, drawn, won.
fn stick(state: State, sum: usize, dealt: &Dealt) -> Vec<Outcome> {
    let mut ends = [Ordering::Less, Ordering::Equal, Ordering::Greater].map(|end| Outcome {
        probability: 0.0,
        ..Outcome::certain(state, f64::from(end as i8), true)
    });
    for (dealer, probability) in dealt.iter().enumerate() {
        // A natural of the dealer counts as 21 unless the player has one too.
        let end = sum.cmp(&dealer.min(sum.max(21)));
        ends[(end as i8 + 1) as usize].probability += probability;
    }
    ends.into_iter()
        .filter(|end| end.probability > 0.0)
        .collect()
}

fn hit(shown: usize, hand: Hand, card: usize) -> Outcome {
    let next = with_card(hand, card);
    let is_bust = next.0 > 21;
    let reward = if is_bust { -1.0 } else { 0.0 };
    Outcome {
        probability: share(card),
        ..Outcome::certain(state(shown, next), reward, is_bust)
    }
}
