//! Equations of motion in manipulator form: `M(q) q'' + bias(q, q') + gravity(q) = torque`, `q = [theta, alpha]`.
//!
//! From Lagrange's equations with the kinetic energy `½ q'ᵀ M q'`:
//!
//! ```text
//! M11 = J_a + m L_r² + (m c² + I_t) sin²(alpha) + I_a cos²(alpha)      M12 = -m L_r c cos(alpha)      M22 = I + m c²
//! bias = [ 2 k sin cos theta' alpha' + m L_r c sin alpha'²,  -k sin cos theta'² ]      k = m c² + I_t - I_a
//! gravity = [ 0, -m g c sin(alpha) ]
//! torque = [ drive u - (b_a + back-EMF) theta', -b_p alpha' ]
//! ```
//!
//! [`crate::derivation`] derives this step by step. The functions take [`Coefficients`]; `(&params).into()` or
//! [`crate::Params::coefficients`] makes them.

use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;

/// Sine and cosine of the pendulum's angle, computed once and shared by all terms.
#[derive(Copy, Clone, Debug)]
pub struct Angle<S> {
    /// `sin(alpha)`.
    pub sin: S,
    /// `cos(alpha)`.
    pub cos: S,
}

impl<S: Scalar> Angle<S> {
    /// Of the pendulum's angle `alpha`, rad.
    #[inline(always)]
    #[must_use]
    pub fn of(alpha: S) -> Self {
        let (sin, cos) = alpha.sin_cos();
        Self { sin, cos }
    }
}

/// The symmetric mass matrix, by its three entries, kg m².
#[derive(Copy, Clone, Debug)]
pub struct MassMatrix<S> {
    /// `M11`.
    pub arm: S,
    /// `M12 = M21`.
    pub coupling: S,
    /// `M22`.
    pub pendulum: S,
}

impl<S: Scalar> MassMatrix<S> {
    /// The inverse, again by its three entries: `[(M⁻¹)11, (M⁻¹)12, (M⁻¹)22]`, 1/(kg m²).
    #[inline(always)]
    #[must_use]
    pub fn inverse(&self) -> MassMatrix<S> {
        let over_det = S::ONE / (self.arm * self.pendulum - self.coupling * self.coupling);
        MassMatrix {
            arm: self.pendulum * over_det,
            coupling: -(self.coupling * over_det),
            pendulum: self.arm * over_det,
        }
    }

    /// The product with a vector.
    #[inline(always)]
    #[must_use]
    pub fn times(&self, v: [S; 2]) -> [S; 2] {
        [
            self.arm * v[0] + self.coupling * v[1],
            self.coupling * v[0] + self.pendulum * v[1],
        ]
    }
}

/// `M(alpha)`, kg m².
///
/// ```
/// use furuta_model::{Rig, dynamics::{Angle, mass_matrix}};
/// let p = Rig::builtin("qube-servo-2").expect("built in").params;
/// let upright = mass_matrix(&p.coefficients(), Angle::of(0.0));
/// assert!((upright.coupling + p.pendulum.mass * p.arm.length * p.pendulum.com).abs() < 1e-18);
/// ```
#[inline(always)]
#[must_use]
pub fn mass_matrix<S: Scalar>(c: &Coefficients<S>, a: Angle<S>) -> MassMatrix<S> {
    MassMatrix {
        arm: c.arm + c.swing * (a.sin * a.sin),
        coupling: -(c.coupling * a.cos),
        pendulum: c.pendulum,
    }
}

/// Coriolis and centrifugal terms, N m (on the left-hand side).
#[inline(always)]
#[must_use]
pub fn bias<S: Scalar>(c: &Coefficients<S>, a: Angle<S>, x: &State<S>) -> [S; 2] {
    let k = c.swing * (a.sin * a.cos);
    let kt = k * x.theta_dot;
    let twist = kt * x.alpha_dot;
    [
        twist + twist + c.coupling * a.sin * (x.alpha_dot * x.alpha_dot),
        -(kt * x.theta_dot),
    ]
}

/// Gravity's terms, N m (on the left-hand side): it pulls an upright pendulum over.
#[inline(always)]
#[must_use]
pub fn gravity<S: Scalar>(c: &Coefficients<S>, a: Angle<S>) -> [S; 2] {
    [S::ZERO, -(c.weight * a.sin)]
}

/// Motor and viscous friction, N m (on the right-hand side), for `volts` of command.
#[inline(always)]
#[must_use]
pub fn torque<S: Scalar>(c: &Coefficients<S>, x: &State<S>, volts: S) -> [S; 2] {
    [
        c.drive * volts - c.arm_damping * x.theta_dot,
        -(c.pendulum_damping * x.alpha_dot),
    ]
}

/// `[theta'', alpha'']` under `volts` of command, rad/s².
///
/// ```
/// use furuta_model::{Rig, State, dynamics::acceleration};
/// let p = Rig::builtin("qube-servo-2").expect("built in").params;
/// // At rest, upright: an equilibrium.
/// assert_eq!(acceleration(&p.coefficients(), &State::upright(), 0.0), [0.0, 0.0]);
/// ```
#[inline(always)]
#[must_use]
pub fn acceleration<S: Scalar>(c: &Coefficients<S>, x: &State<S>, volts: S) -> [S; 2] {
    let a = Angle::of(x.alpha);
    let (b, g, t) = (bias(c, a, x), gravity(c, a), torque(c, x, volts));
    mass_matrix(c, a)
        .inverse()
        .times([t[0] - b[0] - g[0], t[1] - b[1] - g[1]])
}
