//! Raw encoder counts. Newtypes, so that counts and radians, arm and pendulum cannot be mixed up.

use core::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

/// Arm encoder counts since the rig was switched on with its arm at the middle: positive in the direction of theta.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArmCounts(pub i32);

/// Pendulum encoder counts since the rig was switched on with its pendulum hanging at rest: positive in the direction
/// of alpha.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PendulumCounts(pub i32);

impl ArmCounts {
    /// Arm angle theta (rad): `2 pi counts / counts_per_rev`.
    ///
    /// ```
    /// let quarter = furuta_wire::ArmCounts(512).theta(2048.0);
    /// assert!((quarter - core::f64::consts::FRAC_PI_2).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn theta(self, counts_per_rev: f64) -> f64 {
        f64::from(self.0) * TAU / counts_per_rev
    }
}

impl PendulumCounts {
    /// Pendulum angle alpha (rad) from upright: `pi + 2 pi counts / counts_per_rev`, since zero counts is hanging.
    /// Not wrapped: a full turn adds `2 pi`.
    ///
    /// ```
    /// let upright = furuta_wire::PendulumCounts(-1024).alpha(2048.0);
    /// assert!(upright.abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn alpha(self, counts_per_rev: f64) -> f64 {
        PI + f64::from(self.0) * TAU / counts_per_rev
    }
}
