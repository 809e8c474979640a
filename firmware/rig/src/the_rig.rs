//! The rig that this firmware is built for: see build.rs.

use furuta_ctrl::{Limits, Site};
use furuta_model::{Params, PlantError};
use furuta_wire::Hello;

use crate::EmulatedMechanics;

include!(concat!(env!("OUT_DIR"), "/rig.rs"));

/// Sampling period, us.
pub const PERIOD_US: u32 = 2000;

/// Its parameters.
#[must_use]
pub fn params() -> Params<f64> {
    Params::from_array(ACTUATION, PARAMS)
}

/// Where a controller for it works.
#[must_use]
pub fn site(params: &Params<f64>) -> Site<'_> {
    Site {
        resolution: COUNTS.map(|counts| core::f64::consts::TAU / counts),
        limits: LIMITS,
        ..Site::new(params, f64::from(PERIOD_US) * 1e-6)
    }
}

/// What it says of itself.
#[must_use]
pub fn hello() -> Hello {
    let limits: Limits = LIMITS;
    crate::hello(
        NAME,
        PERIOD_US,
        COUNTS,
        params().motor.command_limit,
        &limits,
        ACTUATION,
    )
}

/// Its model in the place of its mechanics.
///
/// # Errors
/// Parameters that are not possible.
pub fn mechanics() -> Result<EmulatedMechanics, PlantError> {
    EmulatedMechanics::new(&params(), COUNTS, PERIOD_US)
}
