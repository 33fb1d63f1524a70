//! The learning curves (Fig. 6 of the paper) and the features per step (Fig. 7), as SVG.

use std::error::Error;

use example_support::plot::{Line, Panel, drawn};
use hough_heuristic::Features;
use qtable::Record;

use crate::record::RunRecord;

type Drawn = Result<String, Box<dyn Error>>;

/// Draws the share of episodes that reached the goal and the mean error of Q over the actions.
pub(crate) fn learning_curves(curves: &[(&str, &[Record])]) -> Drawn {
    let panels = curves.iter().flat_map(|(name, curve)| {
        let panel = |title: &str, pick: fn(&Record) -> Option<f64>| {
            let known = |record: &Record| Some((record.actions as f64, pick(record)?));
            let line = curve.iter().filter_map(known).collect();
            Panel::new(
                &format!("{name}: {title}"),
                "actions",
                vec![(String::new(), line)],
            )
        };
        let success = panel("goal reached, % of episodes", |record| {
            Some(100.0 * record.success_share?)
        });
        let error = panel("mean error of Q", |record| record.mean_td_error);
        [success.up_to(100.0), error]
    });
    drawn(&panels.collect::<Vec<_>>(), 2, (500, 360))
}

/// Draws x, y and r at every step of every run, with the goal interval shaded; three runs, from
/// far, middle and near, stand out.
pub(crate) fn features_per_step(runs: &[RunRecord]) -> Drawn {
    let mut tracks: Vec<Vec<(usize, Features)>> = runs
        .iter()
        .map(RunRecord::track)
        .filter(|track| !track.is_empty())
        .collect();
    tracks.sort_by(|a, b| a[0].1.r.total_cmp(&b[0].1.r));
    let last = tracks.len().saturating_sub(1);
    let distinct = [
        (0, "the farthest start"),
        (tracks.len() / 2, "a start in between"),
        (last, "the nearest start"),
    ];
    type Pick = fn(&Features) -> f64;
    let panels: [(&str, f64, (f64, f64), Pick); 3] = [
        ("x", 192.0, (99.0, 108.0), |f| f.x),
        ("y", 144.0, (74.0, 82.0), |f| f.y),
        ("r", 68.0, (32.0, 34.0), |f| f.r),
    ];
    let panels = panels.map(|(name, top, goal, pick)| {
        let line = |track: &Vec<(usize, Features)>| {
            let points = track.iter().map(|(step, f)| (*step as f64, pick(f)));
            points.collect()
        };
        let named = distinct
            .iter()
            .filter_map(|(index, words)| Some(((*words).into(), line(tracks.get(*index)?))));
        let title = format!("{name} (feature units)");
        Panel::new(&title, "step", named.collect::<Vec<Line>>())
            .in_front_of(tracks.iter().map(line).collect())
            .with_goal(goal.0, goal.1)
            .up_to(top)
    });
    drawn(&panels, 1, (900, 310))
}
