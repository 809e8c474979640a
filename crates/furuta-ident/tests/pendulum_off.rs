//! Recordings of the arm alone (the pendulum taken off or locked), and of the pendulum alone (the arm held).
//!
//! The plant is not the library's: one equation of motion, `J theta'' = drive u - damping theta' - torque` or that of a
//! plane pendulum, integrated in steps of 0.1 ms.

use std::f64::consts::TAU;

use crate::common::patient;
use furuta_ident::diagnose::{Options, Outcome, Request, Verdict, diagnose_with};
use furuta_ident::recording::Recording;
use furuta_ident::{Insufficient, Pendulum, calibrate, validate};
use furuta_model::{Rig, State};

/// A rig file judged by recordings in this state.
fn judged_in(pendulum: Pendulum, recordings: &[Recording], rig: &Rig) -> validate::Validation {
    let options = validate::Options {
        pendulum,
        ..validate::Options::default()
    };
    validate::validate_with(recordings, rig, options).expect("enough")
}

/// What the arm's equation has beside motor and damping: torque [N m] by angle and speed.
type Torque = fn(f64, f64) -> f64;

const STEP: f64 = 1e-4;
const EVERY: usize = 20;

/// An arm driven by a sweep, its encoder counting from `zero`; what the pendulum's encoder says is no matter.
fn recorded(rig: &Rig, inertia: f64, gain: f64, torque: Torque, zero: f64) -> Recording {
    let (arm, m) = (&rig.params.arm, &rig.params.motor);
    let electric = m.torque_constant * m.gear_ratio * m.efficiency / m.resistance * gain;
    let damping = arm.viscous + electric * m.back_emf_constant * m.gear_ratio;
    let slope = |x: [f64; 2], u: f64| {
        let push = electric * m.amplifier_gain * u - damping * x[1] - torque(x[0], x[1]);
        [x[1], push / inertia]
    };
    let mut x = [0.3, 0.0];
    let mut samples = Vec::new();
    for k in 0..4000 {
        let t = STEP * (EVERY * k) as f64;
        let u = 2.0 * (TAU * t * (0.3 + 0.35 * t)).sin();
        let [theta, _] = rig.sensors.quantised([x[0] + zero, 0.0]);
        samples.push([t, u, theta, 0.7]);
        for _ in 0..EVERY {
            let at = |x: [f64; 2], d: [f64; 2], h: f64| [x[0] + h * d[0], x[1] + h * d[1]];
            let a = slope(x, u);
            let b = slope(at(x, a, 0.5 * STEP), u);
            let c = slope(at(x, b, 0.5 * STEP), u);
            let d = slope(at(x, c, STEP), u);
            let mean = |i: usize| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0;
            x = at(x, [mean(0), mean(1)], STEP);
        }
    }
    Recording::from_samples("arm", samples)
        .expect("a recording")
        .0
}

fn diagnosed(rig: &Rig, recordings: &[Recording], pendulum: Pendulum) -> Outcome {
    let request = Request {
        recordings,
        rig,
        verify: recordings,
    };
    let options = Options {
        pendulum,
        ..patient()
    };
    diagnose_with(&request, options, &|_| ()).expect("enough data")
}

fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

/// A motor 8 % stronger than its sheet is no missing effect, and no number of a pendulum that is not there moves.
#[test]
fn a_sound_arm_is_not_accused() {
    let rig = qube();
    let recordings =
        [0.0, 0.9].map(|zero| recorded(&rig, rig.params.arm.inertia, 1.08, |_, _| 0.0, zero));
    let outcome = diagnosed(&rig, &recordings, Pendulum::Removed);
    let d = &outcome.diagnosis;
    assert_eq!(d.verdict, Verdict::ParametersOnly, "{}", d.sentence());
    let motor = &d.parameters["motor.torque_constant"];
    // The back-EMF goes with the gain and the arm's damping is small beside it: the gain is known to a thousandth.
    assert!(
        (motor.fitted / motor.nominal - 1.08).abs() < 2e-3,
        "{motor:?}"
    );
    for key in [
        "pendulum.inertia",
        "pendulum.viscous",
        "arm.length",
        "arm.inertia",
    ] {
        assert!(!d.parameters[key].identifiable, "{key}");
        assert_eq!(d.parameters[key].fitted, d.parameters[key].nominal, "{key}");
    }
    assert!(d.gap.recalibrated.alpha.is_nan() && d.verification.len() == 2);
    assert!(d.notices.iter().any(|n| n.contains("the pendulum is off")));
    assert!(d.limits.iter().all(|l| !l.id.starts_with("pendulum.")));
}

/// A cable beside a locked pendulum: the inertia is that of both, and the torque is the true one.
#[test]
fn a_cable_is_found_on_the_arm_alone() {
    let rig = qube();
    let cable: Torque = |theta, _| 2e-3 * (theta - 0.2);
    let together =
        rig.params.arm.inertia + rig.params.pendulum.mass * rig.params.arm.length.powi(2);
    let cases = [
        (Pendulum::Removed, rig.params.arm.inertia),
        (
            Pendulum::Locked,
            together + rig.params.pendulum.inertia_axial,
        ),
    ];
    for (pendulum, inertia) in cases {
        let recordings = [0.0, -0.6].map(|zero| recorded(&rig, inertia, 1.0, cable, zero));
        let outcome = diagnosed(&rig, &recordings, pendulum);
        let d = &outcome.diagnosis;
        let ids: Vec<&str> = d.effects.iter().map(|e| e.id.as_str()).collect();
        assert_eq!(
            (d.verdict, ids),
            (Verdict::MissingEffects, vec!["arm.spring"]),
            "{}",
            d.sentence()
        );
        let found = &d.effects[0].parameters;
        // The sheet's inertia is the true one here, and with it the unit of all torques.
        assert!(
            (found["stiffness"].value / 2e-3 - 1.0).abs() < 5e-3,
            "{found:?}"
        );
        assert!((found["rest"].value - 0.2).abs() < 0.01, "{found:?}");
        // The second encoder read 0.6 rad less: at its zero the arm stood 0.6 rad further.
        assert!((d.zeros[1].theta - 0.6).abs() < 0.03, "{:?}", d.zeros);
        // What was found goes into the rig file with its pendulum.
        assert_eq!(outcome.repaired.params.pendulum, rig.params.pendulum);
        assert!(
            outcome
                .repaired
                .effects
                .iter()
                .any(|e| e.spec().id == "arm.spring")
        );
    }
}

/// The cable is taken off: what goes with it differs, what stays does not.
#[test]
fn a_cable_that_was_taken_off_differs() {
    let rig = qube();
    let with: Torque = |theta, speed| 2e-3 * (theta - 0.2) + 1.5e-3 * (speed / 1e-3).tanh();
    let without: Torque = |_, speed| 1.5e-3 * (speed / 1e-3).tanh();
    let inertia = rig.params.arm.inertia;
    // The motor is warmer without it, and the encoder was switched off between any two.
    let twice = |gain: f64, torque: Torque, zeros: [f64; 2]| {
        zeros.map(|zero| recorded(&rig, inertia, gain, torque, zero))
    };
    let states = [
        twice(1.0, with, [0.0, -0.6]),
        twice(0.97, without, [1.1, 0.4]),
    ];
    let request = Request {
        recordings: &states[0],
        rig: &rig,
        verify: &[],
    };
    let options = Options {
        pendulum: Pendulum::Removed,
        compare: &states[1],
        ..patient()
    };
    let found = diagnose_with(&request, options, &|_| ()).expect("enough data");
    let comparison = found.diagnosis.comparison.expect("recordings to compare");
    let said: Vec<(&str, &str, bool)> = (comparison.differences.iter())
        .map(|d| (d.id.as_str(), d.parameter.as_str(), d.differs))
        .collect();
    assert_eq!(
        said,
        [
            ("arm.coulomb", "torque", false),
            ("arm.spring", "stiffness", true)
        ],
        "{:?}",
        comparison.lines()
    );
    assert_eq!(comparison.named, ["arm.coulomb"]);
    let spring = &comparison.differences[1];
    assert!(
        (spring.here.value / 2e-3 - 1.0).abs() < 5e-3 && spring.there.value.abs() < 2e-5,
        "{spring:?}"
    );
}

/// Dry friction as well; a recording of a rig with its pendulum is not taken for one without.
#[test]
fn friction_is_found_and_a_dead_pendulum_is_not_overlooked() {
    let rig = qube();
    let friction: Torque = |_, speed| 1.5e-3 * (speed / 1e-3).tanh();
    let recording = recorded(&rig, rig.params.arm.inertia, 1.0, friction, 0.0);
    let d = diagnosed(&rig, std::slice::from_ref(&recording), Pendulum::Removed).diagnosis;
    let ids: Vec<&str> = d.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(ids, ["arm.coulomb"], "{}", d.sentence());
    let torque = d.effects[0].parameters["torque"].value;
    assert!((torque / 1.5e-3 - 1.0).abs() < 0.02, "{torque}");

    let read = vec![(recording, Vec::new())];
    let refused = furuta_ident::selection::select(read, Vec::new(), &rig, false, Pendulum::Swings)
        .unwrap_err();
    assert!(
        refused.to_string().contains("--pendulum removed or locked"),
        "{refused}"
    );
}

/// An arm that rests says nothing, whatever its pendulum's encoder does.
#[test]
fn an_arm_at_rest_is_refused() {
    let rig = qube();
    let still = (0..2000).map(|k| [0.002 * f64::from(k), 0.0, 0.1, (0.01 * f64::from(k)).sin()]);
    let (recording, _) = Recording::from_samples("still", still).expect("a recording");
    let request = Request {
        recordings: &[recording],
        rig: &rig,
        verify: &[],
    };
    let options = Options {
        pendulum: Pendulum::Locked,
        ..patient()
    };
    let refused = diagnose_with(&request, options, &|_| ()).unwrap_err();
    assert!(
        matches!(refused, Insufficient::NothingMoves { .. }),
        "{refused}"
    );
}

/// A free swing with the arm held: `J alpha'' = weight sin(alpha) - damping alpha' - friction sign(alpha')`, integrated
/// here. What theta reads is no matter.
fn swung(rig: &Rig, inertia: f64, damping: f64, friction: f64, begin: f64) -> Recording {
    let p = &rig.params.pendulum;
    let weight = p.mass * rig.params.gravity * p.com;
    // A jump cannot be integrated; a thousandth of the swing's speed.
    let slope = |x: [f64; 2]| {
        let torque = weight * x[0].sin() - damping * x[1] - friction * (x[1] / 5e-3).tanh();
        [x[1], torque / inertia]
    };
    let mut x = [begin, 0.0];
    let mut samples = Vec::new();
    for k in 0..4000 {
        let [_, alpha] = rig.sensors.quantised([0.0, x[0]]);
        samples.push([STEP * (EVERY * k) as f64, 0.0, 0.31, alpha]);
        for _ in 0..EVERY {
            let at = |d: [f64; 2], h: f64| [x[0] + h * d[0], x[1] + h * d[1]];
            let a = slope(x);
            let b = slope(at(a, 0.5 * STEP));
            let c = slope(at(b, 0.5 * STEP));
            let d = slope(at(c, STEP));
            let mean = |i: usize| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0;
            x = [x[0] + STEP * mean(0), x[1] + STEP * mean(1)];
        }
    }
    Recording::from_samples("swing", samples)
        .expect("a recording")
        .0
}

/// Inertia and friction of a pendulum alone, and dry friction in its hinge.
#[test]
fn a_pendulum_is_looked_at_alone() {
    let mut rig = qube();
    rig.params.pendulum.viscous = 5e-5;
    let p = &rig.params.pendulum;
    let inertia = 1.06 * (p.inertia + p.mass * p.com * p.com);
    let damping = 0.7 * p.viscous;
    let swings =
        |friction: f64| [1.4, 2.2].map(|begin| swung(&rig, inertia, damping, friction, begin));
    let sound = swings(0.0);
    let d = diagnosed(&rig, &sound, Pendulum::Alone).diagnosis;
    assert_eq!(d.verdict, Verdict::ParametersOnly, "{}", d.sentence());
    assert!(d.gap.recalibrated.theta.is_nan() && d.verification.len() == 2);
    assert!(d.notices.iter().any(|n| n.contains("the arm is held")));
    assert!(!d.parameters["motor.torque_constant"].identifiable);
    let d = diagnosed(&rig, &swings(1e-4), Pendulum::Alone).diagnosis;
    let ids: Vec<&str> = d.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(ids, ["pendulum.coulomb"], "{}", d.sentence());
    let level = d.effects[0].parameters["torque"].value;
    assert!((level / 1e-4 - 1.0).abs() < 0.05, "{level}");

    let options = calibrate::Options {
        pendulum: Pendulum::Alone,
        ..calibrate::Options::default()
    };
    let found = calibrate::calibrate(&sound, &rig, &options).expect("enough");
    let c = &found.calibration;
    assert!(!c.parameters["arm.inertia"].identifiable);
    let fitted = c.parameters["pendulum.inertia"].fitted + p.mass * p.com * p.com;
    assert!((fitted / inertia - 1.0).abs() < 1e-3, "{fitted} {inertia}");
    let viscous = &c.parameters["pendulum.viscous"];
    assert!((viscous.fitted / damping - 1.0).abs() < 0.02, "{viscous:?}");
    assert!(c.fit.iter().all(|f| f.channel.to_string() == "alpha"));
    let judged = judged_in(Pendulum::Alone, &sound, &found.rig);
    assert!(judged.channels.len() == 2 && judged.channels.iter().all(|c| c.fit_percent > 99.0));
}

/// The arm alone: the motor's torque constant, with the arm's inertia as the sheet has it.
#[test]
fn an_arm_is_calibrated_alone() {
    let rig = qube();
    let recordings =
        [0.0, 0.9].map(|zero| recorded(&rig, rig.params.arm.inertia, 1.08, |_, _| 0.0, zero));
    let options = calibrate::Options {
        hold: vec!["arm.inertia".into()],
        pendulum: Pendulum::Removed,
        ..calibrate::Options::default()
    };
    let found = calibrate::calibrate(&recordings, &rig, &options).expect("enough");
    let c = &found.calibration;
    let motor = &c.parameters["motor.torque_constant"];
    assert!(
        (motor.fitted / motor.nominal - 1.08).abs() < 2e-3,
        "{motor:?}"
    );
    assert!(!c.parameters["pendulum.inertia"].identifiable && c.combinations.is_empty());
    assert!(c.notices.iter().any(|n| n.contains("the pendulum is off")));
    let judged = judged_in(Pendulum::Removed, &recordings, &found.rig);
    assert!(judged.channels.len() == 2 && judged.channels.iter().all(|c| c.fit_percent > 99.0));
}

/// Recordings of the arm alone, fitted together with those of the whole rig, set the arm's inertia apart from what the
/// pendulum adds: where its centre of mass is shows, which the whole rig's alone do not tell.
#[test]
fn the_arm_alone_tells_more_of_the_whole() {
    let sheet = qube();
    let mut real = sheet.clone();
    real.params.arm.inertia *= 1.3;
    real.params.pendulum.com *= 0.95;
    real.params.pendulum.inertia *= 1.1;
    real.params.pendulum.inertia_transverse *= 1.1;
    real.params.motor.torque_constant *= 1.1;
    let whole = {
        let plant = real.nominal_plant::<f64>();
        let mut x = plant.rest(State::hanging());
        let mut samples = Vec::new();
        for k in 0..4000 {
            let t = 2e-3 * f64::from(k);
            let u = 3.0 * (TAU * t * (0.3 + 0.35 * t)).sin();
            let [theta, alpha] = real.sensors.quantised(plant.measure(&x));
            samples.push([t, u, theta, alpha]);
            plant.step(&mut x, u, 2e-3);
        }
        [Recording::from_samples("whole", samples)
            .expect("a recording")
            .0]
    };
    let arm = recorded(&real, real.params.arm.inertia, 1.0, |_, _| 0.0, 0.4);
    let keys = [
        "motor.torque_constant",
        "arm.inertia",
        "arm.viscous",
        "pendulum.inertia",
        "pendulum.viscous",
        "pendulum.com",
    ];
    let calibrated = |beside: Vec<(Pendulum, Recording)>| {
        let options = calibrate::Options {
            free: keys.map(str::to_owned).to_vec(),
            beside,
            ..calibrate::Options::default()
        };
        calibrate::calibrate(&whole, &sheet, &options)
            .expect("enough")
            .calibration
    };
    let together = calibrated(vec![(Pendulum::Removed, arm)]);
    for (key, truth) in keys.iter().zip([
        real.params.motor.torque_constant,
        real.params.arm.inertia,
        real.params.arm.viscous,
        real.params.pendulum.inertia,
        real.params.pendulum.viscous,
        real.params.pendulum.com,
    ]) {
        let p = &together.parameters[*key];
        assert!(p.identifiable, "{key}: {:?}", together.identifiability);
        assert!(
            (p.fitted - truth).abs() < 4.0 * p.std,
            "{key}: {p:?} {truth}"
        );
        assert!(p.std < 0.01 * truth, "{key}: {p:?}");
    }
    assert_eq!(together.fit.len(), 3);
    let notice = "1 of the whole rig, 1 with the pendulum off";
    assert!(
        together.notices.iter().any(|n| n.contains(notice)),
        "{:?}",
        together.notices
    );
    let alone = calibrated(Vec::new());
    let of =
        |c: &calibrate::Calibration, key: &str| c.parameters[key].std / c.parameters[key].fitted;
    println!(
        "{:?}",
        keys.map(|key| [of(&alone, key), of(&together, key)])
    );
    assert!(!alone.parameters["pendulum.com"].identifiable);
}
