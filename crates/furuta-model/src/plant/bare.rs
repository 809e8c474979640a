//! The step of a plant without effects, for loops over thousands of them.

use super::Plant;
use crate::dynamics::acceleration;
use crate::integrate::{Field, Fixed, Stage, rk4};
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;

impl<S: Scalar> Plant<S> {
    /// What [`Plant::step`] does to the mechanical state of a plant without effects, and nothing else: no question is
    /// asked on the way, so that a loop of such steps keeps the state in registers.
    #[inline(always)]
    pub(crate) fn bare_step(&self, x: State<S>, u: S, h: S::Real) -> State<S> {
        let field = Bare {
            coefficients: self.coefficients,
            volts: u,
        };
        rk4(x, Fixed(h), &field)
    }
}

/// The equations of motion without effects.
struct Bare<S> {
    coefficients: Coefficients<S>,
    volts: S,
}

impl<S: Scalar> Field<State<S>> for Bare<S> {
    #[inline(always)]
    fn slope(&self, _: Stage, x: &State<S>) -> State<S> {
        let [arm, pendulum] = acceleration(&self.coefficients, x, self.volts);
        State::new(x.theta_dot, x.alpha_dot, arm, pendulum)
    }
}
