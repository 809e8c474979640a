//! Riccati solutions against closed forms, against SciPy, and against the equations' own properties.

use furuta_ctrl::design::{DesignError, Entry, Weights, dlqr, is_hurwitz, is_schur, lqr, riccati};
use nalgebra::{Matrix1, Matrix2, SMatrix, Vector2};
use proptest::prelude::*;

struct Case {
    name: &'static str,
    discrete: bool,
    size: (usize, usize),
    a: &'static [f64],
    b: &'static [f64],
    q: &'static [f64],
    r: &'static [f64],
    n: &'static [f64],
    x: &'static [f64],
    k: &'static [f64],
    /// How far SciPy's X was from the refined one.
    scipy_error: f64,
}

include!("data/riccati.rs");

/// Largest relative error of solution and gain against SciPy's.
fn errors<const N: usize, const M: usize>(case: &Case) -> (f64, f64) {
    let a = SMatrix::<f64, N, N>::from_row_slice(case.a);
    let b = SMatrix::<f64, N, M>::from_row_slice(case.b);
    let weights = Weights::new(
        SMatrix::from_row_slice(case.q),
        SMatrix::from_row_slice(case.r),
    )
    .with_cross(SMatrix::from_row_slice(case.n));
    let solve = if case.discrete {
        riccati::discrete
    } else {
        riccati::continuous
    };
    let found = solve(&a, &b, &weights).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    let x = SMatrix::<f64, N, N>::from_row_slice(case.x);
    let k = SMatrix::<f64, M, N>::from_row_slice(case.k);
    (
        (found.x - x).norm() / x.norm(),
        (found.gain - k).norm() / k.norm(),
    )
}

#[test]
fn agrees_with_scipy() {
    // Where a problem is so badly conditioned that SciPy's own error is above the tolerance, being better than SciPy is
    // asked for.
    const TOLERANCE: f64 = 1e-12;
    assert!(CASES.len() > 40);
    for case in CASES {
        let (x, k) = match case.size {
            (1, 1) => errors::<1, 1>(case),
            (2, 1) => errors::<2, 1>(case),
            (3, 1) => errors::<3, 1>(case),
            (3, 2) => errors::<3, 2>(case),
            (4, 1) => errors::<4, 1>(case),
            (4, 2) => errors::<4, 2>(case),
            (5, 1) => errors::<5, 1>(case),
            (6, 2) => errors::<6, 2>(case),
            (8, 1) => errors::<8, 1>(case),
            (8, 3) => errors::<8, 3>(case),
            other => panic!("no instance for size {other:?}"),
        };
        println!(
            "{:40} discrete {:5}  X {x:8.1e}  K {k:8.1e}",
            case.name, case.discrete
        );
        let allowed = TOLERANCE.max(case.scipy_error);
        assert!(
            x < allowed && k < allowed,
            "{}: X off by {x:e}, K by {k:e}",
            case.name
        );
    }
}

#[test]
fn scalar_closed_forms() {
    for a in [-3.0, -1.0, -0.5, 0.0, 0.3, 0.999, 1.0, 1.5, 40.0] {
        for (b, q, r) in [(1.0, 1.0, 1.0), (0.1, 2.0, 0.01), (-5.0, 1e-3, 10.0)] {
            let weights = Weights::diagonal([q], [r]);
            let (am, bm) = (Matrix1::new(a), Matrix1::new(b));
            // b^2 x^2 + (r - a^2 r - q b^2) x - q r = 0, and b^2 x^2 / r - 2 a x - q = 0: the positive roots.
            let p: f64 = r - a * a * r - q * b * b;
            let root = (p * p + 4.0 * b * b * q * r).sqrt();
            let expected = if p > 0.0 {
                2.0 * q * r / (p + root)
            } else {
                (root - p) / (2.0 * b * b)
            };
            let x = riccati::discrete(&am, &bm, &weights).unwrap().x[0];
            assert!(
                (x / expected - 1.0).abs() < 1e-12,
                "discrete a={a} b={b}: {x} {expected}"
            );
            let root = (a * a + q * b * b / r).sqrt();
            let expected = if a > 0.0 {
                r * (a + root) / (b * b)
            } else {
                q / (root - a)
            };
            let x = riccati::continuous(&am, &bm, &weights).unwrap().x[0];
            assert!(
                (x / expected - 1.0).abs() < 1e-12,
                "continuous a={a} b={b}: {x} {expected}"
            );
        }
    }
}

#[test]
fn published_gain_of_shahzad_2022() {
    // The printed (A), (B) in the order [theta, theta_dot, alpha, alpha_dot]; Q = I, R = 1.
    #[rustfmt::skip]
    let a = SMatrix::<f64, 4, 4>::from_row_slice(&[
        0.0,   1.0,    0.0,  0.0,
        0.0, -20.38,  54.06, 0.0,
        0.0,   0.0,    0.0,  1.0,
        0.0, -19.22, 109.56, 0.0,
    ]);
    let b = SMatrix::<f64, 4, 1>::new(0.0, 35.84, 0.0, 33.81);
    let regulator = lqr(&a, &b, &Weights::diagonal([1.0; 4], [1.0])).unwrap();
    for (found, printed) in regulator.gain.iter().zip([-1.000, -2.019, 27.660, 3.553]) {
        assert!(
            (found - printed).abs() < 6e-4,
            "{} (last printed digit)",
            regulator.gain
        );
    }
    let poles = regulator.poles().unwrap();
    assert!(poles.iter().all(|p| p.re < 0.0), "{poles:?}");
}

#[test]
fn single_precision_on_the_target() {
    // What a microcontroller can design for itself: a balanced rig at 500 Hz, to four digits.
    let Some(case) = CASES.iter().find(|c| c.name == "paper_b at 500 Hz") else {
        panic!("case missing")
    };
    let [a, q] = [case.a, case.q]
        .map(|m| SMatrix::<f32, 4, 4>::from_iterator(m.iter().map(|&v| v as f32)).transpose());
    let b = SMatrix::<f32, 4, 1>::from_iterator(case.b.iter().map(|&v| v as f32));
    let k = dlqr(&a, &b, &Weights::new(q, Matrix1::new(1.0f32)))
        .unwrap()
        .gain;
    for (found, expected) in k.iter().zip(case.k) {
        assert!((f64::from(*found) / expected - 1.0).abs() < 1e-2, "{k}");
    }
}

#[test]
fn errors_name_the_cause() {
    let a = Matrix2::new(1.0, 1.0, 0.0, 1.0);
    let b = Vector2::new(0.0, 1.0);
    let weights = Weights::diagonal([1.0, 1.0], [1.0]);
    let q = Weights::new(Matrix2::new(1.0, 0.5, 0.0, 1.0), Matrix1::new(1.0));
    assert_eq!(
        dlqr(&a, &b, &q),
        Err(DesignError::NotSymmetric {
            matrix: Entry::Q,
            row: 1,
            col: 0,
            difference: -0.5
        })
    );
    let r = Weights::diagonal([1.0, 1.0], [-2.0]);
    assert_eq!(
        lqr(&a, &b, &r),
        Err(DesignError::NotPositiveDefinite {
            matrix: Entry::R,
            index: 0,
            pivot: -2.0
        })
    );
    let nan = Vector2::new(0.0, f64::NAN);
    assert_eq!(
        dlqr(&a, &nan, &weights),
        Err(DesignError::NotFinite {
            matrix: Entry::B,
            row: 1,
            col: 0
        })
    );
    // An unstable mode out of reach, and a mode on the boundary that costs nothing.
    let unreachable = Vector2::new(1.0, 0.0);
    for system in [
        Matrix2::new(0.5, 0.0, 0.0, 1.5),
        Matrix2::new(0.5, 0.0, 0.0, 1.0),
    ] {
        let found = dlqr(&system, &unreachable, &weights);
        assert!(
            matches!(found, Err(DesignError::NotStabilisable)),
            "{found:?}"
        );
    }
    let found = lqr(&Matrix2::new(2.0, 0.0, 0.0, -1.0), &b, &weights);
    assert_eq!(found, Err(DesignError::NotStabilisable));
    // A mode on the boundary that costs nothing, once and twice.
    let free = Weights::diagonal([0.0, 0.0], [1.0]);
    let turning = Matrix2::new(0.0, 1.0, -1.0, 0.0);
    for found in [
        dlqr(&a, &b, &free),
        dlqr(&turning, &b, &free),
        lqr(&turning, &b, &free),
        lqr(&Matrix2::new(0.0, 1.0, 0.0, 0.0), &b, &free),
    ] {
        assert!(
            matches!(found, Err(DesignError::NoStabilisingSolution { .. })),
            "{found:?}"
        );
    }
}

/// Weights of which no number can hold the gain are to blame themselves: the input does reach every mode.
#[test]
fn weights_too_far_apart_are_said_to_be_so() {
    let a = Matrix2::new(1.0, 0.1, 0.2, 1.0);
    let b = Vector2::new(0.0, 0.1);
    for (q, r) in [(1e300, 1e-300), (1e200, 1e-200), (1.0, 1e-307)] {
        let weights = Weights::diagonal([q, q], [r]);
        for solve in [dlqr, lqr] {
            let found = solve(&a, &b, &weights);
            assert_ne!(found, Err(DesignError::NotStabilisable), "{q} {r}");
        }
    }
}

/// Orthogonal coordinates in which no entry is 0.
fn turn(seed: u32) -> SMatrix<f64, 3, 3> {
    let mut state = seed;
    let random = SMatrix::<f64, 3, 3>::from_fn(|_, _| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) - 0.5
    });
    random.qr().q()
}

#[test]
fn a_mode_that_only_rounding_reaches_or_weighs_is_not_used() {
    let eye = SMatrix::<f64, 3, 3>::identity();
    for seed in 0..50 {
        let t = turn(seed);
        let system = |poles: [f64; 3], reach: [f64; 3]| {
            let a = t * SMatrix::from_diagonal(&poles.into()) * t.transpose();
            (a, t * SMatrix::<f64, 3, 1>::from(reach))
        };
        let (a, b) = system([-0.5, 0.3, 1.2], [1.0, 0.7, 0.0]);
        let weights = Weights::new(eye, Matrix1::new(1.0));
        for solve in [dlqr, lqr] {
            assert_eq!(
                solve(&a, &b, &weights),
                Err(DesignError::NotStabilisable),
                "{seed}"
            );
        }
        let seen = t * SMatrix::from_diagonal(&[1.0, 1.0, 0.0].into()) * t.transpose();
        for (discrete, pole) in [(true, 1.0), (true, -1.0), (false, 0.0)] {
            let (a, b) = system([-0.5, 0.3, pole], [1.0, 0.7, 0.4]);
            let solve = if discrete { dlqr } else { lqr };
            let found = solve(
                &a,
                &b,
                &Weights::new((seen + seen.transpose()) * 0.5, Matrix1::new(1.0)),
            );
            assert!(
                matches!(found, Err(DesignError::NoStabilisingSolution { .. })),
                "{seed} {pole}: {found:?}"
            );
            assert!(
                solve(&a, &b, &weights).is_ok(),
                "with a weight on it there is one"
            );
        }
    }
}

#[test]
fn an_integral_without_weight_is_refused() {
    // The integral of the first state of a double integrator, without weight.
    let a = SMatrix::<f64, 3, 3>::new(0.0, 1.0, 0.0, 2.0, -0.1, 0.0, 1.0, 0.0, 0.0);
    let b = SMatrix::<f64, 3, 1>::new(0.0, 5.0, 0.0);
    let found = lqr(&a, &b, &Weights::diagonal([5.0, 0.1, 0.0], [0.1]));
    assert!(
        matches!(found, Err(DesignError::NoStabilisingSolution { .. })),
        "{found:?}"
    );
    let tiny = lqr(&a, &b, &Weights::diagonal([5.0, 0.1, 1e-6], [0.1])).expect("has a weight");
    assert!(
        (tiny.gain[2] - 1e-5f64.sqrt()).abs() < 1e-12,
        "K of the integral is sqrt(q / r)"
    );
}

proptest! {
    #[test]
    fn solutions_solve_stabilise_and_cost_nothing_negative(
        entries in proptest::array::uniform32(-3.0f64..3.0),
        r in 1e-2f64..1e2,
        discrete: bool,
    ) {
        let a = SMatrix::<f64, 4, 4>::from_row_slice(&entries[..16]);
        let b = SMatrix::<f64, 4, 1>::from_row_slice(&entries[16..20]);
        let c = SMatrix::<f64, 3, 4>::from_row_slice(&entries[20..]);
        let weights = Weights::new(c.transpose() * c, Matrix1::new(r));
        let solve = if discrete { riccati::discrete } else { riccati::continuous };
        // A random pair is controllable and observable, though now and then only just.
        if let Ok(s) = solve(&a, &b, &weights) {
            prop_assert!(s.residual <= 1e-10, "promised by the documentation");
            prop_assert!((s.x - s.x.transpose()).norm() == 0.0);
            let closed_loop = a - b * s.gain;
            let stable = if discrete { is_schur(&closed_loop) } else { is_hurwitz(&closed_loop) };
            prop_assert!(stable);
            let smallest = s.x.symmetric_eigenvalues().min();
            prop_assert!(smallest > -1e-8 * s.x.norm(), "X has the eigenvalue {smallest:e}");
        }
    }

    #[test]
    fn any_input_ends_without_a_panic(entries in proptest::array::uniform9(proptest::num::f64::ANY),
        r in proptest::num::f64::ANY) {
        let a = Matrix2::from_row_slice(&entries[..4]);
        let b = Vector2::from_row_slice(&entries[4..6]);
        let q = Matrix2::new(entries[6], entries[7], entries[7], entries[8]);
        let weights = Weights::new(q, Matrix1::new(r));
        for s in [riccati::discrete(&a, &b, &weights), riccati::continuous(&a, &b, &weights)].into_iter().flatten() {
            prop_assert!(s.gain.iter().chain(s.x.iter()).all(|v| v.is_finite()));
        }
    }
}
