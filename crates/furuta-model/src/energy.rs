//! Mechanical energy, J. The potential is zero with the centre of mass at the pivot's height: `+m g c` upright,
//! `-m g c` hanging.

use crate::dynamics::{Angle, mass_matrix};
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;

/// `½ q'ᵀ M(q) q'`.
#[must_use]
pub fn kinetic<S: Scalar>(c: &Coefficients<S>, x: &State<S>) -> S {
    let v = [x.theta_dot, x.alpha_dot];
    let p = mass_matrix(c, Angle::of(x.alpha)).times(v);
    (v[0] * p[0] + v[1] * p[1]) * S::from_f64(0.5)
}

/// `m g c cos(alpha)`.
#[must_use]
pub fn potential<S: Scalar>(c: &Coefficients<S>, x: &State<S>) -> S {
    c.weight * x.alpha.sin_cos().1
}

/// Kinetic and potential energy together; constant where nothing drives and nothing rubs.
///
/// ```
/// use furuta_model::{Rig, State, energy};
/// let c = Rig::builtin("qube-servo-2").expect("built in").params.coefficients();
/// let fall = energy::total(&c, &State::<f64>::upright()) - energy::total(&c, &State::hanging());
/// assert!((fall - 2.0 * c.weight).abs() < 1e-15);
/// ```
#[must_use]
pub fn total<S: Scalar>(c: &Coefficients<S>, x: &State<S>) -> S {
    kinetic(c, x) + potential(c, x)
}
