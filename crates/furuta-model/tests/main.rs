//! The model against its equations, closed forms and itself. One program: each links all of what it tests.

/// Dual numbers in which plants are tested: each width of them is the whole model compiled anew.
const FEW: usize = 4;
const MANY: usize = 12;

mod bad_input;
mod batch;
mod custom;
mod events;
mod exactness;
mod own_hypothesis;
mod own_states;
mod physics;
mod single_precision;
mod stages;
