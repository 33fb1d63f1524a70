//! The native part of the Python package `puma_grasp`: the detector and batches of cells.

mod cells;
mod detector;
mod frame;
mod task;
mod world;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::cells::Cells;
    #[pymodule_export]
    use crate::detector::Detector;
}
