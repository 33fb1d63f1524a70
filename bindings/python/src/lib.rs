//! The native part of the Python package `puma_grasp`: the detector, batches of
//! cells, and sweeps.

mod cells;
mod detector;
mod frame;
mod sweep;
mod task;
mod world;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::cells::Cells;
    #[pymodule_export]
    use crate::detector::Detector;
    #[pymodule_export]
    use crate::sweep::compare_controllers;
}
