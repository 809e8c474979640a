//! The model against closed forms.

use furuta_model::{Effect, Plant, Rig, State};

fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

/// The rig without friction and motor.
fn frictionless(rig: &Rig) -> Plant<f64> {
    let mut plant: Plant<f64> = rig.nominal_plant();
    plant.coefficients.arm_damping = 0.0;
    plant.coefficients.pendulum_damping = 0.0;
    plant
}

fn run(
    plant: &Plant<f64>,
    x0: State<f64>,
    h: f64,
    seconds: f64,
    u: impl Fn(f64) -> f64,
) -> State<f64> {
    let mut s = plant.rest(x0);
    for k in 0..(seconds / h).round() as usize {
        plant.step(&mut s, u(k as f64 * h), h);
    }
    s.x
}

#[test]
fn small_swings_have_the_period_of_the_linear_model() {
    // Arm locked by an enormous inertia: a physical pendulum, T = 2 pi sqrt(M22 / (m g c)).
    let rig = qube();
    let mut plant = frictionless(&rig);
    plant.coefficients.arm = 1e6;
    let c = plant.coefficients;
    let period = std::f64::consts::TAU * (c.pendulum / c.weight).sqrt();
    let start = State::new(0.0, std::f64::consts::PI + 1e-3, 0.0, 0.0);
    let x = run(&plant, start, period / 1000.0, period, |_| 0.0);
    // amplitude 1e-3 rad: the period's amplitude dependence is 6e-8 relative
    assert!((x.alpha - start.alpha).abs() < 1e-8 && x.alpha_dot.abs() < 1e-8);
}

#[test]
fn the_steady_speed_of_the_arm_balances_motor_and_friction() {
    // Pendulum hanging, arm turning so slowly that it hardly lifts: drive u = damping * speed.
    let plant: Plant<f64> = qube().nominal_plant();
    let c = plant.coefficients;
    let x = run(&plant, State::hanging(), 1e-3, 60.0, |_| 0.05);
    let speed = c.drive * 0.05 / c.arm_damping;
    assert!(
        (x.theta_dot - speed).abs() < 1e-6 * speed,
        "{} {speed}",
        x.theta_dot
    );
}

#[test]
fn a_stuck_axis_stays_exactly_still() {
    let rig = qube();
    let stall = rig.params.coefficients().drive;
    let plant: Plant<f64> = Plant::new(
        &rig.params,
        &[Effect::new("arm.coulomb", &[1.01 * stall]).expect("valid")],
    )
    .expect("one effect");
    let x = run(&plant, State::hanging(), 1e-3, 60.0, |_| 1.0);
    assert_eq!((x.theta, x.theta_dot), (0.0, 0.0));
    let moving = run(&plant, State::hanging(), 1e-3, 1.0, |_| 1.1);
    assert!(moving.theta > 1e-3);
}

#[test]
fn coulomb_friction_brakes_by_its_torque() {
    // Arm alone (pendulum hanging with an almost massless bob): v falls by torque / inertia per second, then stops.
    let mut p = qube().params;
    p.pendulum.mass = 1e-9;
    p.pendulum.inertia = 1e-9;
    p.pendulum.inertia_transverse = 0.0;
    p.pendulum.viscous = 0.0;
    p.arm.viscous = 0.0;
    p.motor.back_emf_constant = 0.0;
    let torque = 1e-4;
    let plant: Plant<f64> =
        Plant::new(&p, &[Effect::new("arm.coulomb", &[torque]).expect("valid")])
            .expect("one effect");
    let mut s = plant.rest(State::new(0.0, std::f64::consts::PI, 1.0, 0.0));
    for _ in 0..300 {
        plant.step(&mut s, 0.0, 1e-3);
    }
    let expected = 1.0 - torque / plant.coefficients.arm * 0.3;
    assert!(
        (s.x.theta_dot - expected).abs() < 1e-4,
        "{} {expected}",
        s.x.theta_dot
    );
    for _ in 0..2000 {
        plant.step(&mut s, 0.0, 1e-3);
    }
    assert!(s.x.theta_dot.abs() < 1e-12, "{:?}", s.x);
}

#[test]
fn delay_shifts_the_response_by_any_real_time() {
    // A delayed plant under a step equals the undelayed one started later, for a delay that is no multiple of the
    // period.
    let rig = qube();
    let delay = 0.0137;
    let late: Plant<f64> = Plant::new(
        &rig.params,
        &[Effect::new("motor.delay", &[delay]).expect("valid")],
    )
    .expect("one");
    let prompt: Plant<f64> = rig.nominal_plant();
    let mut s = late.rest(State::hanging());
    for _ in 0..200 {
        late.step(&mut s, 2.0, 2e-3);
    }
    let mut r = prompt.rest(State::hanging());
    for _ in 0..10_000 {
        prompt.step(&mut r, 2.0, (0.4 - delay) / 10_000.0);
    }
    // RK4 error at 2 ms
    assert!(
        (s.x - r.x).to_array().iter().all(|d| d.abs() < 1e-6),
        "{:?} {:?}",
        s.x,
        r.x
    );
}

#[test]
fn lag_follows_its_exponential() {
    let rig = qube();
    let plant: Plant<f64> = Plant::new(
        &rig.params,
        &[Effect::new("motor.lag", &[0.02]).expect("valid")],
    )
    .expect("one");
    let mut s = plant.rest(State::hanging());
    for _ in 0..10 {
        plant.step(&mut s, 1.0, 2e-3);
    }
    assert!((s.voltage - (1.0 - (-1.0_f64).exp())).abs() < 1e-14);
}

#[test]
fn a_recording_can_be_entered_at_any_sample() {
    let rig = qube();
    let effects = [
        Effect::new("motor.lag", &[0.01]).expect("valid"),
        Effect::new("motor.deadzone", &[0.3]).expect("valid"),
    ];
    let plant: Plant<f64> = Plant::new(&rig.params, &effects).expect("two");
    let u: Vec<f64> = (0..400)
        .map(|k| 2.0 * (f64::from(k) * 0.05).sin())
        .collect();
    let mut s = plant.rest_under(State::hanging(), u[0]);
    let mut middle = None;
    for (k, u) in u.iter().enumerate() {
        if k == 250 {
            middle = Some(s.clone());
        }
        plant.step(&mut s, *u, 2e-3);
    }
    let mut r = plant.resume(middle.expect("passed").x, 0.5, &u[..250], 2e-3);
    for u in &u[250..] {
        plant.step(&mut r, *u, 2e-3);
    }
    assert!((s.x - r.x).to_array().iter().all(|d| d.abs() < 1e-12));
}

/// Where an encoder was zeroed it reads right, whatever its scale; half a turn from there it is off by the scale's
/// share of half a turn.
#[test]
fn an_encoder_is_right_where_it_was_zeroed() {
    use std::f64::consts::PI;
    for (zero, place) in [(0.0, 0.0), (1.0, PI)] {
        let scale = Effect::new("sensor.alpha.scale", &[0.9, zero]).expect("valid");
        let plant: Plant<f64> = Plant::new(&qube().params, &[scale]).expect("one effect");
        let read = |alpha: f64| plant.measure(&plant.rest(State::new(0.2, alpha, 0.0, 0.0)));
        assert_eq!(read(place), [0.2, place]);
        assert!((read(place + PI)[1] - (place + 0.9 * PI)).abs() < 1e-12);
    }
}
