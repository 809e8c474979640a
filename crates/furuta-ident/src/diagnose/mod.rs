//! Finds where model and data disagree, and names what is missing.

pub mod result;

pub use result::{Channel, Channels, Curves, Diagnosis, Verdict};
