//! Shahzad, Munshi, Azam, Khan 2022: LQR on an SRV02.

use super::{
    ROUNDING, assert_poles, identity_gain, printed, rig, same, sorted_poles, states, upright,
};
use furuta_model::dynamics::acceleration;
use furuta_model::published::Quantity::{IdentityGain, InputMatrix, Parameter, StateMatrix};
use furuta_model::{Linear, State, energy};
use nalgebra::{RowVector4, SMatrix, SVector};

const RIG: &str = "shahzad2022-srv02";

/// The symbols of Table 2.
struct Table2 {
    l: f64,
    m: f64,
    r: f64,
    j_eq: f64,
    g: f64,
    /// `K_t K_g eta_m eta_g / R_m`.
    drive: f64,
    /// Factor of `theta'` in (60).
    damping: f64,
}

impl Table2 {
    fn printed() -> Self {
        let value = |key| printed(RIG, Parameter(key));
        let gear = value("motor.gear_ratio");
        let drive = value("motor.torque_constant") * gear * value("motor.efficiency")
            / value("motor.resistance");
        Self {
            l: value("pendulum.com"),
            m: value("pendulum.mass"),
            r: value("arm.length"),
            j_eq: value("arm.inertia"),
            g: rig(RIG).params.gravity,
            drive,
            damping: drive * value("motor.back_emf_constant") * gear + value("arm.viscous"),
        }
    }

    /// (60).
    fn torque(&self, x: &State<f64>, u: f64) -> f64 {
        self.drive * u - self.damping * x.theta_dot
    }

    /// `sin²(alpha) (L² + r²) + J_eq / m`.
    fn inertia(&self, alpha: f64) -> f64 {
        alpha.sin().powi(2) * (self.l.powi(2) + self.r.powi(2)) + self.j_eq / self.m
    }

    /// The bracket of (30) and (31).
    fn bracket(&self, x: &State<f64>, torque: f64) -> f64 {
        let (sin, cos) = x.alpha.sin_cos();
        let (l, r) = (self.l, self.r);
        torque / self.m
            - 2.0 * l * l * sin * cos * x.theta_dot * x.alpha_dot
            - r * l * sin * x.alpha_dot.powi(2)
            + r * l * sin * cos * cos * x.theta_dot.powi(2)
            + r * self.g * cos * sin
    }

    /// (30).
    fn theta_ddot(&self, x: &State<f64>, torque: f64) -> f64 {
        self.bracket(x, torque) / self.inertia(x.alpha)
    }

    /// (31).
    fn alpha_ddot(&self, x: &State<f64>, torque: f64) -> f64 {
        let (sin, cos) = x.alpha.sin_cos();
        self.r * cos / (self.l * self.inertia(x.alpha)) * self.bracket(x, torque)
            + sin * cos * x.theta_dot.powi(2)
            + self.g / self.l * sin
    }
}

/// Derivative by central differences, to about 1e-9 for the functions here.
fn slope(f: impl Fn(f64) -> f64, at: f64) -> f64 {
    let h = 1e-4;
    // Fourth order.
    (8.0 * (f(at + h) - f(at - h)) - (f(at + 2.0 * h) - f(at - 2.0 * h))) / (12.0 * h)
}

/// (A) and (B) as printed, in the order `[theta, alpha, theta_dot, alpha_dot]`.
fn printed_matrices() -> Linear {
    let a = |row, col| printed(RIG, StateMatrix(row, col));
    let b = |row| printed(RIG, InputMatrix(row));
    #[rustfmt::skip]
    let a = SMatrix::<f64, 4, 4>::from_row_slice(&[
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
        0.0, a(2, 1), a(2, 2), 0.0,
        0.0, a(3, 1), a(3, 2), 0.0,
    ]);
    Linear {
        a,
        b: SVector::<f64, 4>::new(0.0, 0.0, b(2), b(3)),
    }
}

#[test]
fn equations_30_and_31_are_the_model_at_every_state() {
    let t = Table2::printed();
    let c = rig(RIG).params.coefficients();
    for (x, u) in states() {
        let torque = t.torque(&x, u);
        let expected = [t.theta_ddot(&x, torque), t.alpha_ddot(&x, torque)];
        assert!(same(acceleration(&c, &x, u), expected), "{x:?} {u}");
    }
}

#[test]
fn equation_62_is_the_linear_model_and_its_zeros_are_zeros() {
    let t = Table2::printed();
    let found = upright(&rig(RIG));
    let lean = t.m * t.r * t.g / t.j_eq;
    let fall = t.g / t.l * (1.0 + t.m * t.r.powi(2) / t.j_eq);
    let (a, b) = (-t.damping / t.j_eq, t.drive / t.j_eq);
    let ratio = t.r / t.l;
    #[rustfmt::skip]
    let expected = SMatrix::<f64, 4, 4>::from_row_slice(&[
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
        0.0, lean, a, 0.0,
        0.0, fall, ratio * a, 0.0,
    ]);
    assert!(
        (found.a - expected).norm() <= ROUNDING * expected.norm(),
        "{}",
        found.a
    );
    let expected = SVector::<f64, 4>::new(0.0, 0.0, b, ratio * b);
    assert!((found.b - expected).norm() <= ROUNDING * expected.norm());
    // (A) and (B) print zeros where ours are zeros exactly.
    let pattern = printed_matrices();
    for (ours, printed) in found.a.iter().zip(pattern.a.iter()) {
        assert_eq!(*ours == 0.0, *printed == 0.0);
    }
}

/// The weights of (C) are not printed. With Q = I, R = 1 the rig's own linearisation gives every printed digit of K.
#[test]
fn gain_c_is_the_regulator_of_unit_weights() {
    let gain = identity_gain(&upright(&rig(RIG))).expect("stabilisable");
    for (i, gain) in gain.into_iter().enumerate() {
        // Half a unit of the second decimal.
        assert!(
            (gain - printed(RIG, IdentityGain(i))).abs() <= 0.005,
            "{gain}"
        );
    }
    // SciPy's solve_continuous_are on the same matrices.
    let scipy = [-1.0, 27.683_928, -2.021_404, 3.555_678];
    for (gain, scipy) in gain.into_iter().zip(scipy) {
        assert!((gain - scipy).abs() < 2e-6, "{gain} {scipy}");
    }
}

/// The printed matrices are rounded to two decimals: their gain is 27.660, not the printed 27.68 (nor 3.553 its 3.56).
#[test]
fn gain_c_does_not_follow_from_the_rounded_matrices() {
    let gain = identity_gain(&printed_matrices()).expect("stabilisable");
    for (gain, expected) in gain.into_iter().zip([-1.0, 27.660, -2.019, 3.553]) {
        assert!((gain - expected).abs() <= 5e-4, "{gain} {expected}");
    }
    assert!((gain[1] - printed(RIG, IdentityGain(1))).abs() > 0.015);
}

#[test]
fn closed_loop_poles_of_gain_c() {
    let gain = RowVector4::from_fn(|_, i| printed(RIG, IdentityGain(i)));
    let expected = [
        (-54.945, 0.0),
        (-6.266, -2.165),
        (-6.266, 2.165),
        (-0.869, 0.0),
    ];
    let Linear { a, b } = printed_matrices();
    assert_poles(&sorted_poles(&(a - b * gain)), &expected, 1e-3);
    // On the rig's own matrices the same within what their rounding does.
    let Linear { a, b } = upright(&rig(RIG));
    assert_poles(&sorted_poles(&(a - b * gain)), &expected, 0.02);
}

/// Erratum, (3) to (5): printed `z = -L cos(alpha)`; corrected `z = L cos(alpha)`, whose rate (6) has and whose
/// potential energy (1) is.
#[test]
fn erratum_equation_3_counts_the_height_downwards() {
    let t = Table2::printed();
    let c = rig(RIG).params.coefficients();
    for (x, _) in states() {
        let height = |sign: f64, alpha: f64| sign * t.l * alpha.cos();
        let lifted = |sign: f64| t.m * t.g * (height(sign, x.alpha) - height(sign, 0.0));
        let model = energy::potential(&c, &x) - energy::potential(&c, &State::upright());
        assert!((lifted(1.0) - model).abs() <= 1e-12, "corrected, {x:?}");
        assert!((lifted(-1.0) + model).abs() <= 1e-12, "as printed, {x:?}");
        // (6) prints the rate of the corrected one.
        let printed = -t.l * x.alpha.sin() * x.alpha_dot;
        let rate = slope(|s| height(1.0, x.alpha + s * x.alpha_dot), 0.0);
        assert!((printed - rate).abs() <= 1e-8 * t.l * x.alpha_dot.abs().max(1.0));
    }
}

/// Erratum, (6) and (7): printed `y' = -r cos(theta) theta' + ...`; corrected `r cos(theta) theta' + ...`.
#[test]
fn erratum_equation_6_has_the_wrong_sign_of_the_arm() {
    let t = Table2::printed();
    let mut wrong = 0;
    for (x, _) in states() {
        let ((st, ct), (sa, ca)) = (x.theta.sin_cos(), x.alpha.sin_cos());
        let (w, v) = (x.theta_dot, x.alpha_dot);
        // (7) with either sign, and (8).
        let squared = |sign: f64| {
            let along = -t.r * st * w + t.l * ct * sa * w + t.l * st * ca * v;
            let across = sign * t.r * ct * w + t.l * st * sa * w - t.l * ct * ca * v;
            along.powi(2) + across.powi(2) + (t.l * sa * v).powi(2)
        };
        let printed = (t.r * w).powi(2) + (t.l * sa * w).powi(2) + (t.l * v).powi(2)
            - 2.0 * t.r * t.l * ca * w * v;
        assert!((squared(1.0) - printed).abs() <= 1e-12 * printed.max(1.0));
        wrong += usize::from((squared(-1.0) - printed).abs() > 1e-2 * printed);
    }
    assert!(wrong > 150, "{wrong} of 200");
}

/// Erratum, (61): printed `... U - [0, a, 0, b] theta'` with negative a and b; corrected with a plus, as (62) has it.
#[test]
fn erratum_equation_61_has_the_wrong_sign_of_the_damping() {
    let t = Table2::printed();
    let Linear { a, .. } = upright(&rig(RIG));
    let of_61 = [-t.damping / t.j_eq, -t.r / (t.l * t.j_eq) * t.damping];
    for (row, damping) in [2, 3].into_iter().zip(of_61) {
        assert!((a[(row, 2)] - damping).abs() <= ROUNDING * damping.abs());
        assert!(-damping > 0.0, "as printed it would drive the arm");
    }
}

/// Erratum, (5): printed `y = r sin(theta) + L cos(theta) sin(alpha)`; the plus must be a minus.
///
/// The model's kinetic energy is that of the corrected position.
#[test]
fn erratum_equation_5_has_the_wrong_sign_of_the_lean() {
    let t = Table2::printed();
    let c = rig(RIG).params.coefficients();
    let mut wrong = 0;
    for (x, _) in states() {
        let kinetic = |sign: f64| {
            // Position of the point mass, moved along the velocities.
            let at = |s: f64| {
                let (st, ct) = (x.theta + s * x.theta_dot).sin_cos();
                let (sa, ca) = (x.alpha + s * x.alpha_dot).sin_cos();
                [
                    t.r * ct + t.l * st * sa,
                    t.r * st + sign * t.l * ct * sa,
                    -t.l * ca,
                ]
            };
            let speed2: f64 = (0..3).map(|i| slope(|s| at(s)[i], 0.0).powi(2)).sum();
            0.5 * t.m * speed2 + 0.5 * t.j_eq * x.theta_dot.powi(2)
        };
        let model = energy::kinetic(&c, &x);
        // Differences of the position: 1e-9 relative.
        assert!(
            (kinetic(-1.0) - model).abs() <= 1e-8 * model,
            "corrected, {x:?}"
        );
        wrong += usize::from((kinetic(1.0) - model).abs() > 1e-2 * model);
    }
    assert!(
        wrong > 150,
        "as printed it is a different body: {wrong} of 200"
    );
}

/// Erratum, (32): printed `r g cos(alpha) sin(2 alpha) / 2`; corrected `r g sin(2 alpha) / 2`, as in (30).
#[test]
fn erratum_equation_32_has_one_cosine_too_many() {
    let t = Table2::printed();
    let c = rig(RIG).params.coefficients();
    let gravity = |x: &State<f64>, extra: f64| {
        // (32): the bracket of (30) with its gravity term rewritten by the double angle.
        let term = 0.5 * t.r * t.g * (2.0 * x.alpha).sin();
        t.bracket(x, 0.0) - t.r * t.g * x.alpha.sin() * x.alpha.cos() + term * extra
    };
    for (mut x, _) in states() {
        x.theta_dot = 0.0;
        let model = acceleration(&c, &x, 0.0)[0];
        let corrected = gravity(&x, 1.0) / t.inertia(x.alpha);
        let as_printed = gravity(&x, x.alpha.cos()) / t.inertia(x.alpha);
        assert!((corrected - model).abs() <= ROUNDING * model.abs().max(1.0));
        let lost = t.r * t.g * x.alpha.sin() * x.alpha.cos() * (1.0 - x.alpha.cos());
        assert!(
            ((corrected - as_printed) * t.inertia(x.alpha) - lost).abs() <= ROUNDING * t.r * t.g
        );
    }
    // Upright the two have one slope, which is why (62) is right.
    let up = State::upright();
    let printed_slope = slope(
        |alpha| gravity(&State { alpha, ..up }, alpha.cos()) / t.inertia(alpha),
        0.0,
    );
    assert!((printed_slope - t.m * t.r * t.g / t.j_eq).abs() < 1e-6);
}

/// Erratum, (33): printed `r cos / (L sin² (L² + r²) + J_eq/m)`; corrected `r cos / (L [sin² (L² + r²) + J_eq/m])`, as
/// in (31).
#[test]
fn erratum_equation_33_lacks_a_bracket() {
    let t = Table2::printed();
    let c = rig(RIG).params.coefficients();
    let with = |denominator: f64, x: &State<f64>, torque: f64| {
        let (sin, cos) = x.alpha.sin_cos();
        t.r * cos / denominator * t.bracket(x, torque)
            + sin * cos * x.theta_dot.powi(2)
            + t.g / t.l * sin
    };
    let as_printed = |x: &State<f64>, torque: f64| {
        let sum = t.l.powi(2) + t.r.powi(2);
        with(t.l * x.alpha.sin().powi(2) * sum + t.j_eq / t.m, x, torque)
    };
    for (x, u) in states() {
        let torque = t.torque(&x, u);
        let model = acceleration(&c, &x, u)[1];
        let corrected = with(t.l * t.inertia(x.alpha), &x, torque);
        assert!((corrected - model).abs() <= ROUNDING * model.abs().max(100.0));
    }
    // As printed even the linear model would be wrong, by the factor L = 0.1675 in the input: (57), (62) and (B) come
    // from the corrected.
    let up = State::upright();
    let gain = as_printed(&up, t.drive) - as_printed(&up, 0.0);
    assert!((gain / upright(&rig(RIG)).b[3] - t.l).abs() < 1e-9);
}

/// (42) is right as printed: the derivative of (30) by the angle, at every state.
#[test]
fn equation_42_is_the_derivative_of_equation_30() {
    let t = Table2::printed();
    for (x, u) in states() {
        let torque = t.torque(&x, u);
        let (sin, cos) = x.alpha.sin_cos();
        let inertia = t.inertia(x.alpha);
        let sum = t.l.powi(2) + t.r.powi(2);
        let (l, r, w, v) = (t.l, t.r, x.theta_dot, x.alpha_dot);
        let inner = -2.0 * l * l * (2.0 * x.alpha).cos() * w * v - r * l * cos * v * v
            + r * l * cos.powi(3) * w * w
            - 2.0 * r * l * sin * sin * cos * w * w
            + r * t.g * (2.0 * x.alpha).cos();
        let printed =
            -2.0 * sin * cos * sum / inertia.powi(2) * t.bracket(&x, torque) + inner / inertia;
        let exact = slope(|alpha| t.theta_ddot(&State { alpha, ..x }, torque), x.alpha);
        // Differences of fourth order with steps of 1e-4 rad.
        assert!(
            (printed - exact).abs() <= 1e-6 * exact.abs().max(100.0),
            "{printed} {exact}"
        );
    }
}

/// Erratum, (52): printed `(p) - (q) x [...]`; corrected `((p) - (q)) x [...]`: both are terms of the derivative of one
/// factor.
#[test]
fn erratum_equation_52_lacks_a_bracket() {
    let t = Table2::printed();
    let sum = t.l.powi(2) + t.r.powi(2);
    let mut wrong = 0;
    for (x, u) in states() {
        let torque = t.torque(&x, u);
        let (sin, cos) = x.alpha.sin_cos();
        let inertia = t.inertia(x.alpha);
        let (l, r, w, v) = (t.l, t.r, x.theta_dot, x.alpha_dot);
        let square = (l * inertia).powi(2);
        let p = -l * r * sin * inertia / square;
        let q = 2.0 * l * r * sin * cos * cos * sum / square;
        let bracket = t.bracket(&x, torque);
        let inner = -2.0 * l * l * (2.0 * x.alpha).cos() * w * v - r * l * cos * v * v
            + r * l * cos.powi(3) * w * w
            - 2.0 * r * l * sin * sin * cos * w * w
            + r * t.g * (2.0 * x.alpha).cos();
        let rest = r * cos / (l * inertia) * inner + (2.0 * x.alpha).cos() * w * w + t.g / l * cos;
        let (as_printed, corrected) = (p - q * bracket + rest, (p - q) * bracket + rest);
        let exact = slope(|alpha| t.alpha_ddot(&State { alpha, ..x }, torque), x.alpha);
        assert!(
            (corrected - exact).abs() <= 1e-6 * exact.abs().max(1000.0),
            "{corrected} {exact}"
        );
        wrong += usize::from((as_printed - exact).abs() > 1e-3 * exact.abs());
    }
    assert!(wrong > 150, "{wrong} of 200");
}
