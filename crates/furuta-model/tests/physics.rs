//! The model against closed forms, invariants and independent derivatives.

use furuta_model::{CATALOGUE, Effect, Plant, Rig, State, energy, linearize};
use proptest::prelude::*;

fn rigs() -> impl Iterator<Item = Rig> {
    Rig::BUILTIN
        .iter()
        .map(|n| Rig::builtin(n).expect("built in"))
}

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
fn energy_is_conserved_without_friction_and_motor() {
    for rig in rigs() {
        let plant = frictionless(&rig);
        let x0 = State::new(0.3, 2.0, 0.5, -1.0);
        let e0 = energy::total(&plant.coefficients, &x0);
        let x = run(&plant, x0, 1e-3, 10.0, |_| 0.0);
        let drift =
            ((energy::total(&plant.coefficients, &x) - e0) / plant.coefficients.weight).abs();
        // RK4's error over 10,000 steps; largest where the pendulum outweighs the arm (ramos-velasco), which then spins fast
        assert!(drift < 5e-8, "{}: {drift}", rig.name);
    }
}

#[test]
fn rk4_converges_with_the_fourth_order() {
    let plant = frictionless(&qube());
    let x0 = State::new(0.0, 1.0, 0.0, 0.0);
    let exact = run(&plant, x0, 1e-4, 1.0, |_| 0.0);
    let error = |h| {
        let e = run(&plant, x0, h, 1.0, |_| 0.0) - exact;
        e.to_array().iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    let ratio = error(4e-3) / error(2e-3);
    // the leading term may cancel on a given motion, as it nearly does here, but no lower order may appear
    assert!(
        ratio > 12.0,
        "halving the step must divide the error by 16 or more, found {ratio}"
    );
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
    // A delayed plant under a step equals the undelayed one started later, for a delay that is no multiple of the period.
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

#[test]
fn the_f32_trajectory_stays_near_the_f64_one() {
    let rig = qube();
    let single: Plant<f32> = rig.nominal_plant();
    let double: Plant<f64> = rig.nominal_plant();
    let mut a = single.rest(State::new(0.0, 2.0, 0.0, 0.0));
    let mut b = double.rest(State::new(0.0, 2.0, 0.0, 0.0));
    for k in 0..10_000 {
        let u = (f64::from(k) * 1e-3 * 3.0).sin();
        single.step(&mut a, u as f32, 1e-3);
        double.step(&mut b, u, 1e-3);
    }
    // rounding of f32 over 10,000 steps of a damped, stable motion
    assert!(
        (f64::from(a.x.theta) - b.x.theta).abs() < 1e-3
            && (f64::from(a.x.alpha) - b.x.alpha).abs() < 1e-3
    );
}

fn any_state() -> impl Strategy<Value = State<f64>> {
    (-3.0..3.0, -4.0..4.0, -10.0..10.0, -15.0..15.0).prop_map(|(a, b, c, d)| State::new(a, b, c, d))
}

proptest! {
    #[test]
    fn effects_of_zero_strength_change_no_bit(x0 in any_state(), which in 0..CATALOGUE.len(), u in -10.0_f64..10.0) {
        let rig = qube();
        let zeros = vec![0.0; CATALOGUE[which].parameters.len()];
        let with: Plant<f64> = Plant::new(&rig.params, &[Effect::unchecked(CATALOGUE[which].id, &zeros).expect("in the catalogue")]).expect("one");
        let without: Plant<f64> = rig.nominal_plant();
        let (a, b) = (run(&with, x0, 2e-3, 0.2, |t| u * (9.0 * t).sin()), run(&without, x0, 2e-3, 0.2, |t| u * (9.0 * t).sin()));
        prop_assert_eq!(a.to_array().map(f64::to_bits), b.to_array().map(f64::to_bits));
    }

    /// Exact Jacobians against central differences of the plant's own rate.
    #[test]
    fn jacobians_agree_with_differences(x in any_state(), u in -5.0_f64..5.0) {
        for rig in rigs() {
            let plant: Plant<f64> = rig.nominal_plant();
            let lin = linearize(&plant, x, u);
            let rate = |x: State<f64>, u: f64| plant.rate(0.0, &x, u, 1e3).to_array();
            for c in 0..5 {
                let h = 1e-5;
                let shifted = |sign: f64| {
                    let mut v = x.to_array();
                    if c < 4 { v[c] += sign * h; }
                    rate(State::from(v), if c == 4 { u + sign * h } else { u })
                };
                let (up, down) = (shifted(1.0), shifted(-1.0));
                for r in 0..4 {
                    let difference = (up[r] - down[r]) / (2.0 * h);
                    let exact = if c < 4 { lin.a[(r, c)] } else { lin.b[r] };
                    // truncation h² and rounding 1e-16/h of numbers up to 1e4
                    prop_assert!((difference - exact).abs() <= 1e-6 * (1.0 + exact.abs() + rate(x, u)[r].abs()));
                }
            }
        }
    }

    /// dE/dt = power of motor and friction (here: without effects).
    #[test]
    fn power_balance(x in any_state(), u in -10.0_f64..10.0) {
        for rig in rigs() {
            let plant: Plant<f64> = rig.nominal_plant();
            let c = plant.coefficients;
            let a = plant.rate(0.0, &x, u, 1e3);
            // dE/dt by the chain rule, with the energy's gradient from dual numbers
            let mut i = 0;
            let jets = State::from(x.to_array().map(|v| { i += 1; furuta_model::Jet::<f64, 4>::variable(v, i - 1) }));
            let e = energy::total(&c.cast(), &jets);
            let de: f64 = e.d.iter().zip(a.to_array()).map(|(g, v)| g * v).sum();
            let t = furuta_model::dynamics::torque(&c, &x, u);
            let power = t[0] * x.theta_dot + t[1] * x.alpha_dot;
            prop_assert!((de - power).abs() < 1e-9 * (1.0 + power.abs()), "{}: {de} {power}", rig.name);
        }
    }

    /// Friction never adds energy: with any dry friction or drag the free plant's energy does not grow.
    #[test]
    fn friction_never_drives(x in any_state(), which in 0..4_usize) {
        let id = ["arm.coulomb", "arm.quadratic", "pendulum.coulomb", "pendulum.quadratic"][which];
        let rig = qube();
        let typical = (furuta_model::effects::spec(id).expect("known").parameters[0].typical)(&rig.params);
        let mut plant: Plant<f64> = Plant::new(&rig.params, &[Effect::new(id, &[typical]).expect("valid")]).expect("one");
        plant.coefficients.arm_damping = 0.0;
        plant.coefficients.pendulum_damping = 0.0;
        let e0 = energy::total(&plant.coefficients, &x);
        let end = run(&plant, x, 1e-3, 0.5, |_| 0.0);
        let e1 = energy::total(&plant.coefficients, &end);
        prop_assert!(e1 <= e0 + 1e-6 * e0.abs().max(plant.coefficients.weight), "{id}: {e0} {e1}");
    }
}

#[test]
fn the_papers_linear_models() {
    // A, eq. (24): printed to four decimals; the entries with C2 follow the corrected value.
    let a = linearize(
        &Rig::builtin("fong2014-emecs")
            .expect("built in")
            .nominal_plant(),
        State::upright(),
        0.0,
    );
    for (r, c, printed) in [
        (2, 1, 5.9796),
        (2, 2, -8.1419),
        (2, 3, -0.1098),
        (3, 1, 57.6254),
        (3, 2, -6.9788),
        (3, 3, -1.0584),
    ] {
        assert!(
            (a.a[(r, c)] - printed).abs() < 1e-3,
            "A[{r},{c}] = {} printed {printed}",
            a.a[(r, c)]
        );
    }
    assert!((a.b[2] - 28.8442).abs() < 2e-3 && (a.b[3] - 24.7236).abs() < 2e-3);
    // B, (A) and (B), printed to two decimals.
    let b = linearize(
        &Rig::builtin("shahzad2022-srv02")
            .expect("built in")
            .nominal_plant(),
        State::upright(),
        0.0,
    );
    for (r, c, printed) in [
        (2, 2, -20.38),
        (2, 1, 54.06),
        (3, 2, -19.22),
        (3, 1, 109.56),
    ] {
        assert!(
            (b.a[(r, c)] - printed).abs() < 6e-3,
            "A[{r},{c}] = {}",
            b.a[(r, c)]
        );
    }
    assert!((b.b[2] - 35.84).abs() < 6e-3 && (b.b[3] - 33.81).abs() < 6e-3);
}
