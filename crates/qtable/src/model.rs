//! Models: known or estimated dynamics, planning, and exact assessment.

mod assess;
mod dynamics;
mod estimate;
mod plan;
mod played;

pub use assess::Assessment;
pub use dynamics::{Model, Outcome};
pub use estimate::ModelEstimate;
pub use plan::Plan;
pub use played::ModelEnvironment;
