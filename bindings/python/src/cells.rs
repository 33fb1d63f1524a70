//! A batch of cells that step together.

use std::sync::{Mutex, MutexGuard, PoisonError};

use hough_heuristic::image::GrayImage;
use numpy::ndarray::{Array1, Array2};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::task::Task;
use crate::world::{ErrorSetting, PICTURE, Setting, World};

/// Most cells of a batch.
const MOST: usize = 1 << 20;

/// Least number of cells of a thread.
const TOGETHER: usize = 64;

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
        count, *, task="reaching", reward="paper", whole=false, frames=false, level="none",
        odd=vec![], noise=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        count: usize,
        task: &str,
        reward: &str,
        whole: bool,
        frames: bool,
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
        let setting = Setting::new(task, whole, frames, errors).map_err(value_error)?;
        let worlds = (0..count).map(|index| World::new(index as u64)).collect();
        let worlds = Mutex::new(worlds);
        Ok(Self { setting, worlds })
    }

    /// Turns of `JT1`, `JT2` and `JT3` of each action of each behaviour, degrees.
    #[getter]
    fn moves(&self) -> Vec<Vec<[f64; 3]>> {
        self.setting.task.moves()
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
        let mut worlds = self.lock();
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
        let mut worlds = self.lock();
        same_length("marks", marked.len(), worlds.len())?;
        for (world, _) in worlds.iter_mut().zip(marked).filter(|(_, marked)| *marked) {
            world
                .reset(&self.setting)
                .map_err(PyRuntimeError::new_err)?;
        }
        Ok(PyArray2::from_owned_array(py, observations(&worlds)))
    }

    /// Turns the joints of all cells by degrees of shape (cells, 3). A cell whose episode is over
    /// is reset instead, with reward 0; one that has made `most` steps is truncated.
    fn step<'py>(
        &self,
        py: Python<'py>,
        degrees: PyReadonlyArray2<'_, f64>,
        most: u32,
    ) -> PyResult<Stepped<'py>> {
        let degrees = degrees.as_array();
        let columns = degrees.ncols();
        if columns != 3 || degrees.iter().any(|turn| !turn.is_finite()) {
            let reason = "actions must be three finite turns a cell";
            return Err(PyValueError::new_err(reason));
        }
        let degrees: Vec<[f64; 3]> = degrees.outer_iter().map(|t| [t[0], t[1], t[2]]).collect();
        let (setting, all) = (&self.setting, &self.worlds);
        let stepped = py.detach(move || {
            let mut worlds = all.lock().unwrap_or_else(PoisonError::into_inner);
            if degrees.len() != worlds.len() {
                return Err(format!(
                    "{} actions for {} cells",
                    degrees.len(),
                    worlds.len()
                ));
            }
            let count = worlds.len();
            let mut rewards = Array1::zeros(count);
            let mut outcomes = Array1::zeros(count);
            let mut truncated = Array1::from_elem(count, false);
            let step = |(world, degrees): (&mut World, [f64; 3])| {
                if world.over {
                    return world.reset(setting).map(|()| (0.0, 0, false));
                }
                let (reward, outcome) = world.step(&setting.task, degrees);
                let truncated = world.steps >= most && !world.over;
                world.over |= truncated;
                Ok((reward, outcome as u8, truncated))
            };
            let all = worlds.par_iter_mut().zip(degrees).with_min_len(TOGETHER);
            let ends: Vec<_> = all.map(step).collect::<Result<_, String>>()?;
            for (i, end) in ends.into_iter().enumerate() {
                (rewards[i], outcomes[i], truncated[i]) = end;
            }
            Ok((observations(&worlds), rewards, outcomes, truncated))
        });
        let (observed, rewards, outcomes, truncated) = stepped.map_err(PyRuntimeError::new_err)?;
        Ok((
            PyArray2::from_owned_array(py, observed),
            PyArray1::from_owned_array(py, rewards),
            PyArray1::from_owned_array(py, outcomes),
            PyArray1::from_owned_array(py, truncated),
        ))
    }

    /// Joint angles of a cell, degrees.
    fn joints(&self, cell: usize) -> PyResult<[f64; 6]> {
        self.of_one(cell, |world| Ok(world.degrees()))
    }

    /// The frame that is observed in a cell, of shape (144, 192).
    fn frame<'py>(&self, py: Python<'py>, cell: usize) -> PyResult<Bound<'py, PyArray2<u8>>> {
        self.of_one(cell, World::frame)
            .map(|frame| array(py, frame))
    }

    /// A picture from the camera of a cell, of shape (576, 768).
    fn picture<'py>(&self, py: Python<'py>, cell: usize) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let picture = self.of_one(cell, |world| world.picture(PICTURE))?;
        Ok(array(py, picture))
    }
}

impl Cells {
    fn lock(&self) -> MutexGuard<'_, Vec<World>> {
        self.worlds.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn of_one<T>(
        &self,
        cell: usize,
        call: impl FnOnce(&mut World) -> Result<T, String>,
    ) -> PyResult<T> {
        let mut worlds = self.lock();
        let count = worlds.len();
        let world = worlds
            .get_mut(cell)
            .ok_or_else(|| PyIndexError::new_err(format!("cell {cell} of a batch of {count}")))?;
        call(world).map_err(PyRuntimeError::new_err)
    }
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

fn observations(worlds: &[World]) -> Array2<f32> {
    let mut all = Array2::zeros((worlds.len(), 4));
    for (mut row, world) in all.outer_iter_mut().zip(worlds) {
        let (features, theta3) = (world.percept.features, world.percept.theta3);
        let values = [features.x, features.y, features.r, theta3];
        for (cell, value) in row.iter_mut().zip(values) {
            *cell = value as f32;
        }
    }
    all
}

fn array(py: Python<'_>, frame: GrayImage) -> Bound<'_, PyArray2<u8>> {
    let shape = (frame.height() as usize, frame.width() as usize);
    let pixels = Array2::from_shape_vec(shape, frame.into_raw()).unwrap_or_default();
    PyArray2::from_owned_array(py, pixels)
}
