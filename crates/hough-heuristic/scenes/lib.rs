//! Rendered scenes, and the detectors compared on them, for the tests and the benchmarks of
//! `hough-heuristic`.

#![allow(
    missing_docs,
    reason = "an unpublished package for tests and benchmarks"
)]

pub mod contest;
pub mod patterns;
pub mod scene;
pub mod simple;
pub mod staged;
