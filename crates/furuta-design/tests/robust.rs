//! Robust regulators: against the LQR where both must agree, and against what they promise for every rig within the
//! range.

use furuta_ctrl::design::{Weights, balance_weights, dlqr, is_hurwitz, lqr, lyapunov, poles};
use furuta_design::polytope::{LENGTHS_AND_MASS, Uncertain, polytope};
use furuta_design::robust::{RobustError, Time, robust_lqr};
use furuta_design::robust_rig::{RobustRigError, robust_rig};
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Params, Rig, State, linearize, params};
use nalgebra::{Matrix1, Matrix2, SMatrix, SVector, Vector2};

type Vertices = Vec<(SMatrix<f64, 4, 4>, SMatrix<f64, 4, 1>)>;

fn vertices(rig: &Rig, share: f64) -> Vertices {
    let off = LENGTHS_AND_MASS.map(|key| Uncertain { key, share });
    let found = polytope(&rig.params, &off).expect("not too wide");
    found.control_points.iter().map(|m| (m.a, m.b)).collect()
}

/// With one vertex the robust regulator is the LQR, whatever the starts.
#[test]
fn one_vertex_is_the_lqr() {
    for rig in Rig::VOLTAGE.iter().filter_map(|name| Rig::builtin(name)) {
        let up = linearize(&rig.nominal_plant(), State::upright(), 0.0);
        let weights = balance_weights(&rig.params);
        let starts = SMatrix::from_diagonal(&[0.1, 1.0, 10.0, 3.0].into());
        let sampled = zero_order_hold(&up.a, &up.b, 0.01);
        for (time, system, expected) in [
            (Time::Continuous, (up.a, up.b), lqr(&up.a, &up.b, &weights)),
            (
                Time::Discrete,
                sampled,
                dlqr(&sampled.0, &sampled.1, &weights),
            ),
        ] {
            let expected = expected.expect("has a solution");
            let found = robust_lqr(time, &[system], &weights, &starts).expect("has a solution");
            let least = (expected.cost * starts).trace();
            assert!(
                (found.guaranteed / least - 1.0).abs() < 1e-7,
                "{} {time:?}: {} {least}",
                rig.name,
                found.guaranteed
            );
            // The cost is flat at its optimum: 1e-8 of it is 1e-4 of the gain.
            let off = (found.gain - expected.gain).norm() / expected.gain.norm();
            assert!(off < 1e-3, "{} {time:?}: {off}", rig.name);
        }
    }
}

/// Draws within the range, inside and at its ends: each is stabilised, and none costs more than was guaranteed.
#[test]
fn the_guarantee_holds_for_rigs_within_the_range() {
    const SHARE: f64 = 0.2;
    for rig in Rig::VOLTAGE.iter().filter_map(|name| Rig::builtin(name)) {
        let weights = balance_weights(&rig.params);
        let starts = SMatrix::identity();
        let found = robust_lqr(Time::Continuous, &vertices(&rig, SHARE), &weights, &starts)
            .unwrap_or_else(|e| panic!("{}: {e}", rig.name));
        assert!(found.gap < 1e-7 && found.gap >= 0.0, "{}", found.gap);
        let cost = weights.q + found.gain.transpose() * weights.r * found.gain;
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 24)
        };
        let mut nearest: f64 = 0.0;
        for draw in 0..500 {
            let mut p = rig.params.to_array();
            for (range, value) in params::RANGES.iter().zip(&mut p) {
                if LENGTHS_AND_MASS.contains(&range.key) {
                    let at = 2.0 * random() - 1.0;
                    // Half of the draws at the corners.
                    *value *= 1.0 + SHARE * if draw % 2 == 0 { at.signum() } else { at };
                }
            }
            let mut other = rig.clone();
            other.params = Params::from_array(rig.params.motor.actuation, p);
            let up = linearize(&other.nominal_plant(), State::upright(), 0.0);
            let closed = up.a - up.b * found.gain;
            let spent = lyapunov::continuous(&closed, &cost).expect("stable");
            let worst = (found.cost - spent).symmetric_eigenvalues().min();
            assert!(worst > -1e-6 * found.cost.norm(), "{}: {worst}", rig.name);
            nearest = nearest.max((spent * starts).trace() / found.guaranteed);
        }
        println!(
            "{}: the costliest draw reaches {nearest:.3} of the bound",
            rig.name
        );
        assert!(nearest < 1.0);
    }
}

/// dx/dt = x + b u with b = 1 or -1 has no gain at all; from 0.1 to 1 it has.
#[test]
fn what_cannot_be_stabilised_is_refused() {
    let one = Matrix1::new(1.0);
    let weights = Weights::diagonal([1.0], [1.0]);
    let vertices = |low: f64| [(one, Matrix1::new(low)), (one, one)];
    for time in [Time::Continuous, Time::Discrete] {
        // The mean input is 0 for -1, and small and of the wrong sign's neighbour for -0.5.
        assert!(matches!(
            robust_lqr(time, &vertices(-1.0), &weights, &one),
            Err(RobustError::Nominal(_))
        ));
        let found = robust_lqr(time, &vertices(-0.5), &weights, &one);
        assert!(
            matches!(
                found,
                Err(RobustError::NotQuadraticallyStabilisable { vertices: 2, reached })
                    if (reached - 1.0 / 3.0).abs() < 0.05
            ),
            "{time:?}: {found:?}"
        );
        assert!(robust_lqr(time, &vertices(0.1), &weights, &one).is_ok());
    }
    // Each can be stabilised with the nominal gain, and the discrete condition asks for |1.9 - b k| < 1 at once: b k in
    // (0.9, 2.9).
    let fast = Matrix1::new(1.9);
    let span = |low: f64, high: f64| [(fast, Matrix1::new(low)), (fast, Matrix1::new(high))];
    assert!(robust_lqr(Time::Discrete, &span(1.0, 3.1), &weights, &one).is_ok());
    assert!(matches!(
        robust_lqr(Time::Discrete, &span(1.0, 3.3), &weights, &one),
        Err(RobustError::NotQuadraticallyStabilisable { .. })
    ));
}

/// Where the nominal regulator fails, the robust one is found from another start.
#[test]
fn the_nominal_gain_need_not_stabilise() {
    // A cheap gain on the mean of very different springs.
    let system = |spring: f64| (Matrix2::new(0.0, 1.0, spring, -0.1), Vector2::new(0.0, 1.0));
    let vertices = [system(-2.0), system(9.0)];
    let weights = Weights::diagonal([1e-3, 1e-3], [1.0]);
    let mean = system(3.5);
    let nominal = lqr(&mean.0, &mean.1, &weights).expect("has a solution");
    assert!(!is_hurwitz(&(vertices[1].0 - vertices[1].1 * nominal.gain)));
    let found = robust_lqr(Time::Continuous, &vertices, &weights, &Matrix2::identity())
        .expect("has a solution");
    for (a, b) in vertices {
        assert!(is_hurwitz(&(a - b * found.gain)));
    }
}

#[test]
fn a_cross_weight_counts() {
    let a = Matrix2::new(0.0, 1.0, 2.0, -0.3);
    let b = Vector2::new(0.0, 1.5);
    let weights = Weights::new(Matrix2::new(2.0, 0.3, 0.3, 1.0), Matrix1::new(0.5))
        .with_cross(Vector2::new(0.4, -0.2));
    let expected = lqr(&a, &b, &weights).expect("has a solution");
    let found = robust_lqr(Time::Continuous, &[(a, b)], &weights, &Matrix2::identity())
        .expect("has a solution");
    assert!((found.guaranteed / expected.cost.trace() - 1.0).abs() < 1e-7);
    assert!((found.gain - expected.gain).norm() < 1e-3 * expected.gain.norm());
}

#[test]
fn errors_name_the_cause() {
    let one = Matrix1::new(1.0);
    let weights = Weights::diagonal([1.0], [1.0]);
    let solve = |vertices: &[(Matrix1<f64>, Matrix1<f64>)], starts| {
        robust_lqr(Time::Continuous, vertices, &weights, &starts)
    };
    assert_eq!(solve(&[], one), Err(RobustError::Empty));
    assert_eq!(solve(&[(one, one)], -one), Err(RobustError::Starts));
    assert_eq!(
        solve(&[(one, one), (one, Matrix1::new(f64::INFINITY))], one),
        Err(RobustError::NotFinite {
            what: "vertex 1".to_owned()
        })
    );
}

/// Slowest pole of the worst corner, rad/s: what the guarantee buys, on every rig.
#[test]
fn the_worst_corner_of_each_rig() {
    for rig in Rig::VOLTAGE.iter().filter_map(|name| Rig::builtin(name)) {
        let weights = balance_weights(&rig.params);
        let up = linearize(&rig.nominal_plant(), State::upright(), 0.0);
        let nominal = lqr(&up.a, &up.b, &weights).expect("has a solution").gain;
        let robust = robust_lqr(
            Time::Continuous,
            &vertices(&rig, 0.2),
            &weights,
            &SMatrix::identity(),
        )
        .expect("has a solution")
        .gain;
        let off = LENGTHS_AND_MASS.map(|key| Uncertain { key, share: 0.2 });
        let corners = polytope(&rig.params, &off).expect("not too wide").corners;
        let slowest = |k: &SMatrix<f64, 1, 4>| {
            corners
                .iter()
                .filter_map(|(_, m)| poles(&(m.a - SVector::<f64, 4>::from(m.b) * k)))
                .flatten()
                .map(|p| p.re)
                .fold(f64::NEG_INFINITY, f64::max)
        };
        println!(
            "{}: {:.3} nominal, {:.3} robust; K {nominal} {robust}",
            rig.name,
            slowest(&nominal),
            slowest(&robust)
        );
        assert!(slowest(&robust) < 0.0);
    }
}

/// The largest range that a refusal names can be had, on the rig with the smallest range.
#[test]
fn a_refusal_names_what_is_possible() {
    let rig = Rig::builtin("ramos-velasco").expect("built in");
    let weights = balance_weights(&rig.params);
    let refused = robust_rig(&rig, &LENGTHS_AND_MASS, 0.6, &weights);
    let Err(RobustRigError::NoCommonLyapunovFunction { spread, largest }) = refused else {
        panic!("{refused:?}");
    };
    assert!(spread == 0.6 && largest > 0.4 && largest < 0.5, "{largest}");
    for share in [0.35, 0.9 * largest, largest] {
        let found = robust_rig(&rig, &LENGTHS_AND_MASS, share, &weights).expect("possible");
        assert!(found.slowest(&found.regulator.gain) < 0.0);
    }
}
