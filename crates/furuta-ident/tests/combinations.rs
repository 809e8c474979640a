//! Effects that a search which takes the best one after the other does not come by: neither of a pair is the best
//! alone, or the form of one is far from what a bearing has.

use furuta_ident::diagnose::{Request, Verdict, diagnose};
use furuta_ident::recording::Recording;
use furuta_model::{Effect, Plant, Rig, State};
use std::f64::consts::TAU;
use std::fmt::Write;

/// Period of the recordings, s: the real QUBE's.
const H: f64 = 0.004;
/// Their length, s.
const SECONDS: f64 = 8.0;

/// A QUBE with less friction than the manual's, as recordings show it.
fn qube() -> Rig {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.params.arm.viscous = 2e-4;
    rig.params.pendulum.viscous = 2e-5;
    rig
}

/// What the encoders read of a rig that hangs at rest and is driven by `command` (V, a function of time).
fn record(rig: &Rig, effects: &[Effect<f64>], command: impl Fn(f64) -> f64) -> Recording {
    let plant: Plant<f64> = Plant::new(&rig.params, effects).expect("few effects");
    let mut state = plant.rest(State::hanging());
    let mut csv = String::from("t,u,theta,alpha\n");
    for k in 0..(SECONDS / H) as usize {
        let t = k as f64 * H;
        let u = command(t);
        let [theta, alpha] = rig.sensors.quantised(plant.measure(&state));
        writeln!(csv, "{t:.6},{u},{theta:.7},{alpha:.7}").expect("a string takes everything");
        plant.step(&mut state, u, H);
    }
    Recording::from_csv("run.csv", csv.as_bytes())
        .expect("a valid recording")
        .0
}

/// The names found in recordings under both commands, given the manual's data sheet, and the verdict.
fn named(effects: &[Effect<f64>], commands: [&dyn Fn(f64) -> f64; 2]) -> (Vec<String>, Verdict) {
    let recordings = commands.map(|command| record(&qube(), effects, command));
    let request = Request {
        recordings: &recordings,
        rig: &Rig::builtin("qube-servo-2").expect("built in"),
        verify: &[],
    };
    let diagnosis = diagnose(&request, &|_| ())
        .expect("good recordings")
        .diagnosis;
    let mut names: Vec<String> = diagnosis.effects.into_iter().map(|e| e.id).collect();
    names.sort();
    (names, diagnosis.verdict)
}

/// Of the same order: a torque that grows with the voltage, and one that does not. Each is named alone.
#[test]
fn a_ripple_of_the_motor_and_cogging_are_told_apart() {
    let sines = |t: f64| 2.0 * (1.9 * t).sin() + 1.5 * (7.3 * t).sin() + (17.0 * t).sin();
    let steps = |t: f64| 2.5 * ((1.1 * t).sin().signum() + 0.4 * (4.1 * t).sin().signum());
    for (id, values) in [
        ("motor.ripple", [0.1, 10.0, 1.0]),
        ("arm.cogging", [1e-3, 10.0, 1.0]),
    ] {
        let hidden = [Effect::new(id, &values).expect("valid")];
        let (names, verdict) = named(&hidden, [&sines, &steps]);
        assert_eq!(names, [id]);
        assert_eq!(verdict, Verdict::MissingEffects, "{id}");
    }
}

/// Under both, the arm hangs in the teeth most of the time. Friction alone explains most, and Stribeck friction a
/// little more: beside that, cogging is not found.
#[test]
fn friction_and_cogging_are_named_though_stribeck_friction_is_the_best_alone() {
    let hidden = [
        Effect::new("arm.coulomb", &[7.1e-3]).expect("valid"),
        Effect::new("arm.cogging", &[5.4e-3, 8.0, 2.8]).expect("valid"),
    ];
    let sines = |t: f64| 2.0 * (1.9 * t).sin() + 2.0 * (7.3 * t).sin() + 1.5 * (17.0 * t).sin();
    let steps = |t: f64| 3.5 * ((1.1 * t).sin().signum() + 0.4 * (4.1 * t).sin().signum());
    let (names, verdict) = named(&hidden, [&sines, &steps]);
    assert_eq!(names, ["arm.cogging", "arm.coulomb"]);
    assert_eq!(verdict, Verdict::MissingEffects);
}

/// What a real QUBE's chirps show: a cable that stiffens, and rubs and bends over a quarter of a radian, where a
/// bearing's bristles do over milliradians.
#[test]
fn a_cable_that_rubs_is_named_beside_its_spring() {
    let hidden = [
        Effect::new("arm.cable", &[1e-3, -7e-4, 6e-4, -0.5]).expect("valid"),
        Effect::new("arm.presliding", &[2.6e-4, 1.3e-3]).expect("valid"),
        Effect::new("motor.lag", &[0.005]).expect("valid"),
    ];
    // From 10 Hz to none.
    let chirp = |t: f64| 1.5 * (TAU * 10.0 * (t - 0.5 * t * t / SECONDS)).sin();
    let (names, verdict) = named(&hidden, [&chirp, &|t| -chirp(t)]);
    assert_eq!(names, ["arm.cable", "arm.presliding", "motor.lag"]);
    assert_eq!(verdict, Verdict::MissingEffects);
}
