//! Settings: the numbers of a controller file's sections, checked against what each section says it takes.
//!
//! A section is described by a [`Spec`] beside the code that reads it; reading and writing of files, messages about
//! mistakes, lists for people and what goes over a wire to a microcontroller all follow from it. No allocation.

pub use crate::config::find;
pub use crate::section::*;
