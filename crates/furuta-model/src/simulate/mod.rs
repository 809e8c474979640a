//! Whole trajectories: one rollout, or thousands at once.

mod batch;
mod error;
mod policy;
mod trajectory;

pub use batch::{Batch, FEW, Keep, Rollout, Run, batch};
pub use error::SimulationError;
pub use policy::{Feedback, OpenLoop, Policy};
pub use trajectory::{follow, trajectory};
