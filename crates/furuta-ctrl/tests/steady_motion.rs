//! The regulator equation's series against SymPy, against its own equation, and where it has no answer.

#[path = "data/steady_motion.rs"]
mod answers;

use furuta_ctrl::design::regulator_equation::arm_angle;
use furuta_ctrl::design::{RegulatorError, SteadyMotion};
use furuta_model::params::Coefficients;
use furuta_model::series::{TERMS, terms};
use furuta_model::{Rig, Scalar, State, zero_dynamics};
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

/// What a motion of any order misses the equation by, at this amplitude, as a part of the arm's largest acceleration:
/// the arm's angle alone is taken from the series, its second rate is that of a cosine sum through 64 places of a turn,
/// exact for a polynomial of such an order, and the model's accelerations are put in by the equations of motion.
fn missed<const N: usize>(
    steady: &SteadyMotion<f64, N>,
    c: &Coefficients<f64>,
    amplitude: f64,
) -> f64 {
    const PLACES: usize = 64;
    let turn = |k: usize| core::f64::consts::TAU * (k % PLACES) as f64 / PLACES as f64;
    let at = |k: usize| [amplitude * turn(k).cos(), amplitude * turn(k).sin()];
    let angles: Vec<f64> = (0..PLACES)
        .map(|k| steady.angle.at(at(k)[0], at(k)[1]))
        .collect();
    // w1 = r cos p, w2 = r sin p with p falling: w1' = lambda w2 means p' = -lambda.
    let series = |k: usize, order: i32| -> f64 {
        let mut sum = 0.0;
        for m in 1..PLACES / 2 {
            let (mut a, mut b) = (0.0, 0.0);
            for (i, theta) in angles.iter().enumerate() {
                a += theta * turn(i * m).cos();
                b += theta * turn(i * m).sin();
            }
            let (cos, sin) = (turn(k * m).cos(), turn(k * m).sin());
            let rate = -(m as f64) * steady.lambda;
            sum += match order {
                1 => rate * (b * cos - a * sin),
                _ => -rate * rate * (a * cos + b * sin),
            };
        }
        sum * 2.0 / PLACES as f64
    };
    let (mut worst, mut largest) = (0.0, 0.0);
    for (k, theta) in angles.iter().enumerate() {
        let [w1, w2] = at(k);
        let x = State::new(*theta, w2, series(k, 1), -steady.lambda * w1);
        let alpha_ddot = -steady.lambda * steady.lambda * w2;
        // The command with which the pendulum does what it should, and what the arm does under it.
        let u = zero_dynamics::command(c, &x, alpha_ddot);
        let [arm, pendulum] = furuta_model::dynamics::acceleration(c, &x, u);
        assert!((pendulum - alpha_ddot).abs() < 1e-9 * (1.0 + alpha_ddot.abs()));
        worst = f64::max(worst, (series(k, 2) - arm).abs());
        largest = f64::max(largest, arm.abs());
    }
    worst / largest
}

/// Orders 3 to 15, each better than the one before, by an evaluation that shares nothing with the solution but the
/// coefficients of the arm's angle.
#[test]
fn the_residual_falls_with_every_order() {
    for (rig, lambda, amplitude) in [
        ("qube-servo-2", 4.0, 0.03),
        ("shahzad2022-srv02", 4.0, 0.1),
        ("ramos-velasco", 3.0, 0.1),
        ("fong2014-emecs", 3.0, 0.1),
    ] {
        let c = coefficients(rig);
        let of = |order: usize| {
            let steady = SteadyMotion::<f64, { terms(15) }>::to_order(&c, lambda, order);
            missed(&steady.expect("solvable"), &c, amplitude)
        };
        let found: Vec<f64> = (3..=15).step_by(2).map(of).collect();
        println!("{rig}, {lambda} rad/s, {amplitude} rad: {found:?}");
        for pair in found.windows(2) {
            assert!(
                pair[1] < 0.7 * pair[0] || pair[1] < 1e-11,
                "{rig}: {found:?}"
            );
        }
        assert!(found[4] < 0.1 * found[0], "{rig}: {found:?}");
    }
}

/// More capacity changes no coefficient: to the bit, those of the orders that both have.
#[test]
fn capacity_changes_nothing() {
    let c = coefficients("qube-servo-2");
    let few = SteadyMotion::solve(&c, 3.0, 7).expect("solvable");
    let many = SteadyMotion::<f64, { terms(11) }>::to_order(&c, 3.0, 7).expect("solvable");
    for i in 0..=11 {
        for j in 0..=11 {
            assert_eq!(few.angle.coefficient(i, j), many.angle.coefficient(i, j));
            assert_eq!(
                few.command.coefficient(i, j),
                many.command.coefficient(i, j)
            );
        }
    }
    let beyond = SteadyMotion::<f64, { terms(11) }>::to_order(&c, 3.0, 13);
    let refused = RegulatorError::Order {
        order: 13,
        capacity: 11,
    };
    assert_eq!(beyond, Err(refused));
}

#[test]
fn what_cannot_be_solved_says_why() {
    let c = planar();
    let solve = |c: &Coefficients<f64>, lambda, order| SteadyMotion::solve(c, lambda, order);
    for order in [0, 8, usize::MAX] {
        let refused = RegulatorError::Order { order, capacity: 7 };
        assert_eq!(solve(&c, 1.0, order), Err(refused));
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
    let even = arm_angle::<f64, TERMS>(1.0, 3, |x, _| x.alpha * x.alpha);
    assert_eq!(
        even,
        Err(RegulatorError::Even {
            i: 0,
            j: 2,
            value: 1.0
        })
    );
    let damped = arm_angle::<f64, TERMS>(1.0, 3, |x, _| x.alpha - x.theta_dot.scale(0.3));
    assert!(matches!(
        damped,
        Err(RegulatorError::Residual { degree: 1, .. })
    ));
}
