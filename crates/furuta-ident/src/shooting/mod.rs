//! The engine that `diagnose`, `calibrate` and `validate` share: recordings cut into windows, predictions with exact
//! sensitivities, initial states that are eliminated, and the fit of any model to all of it.

mod astray;
mod bounded;
mod data;
mod deviations;
mod eliminate;
#[cfg(test)]
mod falls;
mod fit;
mod impulse;
mod late;
mod linear;
mod model;
mod noise;
mod passes;
mod predict;
mod reversals;
mod rig;
mod slopes;
mod solve;
mod start;
mod states;
mod window;
mod zero_search;
mod zeros;

pub(crate) use bounded::bounded_step;
pub(crate) use data::{Data, Run, Window};
pub(crate) use eliminate::{About, Keep, MAX_FREE, Reduced};
pub(crate) use fit::{Effort, Fit, Problem, WHITE};
pub(crate) use impulse::{Block, ImpulseResponse, impulse_responses};
pub(crate) use late::{Late, is_late};
pub(crate) use linear::Course;
pub(crate) use model::{Layout, Model, Observed, Pass, Prior};
pub(crate) use passes::Passes;
pub(crate) use rig::AsGiven;
pub(crate) use start::Start;
pub(crate) use window::Windows;
pub(crate) use zero_search::with_zeros_found;
pub(crate) use zeros::{ZEROS, zero_bounds, zero_priors, zero_units, zeros_each};
