//! The learning curves (Fig. 6 of the paper) and the features per step (Fig. 7), as SVG.

use std::path::Path;

use example_support::plot::{CURVES, Line, Panel, write_svg};
use example_support::prelude::*;
use example_support::trial::{FEATURES, goal_of};
use grasp_agent::{GoalInterval, Lesson};
use hough_heuristic::Features;

use crate::record::RunRecord;

/// Draws the share of episodes that reached the goal and the mean error of Q over the actions. A
/// line marks the table that was kept.
pub(crate) fn learning_curves(path: &Path, lessons: &[Lesson]) -> Outcome {
    let panels = lessons.iter().flat_map(|lesson| {
        CURVES.map(|curve| {
            let name = &lesson.behaviour.spec().name;
            let mut panel = Panel::of_learning(name, curve, std::slice::from_ref(&lesson.curve));
            let kept = lesson.learned_by as f64;
            let end = panel.lines[0].1.iter().map(|at| at.1).fold(1.0, f64::max);
            panel
                .lines
                .push(("table kept".into(), vec![(kept, 0.0), (kept, end)]));
            panel
        })
    });
    write_svg(path, &panels.collect::<Vec<_>>(), 2, (500, 360))
}

/// Draws x, y and r at every step of every run, with the goal interval shaded and losses of the
/// ball marked; three runs, from far, middle and near, stand out.
pub(crate) fn features_per_step(path: &Path, runs: &[RunRecord], goal: &[GoalInterval]) -> Outcome {
    let tracks = runs.iter().map(|run| &run.track);
    let mut tracks: Vec<&Vec<(usize, Features)>> = tracks.filter(|t| !t.is_empty()).collect();
    tracks.sort_by(|a, b| a[0].1.r.total_cmp(&b[0].1.r));
    // A run of many more moves than the others would squeeze them.
    let mut lengths: Vec<usize> = tracks.iter().filter_map(|t| Some(t.last()?.0)).collect();
    lengths.sort_unstable();
    let shown = lengths.get(19 * lengths.len().saturating_sub(1) / 20);
    let shown = shown.copied().unwrap_or(0).max(10);
    let across = match lengths.last().is_some_and(|longest| *longest > shown) {
        true => format!("moves since the first sighting; longer runs are cut at {shown}"),
        false => "moves since the first sighting".into(),
    };
    let distinct = [
        (0, "the farthest start"),
        (tracks.len() / 2, "a start in between"),
        (tracks.len().saturating_sub(1), "the nearest start"),
    ];
    let mut goals = goal_of(goal).into_iter();
    let panels = FEATURES.map(|(name, _, most, of)| {
        let line = |track: &Vec<(usize, Features)>| {
            let points = track.iter().filter(|(step, _)| *step <= shown);
            points.map(|(step, f)| (*step as f64, of(f))).collect()
        };
        let named = distinct
            .iter()
            .filter_map(|(index, words)| Some(((*words).into(), line(tracks.get(*index)?))));
        let lost = runs.iter().flat_map(|run| &run.lost);
        Panel {
            lost: lost.map(|(step, f)| (*step as f64, of(f))).collect(),
            title: format!("{name} until the grip"),
            across: across.clone(),
            up: format!("{name}, feature units"),
            lines: named.collect::<Vec<Line>>(),
            behind: tracks.iter().map(|track| line(track)).collect(),
            goal: goals.next(),
            top: Some(most),
            ..Panel::default()
        }
    });
    write_svg(path, &panels, 1, (900, 310))
}
