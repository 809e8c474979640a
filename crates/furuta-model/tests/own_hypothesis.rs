//! A user's own law: the catalogue's laws written so are the same, derivatives are exact, and each mistake is shown
//! where it is.

use furuta_model::dynamics::Angle;
use furuta_model::effects::own::{Constant, Definition, HypothesisError, Parameter, read};
use furuta_model::effects::{self, Clock, Instant, Law};
use furuta_model::simulate::trajectory;
use furuta_model::{Effect, Jet, Plant, Rig, Scalar, State, linearize};
use proptest::prelude::*;

fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

fn strength(name: &str, unit: &str) -> Parameter {
    Parameter {
        strength: Some(true),
        ..Parameter::new(name, unit, -1e3..=1e3, 1.0)
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

/// A hypothesis with `k` (N m) as its strength, and `w` = 2 rad/s.
fn of(arm: &str) -> Definition {
    Definition {
        id: "user.test".to_owned(),
        arm: Some(arm.to_owned()),
        parameters: vec![strength("k", "N m"), other("c", "-")],
        constants: vec![constant("w", "rad/s", 2.0)],
        ..Definition::default()
    }
}

fn start() -> State<f64> {
    State::new(0.2, 3.0, 0.5, -0.4)
}

fn run<S: Scalar<Real = S>>(effects: &[Effect<S>]) -> Vec<[f64; 4]> {
    let plant: Plant<S> = Plant::new(&qube().params.cast(), effects).expect("valid");
    let mut s = plant.rest(start().map(S::from_f64));
    let mut states = Vec::new();
    for k in 0..300 {
        let u = S::from_f64(2.0 * (f64::from(k) * 0.05).sin());
        plant.step(&mut s, u, S::from_f64(2e-3));
        states.push(s.x.to_array().map(|v| v.value()));
    }
    states
}

/// Of each effect of the catalogue that is a smooth law (or a map of the voltage): the same as a text, and values.
fn catalogue() -> Vec<(&'static str, Definition, Vec<f64>)> {
    let c = qube().params.coefficients();
    let law = |key: &str, text: &str, parameters: Vec<Parameter>| {
        let text = |wanted: &str| (key == wanted).then(|| text.to_owned());
        Definition {
            id: "user.copy".to_owned(),
            arm: text("arm"),
            pendulum: text("pendulum"),
            voltage: text("voltage"),
            parameters,
            ..Definition::default()
        }
    };
    let drag = || vec![strength("coefficient", "N m s2/rad2")];
    let spring = || vec![strength("stiffness", "N m/rad"), other("rest", "rad")];
    let wave = |unit: &str| {
        vec![
            strength("amplitude", unit),
            other("order", "-"),
            other("phase", "rad"),
        ]
    };
    vec![
        (
            "arm.quadratic",
            law("arm", "-coefficient * abs(theta_dot) * theta_dot", drag()),
            vec![3e-5],
        ),
        (
            "arm.spring",
            law("arm", "-stiffness*(theta - rest)", spring()),
            vec![2e-3, -0.5],
        ),
        (
            "arm.cable",
            law(
                "arm",
                "-(stiffness*(theta - rest) + asymmetry*(theta - rest)^2 + cubic*(theta - rest)^3)",
                vec![
                    strength("stiffness", "N m/rad"),
                    strength("asymmetry", "N m/rad2"),
                    strength("cubic", "N m/rad3"),
                    other("rest", "rad"),
                ],
            ),
            vec![2e-3, 5e-4, 1e-3, 0.3],
        ),
        (
            "arm.cogging",
            law("arm", "amplitude*sin(order*theta + phase)", wave("N m")),
            vec![1e-3, 12.0, 0.7],
        ),
        (
            "motor.ripple",
            Definition {
                constants: vec![constant("gain", "N m/V", c.drive)],
                ..law("arm", "amplitude*sin(order*theta + phase)*gain*u", wave("-"))
            },
            vec![0.2, 12.0, 0.7],
        ),
        (
            "disturbance.vibration",
            law(
                "arm",
                "amplitude*sin(2*pi*frequency*t + phase)",
                vec![
                    strength("amplitude", "N m"),
                    other("frequency", "Hz"),
                    other("phase", "rad"),
                ],
            ),
            vec![1e-3, 7.0, 0.4],
        ),
        (
            "arm.tilt",
            Definition {
                pendulum: Some(
                    "weight*(sin(angle)*cos(alpha)*sin(theta - direction) - (1 - cos(angle))*sin(alpha))"
                        .to_owned(),
                ),
                constants: vec![
                    constant("weight", "N m", c.weight),
                    constant("lever", "N m", c.lever),
                ],
                ..law(
                    "arm",
                    "sin(angle)*(weight*sin(alpha)*cos(theta - direction) - lever*(unbalance + 1)*sin(theta - \
                     direction))",
                    vec![
                        strength("angle", "rad"),
                        other("direction", "rad"),
                        other("unbalance", "-"),
                    ],
                )
            },
            vec![0.05, 1.1, 0.2],
        ),
        (
            "pendulum.quadratic",
            law("pendulum", "-coefficient*abs(alpha_dot)*alpha_dot", drag()),
            vec![3e-5],
        ),
        (
            "pendulum.spring",
            law("pendulum", "-stiffness*(alpha - rest)", spring()),
            vec![1e-3, 3.0],
        ),
        (
            "pendulum.bias",
            law("pendulum", "torque", vec![strength("torque", "N m")]),
            vec![1e-3],
        ),
        (
            "motor.bias",
            law("voltage", "voltage", vec![strength("voltage", "V")]),
            vec![0.3],
        ),
        (
            "motor.drift",
            law("voltage", "rate*t*u", vec![strength("rate", "1/s")]),
            vec![0.1],
        ),
        (
            "motor.asymmetry",
            law(
                "voltage",
                "(gain - 1)*min(u, 0)",
                vec![Parameter {
                    off: 1.0,
                    ..strength("gain", "-")
                }],
            ),
            vec![0.8],
        ),
        (
            "motor.deadzone",
            law(
                "voltage",
                "-max(-width, min(width, u))",
                vec![strength("width", "V")],
            ),
            vec![0.3],
        ),
    ]
}

/// To 1e-12 on a trajectory of 0.6 s, each of the laws seen on it.
#[test]
fn the_catalogue_written_as_text_is_the_same() {
    let without = run::<f64>(&[]);
    for (id, text, values) in catalogue() {
        let known = Effect::new(id, &values).expect(id);
        let own = Effect::checked(text.compile().expect(id), &values).expect(id);
        let (wanted, got) = (run(&[known]), run(&[own]));
        let apart = |a: &[[f64; 4]], b: &[[f64; 4]]| {
            let pairs = a.iter().flatten().zip(b.iter().flatten());
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        assert!(apart(&wanted, &without) > 1e-5, "{id} is not seen");
        assert!(
            apart(&wanted, &got) < 1e-12,
            "{id}: {:e}",
            apart(&wanted, &got)
        );
        // In single precision as close as the catalogue's own law.
        let (wanted, got) = (run(&[known.cast::<f32>()]), run(&[own.cast::<f32>()]));
        assert!(
            apart(&wanted, &got) < 1e-3,
            "{id}: {:e}",
            apart(&wanted, &got)
        );
    }
}

/// Limits, which are off at infinity, have a switch as their strength.
#[test]
fn limits_written_as_text_are_the_same() {
    let c = qube().params.coefficients();
    let limit = |text: &str, unit: &str, value: f64, voltage: bool| {
        let text = |wanted: bool| (voltage == wanted).then(|| text.to_owned());
        Definition {
            id: "user.copy".to_owned(),
            arm: text(false),
            voltage: text(true),
            parameters: vec![strength("on", "-")],
            constants: vec![
                constant("limit", unit, value),
                constant("drive", "N m/V", c.drive),
                constant("damping", "N m s/rad", c.arm_damping),
            ],
            ..Definition::default()
        }
    };
    let current = "on*(max(-limit, min(limit, drive*u - 0.7*damping*theta_dot)) - drive*u + 0.7*damping*theta_dot)";
    let torque = 0.5 * c.drive;
    let without = run::<f64>(&[]);
    for (id, values, text) in [
        (
            "motor.saturation",
            vec![0.8],
            limit("on*(max(-limit, min(limit, u)) - u)", "V", 0.8, true),
        ),
        (
            "motor.current_limit",
            vec![torque, 0.7],
            limit(current, "N m", torque, false),
        ),
    ] {
        let known = run(&[Effect::new(id, &values).expect(id)]);
        let own = run(&[Effect::checked(text.compile().expect(id), &[1.0]).expect(id)]);
        for ((a, b), c) in known
            .iter()
            .flatten()
            .zip(own.iter().flatten())
            .zip(without.iter().flatten())
        {
            assert!((a - b).abs() < 1e-12, "{id}: {a} {b} {c}");
        }
        let seen = known.iter().flatten().zip(without.iter().flatten());
        assert!(
            seen.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) > 1e-3,
            "{id} is not seen"
        );
    }
}

/// So are the matrices of a design, by dual numbers.
#[test]
fn linear_models_are_the_same() {
    for (id, text, values) in catalogue() {
        let model = |effect| {
            let plant: Plant<f64> = Plant::new(&qube().params, &[effect]).expect("valid");
            linearize(&plant, State::new(0.1, 0.05, 0.3, -0.2), 0.4)
        };
        let own = model(Effect::checked(text.compile().expect(id), &values).expect(id));
        let known = model(Effect::new(id, &values).expect(id));
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
        let all = own
            .a
            .iter()
            .zip(known.a.iter())
            .chain(own.b.iter().zip(known.b.iter()));
        for (a, b) in all {
            assert!(near(*a, *b), "{id}: {a} {b}");
        }
    }
}

/// A law's value at theta, alpha, theta_dot, alpha_dot, u and t.
type Value = fn(&[f64; 6]) -> f64;

/// Expressions as a person writes them, with their values by Rust's own functions.
fn expression() -> impl Strategy<Value = (String, Value)> {
    let all: [(&str, Value); 12] = [
        ("sin(2*alpha)*theta_dot/w", |v| {
            (2.0 * v[1]).sin() * v[2] / 2.0
        }),
        ("cos(alpha) - -sin(alpha)^3", |v| {
            v[1].cos() + v[1].sin().powi(3)
        }),
        ("tanh(theta_dot/w)*c", |v| (v[2] / 2.0).tanh() * 0.7),
        ("exp(-(alpha_dot/w)^2/c^2)", |v| {
            (-(v[3] / 2.0).powi(2) / 0.49).exp()
        }),
        ("sign(theta_dot, w)", |v| (v[2] / 2.0).tanh()),
        ("max(theta, alpha)*min(theta, 1e-1)", |v| {
            v[0].max(v[1]) * v[0].min(0.1)
        }),
        ("abs(theta_dot)*theta_dot/w^2", |v| v[2].abs() * v[2] / 4.0),
        ("sqrt(1 + (theta_dot/w)^2)", |v| {
            (1.0 + v[2] * v[2] / 4.0).sqrt()
        }),
        ("1 - 2 - 3/4/5 + .5e1*theta", |v| -1.0 - 0.15 + 5.0 * v[0]),
        ("2*-theta^2", |v| -2.0 * v[0] * v[0]),
        ("cos(w*t)*(pi - c)", |v| {
            (2.0 * v[5]).cos() * (std::f64::consts::PI - 0.7)
        }),
        ("max(0, theta) + 0", |v| v[0].max(0.0)),
    ];
    prop::sample::select(all.map(|(text, value)| (text.to_owned(), value)).to_vec())
}

fn torque<S: Scalar>(effect: &Effect<S>, v: [S; 6]) -> S {
    let c = qube().params.coefficients().cast();
    let x = State::new(v[0], v[1], v[2], v[3]);
    let at = Instant {
        clock: Clock::at(v[5]),
        x: &x,
        angle: Angle::of(x.alpha),
        coefficients: &c,
        memory: S::ZERO,
        volts: v[4],
    };
    effect.torque(&at)[0]
}

proptest! {
    /// A law means what mathematics says, and its derivatives by dual numbers are those by differences.
    #[test]
    fn values_and_slopes_are_those_of_the_text(
        (text, wanted) in expression(),
        (second, factor) in expression(),
        v in prop::array::uniform6(-2.0..2.0_f64),
    ) {
        prop_assume!(v.iter().all(|x| x.abs() > 1e-3) && (v[0] - v[1]).abs() > 1e-3 && (v[0] - 0.1).abs() > 1e-3);
        let spec = of(&format!("k*({text})*({second})")).compile().expect("valid");
        let value = |v: [f64; 6], k: f64| torque(&Effect::of(spec, &[k, 0.7]).expect("own"), v);
        let right = 0.5 * wanted(&v) * factor(&v);
        prop_assert!((value(v, 0.5) - right).abs() <= 1e-12 * (1.0 + right.abs()), "{text}: {}", value(v, 0.5));
        let mut n = 0;
        let jets = v.map(|x| { n += 1; Jet::<f64, 7>::variable(x, n - 1) });
        let by_jet = torque(&Effect::of(spec, &[Jet::variable(0.5, 6), Jet::from_f64(0.7)]).expect("own"), jets);
        prop_assert!((by_jet.v - value(v, 0.5)).abs() <= 1e-12 * (1.0 + right.abs()));
        let h = 1e-5;
        for i in 0..6 {
            let (mut up, mut down) = (v, v);
            up[i] += h;
            down[i] -= h;
            let slope = (value(up, 0.5) - value(down, 0.5)) / (2.0 * h);
            // the third derivative times h²/6, and rounding over h
            prop_assert!((by_jet.d[i] - slope).abs() <= 1e-6 * (1.0 + slope.abs()), "{text}: {i}");
        }
        prop_assert!((by_jet.d[6] - value(v, 1.0)).abs() <= 1e-12 * (1.0 + right.abs()));
    }

    /// Whatever is written is answered, and what is answered as an error can be shown.
    #[test]
    fn any_law_is_answered(text in "[-+*/^() .,0-9a-z_é\u{7}]{0,60}", unit in "[-a-zA-Z0-9/() ]{0,12}") {
        let law = Definition { parameters: vec![strength("k", &unit), other("c", "-")], ..of(&text) };
        for d in [of(&text), of(&format!("k*({text})")), law] {
            if let Err(e) = d.compile() {
                prop_assert!(e.to_string().contains("user.test"));
            }
        }
    }

    #[test]
    fn any_file_is_answered(text in ".{0,200}") {
        let _ = read(&text);
    }
}

/// Character (from 1) and words of the answer to each mistake.
#[test]
fn each_mistake_is_shown_where_it_is() {
    for (law, column, wide, words) in [
        ("k*sin(thetta)", 7, 6, "`thetta` is no variable"),
        (
            "k*theta_dot",
            1,
            11,
            "the law is in N m rad/s, it must be in N m: a factor in s/rad is missing",
        ),
        (
            "k*(theta + theta_dot)",
            12,
            9,
            "`theta_dot` is in rad/s and `theta` in rad",
        ),
        ("k*(u - c*t)", 8, 3, "`c*t` is in s and `u` in V"),
        (
            "k*exp(u)",
            7,
            1,
            "exp takes a pure number or an angle, `u` is in V",
        ),
        ("k*max(theta, u)", 14, 1, "`u` is in V and `theta` in rad"),
        ("k*sign(u)", 3, 7, "sign(x, width)"),
        ("k*sin(theta", 12, 1, "the law ends here"),
        ("k*theta)", 8, 1, "`)` stands here"),
        ("k*theta^1.5", 10, 1, "`.` stands here"),
        ("k*theta^c", 9, 1, "a power is a whole number"),
        ("k*2 theta", 5, 1, "`t` stands here"),
        ("", 1, 1, "the law ends here"),
        ("k*1e999", 3, 5, "no finite number"),
        ("k*sqrt(t)", 8, 1, "a root of s has no unit"),
        ("k + 1", 5, 1, "`1` is a pure number and `k` in N m"),
        ("k*sin(θ)", 7, 1, "stands here"),
    ] {
        let error = of(law).compile().expect_err(law);
        let HypothesisError::Text(marked) = &error else {
            panic!("{law}: {error}");
        };
        assert_eq!(marked.column(), column, "{law}: {error}");
        let text = error.to_string();
        assert!(
            text.contains(words) && text.contains(&format!("character {column}")),
            "{text}"
        );
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1].trim_start(), law);
        assert_eq!(lines[2].trim_start_matches(' ').len(), wide, "{text}");
        assert_eq!(lines[2].find('^'), Some(1 + column), "{text}");
    }
    // A law of the voltage does not see the state; a long one, a deep one.
    let voltage = Definition {
        voltage: Some("k*theta_dot".to_owned()),
        arm: None,
        ..of("")
    };
    let text = voltage.compile().expect_err("no state").to_string();
    assert!(
        text.contains("voltage, character 3: `theta_dot` is not seen here"),
        "{text}"
    );
    let long = of(&format!("k{}", "+k".repeat(60)))
        .compile()
        .expect_err("long");
    assert!(long.to_string().contains("more than 64 numbers"), "{long}");
    let deep = format!("{}k{}", "k+(".repeat(14), ")".repeat(14));
    let deep = of(&deep).compile().expect_err("deep");
    assert!(
        deep.to_string().contains("nested more than 12 deep"),
        "{deep}"
    );
    let endless = of(&"(".repeat(401)).compile().expect_err("endless");
    assert!(endless.to_string().contains("longer than 400"), "{endless}");
}

#[test]
fn what_is_no_hypothesis_is_refused() {
    let refused = |change: &dyn Fn(&mut Definition)| {
        let mut d = of("k*c*theta");
        change(&mut d);
        d.compile().expect_err("must be refused").to_string()
    };
    for id in [
        "user.",
        "my-drag",
        "user.Drag",
        "user.a.b",
        "arm.spring",
        "user.1",
    ] {
        assert!(
            refused(&|d| d.id = id.to_owned()).contains("user.my-drag"),
            "{id}"
        );
    }
    assert!(refused(&|d| d.arm = None).contains("it has no law"));
    assert!(refused(&|d| d.parameters.clear()).contains("1 to 4 parameters"));
    let both = |d: &mut Definition| d.parameters[0].strength = None;
    assert!(refused(&both).contains("strength = true; it has k, c"));
    let text = refused(&|d| d.arm = Some("k + c*k*0 + 1e-3*k/k".to_owned()));
    assert!(
        text.contains("pure number") || text.contains("must be 0"),
        "{text}"
    );
    let text = refused(&|d| {
        d.parameters[0] = strength("k", "-");
        d.constants.push(constant("torque", "N m", 1.0));
        d.arm = Some("torque*(1 + k)".to_owned());
    });
    assert!(
        text.contains("with k = 0 the law of `arm` is 1 N m at theta = 0 rad"),
        "{text}"
    );
    let text = refused(&|d| d.arm = Some("k*theta/alpha".to_owned()));
    assert!(
        text.contains("NaN") && text.contains("keep divisors"),
        "{text}"
    );
    assert!(refused(&|d| d.parameters[1].name = "theta".to_owned()).contains("something else"));
    assert!(refused(&|d| d.parameters[1].name = "k".to_owned()).contains("something else"));
    assert!(refused(&|d| d.parameters[1].typical = 0.0).contains("parameters.c.typical = 0"));
    assert!(refused(&|d| d.parameters[1].min = 1e4).contains("parameters.c.range = [10000, 1000]"));
    let text = refused(&|d| d.parameters[1].unit = "N q".to_owned());
    assert!(
        text.contains("parameters.c.unit, character 3: this is no unit"),
        "{text}"
    );
}

const FILE: &str = r#"
[hypothesis."user.eddy-brake"]
name = "Eddy-current brake at the arm"
arm = "-k*theta_dot/(1 + (theta_dot/v)^2)"
parameters.k = { unit = "N m s/rad", min = 0.0, max = 1.0, typical = 1e-4, strength = true }
parameters.v = { unit = "rad/s", min = 0.5, max = 100.0, typical = 5.0 }
"#;

#[test]
fn files_are_read_with_lines() {
    let spec = read(FILE).expect("valid")[0];
    assert_eq!(
        (spec.name, spec.strengths, spec.parameters.len()),
        ("Eddy-current brake at the arm", 1, 2)
    );
    // The same text is the same effect, kept once.
    assert!(std::ptr::eq(spec, read(FILE).expect("valid")[0]));
    assert_eq!(
        effects::spec("user.eddy-brake").map(|s| s.id),
        Some(spec.id)
    );
    let text = read(&FILE.replace("theta_dot/v", "theta_dott/v"))
        .expect_err("misspelt")
        .to_string();
    assert!(text.contains("arm (line 4), character 20"), "{text}");
    let text = read(&FILE.replace("N m s/rad", "N m sec/rad"))
        .expect_err("no unit")
        .to_string();
    assert!(
        text.contains("parameters.k.unit (line 5), character 5"),
        "{text}"
    );
    let text = read(&FILE.replace("typical = 5.0", "tipical = 5.0"))
        .expect_err("no key")
        .to_string();
    assert!(
        text.contains("line 6") && text.contains("tipical"),
        "{text}"
    );
    assert_eq!(read("").expect_err("empty"), HypothesisError::Nothing);
}

/// A rig file carries the law of its effect, and reading it needs nothing else; two laws of one id live side by side.
#[test]
fn rig_files_carry_the_law() {
    let spec = read(FILE).expect("valid")[0];
    let mut rig = qube();
    rig.effects
        .push(Effect::of(spec, &[2e-4, 4.0]).expect("own"));
    let text = rig.to_toml();
    assert!(
        text.contains("[hypothesis.\"user.eddy-brake\"]\nname = \"Eddy"),
        "{text}"
    );
    let again = Rig::from_toml(&text).expect("readable");
    assert_eq!(again, rig);
    assert_eq!(again.to_toml(), text);
    let stronger =
        Rig::from_toml(&text.replace("-k*theta_dot", "-2*k*theta_dot")).expect("readable");
    assert_ne!(stronger, rig);
    let end = |rig: &Rig| {
        let plant: Plant<f64> = rig.plant();
        let u = [1.0; 200];
        trajectory(&plant, plant.rest(start()), &u, 2e-3, 1, |_| true).expect("valid")[200]
    };
    assert!((end(&stronger).theta - end(&rig).theta).abs() > 1e-6);
    assert_eq!(end(&again), end(&rig));
    // Without its law the effect says nothing, whatever this process has read before.
    let start = text.find("[hypothesis").expect("written");
    let stop = text.find("[effects").expect("written");
    let lost = Rig::from_toml(&(text[..start].to_owned() + &text[stop..]))
        .expect_err("no law")
        .to_string();
    assert!(lost.contains("[hypothesis.\"user.eddy-brake\"]"), "{lost}");
    let wrong = Rig::from_toml(&text.replace("v)^2", "v)^t"))
        .expect_err("wrong law")
        .to_string();
    assert!(
        wrong.starts_with("rig file: hypothesis user.eddy-brake, arm (line"),
        "{wrong}"
    );
    let range = Rig::from_toml(&text.replace("v = 4.0", "v = 0.1"))
        .expect_err("out of range")
        .to_string();
    assert!(
        range.contains("v = 0.1 is outside the allowed range [0.5, 100] rad/s"),
        "{range}"
    );
}

/// Two of a kind act in the order of their ids, however they are given.
#[test]
fn the_order_does_not_matter() {
    let law = |id: &str, text: &str| {
        let d = Definition {
            id: id.to_owned(),
            arm: None,
            voltage: Some(text.to_owned()),
            parameters: vec![strength("k", "-")],
            ..of("")
        };
        Effect::of(d.compile().expect("valid"), &[0.3]).expect("own")
    };
    let (a, b) = (law("user.a", "k*max(u, 0)"), law("user.b", "-k*tanh(k)*u"));
    assert_eq!(run(&[a, b]), run(&[b, a]));
}
