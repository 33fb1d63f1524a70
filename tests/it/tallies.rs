//! Tables of the programs: shares with intervals.

use example_support::ball_tally::{self, Counted};
use example_support::comparison::{Row, Tally, csv, plot};
use pipeline_sim::ErrorLevel;

fn told(runs: &[(bool, bool)], collisions: Option<usize>) -> String {
    let mut tally = ball_tally::Tally::default();
    for (happened, success) in runs {
        tally.add(Counted {
            happened: *happened,
            success: *success,
            moves: 2,
            near: 0,
            collisions,
        });
    }
    tally.to_string()
}

#[test]
fn a_failure_counts_before_anything_happened_too() {
    let told = told(&[(true, true), (false, false), (false, true)], Some(1));
    assert!(told.starts_with("1 of 2 grasped (50.0 %"), "{told}");
    assert!(told.contains("3 collisions"), "{told}");
    assert!(told.ends_with("not counted: 1 grasps before anything happened to the ball"));
}

#[test]
fn a_tally_leaves_out_what_was_not_counted() {
    assert_eq!(told(&[], None), "no run to count");
    let none = told(&[(true, false); 20], None);
    assert!(none.contains("interval 0.0..16.1)"), "{none}");
    assert!(!none.contains("collisions"), "{none}");
}

/// The row of a controller with these successes and runs of each cell.
fn row(draws: &[(usize, usize)]) -> Row {
    let mut tally = Tally::default();
    tally.draws = draws.into();
    Row::new(ErrorLevel::Heavy, "hybrid", &tally)
}

#[test]
fn the_interval_of_a_comparison_always_leaves_some_chance() {
    let all = row(&[(30, 30); 16]);
    assert!(all.to_string().contains("80.6..100.0"), "{all}");
    assert!(all.to_string().contains("16 of 16"), "{all}");
    assert!(row(&[(0, 30); 16]).to_string().contains("0.0..19.4"));
    // More runs in as many cells do not narrow the interval; a cell without runs does not count.
    assert!(row(&[(300, 300); 16]).to_string().contains("80.6..100.0"));
    assert!(row(&[(3, 6), (0, 0), (6, 6)]).to_string().contains(" 75.0"));
    let none = csv(&[row(&[])]);
    assert!(
        none.ends_with("heavy,\"hybrid\",,,,0,0,,NaN,,0\n"),
        "{none}"
    );
    let file = csv(std::slice::from_ref(&all));
    assert!(file.contains("100.000,80.639,100.000,16,16"), "{file}");
    let plot = plot(&[all], "grasped").expect("draws");
    assert!(plot.contains("% grasped / moves"));
}
