//! Whole trajectories, one rollout or thousands at once; and many rigs that are stepped together.

mod batch;
mod error;
mod policy;
mod stepper;
mod trajectory;

pub use batch::{Batch, FEW, Keep, Rollout, Run, batch};
pub use error::SimulationError;
pub use policy::{Feedback, OpenLoop, Policy};
pub use stepper::Stepper;
pub use trajectory::{follow, trajectory};
