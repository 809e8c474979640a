//! Recordings of a rotary inverted pendulum, and what they say about its model: reading and checking them, fitting a rig's parameters, finding the effect
//! that the model lacks, and showing it.

pub mod calibrate;
pub mod diagnose;
pub mod frequency;
mod insufficient;
pub mod recording;
pub mod report;
mod task;
pub mod validate;

pub use insufficient::Insufficient;
pub use task::Task;
