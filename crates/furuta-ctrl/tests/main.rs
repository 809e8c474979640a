//! Estimators, controllers and supervisor, against independent answers. One program: each links all of what it tests.

mod estimators;
mod registry;
mod riccati;
mod steady_motion;
mod supervisor;
mod tracking;
mod transitions;
