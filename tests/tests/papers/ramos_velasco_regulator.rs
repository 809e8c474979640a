//! Ramos-Velasco, Ruiz-Leon, Celikovsky: the zero dynamics of `y = beta`, and the solutions of the regulator equation
//! printed in sec. 4.1 and 4.2. A polynomial in the exosystem's states is differentiated along them, so each is tested
//! by substitution.

use super::ramos_velasco::{RIG, Table1, planar};
use super::{ROUNDING, rig};
use furuta_ctrl::design::SteadyMotion;
use furuta_ctrl::design::regulator_equation::arm_angle;
use furuta_model::dynamics::acceleration;
use furuta_model::published::Paper;
use furuta_model::published::Quantity::{SteadyArmAngle, SteadyArmSpeed};
use furuta_model::series::Series;
use furuta_model::zero_dynamics::arm_acceleration;
use furuta_model::{Scalar, State};
use std::collections::BTreeMap;

#[test]
fn zero_dynamics_are_the_papers_formula() {
    // theta'' = (g/l1) tan(w2) + (l2/l1) lambda² w2 / cos(w2) on beta = w2, in the planar model.
    let (t, planar) = (Table1::printed(), planar());
    for lambda in [0.5, 1.0, 3.0] {
        for step in 0..50 {
            let (w1, w2) = (0.8 * f64::from(step).cos(), 0.8 * f64::from(step).sin());
            let formula = t.g / t.l1 * w2.tan() + t.l2 / t.l1 * lambda * lambda * w2 / w2.cos();
            // beta' = -lambda w1, beta'' = -lambda² w2; the arm's state must not matter.
            for theta_dot in [0.0, 7.0] {
                let x = State::new(1.0, -w2, theta_dot, lambda * w1);
                let ours = arm_acceleration(&planar, &x, lambda * lambda * w2);
                assert!((ours - formula).abs() <= ROUNDING * formula.abs().max(1.0));
                // And the model does it: with the command that makes alpha'' so, theta'' is that.
                let [_, free] = acceleration(&planar, &x, 0.0);
                let [_, one] = acceleration(&planar, &x, 1.0);
                let v = (lambda * lambda * w2 - free) / (one - free);
                let [theta_ddot, _] = acceleration(&planar, &x, v);
                assert!((theta_ddot - formula).abs() <= 1e-9 * formula.abs().max(1.0));
            }
        }
    }
}

/// A polynomial in `(w1, w2)`: exponents to coefficient.
type Polynomial = BTreeMap<(u32, u32), f64>;

/// The rate of a polynomial along `w1' = lambda w2`, `w2' = -lambda w1`.
fn rate(polynomial: &Polynomial, lambda: f64) -> Polynomial {
    let mut out = Polynomial::new();
    for (&(i, j), &c) in polynomial {
        if i > 0 {
            *out.entry((i - 1, j + 1)).or_default() += lambda * f64::from(i) * c;
        }
        if j > 0 {
            *out.entry((i + 1, j - 1)).or_default() -= lambda * f64::from(j) * c;
        }
    }
    out
}

fn value(polynomial: &Polynomial, w1: f64, w2: f64) -> f64 {
    polynomial
        .iter()
        .map(|(&(i, j), c)| c * w1.powi(i as i32) * w2.powi(j as i32))
        .sum()
}

fn coefficient(polynomial: &Polynomial, at: (u32, u32)) -> f64 {
    polynomial.get(&at).copied().unwrap_or(0.0)
}

/// The printed polynomial of sec. 4.2 or 4.1, from the table of figures.
fn printed_polynomial(place: &str, name: &str) -> Polynomial {
    let paper = Paper::of(RIG).expect("a paper's rig");
    paper
        .figures
        .iter()
        .filter(|f| f.place == place && f.what.starts_with(name))
        .filter_map(|f| match f.quantity {
            SteadyArmAngle(i, j) | SteadyArmSpeed(i, j) => Some(((i as u32, j as u32), f.printed)),
            _ => None,
        })
        .collect()
}

/// Taylor series of the zero dynamics' right-hand side to fifth order, lambda = 1.
fn right_hand_side(t: &Table1) -> Polynomial {
    let (p, q) = (t.g / t.l1, t.l2 / t.l1);
    Polynomial::from([
        ((0, 1), p + q),
        ((0, 3), p / 3.0 + q / 2.0),
        ((0, 5), 2.0 * p / 15.0 + 5.0 * q / 24.0),
    ])
}

/// The solution of the regulator equation to fifth order, lambda = 1, found by SymPy from the series of the right-hand
/// side.
fn fifth_order() -> Polynomial {
    Polynomial::from([
        ((0, 1), -81.230_77),
        ((2, 1), -18.692_31),
        ((0, 3), -21.807_69),
        ((4, 1), -6.007_179),
        ((2, 3), -13.015_56),
        ((0, 5), -7.458_915),
    ])
}

#[test]
fn fifth_order_solution_satisfies_the_zero_dynamics() {
    let t = Table1::printed();
    let angle = fifth_order();
    let speed = rate(&angle, 1.0);
    let acceleration = rate(&speed, 1.0);
    let expected = right_hand_side(&t);
    for i in 0..6 {
        for j in 0..6 - i {
            let difference = coefficient(&acceleration, (i, j)) - coefficient(&expected, (i, j));
            // Seven digits given of coefficients to 13, taken twice with factors to 21.
            assert!(difference.abs() < 2e-4, "w1^{i} w2^{j}: {difference}");
        }
    }
    // The same without series: what is left of theta'' - zero dynamics is of seventh order.
    let planar = planar();
    let left = |size: f64| {
        (0..32)
            .map(|k| {
                let (s, c) = (f64::from(k) * 0.2).sin_cos();
                let (w1, w2) = (size * c, size * s);
                let x = State::new(0.0, -w2, value(&speed, w1, w2), w1);
                (value(&acceleration, w1, w2) - arm_acceleration(&planar, &x, w2)).abs()
            })
            .fold(0.0, f64::max)
    };
    let order = (left(0.8) / left(0.4)).log2();
    assert!((6.5..7.7).contains(&order), "order {order}");
    // What the paper prints of it and what furuta-model computes are its first terms.
    let figure = |quantity| {
        let paper = Paper::of(RIG).expect("a paper's rig");
        let figure = paper.figure(quantity).expect("a printed figure");
        figure.recompute(&rig(RIG), |_| None).expect("computable")
    };
    for (i, j) in [(0, 1), (2, 1), (0, 3)] {
        let ours = figure(SteadyArmAngle(i, j));
        assert!(
            (ours - coefficient(&angle, (i as u32, j as u32))).abs() < 1e-5,
            "{ours}"
        );
    }
    for (i, j) in [(1, 0), (3, 0), (1, 2)] {
        let ours = figure(SteadyArmSpeed(i, j));
        assert!(
            (ours - coefficient(&speed, (i as u32, j as u32))).abs() < 5e-5,
            "{ours}"
        );
    }
    assert!((coefficient(&speed, (1, 2)) - 28.038_46).abs() < 1e-4);
}

/// Erratum, sec. 4.1: the coefficients printed for lambda = 1 satisfy `pi_2 = d pi_1/dt` only for lambda = 3, and the
/// zero dynamics for neither. The model's are -81.23 and 81.23.
#[test]
fn erratum_section_4_1_coefficients_belong_to_lambda_3() {
    let t = Table1::printed();
    let (angle, speed) = (
        printed_polynomial("sec. 4.1", "pi_1"),
        printed_polynomial("sec. 4.1", "pi_2"),
    );
    let (first, second) = (coefficient(&angle, (0, 1)), coefficient(&speed, (1, 0)));
    assert!((-first * 3.0 - second).abs() < 0.005, "lambda = 3");
    assert!((-first - second).abs() > 30.0, "not lambda = 1");
    // Terms of second order have rates of second order: printed is third. Read as w1² w2 and w2³ they come within 6 %
    // of it at lambda = 3.
    assert!(coefficient(&angle, (1, 1)) != 0.0 && coefficient(&speed, (3, 0)) != 0.0);
    let cubic = Polynomial::from([
        ((2, 1), coefficient(&angle, (1, 1))),
        ((0, 3), coefficient(&angle, (0, 2))),
    ]);
    for (at, c) in rate(&cubic, 3.0) {
        if c != 0.0 {
            assert!(
                (c / coefficient(&speed, at) - 1.0).abs() < 0.06,
                "{at:?}: {c}"
            );
        }
    }
    // -lambda² a = g/l1 + (l2/l1) lambda².
    let correct = |lambda: f64| -(t.g / t.l1 / (lambda * lambda) + t.l2 / t.l1);
    assert!((correct(1.0) + 81.2308).abs() < 1e-4 && (correct(3.0) + 14.1538).abs() < 1e-4);
    assert!((first - correct(3.0)).abs() > 1.0);
}

/// Erratum, sec. 4.2: the printed solution solves the zero dynamics of (39) as printed, but for the sign of the `w2³`
/// term; the model's is -81.23 w2 - 18.69 w1² w2 - 21.81 w2³.
#[test]
fn erratum_section_4_2_solution_carries_the_lost_factors() {
    let t = Table1::printed();
    // Zero dynamics of (39) as printed: pi'' = f31 + (d22/d12)(w2 + f41). Beyond the right terms it has (T2 + c12) x4
    // (1 - d22/d12) / p.
    let lost = |beta: f64| (1.0 - t.d22 / t.d12(beta)) / t.p(beta);
    for (w1, w2) in [(0.3, 0.2), (-0.7, 0.5), (0.1, -0.9)] {
        let x = State::new(0.0, w2, 0.0, -w1);
        let [f31, f41] = t.printed_39(&x);
        let direct = f31 + t.d22 / t.d12(w2) * (w2 + f41);
        let extra = (t.t2 + t.c12(w2, -w1)) * -w1 * lost(w2);
        let right = t.g / t.l1 * w2.tan() + t.l2 / t.l1 * w2 / w2.cos();
        assert!((direct - right - extra).abs() <= ROUNDING * direct.abs());
    }
    // Its series to third order, with lost(beta) = g0 + g2 beta² + ... .
    let g0 = lost(0.0);
    let (a, b) = (t.d12(0.0).powi(2), t.d11 * t.d22);
    let k = t.d22 / t.d12(0.0);
    let g2 = (-k / 2.0 + (1.0 - k) * a / (a - b)) / (a - b);
    assert!(((lost(1e-3) - g0) / 1e-6 / g2 - 1.0).abs() < 1e-3);
    let mut expected = right_hand_side(&t);
    expected.remove(&(0, 5));
    expected.insert((1, 0), -t.t2 * g0);
    expected.insert((1, 2), -t.t2 * g2);
    expected.insert((2, 1), -t.m2 * t.l1 * t.l2 * g0);

    let angle = printed_polynomial("sec. 4.2", "pi_eta1");
    let speed = printed_polynomial("sec. 4.2", "pi_eta2");
    let second = rate(&rate(&angle, 1.0), 1.0);
    // Two decimals of the printed coefficients, times factors to 7.
    let within = 0.08;
    for at in [(1, 0), (0, 1), (3, 0), (1, 2), (2, 1)] {
        let difference = coefficient(&second, at) - coefficient(&expected, at);
        assert!(difference.abs() < within, "{at:?}: {difference}");
    }
    // The w2³ term has the right size and the wrong sign ...
    let (found, should) = (coefficient(&second, (0, 3)), coefficient(&expected, (0, 3)));
    assert!((found + should).abs() < within, "{found} {should}");
    // ... and so pi_eta1 contradicts pi_eta2 there, and there alone.
    let rates = rate(&angle, 1.0);
    for at in [(1, 0), (0, 1), (3, 0), (0, 3), (2, 1)] {
        let difference = coefficient(&rates, at) - coefficient(&speed, at);
        assert!(difference.abs() < within, "{at:?}: {difference}");
    }
    let (found, printed) = (coefficient(&rates, (1, 2)), coefficient(&speed, (1, 2)));
    assert!((found + printed).abs() < within, "{found} {printed}");
    // With the sign right, 73.80 and 58.55 would be 36.42 and 14.93.
    let cubic = coefficient(&expected, (0, 3));
    let (c0, c1) = (coefficient(&expected, (2, 1)), cubic);
    // -7 b + 6 c = c0, 2 b - 3 c = c1.
    let b = -(c0 + 2.0 * c1) / 3.0;
    let c = (2.0 * b - c1) / 3.0;
    assert!(
        (b - 36.418_803).abs() < 1e-5 && (c - 14.933_048).abs() < 1e-5,
        "{b} {c}"
    );
}

/// `f_31 + d22/d12 (lambda² w2 + f_41)` of (39) as printed, on series: what `pi_eta1` must accelerate by for the
/// printed model.
fn printed_demand(t: &Table1, x: &State<Series<f64>>, beta_ddot: Series<f64>) -> Series<f64> {
    let (sin, cos) = x.alpha.sin_cos();
    let number = Series::constant;
    let ml = number(t.m2 * t.l1 * t.l2);
    let (d12, g2) = (ml * cos, sin.scale(-t.m2 * t.l2 * t.g));
    let c12 = -(ml * sin * x.alpha_dot);
    let p = d12 * d12 - number(t.d11 * t.d22);
    let damping = (number(t.t2) + c12) * x.alpha_dot;
    let f31 = (damping - d12 * g2) / p;
    let f41 = (g2.scale(t.d11) - damping) / p;
    f31 + number(t.d22) / d12 * (f41 - beta_ddot)
}

/// The solver for the regulator equation finds the coefficients of sec. 4.2: from the model those that are right, from
/// (39) as printed those that carry its lost factors; from the printed equation with the sign of one term turned, all.
#[test]
fn the_series_solver_gives_both_the_corrected_and_the_printed_coefficients() {
    let t = Table1::printed();
    // alpha = -beta: the paper's series is ours with the other sign.
    let ours = SteadyMotion::solve(&planar(), 1.0, 5).expect("solvable");
    for (&(i, j), c) in &fifth_order() {
        let found = -ours.angle.coefficient(i as usize, j as usize);
        assert!((found - c).abs() < 1e-5 * c.abs(), "w1^{i} w2^{j}: {found}");
    }
    let printed = printed_polynomial("sec. 4.2", "pi_eta1");
    let solved = arm_angle(1.0, 3, |x, b| printed_demand(&t, x, b)).expect("solvable");
    // Of all printed ones the two that contradict pi_eta2 are not among the solution's.
    for (&(i, j), c) in &printed {
        let found = solved.coefficient(i as usize, j as usize);
        let expected = match (i, j) {
            (2, 1) => 36.418_803,
            (0, 3) => 14.933_048,
            _ => *c,
        };
        assert!(
            (found - expected).abs() < 0.0051,
            "w1^{i} w2^{j}: {found} {c}"
        );
    }
    // The sign of its w2³ term turned round, every one is.
    let turned = arm_angle(1.0, 3, |x, b| {
        let right = printed_demand(&t, x, b);
        right.map(|i, j, c| if (i, j) == (0, 3) { -c } else { c })
    })
    .expect("solvable");
    for (&(i, j), c) in &printed {
        let found = turned.coefficient(i as usize, j as usize);
        assert!((found - c).abs() < 0.0051, "w1^{i} w2^{j}: {found} {c}");
    }
    // Sec. 4.1 says lambda = 1 and has the ratio of lambda = 3, whose solution starts with -14.15.
    let three = SteadyMotion::solve(&planar(), 3.0, 3).expect("solvable");
    assert!((three.angle.coefficient(0, 1) - 14.1538).abs() < 1e-4);
}

/// Erratum, (46) and (53): printed `z_2' = f_41 + g_41 u` for the error `z_2 = beta' + lambda w1`; corrected `z_2' =
/// f_41 + g_41 u + lambda² w2`, as sec. 4.1 has it (`c(w) = -(w2 + f_41) / g_41`).
#[test]
fn erratum_equation_46_lacks_the_references_acceleration() {
    let (t, planar) = (Table1::printed(), planar());
    let lambda = 1.0;
    for (w1, w2) in [(0.1, 0.0), (0.06, 0.08), (0.0, 0.1)] {
        // On the steady motion the error must stay zero: with the command of sec. 4.1 it does.
        let steady = SteadyMotion::solve(&planar, lambda, 7).expect("solvable");
        let x = steady.state([-w1, -w2]);
        let held = |u: f64| {
            let [_, alpha_ddot] = acceleration(&planar, &x, u);
            // z_2' = beta'' + lambda² w2.
            -alpha_ddot + lambda * lambda * w2
        };
        let [g31, g41] = t.g31_g41(w2);
        assert!(g31 > 0.0 && g41 < 0.0);
        let [_, f41] = t.corrected_f(&State::new(0.0, w2, x.theta_dot, -lambda * w1), x.theta_dot);
        let corrected = -(lambda * lambda * w2 + f41) / g41;
        let printed = -f41 / g41;
        assert!(held(corrected).abs() < 1e-9, "{}", held(corrected));
        // As printed, the pendulum's acceleration is zero: what is missed is the reference's.
        assert!((held(printed) - lambda * lambda * w2).abs() < 1e-9);
    }
}
