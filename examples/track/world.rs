//! A ball that does not stay where it is.

use clap::ValueEnum;
use example_support::trial::at_goal;
use pipeline_sim::{Cell, Workspace};
use puma_val2::Joints;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// The events that happen to a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Fate {
    /// Stays at rest
    Rest,
    /// Pushed toward the camera, to a radius of 60 units, each of the first three times it is
    /// reached (Fig. 8 of the paper)
    Push,
    /// Jumps 150 mm away when first reached
    Jump,
    /// Drifts by 20 mm in each of ten moves
    Drift,
}

/// The events that happen to one ball.
pub(crate) struct World {
    fate: Fate,
    pub(crate) events: usize,
    heading: Option<(f64, f64)>,
    rng: Xoshiro256PlusPlus,
}

impl World {
    pub(crate) fn new(fate: Fate, seed: u64) -> Self {
        Self {
            fate,
            events: 0,
            heading: None,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// Returns whether all events have happened; of a ball that drifts until it is gripped, whether
    /// it has moved at all.
    pub(crate) fn has_happened(&self) -> bool {
        self.events
            >= match self.fate {
                Fate::Rest => 0,
                Fate::Push => 3,
                Fate::Jump | Fate::Drift => 1,
            }
    }

    /// Lets happen what is due after the arm has moved to `joints`.
    pub(crate) fn go_on(&mut self, cell: &mut Cell, joints: &Joints) {
        let workspace = Workspace::paper();
        let reached = cell.features(joints).is_ok_and(|f| at_goal(&f));
        match self.fate {
            Fate::Push if reached && self.events < 3 => {
                self.events += usize::from(cell.push_to_radius(joints, 60.0));
            }
            Fate::Jump if reached && self.events < 1 => {
                // To a place in view of the search.
                for _ in 0..100 {
                    let from = &cell.ball.centre;
                    let Some(place) = workspace.sample_jump(from, 0.150, &mut self.rng) else {
                        return;
                    };
                    let mut there = *cell;
                    there.place_ball(place);
                    let seen = |pose: &Joints| there.features(pose).is_ok();
                    if workspace.search_poses().iter().any(seen) {
                        *cell = there;
                        self.events = 1;
                        return;
                    }
                }
            }
            Fate::Drift if self.events < 10 => {
                let (centre, rng) = (cell.ball.centre, &mut self.rng);
                let (x, y) = *self.heading.get_or_insert_with(|| {
                    // One of the directions that keep it in the workspace.
                    let ways =
                        (0..100).map(|_| rng.random_range(0.0..std::f64::consts::TAU).sin_cos());
                    let stays = |(x, y): &(f64, f64)| {
                        let mut end = centre;
                        (end.x, end.y) = (end.x + 0.2 * x, end.y + 0.2 * y);
                        workspace.contains(&end)
                    };
                    ways.into_iter().find(stays).unwrap_or_default()
                });
                if x.hypot(y) < 0.5 {
                    return;
                }
                let mut next = centre;
                (next.x, next.y) = (next.x + 0.020 * x, next.y + 0.020 * y);
                cell.place_ball(next);
                self.events += 1;
            }
            _ => {}
        }
    }
}
