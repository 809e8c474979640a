//! The regulator equation's series against SymPy, against its own equation, and where it has no answer.

#[path = "data/steady_motion.rs"]
mod answers;

use furuta_ctrl::design::regulator_equation::arm_angle;
use furuta_ctrl::design::{RegulatorError, SteadyMotion};
use furuta_model::params::Coefficients;
use furuta_model::{Rig, Scalar};
use proptest::prelude::*;

fn coefficients(rig: &str) -> Coefficients<f64> {
    Rig::builtin(rig).expect("built in").params.coefficients()
}

fn planar() -> Coefficients<f64> {
    Coefficients {
        swing: 0.0,
        ..coefficients("ramos-velasco")
    }
}

#[test]
fn every_coefficient_is_sympys() {
    let cases = [
        (coefficients("qube-servo-2"), 3.0, &answers::QUBE),
        (planar(), 1.0, &answers::RAMOS_VELASCO_PLANAR),
        (coefficients("ramos-velasco"), 1.0, &answers::RAMOS_VELASCO),
    ];
    for (c, lambda, answers) in cases {
        for order in 1..=7 {
            let steady = SteadyMotion::solve(&c, lambda, order).expect("solvable");
            for (i, j, angle, command) in answers {
                let kept = if i + j <= order { 1.0 } else { 0.0 };
                // Of some hundred products that cancel: rounding is that of the degree's largest coefficient.
                let largest = answers
                    .iter()
                    .filter(|a| a.0 + a.1 == i + j)
                    .fold(1.0, |m: f64, a| m.max(a.2.abs()).max(a.3.abs()));
                let angle = steady.angle.coefficient(*i, *j) - kept * angle;
                let command = steady.command.coefficient(*i, *j) - kept * command;
                assert!(angle.abs() <= 1e-13 * largest, "w1^{i} w2^{j}: {angle}");
                assert!(command.abs() <= 1e-13 * largest, "w1^{i} w2^{j}: {command}");
            }
        }
    }
}

#[test]
fn single_precision_solves_it_too() {
    let steady = SteadyMotion::<f32>::solve(&planar().cast(), 1.0, 7).expect("solvable");
    for (i, j, angle, command) in &answers::RAMOS_VELASCO_PLANAR {
        let (a, c) = (
            f64::from(steady.angle.coefficient(*i, *j)),
            f64::from(steady.command.coefficient(*i, *j)),
        );
        // 24 bits; products with factors to 50.
        assert!(
            (a - angle).abs() < 1e-5 * (1.0 + angle.abs()),
            "{a} {angle}"
        );
        assert!(
            (c - command).abs() < 1e-4 * (1.0 + command.abs()),
            "{c} {command}"
        );
    }
}

proptest! {
    /// Substituted into the equation, the series of order n leaves a term of degree n + 1 or n + 2 (only odd ones
    /// exist): for small amplitudes half the amplitude leaves less than 2^-(n+1) of it (relative to the first term,
    /// which halves as well).
    #[test]
    fn the_residual_falls_with_its_order(
        which in 0..4_usize, lambda in 0.3_f64..8.0, order in 1..=7_usize,
    ) {
        let rig = ["fong2014-emecs", "shahzad2022-srv02", "ramos-velasco", "qube-servo-2"][which];
        let c = coefficients(rig);
        let steady = SteadyMotion::solve(&c, lambda, order).expect("solvable");
        // Well within the amplitude at which the centrifugal moment lets the arm's motion cease to exist: see
        // largest_amplitude.
        let small = 0.1 * lambda * core::f64::consts::FRAC_PI_2 * c.coupling
            / ((c.pendulum * lambda * lambda + c.weight) * c.swing).sqrt();
        let small = small.min(0.1);
        let (far, near) = (steady.residual(&c, small), steady.residual(&c, small / 2.0));
        let odd = order.div_ceil(2) * 2;
        prop_assert!(far < 0.1, "{far}");
        prop_assert!(near <= 1.3 * far / f64::from(1 << odd) + 1e-12, "{rig} {lambda} {order}: {far} {near}");
    }
}

#[test]
fn what_cannot_be_solved_says_why() {
    let c = planar();
    let solve = |c: &Coefficients<f64>, lambda, order| SteadyMotion::solve(c, lambda, order);
    for order in [0, 8, usize::MAX] {
        assert_eq!(solve(&c, 1.0, order), Err(RegulatorError::Order { order }));
    }
    for lambda in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(
            solve(&c, lambda, 3),
            Err(RegulatorError::Frequency { value: lambda })
        );
    }
    assert!(solve(&c, f64::NAN, 3).is_err());
    let no_arm = Coefficients { coupling: 0.0, ..c };
    assert!(matches!(
        solve(&no_arm, 1.0, 3),
        Err(RegulatorError::NotFinite { .. })
    ));
    // Equations of one's own: an even term, and friction of the arm, which no degree by degree solution has.
    let even = arm_angle(1.0, 3, |x, _| x.alpha * x.alpha);
    assert_eq!(
        even,
        Err(RegulatorError::Even {
            i: 0,
            j: 2,
            value: 1.0
        })
    );
    let damped = arm_angle(1.0, 3, |x, _| x.alpha - x.theta_dot.scale(0.3));
    assert!(matches!(
        damped,
        Err(RegulatorError::Residual { degree: 1, .. })
    ));
}
