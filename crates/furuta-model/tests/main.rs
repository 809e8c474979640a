//! The model against its equations, closed forms and itself. One program: each links all of what it tests.

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
