//! Pendulums on an arm that moves as measured, whatever moves it: the arm's course is a formula, the pendulum on it is
//! integrated here without the library's plant, both are read by encoders, and the command's column is of another rig.

use std::path::Path;

use crate::common::patient;
use furuta_ident::diagnose::{Diagnosis, Options, Outcome, Request, Verdict, diagnose_with};
use furuta_ident::recording::Recording;
use furuta_ident::selection::select;
use furuta_ident::validate::{self, validate_with};
use furuta_ident::{Pendulum, calibrate};
use furuta_model::{Effect, Rig};

/// Step of the integration, s: RK4 leaves less than a thousandth of a count.
const STEP: f64 = 5e-4;
/// Time between two samples, s.
const PERIOD: f64 = 0.002;

/// Torques on the pendulum that its sheet does not have, N m s²/rad² and N m/rad.
#[derive(Clone, Copy, Default)]
struct Hidden {
    quadratic: f64,
    spring: f64,
}

/// Angle, speed and acceleration of the arm at `t`: four sines whose frequencies have no common period.
fn arm(t: f64, seed: f64) -> [f64; 3] {
    let sines = [(0.5, 3.1), (0.3, 5.7), (0.15, 9.3), (0.05, 14.9)];
    let mut at = [0.0; 3];
    for (i, (size, w)) in sines.into_iter().enumerate() {
        let (sin, cos) = (w * t + seed * i as f64).sin_cos();
        for (at, value) in at.iter_mut().zip([sin, w * cos, -w * w * sin]) {
            *at += size * value;
        }
    }
    at
}

/// `J alpha'' = C cos(alpha) theta'' + S sin(alpha) cos(alpha) theta'² + W sin(alpha) - b alpha' + torques`.
fn slopes(rig: &Rig, hidden: Hidden, x: [f64; 2], [_, speed, a]: [f64; 3]) -> [f64; 2] {
    let p = &rig.params.pendulum;
    let square = p.mass * p.com * p.com;
    let [alpha, rate] = x;
    let (sin, cos) = alpha.sin_cos();
    let torque = p.mass * rig.params.arm.length * p.com * cos * a
        + (square + p.inertia_transverse - p.inertia_axial) * sin * cos * speed * speed
        + p.mass * rig.params.gravity * p.com * sin
        - p.viscous * rate
        - hidden.quadratic * rate * rate.abs()
        - hidden.spring * (alpha - std::f64::consts::PI);
    [rate, torque / (p.inertia + square)]
}

/// Ten seconds of it.
fn record(rig: &Rig, hidden: Hidden, seed: f64) -> Recording {
    let parts = (PERIOD / STEP).round() as usize;
    let mut x = [std::f64::consts::PI, 0.0];
    let mut samples = Vec::new();
    for k in 0..5000 {
        let t = PERIOD * f64::from(k);
        let [theta, alpha] = rig.sensors.quantised([arm(t, seed)[0] + 0.4 * seed, x[0]]);
        samples.push([t, 3.0 * (7.0 * t).sin(), theta, alpha]);
        for part in 0..parts {
            let t = t + STEP * part as f64;
            let slopes = |x, t| slopes(rig, hidden, x, arm(t, seed));
            let add = |d: [f64; 2], by: f64| [x[0] + by * d[0], x[1] + by * d[1]];
            let k1 = slopes(x, t);
            let k2 = slopes(add(k1, 0.5 * STEP), t + 0.5 * STEP);
            let k3 = slopes(add(k2, 0.5 * STEP), t + 0.5 * STEP);
            let k4 = slopes(add(k3, STEP), t + STEP);
            let mean = |i: usize| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0;
            x = add([mean(0), mean(1)], STEP);
        }
    }
    let (recording, _) = Recording::from_samples(&format!("run-{seed}"), samples).expect("sound");
    recording
}

fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

/// Its sheet as a ruler and a balance leave it, with a cable and a delay that nothing is to be said of.
fn sheet() -> Rig {
    let mut rig = qube();
    rig.params.arm.length *= 1.02;
    rig.params.pendulum.inertia *= 0.95;
    rig.params.pendulum.viscous *= 1.5;
    rig.effects = vec![
        Effect::new("arm.spring", &[0.01, 0.2]).expect("in the catalogue"),
        Effect::new("motor.delay", &[0.05]).expect("in the catalogue"),
    ];
    rig
}

fn diagnosed(request: &Request<'_>) -> Outcome {
    let options = Options {
        pendulum: Pendulum::Driven,
        ..patient()
    };
    let outcome = diagnose_with(request, options, &|_| ()).expect("good recordings");
    println!("{:#?}", outcome.diagnosis.effects);
    outcome
}

/// Of two recordings, by the sheet, verified on a third.
fn found(hidden: Hidden) -> Outcome {
    let [first, second, unseen] = [1.0, 2.0, 3.0].map(|seed| record(&qube(), hidden, seed));
    diagnosed(&Request {
        recordings: &[first, second],
        rig: &sheet(),
        verify: &[unseen],
    })
}

/// What is wrong with the command does not matter where the arm moves as measured; what is wrong with theta does.
#[test]
fn the_command_alone_may_be_wrong() {
    let sound = record(&qube(), Hidden::default(), 1.0);
    let chosen = |turn: f64, pendulum| {
        let angles = sound.theta.iter().zip(&sound.alpha);
        let samples = (sound.t.iter().zip(&sound.u).zip(angles))
            .map(|((t, u), (theta, alpha))| [*t, *u, turn * theta, *alpha]);
        let read = Recording::from_samples("run", samples).expect("sound");
        select(vec![read], Vec::new(), &qube(), false, pendulum)
    };
    assert_eq!(chosen(1.0, Pendulum::Driven).expect("used").notices, []);
    let error = chosen(-1.0, Pendulum::Driven)
        .expect_err("refused")
        .to_string();
    assert!(error.contains("counted the other way"), "{error}");
}

fn ids(d: &Diagnosis) -> Vec<&str> {
    d.effects.iter().map(|e| e.id.as_str()).collect()
}

/// No cable, no motor and no command of another rig accuses a sound pendulum; its numbers are found, and the rig file
/// keeps the others.
#[test]
fn a_sound_pendulum_is_not_accused() {
    let outcome = found(Hidden::default());
    let d = &outcome.diagnosis;
    assert_eq!(d.verdict, Verdict::ParametersOnly, "{}", d.sentence());
    let length = &d.parameters["arm.length"];
    assert!(
        (length.fitted - qube().params.arm.length).abs() < 4.0 * length.std,
        "{length:?}"
    );
    assert!(length.std < 1e-3 * length.fitted, "{length:?}");
    let (sheet, repaired) = (sheet(), &outcome.repaired);
    assert_eq!(repaired.effects, sheet.effects);
    assert_eq!(repaired.params.motor, sheet.params.motor);
    assert_eq!(repaired.params.arm.inertia, sheet.params.arm.inertia);
    // The arm follows itself, which tells nothing.
    assert!(d.gap.recalibrated.theta.is_nan() && d.verification.len() == 1);
    assert!(
        d.limits
            .iter()
            .all(|l| !l.id.starts_with("arm.") || l.id == "arm.tilt")
    );
}

/// Torques on the pendulum are named, with their size.
#[test]
fn torques_on_the_pendulum_are_found() {
    let drag = found(Hidden {
        quadratic: 2e-5,
        ..Hidden::default()
    });
    let d = &drag.diagnosis;
    assert_eq!(
        (d.verdict, ids(d)),
        (Verdict::MissingEffects, vec!["pendulum.quadratic"])
    );
    let estimate = &d.effects[0].parameters["coefficient"];
    assert!(
        (estimate.value - 2e-5).abs() < 4.0 * estimate.std,
        "{estimate:?}"
    );
    let spring = found(Hidden {
        spring: 2e-3,
        ..Hidden::default()
    });
    let d = &spring.diagnosis;
    assert_eq!(
        (d.verdict, ids(d)),
        (Verdict::MissingEffects, vec!["pendulum.spring"])
    );
}

/// A kit whose stepper motor has a driver's limits and delays: with the arm's motion as measured, not as commanded, the
/// pendulum is predicted within 0.02 rad over half a second in the half of the run that the fit has not seen. As
/// commanded it is not.
#[test]
fn the_pendulum_of_a_stepper_kit_is_predicted() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/stepper-kit");
    let sheet = Rig::load(&folder.join("rig.toml").to_string_lossy()).expect("a valid rig file");
    let run = Recording::load(folder.join("run-0-swingup.csv")).expect("a readable recording");
    let [first, second] = [(0.0, 30.0), (30.0, 60.0)].map(|(a, b)| run.span(a, b).expect("half"));
    let error = |pendulum| {
        let options = calibrate::Options {
            pendulum,
            ..calibrate::Options::default()
        };
        let outcome = calibrate::calibrate(std::slice::from_ref(&first), &sheet, &options)
            .expect("good recordings");
        println!("{}", outcome.calibration.summary());
        let validation = validate_with(
            std::slice::from_ref(&second),
            &outcome.rig,
            validate::Options {
                pendulum,
                ..validate::Options::default()
            },
        )
        .expect("good recordings");
        println!("{}", validation.summary());
        validation.channels.last().expect("alpha").rms
    };
    assert!(error(Pendulum::Driven) < 0.02);
}

/// The pendulum of a real QUBE on an arm that a cable holds: refitted alone it is predicted better over two whole
/// chirps that the search has not seen than by the repaired model of the whole rig (0.0070 rad).
#[test]
fn the_pendulum_of_a_real_qube_is_predicted() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/qube-servo-2");
    let sheet = Rig::load(&folder.join("rig.toml").to_string_lossy()).expect("a valid rig file");
    let [seen, unseen] = [1, 5].map(|run| {
        ["plus", "minus"].map(|sign| {
            let file = folder.join(format!("chirp-{sign}-{run}.csv"));
            Recording::load(file).expect("a readable recording")
        })
    });
    let request = Request {
        recordings: &seen,
        rig: &sheet,
        verify: &unseen,
    };
    let d = diagnosed(&request).diagnosis;
    for row in &d.verification {
        println!("{row:?}");
        assert!(row.repaired < 0.006, "{row:?}");
    }
    assert_eq!(d.verification.len(), 2);
}
