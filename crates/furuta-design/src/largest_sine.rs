//! The largest sine that a pendulum can follow while its arm moves periodically.
//!
//! A leaning pendulum is held by an accelerating arm, but an arm that has become fast pulls the pendulum outwards
//! itself. Following `alpha = A sin(lambda t)`, the arm's speed obeys, for small angles and without friction of the
//! hinge, `omega' = -alpha (a + b omega²)` with `a = (M22 lambda² + m g c) / m L_r c`, `b = k / m L_r c`. Its periodic
//! solution is `omega = sqrt(a/b) tan(sqrt(a b) A cos(lambda t) / lambda)`, and that is finite only for
//!
//! ```text
//! A < pi lambda / (2 sqrt(a b))
//! ```
//!
//! Beyond, no controller tracks: the arm's speed escapes within a quarter of a turn. A planar model (`k = 0`) knows no
//! such limit.

use furuta_model::State;
use furuta_model::params::Coefficients;
use furuta_model::zero_dynamics::arm_acceleration;

/// The limit by the formula above, for small angles; infinite for a planar model.
///
/// ```
/// use furuta_design::largest_sine::small_angles;
/// let c = furuta_model::Rig::builtin("ramos-velasco").ok_or("no such rig")?.params.coefficients();
/// // The paper's rig cannot follow the paper's reference, 0.1 rad at 1 rad/s.
/// assert!((small_angles(&c, 1.0) - 0.0726).abs() < 1e-4);
/// # Ok::<(), &str>(())
/// ```
#[must_use]
pub fn small_angles(c: &Coefficients<f64>, lambda: f64) -> f64 {
    let a = (c.pendulum * lambda * lambda + c.weight) / c.coupling;
    let b = c.swing / c.coupling;
    std::f64::consts::FRAC_PI_2 * lambda / (a * b).sqrt()
}

/// Steps of the quarter turn.
const STEPS: usize = 2000;

/// The arm's speed (rad/s) in the moment in which the pendulum, following a sine of `amplitude` (rad) without friction
/// in its hinge, passes upright; `None` where the motion does not exist.
///
/// Without friction the motion is the same backwards, so the arm stands still when the pendulum leans most; from there
/// to upright is a quarter of a turn, integrated by RK4.
#[must_use]
pub fn speed_at_upright(c: &Coefficients<f64>, lambda: f64, amplitude: f64) -> Option<f64> {
    let free = Coefficients {
        pendulum_damping: 0.0,
        ..*c
    };
    let rate = |t: f64, omega: f64| {
        let (sin, cos) = (lambda * t).sin_cos();
        let alpha = amplitude * cos;
        let x = State::new(0.0, alpha, omega, -amplitude * lambda * sin);
        arm_acceleration(&free, &x, -lambda * lambda * alpha)
    };
    // More than the arm can do however fast the pendulum turns: the tangent is about to leave.
    let escape = 1e6 * lambda;
    let h = std::f64::consts::FRAC_PI_2 / lambda / STEPS as f64;
    let mut omega = 0.0_f64;
    for k in 0..STEPS {
        let t = k as f64 * h;
        let k1 = rate(t, omega);
        let k2 = rate(t + h / 2.0, omega + h / 2.0 * k1);
        let k3 = rate(t + h / 2.0, omega + h / 2.0 * k2);
        let k4 = rate(t + h, omega + h * k3);
        omega += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        if !(omega.abs() < escape) {
            return None;
        }
    }
    Some(omega)
}

/// The limit for any angle, by bisection; `None` where every amplitude up to 1.5 rad is possible.
///
/// ```
/// use furuta_design::largest_sine::{amplitude, small_angles};
/// let c = furuta_model::Rig::builtin("ramos-velasco").ok_or("no such rig")?.params.coefficients();
/// let limit = amplitude(&c, 1.0).ok_or("none")?;
/// assert!((limit / small_angles(&c, 1.0) - 1.0).abs() < 2e-3, "{limit}");
/// # Ok::<(), &str>(())
/// ```
#[must_use]
pub fn amplitude(c: &Coefficients<f64>, lambda: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1.5);
    if speed_at_upright(c, lambda, high).is_some() {
        return None;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if speed_at_upright(c, lambda, middle).is_some() {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}
