//! What the arm must do while the pendulum follows a prescribed motion: the zero dynamics of the output `alpha`.
//!
//! The pendulum's equation of motion holds no command. Once `alpha(t)` is prescribed, it is an equation for the arm
//! alone:
//!
//! ```text
//! theta'' = (M22 alpha'' + b_p alpha' - weight sin(alpha) - k sin(alpha) cos(alpha) theta'²) / (m L_r c cos(alpha))
//! ```
//!
//! with the terms of [`crate::dynamics`]. For `alpha = 0` it reads `theta'' = 0`: the arm drifts on at its speed. The
//! two poles at the origin mean that the arm's motion neither settles nor runs away by itself, so the arm's part of an
//! output regulator has to be found by solving this equation (paper: Ramos-Velasco, Ruiz-Leon, Celikovsky, eq. (28),
//! (30)).

use crate::dynamics::{self, Angle};
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;

/// The arm's acceleration, rad/s², at which the pendulum in state `x` accelerates by `alpha_ddot` (rad/s²).
///
/// Not finite where the pendulum is horizontal: there the arm does not act on it.
///
/// ```
/// use furuta_model::{Rig, State, dynamics::acceleration, zero_dynamics::arm_acceleration};
/// let c = Rig::builtin("qube-servo-2").expect("built in").params.coefficients();
/// let x = State::new(0.3, 0.2, -4.0, 1.5);
/// // Whatever the command, the two accelerations of the model satisfy it.
/// let [theta_ddot, alpha_ddot] = acceleration(&c, &x, 2.5);
/// assert!((arm_acceleration(&c, &x, alpha_ddot) - theta_ddot).abs() < 1e-9 * theta_ddot.abs());
/// ```
#[must_use]
pub fn arm_acceleration<S: Scalar>(c: &Coefficients<S>, x: &State<S>, alpha_ddot: S) -> S {
    arm_acceleration_under(c, [S::ZERO; 2], x, alpha_ddot)
}

/// The same where a further `torque` (N m) acts on `[arm, pendulum]`: a spring's, a cable's, a tilted base's.
///
/// ```
/// use furuta_model::zero_dynamics::{arm_acceleration, arm_acceleration_under};
/// use furuta_model::{Rig, State};
/// let c = Rig::builtin("qube-servo-2").expect("built in").params.coefficients();
/// let x = State::new(0.3, 0.2, -4.0, 1.5);
/// let free = arm_acceleration(&c, &x, 7.0);
/// // What acts on the arm is the motor's business; what acts on the pendulum, the arm's.
/// assert_eq!(arm_acceleration_under(&c, [0.01, 0.0], &x, 7.0), free);
/// assert!(arm_acceleration_under(&c, [0.0, 0.001], &x, 7.0) < free);
/// ```
#[must_use]
pub fn arm_acceleration_under<S: Scalar>(
    c: &Coefficients<S>,
    torque: [S; 2],
    x: &State<S>,
    alpha_ddot: S,
) -> S {
    let a = Angle::of(x.alpha);
    let centrifugal = c.swing * (a.sin * a.cos) * (x.theta_dot * x.theta_dot);
    let moment =
        c.pendulum * alpha_ddot + c.pendulum_damping * x.alpha_dot - c.weight * a.sin - centrifugal;
    (moment - torque[1]) / (c.coupling * a.cos)
}

/// The command (V) under which the pendulum accelerates by `alpha_ddot` (rad/s²): what keeps it on a prescribed motion.
///
/// With `[theta'', alpha''] = f(x) + g(x) u` this is `(alpha_ddot - f_alpha) / g_alpha`. Not finite where the pendulum
/// is horizontal.
///
/// ```
/// use furuta_model::{Rig, State, dynamics::acceleration, zero_dynamics::command};
/// let c = Rig::builtin("qube-servo-2").expect("built in").params.coefficients();
/// let x = State::new(0.3, 0.2, -4.0, 1.5);
/// let u = command(&c, &x, 7.0);
/// assert!((acceleration(&c, &x, u)[1] - 7.0).abs() < 1e-9);
/// ```
#[must_use]
pub fn command<S: Scalar>(c: &Coefficients<S>, x: &State<S>, alpha_ddot: S) -> S {
    command_under(c, [S::ZERO; 2], x, alpha_ddot)
}

/// The same where a further `torque` (N m) acts on `[arm, pendulum]`.
///
/// ```
/// use furuta_model::zero_dynamics::{command, command_under};
/// use furuta_model::{Rig, State};
/// let c = Rig::builtin("qube-servo-2").expect("built in").params.coefficients();
/// let x = State::new(0.3, 0.2, -4.0, 1.5);
/// // A spring of 0.02 N m/rad pulls the arm back; the motor makes up for it.
/// let pull = -0.02 * x.theta;
/// let more = command_under(&c, [pull, 0.0], &x, 7.0) - command(&c, &x, 7.0);
/// assert!((more + pull / c.drive).abs() < 1e-12);
/// ```
#[must_use]
pub fn command_under<S: Scalar>(
    c: &Coefficients<S>,
    torque: [S; 2],
    x: &State<S>,
    alpha_ddot: S,
) -> S {
    let theta_ddot = arm_acceleration_under(c, torque, x, alpha_ddot);
    let a = Angle::of(x.alpha);
    let (m, b) = (dynamics::mass_matrix(c, a), dynamics::bias(c, a, x));
    let moment = m.arm * theta_ddot + m.coupling * alpha_ddot + b[0];
    (moment + c.arm_damping * x.theta_dot - torque[0]) / c.drive
}
