//! Fong, Jamaludin, Abdullah 2014: the EMECS rig, upright and downward, and the transfer function fitted to its
//! measurements.

use super::{ROUNDING, assert_poles, hanging, printed, rig, same, sorted_poles, states, upright};
use furuta_model::dynamics::acceleration;
use furuta_model::published::Quantity::{
    HangingDenominator, HangingNumerator, Parameter, StateMatrix,
};
use furuta_model::transfer::transfer_function;
use furuta_model::{Linear, linearize};
use nalgebra::{Complex, RowSVector, SMatrix, SVector};

const RIG: &str = "fong2014-emecs";

/// The symbols of Table 1.
#[derive(Copy, Clone)]
struct Table1 {
    m2: f64,
    l1: f64,
    c2: f64,
    j1: f64,
    j2: f64,
    friction1: f64,
    friction2: f64,
    g: f64,
    /// `K_t K_b / R_m`.
    back_emf: f64,
    /// `K_t K_u / R_m`.
    drive: f64,
}

impl Table1 {
    /// As printed.
    fn printed() -> Self {
        let value = |key| printed(RIG, Parameter(key));
        let (kt, rm) = (value("motor.torque_constant"), value("motor.resistance"));
        Self {
            m2: value("pendulum.mass"),
            l1: value("arm.length"),
            c2: value("pendulum.com"),
            j1: value("arm.inertia"),
            j2: value("pendulum.inertia"),
            friction1: value("arm.viscous"),
            friction2: value("pendulum.viscous"),
            g: value("environment.gravity"),
            back_emf: kt * value("motor.back_emf_constant") / rm,
            drive: kt * value("motor.amplifier_gain") / rm,
        }
    }

    /// With the one misprint corrected: `C_2` of the rig file.
    fn corrected() -> Self {
        Self {
            friction2: rig(RIG).params.pendulum.viscous,
            ..Self::printed()
        }
    }

    /// Denominator of (20), (22), (27).
    fn det(&self) -> f64 {
        (self.j1 + self.m2 * self.l1.powi(2)) * (self.j2 + self.m2 * self.c2.powi(2))
            - (self.m2 * self.l1 * self.c2).powi(2)
    }
}

/// The entries that are 0 or 1 because they say that a speed is the rate of an angle, and that nothing depends on the
/// arm's angle.
fn assert_structure(linear: &Linear) {
    for row in 0..2 {
        for col in 0..4 {
            let expected = if col == row + 2 { 1.0 } else { 0.0 };
            assert_eq!(linear.a[(row, col)], expected);
        }
        assert_eq!(linear.a[(row + 2, 0)], 0.0);
        assert_eq!(linear.b[row], 0.0);
    }
}

#[test]
fn equation_3_is_the_model_at_every_state() {
    let t = Table1::corrected();
    let c = rig(RIG).params.coefficients();
    for (x, e) in states() {
        let (sin, cos) = x.alpha.sin_cos();
        let sin2 = (2.0 * x.alpha).sin();
        let (w1, w2) = (x.theta_dot, x.alpha_dot);
        let half = 0.5 * t.m2 * t.c2.powi(2);
        let m = SMatrix::<f64, 2, 2>::new(
            t.j1 + t.m2 * t.l1.powi(2) + t.m2 * t.c2.powi(2) * sin * sin,
            -t.m2 * t.l1 * t.c2 * cos,
            -t.m2 * t.l1 * t.c2 * cos,
            t.j2 + t.m2 * t.c2.powi(2),
        );
        let v = SMatrix::<f64, 2, 2>::new(
            t.friction1 + half * w2 * sin2,
            t.m2 * t.l1 * t.c2 * w2 * sin + half * w1 * sin2,
            -half * w1 * sin2,
            t.friction2,
        );
        let gravity = SVector::<f64, 2>::new(0.0, -t.m2 * t.c2 * t.g * sin);
        let torque = SVector::<f64, 2>::new(t.drive * e - t.back_emf * w1, 0.0);
        let q = m.try_inverse().expect("positive definite")
            * (torque - v * SVector::<f64, 2>::new(w1, w2) - gravity);
        assert!(same(acceleration(&c, &x, e), [q[0], q[1]]), "{x:?} {e}");
    }
}

#[test]
fn equation_24_has_these_entries_and_zeros_elsewhere() {
    // The printed entries are checked with every other figure of the paper; here what is printed as 0 or 1.
    assert_structure(&upright(&rig(RIG)));
}

#[test]
fn open_loop_poles_of_equation_24() {
    let entry = |row, col| printed(RIG, StateMatrix(row, col));
    #[rustfmt::skip]
    let a = SMatrix::<f64, 4, 4>::from_row_slice(&[
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
        0.0, entry(2, 1), entry(2, 2), entry(2, 3),
        0.0, entry(3, 1), entry(3, 2), entry(3, 3),
    ]);
    let expected = [(-9.84652, 0.0), (-6.27353, 0.0), (0.0, 0.0), (6.91975, 0.0)];
    // NumPy's eigenvalues of the printed matrix, to the digits given.
    assert_poles(&sorted_poles(&a), &expected, 1e-5);
    // The rig's own differ from them as the printed entries do from the rig's.
    assert_poles(&sorted_poles(&upright(&rig(RIG)).a), &expected, 3e-4);
}

#[test]
fn equation_27_is_the_model_hanging() {
    let t = Table1::corrected();
    let (arm, pendulum) = (t.j1 + t.m2 * t.l1.powi(2), t.j2 + t.m2 * t.c2.powi(2));
    let (coupling, damping) = (t.m2 * t.l1 * t.c2, t.friction1 + t.back_emf);
    let linear = hanging(&rig(RIG));
    assert_structure(&linear);
    let rows = [
        // x3' and x4' of (27): coefficients of x2, x3, x4 and u.
        [
            t.m2.powi(2) * t.l1 * t.c2.powi(2) * t.g,
            -pendulum * damping,
            coupling * t.friction2,
            pendulum * t.drive,
        ],
        [
            -arm * t.m2 * t.c2 * t.g,
            coupling * damping,
            -arm * t.friction2,
            -coupling * t.drive,
        ],
    ];
    for (row, expected) in [2, 3].into_iter().zip(rows) {
        let found = [1, 2, 3].map(|col| linear.a[(row, col)]);
        for (found, expected) in found.into_iter().chain([linear.b[row]]).zip(expected) {
            let expected = expected / t.det();
            // The sine of pi is 1e-16, not 0: an error of that order, times the velocity terms, is in the
            // linearisation.
            assert!(
                (found - expected).abs() <= ROUNDING * expected.abs(),
                "{found} {expected}"
            );
        }
    }
}

#[test]
fn downward_coupling_and_gravity_change_sign() {
    // Eq. (25), (26) against (3).
    let (up, down) = (upright(&rig(RIG)), hanging(&rig(RIG)));
    let signs = [
        ((2, 1), 1.0),
        ((2, 2), 1.0),
        ((2, 3), -1.0),
        ((3, 1), -1.0),
        ((3, 2), -1.0),
        ((3, 3), 1.0),
    ];
    for (at, sign) in signs {
        assert!(
            (down.a[at] - sign * up.a[at]).abs() <= ROUNDING * up.a[at].abs(),
            "{at:?}"
        );
    }
    assert!((down.b[2] - up.b[2]).abs() <= ROUNDING * up.b[2]);
    assert!((down.b[3] + up.b[3]).abs() <= ROUNDING * up.b[3]);
}

#[test]
fn equation_28_as_a_transfer_function() {
    // The numbers of (28) are not printed anywhere: they follow from Table 1 (SciPy: ss2tf of (27) with the corrected
    // C_2).
    let Linear { a, b } = hanging(&rig(RIG));
    let output = RowSVector::<f64, 4>::new(0.0, 1.0, 0.0, 0.0);
    let g = transfer_function(&a, &b, &output);
    let expected_numerator = [0.0, 0.0, -24.724_684_65, 0.0];
    let expected_denominator = [0.0, 427.457_089_57, 65.474_782_6, 9.200_059_97];
    for i in 0..4 {
        assert!(
            (g.numerator[i] - expected_numerator[i]).abs() < 1e-8,
            "{g:?}"
        );
        assert!(
            (g.denominator[i] - expected_denominator[i]).abs() < 1e-7,
            "{g:?}"
        );
    }
    let expected = [
        (-7.818_460_02, 0.0),
        (-0.690_799_98, -7.361_765_68),
        (-0.690_799_98, 7.361_765_68),
        (0.0, 0.0),
    ];
    assert_poles(&sorted_poles(&a), &expected, 1e-7);
    // The same as a frequency response, by solving (s I - A) x = B at each frequency up to the paper's 23 Hz.
    for hertz in [0.1, 1.0, 1.17, 5.0, 23.0] {
        let s = Complex::new(0.0, std::f64::consts::TAU * hertz);
        let matrix =
            SMatrix::<Complex<f64>, 4, 4>::identity() * s - a.map(|v| Complex::new(v, 0.0));
        let x = matrix
            .lu()
            .solve(&b.map(|v| Complex::new(v, 0.0)))
            .expect("no pole here");
        let polynomial = |c: &[f64; 4], leading: f64| {
            c.iter()
                .rev()
                .fold(Complex::new(leading, 0.0), |sum, c| sum * s + c)
        };
        let ratio = polynomial(&g.numerator, 0.0) / polynomial(&g.denominator, 1.0);
        assert!(
            (ratio - x[1]).norm() <= 1e-9 * x[1].norm(),
            "{hertz} Hz: {ratio} {}",
            x[1]
        );
    }
}

#[test]
fn equation_29_agrees_in_its_leading_numerator_and_not_in_its_poles() {
    // What the fit to measurements has and (28) has not: no pole at the origin (a spring on the arm), more damping, a
    // faster resonance.
    let d = |power| -printed(RIG, HangingDenominator(power));
    #[rustfmt::skip]
    let companion = SMatrix::<f64, 4, 4>::from_row_slice(&[
        0.0, 1.0, 0.0, 0.0,
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
        d(0), d(1), d(2), d(3),
    ]);
    let expected = [
        (-6.480, -4.048),
        (-6.480, 4.048),
        (-1.160, -10.527),
        (-1.160, 10.527),
    ];
    assert_poles(&sorted_poles(&companion), &expected, 1e-3);
    let ours = hanging(&rig(RIG)).b[3];
    assert!((ours / printed(RIG, HangingNumerator(2)) - 1.0).abs() < 0.01);
}

/// Erratum, Table 1: printed `C_2 = 390`, corrected 3.167e-4, which the rig file uses.
#[test]
fn erratum_table_1_c2_is_3_167e_4_not_390() {
    let t = Table1::corrected();
    let arm = t.j1 + t.m2 * t.l1.powi(2);
    let coupling = t.m2 * t.l1 * t.c2;
    // Both entries of (24) that hold C_2, solved for it, give the corrected value; to the four digits that are printed
    // of them.
    let from_arm = -printed(RIG, StateMatrix(2, 3)) * t.det() / coupling;
    let from_pendulum = -printed(RIG, StateMatrix(3, 3)) * t.det() / arm;
    assert!((from_arm / t.friction2 - 1.0).abs() < 5e-4, "{from_arm}");
    assert!(
        (from_pendulum / t.friction2 - 1.0).abs() < 5e-4,
        "{from_pendulum}"
    );
    // Neither the printed number nor the same digits with the exponent restored do.
    let entries = |c2: f64| [-coupling * c2 / t.det(), -arm * c2 / t.det()];
    let [theta, alpha] = entries(Table1::printed().friction2);
    assert!((theta + 135_208.0).abs() < 1.0 && (alpha + 1_302_999.95).abs() < 1.0);
    let [theta, alpha] = entries(3.9e-4);
    assert!((theta + 0.1352).abs() < 1e-4 && (alpha + 1.3030).abs() < 1e-4);
    // The code: as the formula, with the value of the rig file, whatever it is.
    for c2 in [t.friction2, 3.9e-4] {
        let mut rig = rig(RIG);
        rig.params.pendulum.viscous = c2;
        let linear = linearize(&rig.nominal_plant(), furuta_model::State::upright(), 0.0);
        for (row, expected) in [2, 3].into_iter().zip(entries(c2)) {
            assert!((linear.a[(row, 3)] - expected).abs() <= ROUNDING * expected.abs());
        }
    }
}
