//! The a contrario detector on numpy arrays.

use std::sync::{Mutex, MutexGuard, PoisonError};

use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    AContrario, AContrarioConfig, Channel, Circle, CircleDetector, Effort, Ellipse, FrameRefused,
    Measurement, Region, Rings,
};
use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::frame;

/// Columns of a circle, and those of its ellipse after them.
const COLUMNS: (usize, usize) = (10, 6);

/// A detector with its buffers. Calls from several threads take turns.
#[pyclass(frozen, module = "puma_grasp._native")]
pub struct Detector {
    detector: Mutex<AContrario>,
    /// The frame of the last call, for its memory, and the bits that its values used.
    last: Mutex<(GrayImage, Option<u32>)>,
    channel: Channel,
    /// `true` if each result has an ellipse.
    ellipses: bool,
}

#[pymethods]
impl Detector {
    #[new]
    #[pyo3(signature = (
        *, min_radius=None, max_radius=None, max_circles=None, rings="all", min_distance=0.0,
        min_axis_ratio=1.0, min_score=0.5, contrast=8.0, draws=50_000, time_limit=None,
        region=None, channel="auto", seed=1
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        min_radius: Option<f64>,
        max_radius: Option<f64>,
        max_circles: Option<usize>,
        rings: &str,
        min_distance: f64,
        min_axis_ratio: f64,
        min_score: f64,
        contrast: f64,
        draws: u32,
        time_limit: Option<f64>,
        region: Option<(u32, u32, u32, u32)>,
        channel: &str,
        seed: u64,
    ) -> PyResult<Self> {
        let default = AContrarioConfig::default();
        let config = AContrarioConfig {
            min_radius,
            max_radius,
            max_circles: max_circles.unwrap_or(default.max_circles),
            rings: match rings {
                "all" => Rings::All,
                "outer" => Rings::Outer,
                "inner" => Rings::Inner,
                _ => {
                    return Err(PyValueError::new_err(format!(
                        "rings is {rings:?}: use \"all\", \"outer\" or \"inner\""
                    )));
                }
            },
            min_distance,
            min_axis_ratio,
            min_score,
            contrast,
            draws_per_megapixel: draws,
            milliseconds_per_megapixel: time_limit,
            region: region.map(|(left, top, width, height)| Region {
                left,
                top,
                width,
                height,
            }),
            seed,
        };
        let detector = AContrario::new(config).map_err(value_error)?;
        Ok(Self {
            detector: Mutex::new(detector),
            last: Mutex::new((GrayImage::default(), None)),
            channel: frame::channel(channel)?,
            ellipses: min_axis_ratio < 1.0,
        })
    }

    /// Returns one row of ten numbers a circle, best first; of sixteen with `min_axis_ratio`.
    fn detect<'py>(&self, image: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, ()) = self.run(image, |detector, frame| detector.detect(frame).map(drop))?;
        Ok(rows)
    }

    /// Looks near a circle, and in the whole frame if it is not there. Returns the rows and `True`
    /// if the circle was found nearby.
    fn track<'py>(
        &self,
        image: &Bound<'py, PyAny>,
        last: (f64, f64, f64),
        reach: f64,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, bool)> {
        let (x, y, radius) = last;
        let last = Circle { x, y, radius };
        self.run(image, |detector, frame| detector.track(frame, &last, reach))
    }

    /// The work of the last frame.
    #[getter]
    fn effort<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Effort {
            draws,
            looks,
            proven,
            ended_by_budget,
            ended_by_count,
        } = lock(&self.detector).effort();
        let effort = PyDict::new(py);
        effort.set_item("draws", draws)?;
        effort.set_item("looks", looks)?;
        effort.set_item("proven", proven)?;
        effort.set_item("ended_by_budget", ended_by_budget)?;
        effort.set_item("ended_by_count", ended_by_count)?;
        effort.set_item("bits_used", lock(&self.last).1)?;
        Ok(effort)
    }
}

impl Detector {
    /// Copies the picture, lets other threads of Python run, and searches it.
    fn run<'py, T: Send>(
        &self,
        image: &Bound<'py, PyAny>,
        search: impl FnOnce(&mut AContrario, &GrayImage) -> Result<T, FrameRefused> + Send,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, T)> {
        let py = image.py();
        let buffer = std::mem::take(&mut lock(&self.last).0);
        let (frame, bits) = frame::from_array(image, self.channel, buffer)?;
        let found = py.detach(|| {
            let mut detector = lock(&self.detector);
            let found = search(&mut detector, &frame);
            found.map(|told| (rows(detector.measurements(), self.ellipses), told))
        });
        *lock(&self.last) = (frame, bits);
        let (rows, told) = found.map_err(value_error)?;
        Ok((PyArray2::from_owned_array(py, rows), told))
    }
}

/// A detector stays usable when a thread panics: every frame begins anew.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn value_error(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn rows(measurements: &[Measurement], ellipses: bool) -> Array2<f64> {
    let columns = if ellipses {
        COLUMNS.0 + COLUMNS.1
    } else {
        COLUMNS.0
    };
    let mut rows = Array2::zeros((measurements.len(), columns));
    for (mut row, found) in rows.outer_iter_mut().zip(measurements) {
        let Measurement {
            circle: Circle { x, y, radius },
            score,
            log_false_alarms,
            centre_error,
            radius_error,
            axis_ratio,
            visible,
            covered,
            ellipse,
        } = *found;
        let circle = [
            x,
            y,
            radius,
            score,
            covered,
            visible,
            axis_ratio,
            centre_error,
            radius_error,
            log_false_alarms,
        ];
        let ellipse = ellipse.map_or([f64::NAN; COLUMNS.1], |found| {
            let Ellipse {
                major,
                minor,
                angle,
                ..
            } = found.ellipse;
            let (angle, angle_error) = (angle.to_degrees(), found.angle_error.to_degrees());
            let (major_error, minor_error) = (found.major_error, found.minor_error);
            [major, minor, angle, major_error, minor_error, angle_error]
        });
        for (cell, value) in row.iter_mut().zip(circle.into_iter().chain(ellipse)) {
            *cell = value;
        }
    }
    rows
}
