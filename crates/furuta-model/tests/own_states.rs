//! A user's own law with a state, and one on the motor's side: the catalogue's laws written so are the same,
//! derivatives are exact, what was before is remembered, and mistakes are shown.

use furuta_model::effects::own::{Constant, Definition, InternalState, Parameter, Side, read};
use furuta_model::{Actuation, Effect, Jet, MAX_OWN_STATES, Plant, PlantError, Rig, Scalar, State};

const H: f64 = 2e-3;

fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

fn strength(name: &str, unit: &str) -> Parameter {
    Parameter {
        strength: Some(true),
        ..other(name, unit)
    }
}

fn other(name: &str, unit: &str) -> Parameter {
    Parameter::new(name, unit, -1e3..=1e3, 1.0)
}

fn constant(name: &str, unit: &str, value: f64) -> Constant {
    Constant {
        name: name.to_owned(),
        unit: unit.to_owned(),
        value,
    }
}

fn state(unit: &str, rate: &str) -> Option<InternalState> {
    Some(InternalState {
        name: "z".to_owned(),
        unit: unit.to_owned(),
        rate: rate.to_owned(),
        start: 0.0,
    })
}

fn law(arm: &str, parameters: Vec<Parameter>) -> Definition {
    Definition {
        id: "user.copy".to_owned(),
        arm: Some(arm.to_owned()),
        parameters,
        ..Definition::default()
    }
}

fn effect<S: Scalar>(text: &Definition, values: &[f64]) -> Effect<S> {
    let values: Vec<S> = values.iter().map(|v| S::from_f64(*v)).collect();
    Effect::checked(text.compile().expect("valid"), &values).expect("in range")
}

/// A cable that relaxes.
fn maxwell() -> Definition {
    Definition {
        state: state("rad", "theta_dot - z/tau"),
        ..law(
            "-k*z",
            vec![
                strength("k", "N m/rad"),
                Parameter::new("tau", "s", 1e-3..=1e3, 0.5),
            ],
        )
    }
}

/// Dahl's friction by its torque.
fn dahl() -> Definition {
    Definition {
        state: state("N m", "k*(theta_dot - abs(theta_dot)*z/c)"),
        ..law(
            "-z",
            vec![
                strength("k", "N m/rad"),
                Parameter::new("c", "N m", 1e-6..=1.0, 1e-3),
            ],
        )
    }
}

fn run(plant: &Plant<f64>, h: f64) -> Vec<[f64; 4]> {
    let mut s = plant.rest(State::new(0.2, 3.0, 0.0, -0.4));
    let mut states = Vec::new();
    for k in 0..(0.6 / h).round() as u32 {
        plant.step(&mut s, 2.0 * (25.0 * f64::from(k) * h).sin(), h);
        states.push(s.x.to_array());
    }
    states
}

fn with(effects: &[Effect<f64>]) -> Plant<f64> {
    Plant::new(&qube().params, effects).expect("valid")
}

fn apart(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The same differential equations in the same steps: to rounding.
#[test]
fn a_cable_and_a_winding_written_as_text_are_the_same() {
    let c = qube().params.coefficients();
    let e = 0.7 * c.arm_damping / c.drive;
    // The motor gives drive (z + e theta_dot) in place of drive u.
    let winding = Definition {
        state: state("V", "(u - e*theta_dot - z)/tau"),
        constants: vec![
            constant("drive", "N m/V", c.drive),
            constant("e", "V s/rad", e),
        ],
        ..law(
            "on*drive*(z + e*theta_dot - u)",
            vec![
                strength("on", "-"),
                Parameter::new("tau", "s", 1e-4..=1.0, 0.01),
            ],
        )
    };
    let (stiff, tau) = (2e-3, 0.05);
    let pairs = [
        (
            with(&[Effect::new("arm.relaxation", &[stiff, tau]).expect("valid")]),
            with(&[effect(&maxwell(), &[stiff, tau])]),
        ),
        (
            with(&[Effect::new("motor.inductance", &[0.01, 0.7]).expect("valid")]),
            with(&[effect(&winding, &[1.0, 0.01])]),
        ),
    ];
    let without = run(&with(&[]), H);
    for (n, (catalogue, own)) in pairs.iter().enumerate() {
        let (catalogue, own) = (run(catalogue, H), run(own, H));
        assert!(apart(&catalogue, &without) > 1e-3, "{n} is not seen");
        assert!(
            apart(&catalogue, &own) < 1e-12,
            "{n}: {:e}",
            apart(&catalogue, &own)
        );
    }
}

/// The catalogue solves Dahl's law by the way gone, this one by time: they meet as the step shrinks.
#[test]
fn bristles_written_as_text_come_to_the_same() {
    let (torque, stiffness) = (1e-3, 0.1);
    let catalogue = with(&[Effect::new("arm.presliding", &[torque, stiffness]).expect("valid")]);
    let own = with(&[effect(&dahl(), &[stiffness, torque])]);
    let gap = |h: f64| apart(&run(&catalogue, h), &run(&own, h));
    assert!(apart(&run(&catalogue, H), &run(&with(&[]), H)) > 1e-2);
    // A speed of 10 rad/s bends bristles at 1000/s: at a turn of the arm the rate has a kink.
    assert!(gap(H) < 1e-3, "{:e}", gap(H));
    assert!(
        gap(H / 8.0) < gap(H) / 10.0,
        "{:e} {:e}",
        gap(H),
        gap(H / 8.0)
    );
}

/// An RK4 of this test's own, of arm and state alone: the pendulum weighs nothing.
#[test]
fn a_law_with_a_state_follows_its_differential_equation() {
    let mut p = qube().params;
    p.pendulum.mass = 1e-12;
    p.pendulum.inertia = 1e-12;
    p.pendulum.inertia_transverse = 0.0;
    p.pendulum.viscous = 0.0;
    let c = p.coefficients();
    let text = Definition {
        state: Some(InternalState {
            start: 0.3,
            ..state("rad", "sin(theta) + w*(1 - z^2)*z + theta_dot").expect("one")
        }),
        constants: vec![constant("w", "rad/s", 3.0)],
        ..law("-k*z*cos(theta)", vec![strength("k", "N m/rad")])
    };
    // sin(theta) is no speed.
    let error = text.compile().expect_err("a unit").to_string();
    assert!(
        error.contains("state.rate, character 14: `w*(1 - z^2)*z` is in rad2/s"),
        "{error}"
    );
    let text = Definition {
        state: Some(InternalState {
            rate: "w*sin(theta) + w*(1 - z^2)*z + theta_dot".to_owned(),
            ..text.state.clone().expect("one")
        }),
        ..text
    };
    let k = 2e-3;
    let plant: Plant<f64> = Plant::new(&p, &[effect(&text, &[k])]).expect("valid");
    let mut s = plant.rest(State::new(0.4, 3.0, -1.0, 0.0));
    let mut x = [0.4, -1.0, 0.3];
    let rate = |x: &[f64; 3], u: f64| {
        let torque = c.drive * u - c.arm_damping * x[1] - k * x[2] * x[0].cos();
        [
            x[1],
            torque / c.arm,
            3.0 * x[0].sin() + 3.0 * (1.0 - x[2] * x[2]) * x[2] + x[1],
        ]
    };
    let along = |x: &[f64; 3], d: &[f64; 3], h: f64| [0, 1, 2].map(|i| x[i] + h * d[i]);
    for n in 0..500 {
        let u = 1.5 * (0.02 * f64::from(n)).sin();
        plant.step(&mut s, u, H);
        let h = H / 4.0;
        for _ in 0..4 {
            let a = rate(&x, u);
            let b = rate(&along(&x, &a, h / 2.0), u);
            let d = rate(&along(&x, &b, h / 2.0), u);
            let e = rate(&along(&x, &d, h), u);
            x = [0, 1, 2].map(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * d[i] + e[i]));
        }
    }
    assert!(x[0].abs() > 0.3 && x[1].abs() > 1.0, "it went far: {x:?}");
    assert!(
        (s.x.theta - x[0]).abs() < 1e-7 && (s.x.theta_dot - x[1]).abs() < 1e-6,
        "{:?} {x:?}",
        s.x
    );
}

/// How a trajectory changes with the law's parameters, by dual numbers and by differences.
#[test]
fn derivatives_pass_through_the_state() {
    type Number = Jet<f64, { crate::FEW }>;
    let end = |values: [Number; 2]| {
        let own = Effect::checked(maxwell().compile().expect("valid"), &values).expect("in range");
        let plant: Plant<Number> = Plant::new(&qube().params.cast(), &[own]).expect("valid");
        let mut s = plant.rest(State::new(0.2, 3.0, 0.5, -0.4).map(Jet::from_f64));
        // Remembered, then simulated.
        let past = (0..100).map(|n| {
            let speed = (0.1 * f64::from(n)).cos();
            (State::new(0.0, 3.0, speed, 0.0).map(Jet::from_f64), 0.0)
        });
        plant.remember(&mut s, past, H);
        for _ in 0..100 {
            plant.step(&mut s, Jet::from_f64(0.5), H);
        }
        s.x.theta
    };
    let (k, tau) = (2e-3, 0.05);
    let exact = end([Jet::variable(k, 0), Jet::variable(tau, 1)]).d;
    for (i, step) in [1e-7, 1e-5].into_iter().enumerate() {
        let at = |by: f64| {
            let values = [k, tau].map(Jet::from_f64);
            end(std::array::from_fn(|n| {
                if n == i {
                    values[n] + Jet::from_f64(by)
                } else {
                    values[n]
                }
            }))
            .v
        };
        let slope = (at(step) - at(-step)) / (2.0 * step);
        // the third derivative, and rounding over the step
        assert!(
            (exact[i] - slope).abs() < 1e-6 * (1.0 + slope.abs()),
            "{i}: {} {slope}",
            exact[i]
        );
    }
}

/// What is remembered of a motion is what a catalogue's cable remembers; and for how long is the law's own.
#[test]
fn what_was_before_is_remembered() {
    let (k, tau) = (1e-2, 0.08);
    let catalogue = with(&[Effect::new("arm.relaxation", &[k, tau]).expect("valid")]);
    let own = with(&[effect(&maxwell(), &[k, tau])]);
    let after = |plant: &Plant<f64>| {
        let mut s = plant.rest(State::new(0.0, 3.0, 0.0, 0.0));
        let past = (0..300).map(|n| {
            let t = H * f64::from(n);
            (State::new(t, 3.0, 4.0 * (9.0 * t).sin(), 0.0), 0.3)
        });
        plant.remember(&mut s, past, H);
        plant.step(&mut s, 0.0, H);
        s.x.theta_dot
    };
    let (wanted, got) = (after(&catalogue), after(&own));
    // RK4 at h/tau = 1/40 for exp: (1/40)^5/120 a step, of which some 40 are remembered.
    assert!(
        (wanted - got).abs() < 1e-8 * wanted.abs() && wanted.abs() > 1e-4,
        "{wanted} {got}"
    );
    let turning = |speed: f64| State::new(0.0, 3.0, speed, 0.0);
    let forgets = |plant: &Plant<f64>, speed: f64| plant.forgetting(0.0, &turning(speed), 0.0);
    assert_eq!(forgets(&own, 1.0), forgets(&catalogue, 1.0));
    // Bristles forget by the way.
    let bristles = with(&[effect(&dahl(), &[0.1, 1e-3])]);
    assert!((forgets(&bristles, -3.0).expect("a state") - 300.0).abs() < 1e-9);
    assert_eq!(forgets(&bristles, 0.0), Some(0.0));
    assert_eq!(forgets(&with(&[]), 0.0), None);
}

/// A drive sets the rotor apart: a law on the motor's side is there what the catalogue's is.
#[test]
fn a_law_on_the_motors_side_acts_on_the_rotor() {
    let drag = |side: Side| Definition {
        side,
        ..law(
            "-c*abs(theta_dot)*theta_dot",
            vec![strength("c", "N m s2/rad2")],
        )
    };
    let relaxing = |side: Side| Definition { side, ..maxwell() };
    for (drive, values) in [
        ("drive.compliance", [0.3, 1e-4, 0.4, 0.0]),
        ("drive.backlash", [0.1, 0.4, 0.0, 0.0]),
    ] {
        let count = if drive == "drive.backlash" { 3 } else { 4 };
        let drive = Effect::new(drive, &values[..count]).expect("valid");
        let go = |e: Effect<f64>| run(&with(&[drive, e]), 1e-3);
        let catalogue = go(Effect::new("arm.quadratic", &[3e-5]).expect("valid"));
        let [motor, arm] = [Side::Motor, Side::Arm].map(|s| go(effect(&drag(s), &[3e-5])));
        assert!(
            apart(&catalogue, &motor) < 1e-12,
            "{:e}",
            apart(&catalogue, &motor)
        );
        assert!(
            apart(&catalogue, &arm) > 1e-6,
            "{:e}",
            apart(&catalogue, &arm)
        );
        let relaxation = go(Effect::new("arm.relaxation", &[2e-3, 0.1]).expect("valid"));
        let [motor, arm] = [Side::Motor, Side::Arm].map(|s| go(effect(&relaxing(s), &[2e-3, 0.1])));
        assert!(
            apart(&relaxation, &arm) < 1e-12,
            "{:e}",
            apart(&relaxation, &arm)
        );
        assert!(
            apart(&relaxation, &motor) > 1e-6,
            "{:e}",
            apart(&relaxation, &motor)
        );
    }
    // Without a drive both are the same.
    let [motor, arm] =
        [Side::Motor, Side::Arm].map(|s| run(&with(&[effect(&drag(s), &[3e-5])]), H));
    assert_eq!(motor, arm);
}

/// Dry friction beside it: steps are cut at stops all the same.
#[test]
fn it_stands_beside_dry_friction_and_a_second_one() {
    let second = Definition {
        id: "user.second".to_owned(),
        ..dahl()
    };
    let friction = Effect::new("arm.coulomb", &[1e-3]).expect("valid");
    let catalogue = [
        friction,
        Effect::new("arm.relaxation", &[2e-3, 0.1]).expect("valid"),
        effect(&second, &[0.1, 1e-3]),
    ];
    let own = [
        friction,
        effect(&maxwell(), &[2e-3, 0.1]),
        effect(&second, &[0.1, 1e-3]),
    ];
    let difference = apart(&run(&with(&catalogue), H), &run(&with(&own), H));
    assert!(difference < 1e-10, "{difference:e}");
    let third = Definition {
        id: "user.third".to_owned(),
        ..dahl()
    };
    let three = [own[1], own[2], effect(&third, &[0.1, 1e-3])];
    let error = Plant::<f64>::new(&qube().params, &three).expect_err("one too many");
    assert_eq!(error, PlantError::TooManyStates { given: 3 });
    assert!(
        error
            .to_string()
            .contains(&format!("at most {MAX_OWN_STATES} are possible"))
    );
}

/// A state that is fast needs more steps than the sample period has, and gets them.
#[test]
fn a_fast_state_is_followed() {
    let fast = |tau: f64| run(&with(&[effect(&maxwell(), &[0.5, tau])]), H);
    let damping = law("-c*theta_dot", vec![strength("c", "N m s/rad")]);
    // k z comes to k tau theta_dot.
    let tau = 5e-5; // a fortieth of the period
    let mut text = maxwell();
    text.parameters[1].min = 1e-6;
    let settled = run(&with(&[effect(&damping, &[0.5 * tau])]), H);
    assert!(fast(1e-3).iter().flatten().all(|x| x.is_finite()));
    let own = run(&with(&[effect(&text, &[0.5, tau])]), H);
    // It lags by tau, which is 5e-5 s of 25 rad/s, of speeds up to 10 rad/s.
    assert!(apart(&own, &settled) < 3e-2, "{:e}", apart(&own, &settled));
}

const FILE: &str = r#"
[hypothesis."user.cable"]
arm = "-k*z"
side = "motor"
state = { name = "z", unit = "rad", rate = "theta_dot - z/tau", start = 0.1 }
parameters.k = { unit = "N m/rad", min = 0.0, max = 1.0, typical = 1e-3, strength = true }
parameters.tau = { unit = "s", min = 0.01, max = 100.0, typical = 0.5 }
"#;

#[test]
fn files_carry_state_and_side() {
    let spec = read(FILE).expect("valid")[0];
    assert!(
        spec.law.contains("arm: -k*z; dz/dt = theta_dot - z/tau"),
        "{}",
        spec.law
    );
    let mut rig = qube();
    rig.effects
        .push(Effect::checked(spec, &[2e-3, 0.4]).expect("in range"));
    let text = rig.to_toml();
    let again = Rig::from_toml(&text).expect("readable");
    assert_eq!((again.to_toml(), &again), (text.clone(), &rig));
    assert!(
        text.contains("side = \"motor\"\nstate = { name = \"z\""),
        "{text}"
    );
    for (from, to, words) in [
        (
            "theta_dot - z/tau",
            "theta_dot - z",
            "state.rate (line 5), character 13: `z` is in rad and",
        ),
        (
            "theta_dot - z/tau",
            "theta - z",
            "state.rate (line 5), character 1: the law is in rad, it must be in rad/s",
        ),
        (
            "theta_dot - z/tau",
            "theta_dot - y/tau",
            "character 13: `y` is no variable",
        ),
        (
            "\"rad\"",
            "\"rod\"",
            "state.unit (line 5), character 1: this is no unit",
        ),
        ("start = 0.1", "begin = 0.1", "begin"),
        ("start = 0.1", "start = nan", "state.start"),
        ("name = \"z\"", "name = \"theta\"", "something else"),
        ("name = \"z\"", "name = \"k\"", "something else"),
        ("arm = \"-k*z\"", "arm = \"-k*theta\"", "must contain it"),
        (
            "arm = \"-k*z\"",
            "pendulum = \"-k*z\"",
            "only a law for `arm` acts on the motor's side",
        ),
        (
            "arm = \"-k*z\"",
            "arm = \"-k*z\"\nvoltage = \"k*z\"",
            "`z` is not seen here",
        ),
        ("side = \"motor\"", "side = \"left\"", "left"),
        ("tau = {", "z = {", "something else"),
    ] {
        let error = read(&FILE.replace(from, to)).expect_err(to).to_string();
        assert!(error.contains(words), "{to}: {error}");
    }
    // With k = 0 something of the state is left.
    let left = FILE.replace("arm = \"-k*z\"", "arm = \"-k*z - m*z\"")
        + "constants.m = { value = 1e-3, unit = \"N m/rad\" }\n";
    let error = read(&left).expect_err("never off").to_string();
    assert!(
        error.contains("with k = 0 the law of `arm` is") && error.contains("z = 0.1"),
        "{error}"
    );
}

/// Where the arm follows an acceleration, a torque on it does nothing; one on the pendulum does.
#[test]
fn kinds_of_motors_are_told() {
    let not_on = |d: &Definition| {
        d.compile()
            .expect("valid")
            .acts
            .not_on(Actuation::Acceleration)
    };
    assert!(
        not_on(&maxwell()).is_some_and(|why| why.contains("follows the commanded acceleration"))
    );
    let pendulum = Definition {
        arm: None,
        pendulum: Some("-k*z".to_owned()),
        state: state("rad", "alpha_dot - z/tau"),
        ..maxwell()
    };
    assert_eq!(not_on(&pendulum), None);
}
