//! Where a window starts: its state, which is free, and how the rotor stands against the arm, which is not.

use furuta_model::{Jet, State, Twist};
use nalgebra::Vector4;

use super::model::Pass;

/// A step of a start that is predicted to gain less than this plus this share of the cost is not simulated.
const LEAST_STEP: (f64, f64) = (0.01, 1e-3);

/// Whether a step of a start that costs this is simulated.
pub(super) fn is_worth_a_step(predicted: f64, cost: f64) -> bool {
    predicted >= LEAST_STEP.0 + LEAST_STEP.1 * cost
}

/// Where a window starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Start<S = f64> {
    /// The state, which is free.
    pub(crate) x: State<S>,
    /// How the rotor stands against the arm.
    pub(crate) rotor: Rotor,
}

/// How the rotor stands against the arm at a window's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rotor {
    /// As the motion turns it that was measured before. Nothing where both are one body.
    Measured,
    /// As the motion turns it from how it stood some time before: as the window before says, or as was found.
    Follows(Before),
}

/// How a rig with a drive stood some time before a window's start, as the window before says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Before {
    /// The sample at which it stood so.
    pub(super) sample: usize,
    /// State, as the recording's encoders count it.
    pub(super) x: State<f64>,
    /// The rotor against the arm.
    pub(super) twist: Twist,
}

impl Start {
    /// With its state as the first four variables of a pass that begins with them; held in the others.
    pub(super) fn variables<const N: usize>(&self, pass: Pass) -> Start<Jet<f64, N>> {
        let values = self.x.to_array();
        let variable = |i: usize| match pass {
            Pass::FIRST => Jet::variable(values[i], i),
            _ => Jet::constant(values[i]),
        };
        Start {
            x: State::from(std::array::from_fn(variable)),
            rotor: self.rotor,
        }
    }

    /// Where a step of its state leads.
    pub(super) fn less(&self, by: &Vector4<f64>) -> Self {
        let x = self.x.to_array();
        Self {
            x: State::from(std::array::from_fn(|i| x[i] - by[i])),
            ..*self
        }
    }
}
