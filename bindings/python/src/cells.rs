//! A batch of cells that step together.

use std::sync::{Mutex, MutexGuard, PoisonError};

use hough_heuristic::image::GrayImage;
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::task::{Outcome, Task, relative};
use crate::world::{ErrorSetting, PICTURE, Setting, World};

/// Most cells of a batch.
const MOST: usize = 1 << 20;

/// Least number of cells of a thread.
const TOGETHER: usize = 64;

/// Largest value of an observation relative to the goal.
const BOUND: f64 = 2.0;

/// Observations, rewards, outcomes and truncations of a step.
type Stepped<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<bool>>,
);

/// Cells that step together. Calls from several threads take turns.
#[pyclass(frozen, module = "puma_grasp._native")]
pub struct Cells {
    setting: Setting,
    worlds: Mutex<Vec<World>>,
}

#[pymethods]
impl Cells {
    #[new]
    #[pyo3(signature = (
        count, *, task="reaching", reward="paper", whole=false, frames=false, scaled=false,
        level="none", odd=vec![], noise=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        count: usize,
        task: &str,
        reward: &str,
        whole: bool,
        frames: bool,
        scaled: bool,
        level: &str,
        odd: Vec<String>,
        noise: Option<f64>,
    ) -> PyResult<Self> {
        if !(1..=MOST).contains(&count) {
            return Err(PyValueError::new_err(format!(
                "the number of cells is {count}: use 1..={MOST}"
            )));
        }
        if let Some(noise) = noise.filter(|noise| !(noise.is_finite() && *noise >= 0.0)) {
            return Err(PyValueError::new_err(format!(
                "noise is {noise}: use a number of at least 0"
            )));
        }
        let level = level.parse().map_err(value_error)?;
        let errors = ErrorSetting { level, odd, noise };
        let task = Task::new(task, reward)?;
        let setting = Setting::new(task, whole, frames, scaled, errors).map_err(value_error)?;
        let worlds = (0..count).map(|index| World::new(index as u64)).collect();
        let worlds = Mutex::new(worlds);
        Ok(Self { setting, worlds })
    }

    /// Turns of `JT1`, `JT2` and `JT3` of each action of each behaviour, degrees.
    #[getter]
    fn moves(&self) -> Vec<Vec<[f64; 3]>> {
        self.setting.task.moves.clone()
    }

    /// Largest turn of `JT1`, `JT2` and `JT3`, degrees.
    #[getter]
    fn largest(&self) -> [f64; 3] {
        self.setting.task.largest()
    }

    /// Goal intervals: index in the observation, lowest and highest value.
    #[getter]
    fn goal(&self) -> Vec<(usize, f64, f64)> {
        self.setting.task.goal()
    }

    /// Begins the random numbers of each cell anew.
    fn seed(&self, seeds: PyReadonlyArray1<'_, u64>) -> PyResult<()> {
        let mut worlds = lock(&self.worlds);
        let seeds = seeds.as_array();
        same_length("seeds", seeds.len(), worlds.len())?;
        for (world, seed) in worlds.iter_mut().zip(seeds) {
            world.seed(*seed);
        }
        Ok(())
    }

    /// Begins an episode in the cells whose mark is set, and returns all observations: x, y, r in
    /// feature units and theta 3 in degrees.
    fn reset<'py>(
        &self,
        py: Python<'py>,
        marked: PyReadonlyArray1<'_, bool>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let marked = marked.as_array().to_vec();
        let (setting, all) = (&self.setting, &self.worlds);
        let observed = py.detach(move || {
            let mut worlds = lock(all);
            same_length("marks", marked.len(), worlds.len())?;
            let all = worlds.par_iter_mut().zip(marked).with_min_len(TOGETHER);
            all.filter(|(_, marked)| *marked)
                .try_for_each(|(world, _)| world.reset(setting))
                .map_err(PyRuntimeError::new_err)?;
            let observed = worlds.iter().map(|world| observation(world, setting));
            Ok::<_, PyErr>(rows(observed.collect()))
        })?;
        Ok(PyArray2::from_owned_array(py, observed))
    }

    /// Acts in all cells: a move of each behaviour (int64 of shape (cells, behaviours)), or turns
    /// of the three joints in degrees (float64 of shape (cells, 3)). A cell whose episode is over
    /// is reset instead, with reward 0; one that has made `most` steps is truncated.
    fn step<'py>(
        &self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        most: u32,
    ) -> PyResult<Stepped<'py>> {
        let degrees = self.degrees(actions)?;
        let (setting, all) = (&self.setting, &self.worlds);
        let stepped = py.detach(move || {
            let mut worlds = lock(all);
            same_length("actions", degrees.len(), worlds.len())?;
            let step = |(world, degrees): (&mut World, [f64; 3])| {
                let (mut reward, mut outcome, mut truncated) = (0.0, Outcome::Continuing, false);
                if world.over {
                    world.reset(setting)?;
                } else {
                    (reward, outcome) = world.step(setting, degrees);
                    truncated = world.steps >= most && !world.over;
                    world.over |= truncated;
                }
                Ok((
                    observation(world, setting),
                    reward,
                    outcome as u8,
                    truncated,
                ))
            };
            let all = worlds.par_iter_mut().zip(degrees).with_min_len(TOGETHER);
            let ends: Result<Vec<_>, String> = all.map(step).collect();
            let ends = ends.map_err(PyRuntimeError::new_err)?;
            Ok::<_, PyErr>((
                rows(ends.iter().map(|end| end.0).collect()),
                ends.iter().map(|end| end.1).collect::<Vec<f64>>(),
                ends.iter().map(|end| end.2).collect::<Vec<u8>>(),
                ends.iter().map(|end| end.3).collect::<Vec<bool>>(),
            ))
        });
        let (observed, rewards, outcomes, truncated) = stepped?;
        Ok((
            PyArray2::from_owned_array(py, observed),
            PyArray1::from_vec(py, rewards),
            PyArray1::from_vec(py, outcomes),
            PyArray1::from_vec(py, truncated),
        ))
    }

    /// Joint angles of a cell, degrees.
    fn joints(&self, cell: usize) -> PyResult<[f64; 6]> {
        self.of_one(cell, |world| Ok(world.degrees()))
    }

    /// x, y and r of the ball as they were seen last in a cell, feature units.
    fn features(&self, cell: usize) -> PyResult<(f64, f64, f64)> {
        self.of_one(cell, |world| {
            let seen = world.percept.features;
            Ok((seen.x, seen.y, seen.r))
        })
    }

    /// The frame that is observed in a cell, of shape (144, 192).
    fn frame<'py>(&self, py: Python<'py>, cell: usize) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let frame = self.of_one(cell, |world| world.frame(&self.setting))?;
        Ok(array(py, frame))
    }

    /// A picture from the camera of a cell, of shape (576, 768).
    fn picture<'py>(&self, py: Python<'py>, cell: usize) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let picture = self.of_one(cell, |world| world.picture(&self.setting, PICTURE))?;
        Ok(array(py, picture))
    }
}

impl Cells {
    /// The turns of the three joints that actions stand for, degrees.
    fn degrees(&self, actions: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
        if let Ok(turns) = actions.cast::<PyArray2<f64>>() {
            let turns = turns.try_readonly()?;
            let turns = turns.as_array();
            if turns.ncols() != 3 || turns.iter().any(|turn| !turn.is_finite()) {
                let reason = "actions must be three finite turns a cell";
                return Err(PyValueError::new_err(reason));
            }
            return Ok(turns.outer_iter().map(|t| [t[0], t[1], t[2]]).collect());
        }
        let moves = &self.setting.task.moves;
        let chosen = actions.cast::<PyArray2<i64>>().map_err(|_| {
            PyTypeError::new_err("actions must be of dtype int64 or float64, of two dimensions")
        })?;
        let chosen = chosen.try_readonly()?;
        let chosen = chosen.as_array();
        if chosen.ncols() != moves.len() {
            let (found, needed) = (chosen.ncols(), moves.len());
            let reason = format!("{found} actions a cell where {needed} are needed");
            return Err(PyValueError::new_err(reason));
        }
        let turns = chosen.outer_iter().map(|actions| {
            let mut summed = [0.0; 3];
            for (moves, action) in moves.iter().zip(actions) {
                let turns = usize::try_from(*action).ok().and_then(|at| moves.get(at));
                let Some(turns) = turns else {
                    let last = moves.len() - 1;
                    let reason = format!("action {action} is not in 0..{last}");
                    return Err(PyValueError::new_err(reason));
                };
                for (sum, turn) in summed.iter_mut().zip(turns) {
                    *sum += turn;
                }
            }
            Ok(summed)
        });
        turns.collect()
    }

    fn of_one<T>(
        &self,
        cell: usize,
        call: impl FnOnce(&mut World) -> Result<T, String>,
    ) -> PyResult<T> {
        let mut worlds = lock(&self.worlds);
        let count = worlds.len();
        let world = worlds
            .get_mut(cell)
            .ok_or_else(|| PyIndexError::new_err(format!("cell {cell} of a batch of {count}")))?;
        call(world).map_err(PyRuntimeError::new_err)
    }
}

fn lock(worlds: &Mutex<Vec<World>>) -> MutexGuard<'_, Vec<World>> {
    worlds.lock().unwrap_or_else(PoisonError::into_inner)
}

fn value_error(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn same_length(what: &str, found: usize, needed: usize) -> PyResult<()> {
    if found == needed {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{found} {what} for {needed} cells"
    )))
}

/// x, y, r and theta 3 of a cell, or those relative to the goal within `BOUND`.
fn observation(world: &World, setting: &Setting) -> [f32; 4] {
    if setting.scaled {
        return relative(&world.percept).map(|value| value.clamp(-BOUND, BOUND) as f32);
    }
    let (features, theta3) = (world.percept.features, world.percept.theta3);
    [features.x, features.y, features.r, theta3].map(|value| value as f32)
}

fn rows(all: Vec<[f32; 4]>) -> Array2<f32> {
    let shape = (all.len(), 4);
    Array2::from_shape_vec(shape, all.into_flattened()).unwrap_or_default()
}

fn array(py: Python<'_>, frame: GrayImage) -> Bound<'_, PyArray2<u8>> {
    let shape = (frame.height() as usize, frame.width() as usize);
    let pixels = Array2::from_shape_vec(shape, frame.into_raw()).unwrap_or_default();
    PyArray2::from_owned_array(py, pixels)
}
