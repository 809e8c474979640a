//! Every bit that the model computes, as lines of text: the same source compiled for a host and for a Cortex-M4 must
//! print the same.
//!
//! `make same-bits` runs the program on both and compares. What is covered, and where equality ends, says
//! docs/target.md.
#![no_std]

mod fingerprint;
mod functions;
mod signals;
mod trajectories;

pub use fingerprint::{Fingerprint, Float};
pub use trajectories::{End, RIGS, trajectory};

use core::fmt;

/// Simulated time in single precision, which the target's floating-point unit computes, s.
pub const SECONDS_F32: u32 = 10;

/// Simulated time in double precision, which the target computes in software, s.
pub const SECONDS_F64: u32 = 4;

/// Prints all lines.
///
/// # Errors
/// Those of `out`.
pub fn print(out: &mut impl fmt::Write) -> fmt::Result {
    functions::print::<f32>(out, 20_000)?;
    functions::print::<f64>(out, 20_000)?;
    signals::print(out, 2_000)?;
    trajectories::print_jacobians(out)?;
    trajectories::print::<f32>(out, SECONDS_F32)?;
    trajectories::print::<f64>(out, SECONDS_F64)
}
