//! Tables of the programs: shares with intervals.

use example_support::comparison::{Row, plot};
use example_support::tally::{Counted, Tally};
use pipeline_sim::ErrorLevel;

fn told(runs: &[(bool, bool)], collisions: Option<usize>) -> String {
    let run = |(happened, success): &(bool, bool)| Counted {
        too_early: !happened,
        success: *success,
        moves: 2,
        collisions,
        ..Counted::default()
    };
    let cells = vec![runs.iter().map(run).collect()];
    Tally { cells }.to_string()
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
    let cell = |(successes, runs): &(usize, usize)| {
        let run = |run| Counted {
            success: run < *successes,
            moves: 9,
            ..Counted::default()
        };
        (0..*runs).map(run).collect()
    };
    let cells = draws.iter().map(cell).collect();
    Row::new(ErrorLevel::Heavy, "hybrid", &Tally { cells })
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
    let none = row(&[]);
    let file = "heavy,\"hybrid\",,,,0,0,,NaN,,0,0,,,";
    assert_eq!(none.csv(&none), file);
    let file = all.csv(&row(&[(30, 30); 8]));
    assert!(file.ends_with(",480,8,100.000,67.558,100.000"), "{file}");
    assert!(file.contains("100.000,80.639,100.000,16,16"), "{file}");
    let plot = plot(&[all], "grasped").expect("draws");
    assert!(plot.contains("9.0 moves, 100.0 %"), "{plot}");
}
