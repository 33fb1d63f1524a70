//! The searches that accept a curve by its belonging β: the paper's and those it compares with.

mod belonging;
mod curve_search;
mod fit;
mod heuristic;
mod pass;
mod randomized_hough;
mod standard_hough;

pub use curve_search::{CurveSearch, CurveSearchConfig};
pub use heuristic::{Heuristic, HeuristicConfig};
pub use randomized_hough::{RandomizedHough, RandomizedHoughConfig};
pub use standard_hough::{StandardHough, StandardHoughConfig};
