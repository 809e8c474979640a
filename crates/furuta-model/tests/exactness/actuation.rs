//! Commands that are no voltage, against closed forms.

use furuta_model::dynamics::acceleration;
use furuta_model::{
    Actuation, Effect, EffectError, Jet, Lanes, Params, Plant, PlantError, Rig, Scalar, State,
    linearize,
};
use proptest::prelude::*;

fn rig(name: &str) -> Rig {
    Rig::builtin(name).expect("built in")
}

fn plant<S: Scalar>(rig: &Rig, effects: &[(&str, S)]) -> Plant<S> {
    let effects: Vec<_> = effects
        .iter()
        .map(|(id, value)| Effect::new(id, &[*value]).expect("valid"))
        .collect();
    Plant::new(&rig.params.cast(), &effects).expect("possible")
}

proptest! {
    /// `theta'' = u`, and the pendulum on a base that is moved so:
    /// `(I + m c²) alpha'' = m L c cos u + k sin cos theta'² + m g c sin - b alpha'`.
    #[test]
    fn a_commanded_acceleration_is_the_arms(
        alpha in -4.0..4.0_f64, theta_dot in -20.0..20.0_f64, alpha_dot in -40.0..40.0_f64, u in -150.0..150.0_f64,
    ) {
        let p = rig("stepper-kit").params;
        let (m, l, c) = (p.pendulum.mass, p.arm.length, p.pendulum.com);
        let (sin, cos) = alpha.sin_cos();
        let k = m * c * c + p.pendulum.inertia_transverse - p.pendulum.inertia_axial;
        let moment = m * l * c * cos * u + k * sin * cos * theta_dot * theta_dot + m * p.gravity * c * sin
            - p.pendulum.viscous * alpha_dot;
        let [arm, pendulum] = acceleration(&p.coefficients(), &State::new(0.3, alpha, theta_dot, alpha_dot), u);
        prop_assert!((arm - u).abs() < 1e-12 * (1.0 + u.abs()), "{arm} {u}");
        let expected = moment / (p.pendulum.inertia + m * c * c);
        prop_assert!((pendulum - expected).abs() < 1e-11 * (100.0 + expected.abs()), "{pendulum} {expected}");
    }

    /// In single precision, in lanes, and on a voltage motor without resistance's part the same equations.
    #[test]
    fn a_current_is_a_torque(
        alpha in -4.0..4.0_f64, theta_dot in -20.0..20.0_f64, alpha_dot in -40.0..40.0_f64, u in -1.8..1.8_f64,
    ) {
        let p = rig("qube-servo-3").params;
        let (m, l, c) = (p.pendulum.mass, p.arm.length, p.pendulum.com);
        let (sin, cos) = alpha.sin_cos();
        let k = m * c * c + p.pendulum.inertia_transverse;
        let mass = [
            [p.arm.inertia + m * l * l + k * sin * sin, -m * l * c * cos],
            [-m * l * c * cos, p.pendulum.inertia + m * c * c],
        ];
        let torque = p.motor.torque_constant * u - p.arm.viscous * theta_dot;
        let right = [
            torque - 2.0 * k * sin * cos * theta_dot * alpha_dot - m * l * c * sin * alpha_dot * alpha_dot,
            k * sin * cos * theta_dot * theta_dot + m * p.gravity * c * sin - p.pendulum.viscous * alpha_dot,
        ];
        let [arm, pendulum] = acceleration(&p.coefficients(), &State::new(0.3, alpha, theta_dot, alpha_dot), u);
        for (row, right) in mass.iter().zip(right) {
            let left = row[0] * arm + row[1] * pendulum;
            prop_assert!((left - right).abs() < 1e-12 * (1.0 + right.abs()), "{left} {right}");
        }
    }
}

/// On a base that turns steadily nothing is lost in the turning frame:
/// `P alpha'²/2 - k sin² w²/2 + m g c cos alpha` stays.
#[test]
fn on_a_steady_base_the_pendulum_keeps_its_energy() {
    let mut rig = rig("stepper-kit");
    rig.params.pendulum.viscous = 0.0;
    let c = rig.params.coefficients();
    let energy = |x: &State<f64>| {
        let sin = x.alpha.sin() * x.theta_dot;
        0.5 * (c.pendulum * x.alpha_dot * x.alpha_dot - c.swing * sin * sin)
            + c.weight * x.alpha.cos()
    };
    let plant = plant::<f64>(&rig, &[]);
    let mut s = plant.rest(State::new(0.0, 0.7, 9.0, -3.0));
    let before = energy(&s.x);
    for _ in 0..20_000 {
        plant.step(&mut s, 0.0, 5e-4);
    }
    assert!((s.x.theta_dot - 9.0).abs() < 1e-9 && (s.x.theta - 90.0).abs() < 1e-8);
    assert!(
        (energy(&s.x) - before).abs() < 1e-7 * c.weight,
        "{}",
        energy(&s.x) - before
    );
}

/// Single precision and lanes take the same step.
#[test]
fn every_scalar_follows_the_command() {
    let rig = rig("stepper-kit");
    let start = State::new(0.1, 2.0, 1.0, -4.0);
    let (double, single) = (plant::<f64>(&rig, &[]), plant::<f32>(&rig, &[]));
    let several = plant::<Lanes<f64, 4>>(&rig, &[]);
    let mut a = double.rest(start);
    let mut b = single.rest(start.map(|x| x as f32));
    let mut c = several.rest(start.map(Lanes::from_f64));
    for k in 0..200 {
        let u = 100.0 * (f64::from(k) * 0.07).sin();
        double.step(&mut a, u, 0.005);
        single.step(&mut b, u as f32, 0.005);
        several.step(&mut c, Lanes::from_f64(u), 0.005);
    }
    assert!(
        (f64::from(b.x.theta) - a.x.theta).abs() < 1e-4
            && (f64::from(b.x.alpha) - a.x.alpha).abs() < 1e-3
    );
    assert!(
        c.x.alpha
            .0
            .iter()
            .all(|lane| lane.to_bits() == a.x.alpha.to_bits())
    );
}

/// 10 rad/s² up to 2 rad/s, then steadily, then back: to the last bits, with the derivative by the limit and by a delay
/// that falls within a sample.
#[test]
fn the_arm_keeps_to_its_largest_speed() {
    type Number = Jet<f64, { crate::FEW }>;
    let rig = rig("stepper-kit");
    let (limit, delay) = (Number::variable(2.0, 0), Number::variable(0.013, 1));
    let plant = plant(
        &rig,
        &[("motor.speed_limit", limit), ("motor.delay", delay)],
    );
    let mut s = plant.rest(State::hanging());
    let command = |k: usize| if k < 50 { 10.0 } else { -30.0 };
    for k in 0..75 {
        plant.step(&mut s, Number::constant(command(k)), 0.02);
    }
    // Rises for 0.2 s from 0.013 s on, turns at 1.013 s: -2 rad/s after 4/30 s.
    let turned = 1.013 + 4.0 / 30.0;
    let theta = 2.0 * (1.013 - 0.013 - 0.1) - 2.0 * (1.5 - turned);
    assert!((s.x.theta_dot.v + 2.0).abs() < 1e-12, "{}", s.x.theta_dot.v);
    assert!(
        (s.x.theta.v - theta).abs() < 1e-12,
        "{} {theta}",
        s.x.theta.v
    );
    // d theta / d limit = (1 - limit/10) - (1.5 - 1.013 - limit*2/30) + limit*2/30, d theta / d delay = 0 + limit.
    let by_limit = (1.0 - 0.2) - (1.5 - turned) + 4.0 / 30.0;
    assert!(
        (s.x.theta.d[0] - by_limit).abs() < 1e-11,
        "{} {by_limit}",
        s.x.theta.d[0]
    );
    assert!((s.x.theta.d[1] - 2.0).abs() < 1e-11, "{}", s.x.theta.d[1]);
}

/// Through a lag the limit is reached where the speed's closed form says.
#[test]
fn the_limit_counts_behind_a_lag() {
    let rig = rig("stepper-kit");
    let (limit, lag) = (1.5, 0.05);
    let plant = plant::<f64>(&rig, &[("motor.speed_limit", limit), ("motor.lag", lag)]);
    let mut s = plant.rest(State::hanging());
    let speed = |t: f64| 10.0 * (t - lag * (1.0 - (-t / lag).exp()));
    for k in 1..=30 {
        plant.step(&mut s, 10.0, 0.01);
        let expected = speed(0.01 * f64::from(k)).min(limit);
        assert!(
            (s.x.theta_dot - expected).abs() < 1e-6,
            "{k}: {} {expected}",
            s.x.theta_dot
        );
    }
}

/// A held command is followed by ringing about it, as the closed form of a mass on a spring says; entered at any
/// sample, it goes on as if it had been followed from the start.
#[test]
fn an_arm_rings_about_a_held_command() {
    type Number = Jet<f64, { crate::FEW }>;
    let rig = rig("stepper-kit");
    let (period, damping, h) = (0.05, 0.2, 0.004);
    let values = [Number::variable(period, 0), Number::constant(damping)];
    let ringing = Effect::new("motor.resonance", &values).expect("valid");
    let plant = Plant::new(&rig.params.cast(), &[ringing]).expect("possible");
    let mut s = plant.rest(State::hanging());
    let push = 10.0;
    let lag = |period: f64, t: f64| {
        let w = std::f64::consts::TAU / period;
        let swing = w * (1.0 - damping * damping).sqrt();
        let (sin, cos) = (swing * t).sin_cos();
        let fading = (-damping * w * t).exp();
        push / (w * w) * (1.0 - fading * (cos + damping * w / swing * sin))
    };
    for k in 1..=100 {
        plant.step(&mut s, Number::constant(push), h);
        let t = h * f64::from(k);
        let expected = 0.5 * push * t * t - lag(period, t);
        // Runge and Kutta's of a forcing that turns by half a radian in a step.
        assert!(
            (s.x.theta.v - expected).abs() < 2e-6,
            "{k}: {} {expected}",
            s.x.theta.v
        );
        let slope = -(lag(period + 1e-6, t) - lag(period - 1e-6, t)) / 2e-6;
        assert!(
            (s.x.theta.d[0] - slope).abs() < 2e-3,
            "{k}: {} {slope}",
            s.x.theta.d[0]
        );
    }
    let mut past = vec![0.0; 20];
    past.extend([push; 100]);
    let mut entered = plant.resume(s.x, 100.0 * h, &past, h);
    plant.step(&mut s, Number::constant(-push), h);
    plant.step(&mut entered, Number::constant(-push), h);
    assert!((s.x.theta_dot.v - entered.x.theta_dot.v).abs() < 1e-12);
}

/// Lost steps leave the arm where the count is not, and the pendulum feels the way there as a blow: before and after,
/// its motion is that of the equations.
#[test]
fn lost_steps_move_the_arm_and_not_the_count() {
    let rig = rig("stepper-kit");
    let size = -0.125;
    let steps = |reads: f64| {
        let slip = Effect::new("motor.lost_steps", &[size, 0.1234, 0.0, reads]).expect("valid");
        Plant::new(&rig.params, &[slip]).expect("possible")
    };
    let sound = plant::<f64>(&rig, &[]);
    let go = |plant: &Plant<f64>, h: f64| {
        let mut s = plant.rest(State::hanging());
        for k in 0..145 {
            plant.step(&mut s, 20.0 * (9.0 * h * f64::from(k / 5 * 5)).sin(), h);
        }
        (s.x, plant.measure(&s))
    };
    let h = 0.001;
    let (there, [theta, _]) = go(&sound, h);
    let (slipped, [on_arm, _]) = go(&steps(0.0), h);
    let (_, [counted, _]) = go(&steps(1.0), h);
    assert!((slipped.theta - there.theta - size).abs() < 1e-12);
    assert!((slipped.theta_dot - there.theta_dot).abs() < 1e-9);
    assert!((on_arm - theta - size).abs() < 1e-12 && (counted - theta).abs() < 1e-12);
    // The blow, just after the slip, which is short against the pendulum's swing.
    let c = rig.params.coefficients();
    let blow = slipped.alpha - there.alpha;
    let expected = -c.coupling / c.pendulum * size;
    assert!((blow / expected - 1.0).abs() < 0.05, "{blow} {expected}");
}

#[test]
fn the_linear_model_is_the_closed_form() {
    let rig = rig("stepper-kit");
    let (c, linear) = (
        rig.params.coefficients(),
        linearize(&rig.nominal_plant(), State::upright(), 0.0),
    );
    let pendulum = [
        c.weight / c.pendulum,
        -c.pendulum_damping / c.pendulum,
        c.coupling / c.pendulum,
    ];
    let expected = [
        [0.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0],
        [0.0, pendulum[0], 0.0, pendulum[1], pendulum[2]],
    ];
    for (r, row) in expected.iter().enumerate() {
        for (column, value) in row.iter().enumerate() {
            let found = if column < 4 {
                linear.a[(r, column)]
            } else {
                linear.b[r]
            };
            assert!(
                (found - value).abs() < 1e-10 * (1.0 + value.abs()),
                "{r} {column}: {found} {value}"
            );
        }
    }
}

#[test]
fn effects_that_make_no_sense_are_named() {
    let stepper = rig("stepper-kit").params;
    let refused = |params: &Params<f64>, id: &str, values: &[f64]| {
        let effect = Effect::new(id, values).expect("valid");
        match Plant::new(params, &[effect]) {
            Err(PlantError::Effect(EffectError::OtherActuation {
                effect, actuation, ..
            })) => {
                assert_eq!(effect, id);
                Some(actuation)
            }
            _ => None,
        }
    };
    for (id, values) in [
        ("arm.coulomb", &[0.01][..]),
        ("arm.spring", &[0.01, 0.0]),
        ("drive.compliance", &[0.5, 1e-3, 0.4, 0.0]),
        ("disturbance.arm_kick", &[0.1, 0.1, 1.0, 0.0]),
    ] {
        assert_eq!(
            refused(&stepper, id, values),
            Some(Actuation::Acceleration),
            "{id}"
        );
        assert_eq!(
            refused(&rig("qube-servo-3").params, id, values),
            None,
            "{id}"
        );
    }
    for (id, values) in [
        ("motor.delay", &[0.01][..]),
        ("pendulum.coulomb", &[1e-4]),
        ("motor.speed_limit", &[5.0]),
        ("motor.resonance", &[0.03, 0.1]),
        ("motor.lost_steps", &[0.1, 1.0, 0.0, 1.0]),
    ] {
        assert_eq!(refused(&stepper, id, values), None, "{id}");
    }
    let qube = rig("qube-servo-2").params;
    for (id, values) in [
        ("motor.speed_limit", &[5.0][..]),
        ("motor.resonance", &[0.03, 0.1]),
        ("motor.lost_steps", &[0.1, 1.0, 0.0, 1.0]),
    ] {
        assert_eq!(refused(&qube, id, values), Some(Actuation::Voltage), "{id}");
    }
}

#[test]
fn rig_files_name_what_does_not_enter() {
    let stepper = Rig::builtin_text("stepper-kit").expect("built in");
    let qube = Rig::builtin_text("qube-servo-3").expect("built in");
    let message = |text: &str, from: &str, to: &str| {
        assert!(text.contains(from));
        Rig::from_toml(&text.replace(from, to))
            .expect_err("refused")
            .to_string()
    };
    let inertia = message(stepper, "length = 0.065", "inertia = 1e-4\nlength = 0.065");
    assert!(
        inertia.contains("arm.inertia does not enter") && inertia.contains("\"acceleration\""),
        "{inertia}"
    );
    let resistance = message(qube, "gear_ratio", "resistance = 7.5\ngear_ratio");
    assert!(
        resistance.contains("motor.resistance does not enter"),
        "{resistance}"
    );
    let constant = message(qube, "torque_constant = 0.0422", "");
    assert!(
        constant.contains("motor.torque_constant is missing"),
        "{constant}"
    );
    let kind = message(qube, "\"torque\"", "\"current\"");
    assert!(
        kind.contains("motor.kind = \"current\" with unit = \"A\"")
            && kind.contains("\"acceleration\""),
        "{kind}"
    );
    let friction = format!("{stepper}\n[effects.\"arm.coulomb\"]\ntorque = 0.01\n");
    let friction = Rig::from_toml(&friction).expect_err("refused").to_string();
    assert!(friction.contains("arm.coulomb cannot act"), "{friction}");
    let range = message(stepper, "command_limit = 150.0", "command_limit = -1.0");
    assert!(
        range.contains("motor.command_limit = -1")
            && range.ends_with("rad/s2; values are in SI units"),
        "{range}"
    );
    // A torque in N m has no torque constant.
    let torque = qube
        .replace("\"A\"", "\"N m\"")
        .replace("torque_constant = 0.0422", "");
    let torque = Rig::from_toml(&torque).expect("valid");
    assert_eq!(torque.params.motor.actuation, Actuation::Torque);
    assert_eq!(torque.params.coefficients().drive, 1.0);
    assert_eq!(Rig::from_toml(&torque.to_toml()).expect("readable"), torque);
}
