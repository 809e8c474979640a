//! Arms that follow a commanded acceleration: the pendulum on a base that moves as commanded, integrated here without
//! the library's plant, read by encoders, and diagnosed by a sheet that is off.

use crate::common::patient;
use furuta_ident::diagnose::{
    Channel, Diagnosis, Options, Outcome, Request, Verdict, diagnose, diagnose_with,
};
use furuta_ident::recording::Recording;
use furuta_model::{Effect, Plant, Rig, Spec, State, effects};

/// Longest step of the integration, s: RK4 leaves less than a thousandth of a count.
const STEP: f64 = 5e-4;

/// What the kit has that its sheet does not say.
#[derive(Clone, Copy, Default)]
struct Hidden {
    /// The command acts later, s.
    delay: f64,
    /// The arm is never faster, rad/s; 0 for no limit.
    speed_limit: f64,
    /// Torque on the pendulum, N m s²/rad², N m/rad.
    quadratic: f64,
    spring: f64,
}

/// The kit without the effects of its file.
fn kit() -> Rig {
    let mut rig = Rig::builtin("stepper-kit").expect("built in");
    rig.effects.clear();
    rig
}

/// Its sheet as a ruler and a balance leave it.
fn sheet() -> Rig {
    let mut rig = kit();
    rig.params.arm.length *= 1.02;
    rig.params.pendulum.com *= 1.015;
    rig.params.pendulum.inertia *= 0.95;
    rig.params.pendulum.viscous *= 1.5;
    rig
}

/// Slopes of theta, theta', alpha, alpha' on a base accelerated by `a`:
/// `J alpha'' = C cos(alpha) a + S sin(alpha) cos(alpha) theta'² + W sin(alpha) - b alpha' + torques`.
fn slopes(rig: &Rig, hidden: &Hidden, x: [f64; 4], a: f64) -> [f64; 4] {
    let p = &rig.params.pendulum;
    let square = p.mass * p.com * p.com;
    let [_, speed, alpha, rate] = x;
    let (sin, cos) = alpha.sin_cos();
    let limited = hidden.speed_limit > 0.0 && speed.abs() >= hidden.speed_limit && speed * a > 0.0;
    let a = if limited { 0.0 } else { a };
    let torque = p.mass * rig.params.arm.length * p.com * cos * a
        + (square + p.inertia_transverse - p.inertia_axial) * sin * cos * speed * speed
        + p.mass * rig.params.gravity * p.com * sin
        - p.viscous * rate
        - hidden.quadratic * rate * rate.abs()
        - hidden.spring * (alpha - std::f64::consts::PI);
    [speed, a, rate, torque / (p.inertia + square)]
}

/// One step of RK4.
fn stepped(x: [f64; 4], dt: f64, f: impl Fn([f64; 4]) -> [f64; 4]) -> [f64; 4] {
    let add = |d: [f64; 4], by: f64| std::array::from_fn(|i| x[i] + by * d[i]);
    let k1 = f(x);
    let k2 = f(add(k1, 0.5 * dt));
    let k3 = f(add(k2, 0.5 * dt));
    let k4 = f(add(k3, dt));
    std::array::from_fn(|i| x[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// One recording of ten seconds: a sum of sines, held from sample to sample, every sample moved by up to `jitter`
/// periods.
fn record(rig: &Rig, hidden: &Hidden, seed: u32, jitter: f64) -> Recording {
    let h = 0.008;
    let mut random = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let mut draw = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(random >> 8) / f64::from(1 << 24)
    };
    let phases: Vec<f64> = (0..12).map(|_| 6.3 * draw()).collect();
    let times: Vec<f64> = (0..1250)
        .map(|k| h * (f64::from(k) + if k > 0 { jitter * (draw() - 0.5) } else { 0.0 }))
        .collect();
    // Of positions: an arm that is told accelerations would wander off.
    let command = |t: f64| {
        let lines = phases.iter().enumerate();
        lines
            .map(|(k, phase)| {
                let w = std::f64::consts::PI * (k as f64 + 1.0);
                4.0 * (w * t + phase).sin()
            })
            .sum::<f64>()
    };
    let commands: Vec<f64> = times.iter().map(|t| command(*t)).collect();
    let held = |t: f64| {
        let at = times.partition_point(|time| *time <= t + 1e-12);
        at.checked_sub(1).map_or(0.0, |k| commands[k])
    };
    let mut x = [0.0, 0.0, std::f64::consts::PI, 0.0];
    let mut samples = Vec::new();
    for (k, t) in times.iter().enumerate() {
        let [theta, alpha] = rig.sensors.quantised([x[0], x[2]]);
        samples.push([*t, commands[k], theta, alpha]);
        let Some(next) = times.get(k + 1) else { break };
        // The delayed command changes in between: the steps end there.
        let changes = times.iter().map(|t| t + hidden.delay);
        let mut ends: Vec<f64> = changes.filter(|c| t < c && c < next).collect();
        ends.push(*next);
        let mut from = *t;
        for end in ends {
            let a = held(0.5 * (from + end) - hidden.delay);
            let parts = ((end - from) / STEP).ceil();
            let dt = (end - from) / parts;
            for _ in 0..parts as usize {
                x = stepped(x, dt, |x| slopes(rig, hidden, x, a));
            }
            from = end;
        }
    }
    Recording::from_samples(&format!("run-{seed}"), samples)
        .expect("sound")
        .0
}

fn found(hidden: Hidden, jitter: f64) -> Diagnosis {
    outcome(hidden, jitter).diagnosis
}

fn outcome(hidden: Hidden, jitter: f64) -> Outcome {
    let recordings = [1, 2].map(|seed| record(&kit(), &hidden, seed, jitter));
    assert_eq!(recordings[0].is_uneven(), jitter > 0.0);
    let request = Request {
        recordings: &recordings,
        rig: &sheet(),
        verify: &[],
    };
    let outcome = diagnose(&request, &|_| ()).expect("good recordings");
    println!("{:#?}", outcome.diagnosis.effects);
    outcome
}

fn ids(d: &Diagnosis) -> Vec<&str> {
    d.effects.iter().map(|e| e.id.as_str()).collect()
}

/// A sheet that is off accuses a sound kit of nothing, and its numbers are found.
#[test]
fn a_sound_kit_has_its_sheet_refitted() {
    for jitter in [0.0, 0.8] {
        let d = found(Hidden::default(), jitter);
        assert_eq!(d.verdict, Verdict::ParametersOnly);
        let length = &d.parameters["arm.length"];
        assert!(
            (length.fitted - 0.065).abs() < 4.0 * length.std,
            "{length:?}"
        );
        assert!(!d.parameters.contains_key("arm.inertia"));
        assert!(d.parameters["motor.amplifier_gain"].identifiable);
    }
}

/// A delay, at even and at jittering samples: named, with an interval of a millisecond that holds the truth.
#[test]
fn a_late_command_is_found() {
    for jitter in [0.0, 0.8] {
        let hidden = Hidden {
            delay: 0.0137,
            ..Hidden::default()
        };
        let d = found(hidden, jitter);
        assert_eq!(ids(&d), ["motor.delay"]);
        let delay = &d.effects[0].parameters["delay"];
        assert!((delay.value - 0.0137).abs() < 4.0 * delay.std, "{delay:?}");
        assert!(delay.std < 2.5e-4, "{delay:?}");
    }
}

/// What the driver does to fast arms, though nothing of it shows below the limit.
#[test]
fn a_limit_of_the_speed_is_found() {
    let hidden = Hidden {
        speed_limit: 0.6,
        ..Hidden::default()
    };
    let d = found(hidden, 0.0);
    assert_eq!(ids(&d), ["motor.speed_limit"]);
    let speed = &d.effects[0].parameters["speed"];
    assert!((speed.value - 0.6).abs() < 0.01, "{speed:?}");
}

/// Torques on the pendulum, one beside a delay, at jittering samples.
#[test]
fn torques_on_the_pendulum_are_found() {
    let drag = Hidden {
        quadratic: 3e-6,
        ..Hidden::default()
    };
    assert_eq!(ids(&found(drag, 0.0)), ["pendulum.quadratic"]);
    let both = Hidden {
        delay: 0.0137,
        quadratic: 3e-6,
        ..Hidden::default()
    };
    let d = found(both, 0.8);
    let mut named = ids(&d);
    named.sort_unstable();
    assert_eq!(named, ["motor.delay", "pendulum.quadratic"]);
}

/// What a diagnosis finds of two recordings of the library's plant with these effects: `asked` for, or not.
fn found_of(effects: &[(&str, &[f64])], asked: &[&str]) -> Diagnosis {
    let effects: Vec<Effect<f64>> = (effects.iter())
        .map(|(id, values)| Effect::new(id, values).expect("valid"))
        .collect();
    let plant = Plant::new(&kit().params, &effects).expect("possible");
    let recordings = [0, 1].map(|run| {
        let told = record(&kit(), &Hidden::default(), 1 + run as u32, 0.0);
        let mut s = plant.rest(State::hanging());
        s.run = run;
        let samples: Vec<[f64; 4]> = (told.t.iter().zip(&told.u))
            .map(|(t, u)| {
                let [theta, alpha] = kit().sensors.quantised(plant.measure(&s));
                plant.step(&mut s, *u, told.sample_period);
                [*t, *u, theta, alpha]
            })
            .collect();
        Recording::from_samples(&told.name, samples)
            .expect("sound")
            .0
    });
    let request = Request {
        recordings: &recordings,
        rig: &sheet(),
        verify: &[],
    };
    let asked: Vec<&'static Spec> = (asked.iter())
        .map(|id| effects::spec(id).expect("an entry"))
        .collect();
    let options = Options {
        candidates: &asked,
        ..patient()
    };
    let d = diagnose_with(&request, options, &|_| ())
        .expect("good recordings")
        .diagnosis;
    println!("{:#?} {:?}", d.effects, d.suspected);
    d
}

/// What few kits have: an arm that rings about the command is named where it is asked for.
#[test]
fn ringing_is_found_on_request() {
    let d = found_of(&[("motor.resonance", &[0.05, 0.1])], &["motor.resonance"]);
    assert_eq!(
        (ids(&d), d.verdict),
        (vec!["motor.resonance"], Verdict::MissingEffects)
    );
    let period = d.effects[0].parameters["period"].value;
    assert!((period / 0.05 - 1.0).abs() < 0.05, "{period}");
}

/// A slip of the rotor by four steps at a moment of the second recording is named unasked, whether theta counts what
/// was commanded or is the arm's own, alone and beside a delay; its moment to a fraction of the slip's 20 ms.
#[test]
fn a_slip_is_named() {
    for reads in [0.0, 1.0] {
        let slip: (&str, &[f64]) = ("motor.lost_steps", &[-0.126, 4.321, 1.0, reads]);
        for beside in [None, Some(("motor.delay", &[0.0137] as &[f64]))] {
            let hidden: Vec<(&str, &[f64])> = std::iter::once(slip).chain(beside).collect();
            let d = found_of(&hidden, &[]);
            let mut expected: Vec<&str> = hidden.iter().map(|(id, _)| *id).collect();
            expected.sort_unstable();
            let mut named = ids(&d);
            named.sort_unstable();
            assert_eq!((named, d.verdict), (expected, Verdict::MissingEffects));
            let slip = d.effects.iter().find(|e| e.id == "motor.lost_steps");
            let found = &slip.expect("named").parameters;
            assert!((found["size"].value + 0.126).abs() < 0.01, "{found:?}");
            assert!((found["time"].value - 4.321).abs() < 0.004, "{found:?}");
            let same = |name: &str, value: f64| found[name].value.to_bits() == value.to_bits();
            assert!(same("run", 1.0) && same("reads", reads), "{found:?}");
        }
    }
}

/// A torque missing on an arm that no torque moves is not spoken of, nor drawn.
#[test]
fn nothing_is_said_of_torques_on_the_arm() {
    let hidden = Hidden {
        spring: 2e-3,
        ..Hidden::default()
    };
    let Outcome {
        diagnosis: d,
        curves,
        ..
    } = outcome(hidden, 0.0);
    assert_eq!(ids(&d), ["pendulum.spring"]);
    assert!(d.missing_torque.iter().all(|t| t.axis == Channel::Alpha));
    assert!(!curves.torque_by_state.is_empty() && !curves.torque_in_time.is_empty());
    assert!(
        curves
            .torque_by_state
            .iter()
            .all(|t| t.axis == Channel::Alpha)
    );
    for run in &curves.torque_in_time {
        assert!(run.recalibrated[0].iter().all(|t| t.is_nan()));
        assert!(run.recalibrated[1].iter().any(|t| t.is_finite()));
    }
}
