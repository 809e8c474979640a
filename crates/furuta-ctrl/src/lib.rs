//! Control of the rotary inverted pendulum: the part that runs, unchanged, on a microcontroller, on a Linux board and
//! in Python.
//!
//! Nothing here allocates or needs an operating system. What is configured (gains, limits, models) is kept apart from
//! what changes while it runs: a controller is an immutable value, its state a second one that the caller owns. A new
//! gain is a new value; one controller serves any number of rollouts.
//!
//! | Module | What it holds |
//! |---|---|
//! | [`design`] | Riccati equations, LQR, the standard balance gain of a rig |
//! | [`controllers`] | state feedback, energy swing-up, output regulation and sliding modes, and a choice at run time |
//! | [`mod@reference`] | references that are known ahead of time, for controllers that act before they move |
//! | [`estimators`] | states from encoder angles |
//! | [`compensation`] | what is added to the command for effects that the rig file names |
//! | [`supervisor`] | modes, the catch, limits, faults: what stands between a controller and a motor |
//! | [`trajectory`] | a swing-up computed beforehand, and what follows it |
//! | [`settings`], [`config`], [`plan`] | a controller file's contents, checked, in fixed size, as sent to a microcontroller |
//! | [`numbers`] | the numbers that a control system runs on, by name, for other languages |
//! | `file` (feature `std`) | controller files (TOML) |
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]
// `!(x > 0)` is how a NaN is made to fail a test.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod compensation;
pub mod config;
pub mod controllers;
pub mod design;
mod error;
pub mod estimators;
#[cfg(feature = "std")]
pub mod file;
mod from_settings;
pub mod numbers;
pub mod plan;
mod real;
pub mod reference;
mod section;
mod sent;
pub mod settings;
mod site;
pub mod supervisor;
mod thresholds;
pub mod trajectory;

pub use config::Config;
pub use error::ConfigError;
#[cfg(feature = "std")]
pub use file::{ControllerFile, FileError};
pub use plan::Plan;
pub use real::{Real, wrap};
pub use site::{Limits, Site};
