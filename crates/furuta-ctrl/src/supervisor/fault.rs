//! What a supervisor switches the motor off for.

use crate::real::Real;
use crate::thresholds::Thresholds;
use furuta_model::State;

/// Why the motor was switched off.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Fault {
    /// An encoder's angle is not a finite number.
    #[error("a measured angle is not a finite number")]
    NotANumber,
    /// The arm went too far.
    #[error("arm at {angle:.3} rad, beyond its limit of {limit:.3} rad")]
    ArmAngle {
        /// rad.
        angle: f64,
        /// rad.
        limit: f64,
    },
    /// The arm went too fast.
    #[error("arm at {speed:.2} rad/s, beyond its limit of {limit:.2} rad/s")]
    ArmSpeed {
        /// rad/s.
        speed: f64,
        /// rad/s.
        limit: f64,
    },
    /// The pendulum went too fast.
    #[error("pendulum at {speed:.2} rad/s, beyond its limit of {limit:.2} rad/s")]
    PendulumSpeed {
        /// rad/s.
        speed: f64,
        /// rad/s.
        limit: f64,
    },
}

impl<T: Real> Thresholds<T> {
    /// What is beyond its limit in this state, or no number.
    pub(super) fn violation(&self, x: &State<T>) -> Option<Fault> {
        if !x.is_finite() {
            return Some(Fault::NotANumber);
        }
        if x.theta.abs() > self.arm_angle_limit {
            return Some(Fault::ArmAngle {
                angle: x.theta.value(),
                limit: self.arm_angle_limit.value(),
            });
        }
        if x.theta_dot.abs() > self.arm_speed_limit {
            return Some(Fault::ArmSpeed {
                speed: x.theta_dot.value(),
                limit: self.arm_speed_limit.value(),
            });
        }
        if x.alpha_dot.abs() > self.pendulum_speed_limit {
            return Some(Fault::PendulumSpeed {
                speed: x.alpha_dot.value(),
                limit: self.pendulum_speed_limit.value(),
            });
        }
        None
    }
}
