//! Recordings of a rotary inverted pendulum, and what they say about its model: reading and checking them, fitting a
//! rig's parameters, finding the effect that the model lacks, and showing it.

mod answer;
mod arm_motion;
pub mod calibrate;
pub mod diagnose;
mod experiment;
pub mod frequency;
mod insufficient;
mod least_squares;
mod pendulum;
pub mod report;
pub mod selection;
mod shooting;
mod stages;
mod stop;
mod task;
pub mod validate;

/// Recordings: a crate of its own.
pub use furuta_recording as recording;
pub use insufficient::Insufficient;
pub use pendulum::{Pendulum, UnknownPendulum};
pub use task::Task;
