//! Effects that jump, hold or remember, against closed forms: what happens within a step happens at the right moment.

use furuta_model::effects::spec;
use furuta_model::{Effect, Jet, Params, Plant, PlantState, Rig, Scalar, State, energy};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

fn qube() -> Params<f64> {
    Rig::builtin("qube-servo-2").expect("built in").params
}

/// An arm that nothing brakes, with next to no pendulum: `arm.inertia` and the torque on it are all there is.
fn bare_arm() -> Params<f64> {
    let mut p = qube();
    p.pendulum.mass = 1e-12;
    p.pendulum.inertia = 1e-12;
    p.pendulum.inertia_transverse = 0.0;
    p.pendulum.viscous = 0.0;
    p.arm.viscous = 0.0;
    p.motor.back_emf_constant = 0.0;
    p
}

fn plant(p: &Params<f64>, effects: &[(&str, &[f64])]) -> Plant<f64> {
    let effects: Vec<_> = effects
        .iter()
        .map(|(id, values)| Effect::new(id, values).expect("valid"))
        .collect();
    Plant::new(p, &effects).expect("valid")
}

fn run(plant: &Plant<f64>, s: &mut PlantState<f64>, h: f64, seconds: f64, u: impl Fn(f64) -> f64) {
    for k in 0..(seconds / h).round() as usize {
        plant.step(s, u(k as f64 * h), h);
    }
}

#[test]
fn a_braked_arm_stops_at_the_right_place_whatever_the_step() {
    // v falls by torque/J; it stops after v²/(2 torque/J), within a step of any length, and then stays for ever.
    let p = bare_arm();
    let (torque, v) = (1e-4, 1.0);
    let plant = plant(&p, &[("arm.coulomb", &[torque])]);
    let brake = torque / plant.coefficients.arm;
    for h in [1e-3, 3.7e-3, 1e-2] {
        let mut s = plant.rest(State::new(0.0, PI, v, 0.0));
        run(&plant, &mut s, h, 3.0, |_| 0.0);
        let way = v * v / (2.0 * brake);
        // what the almost massless pendulum still does
        assert!(
            (s.x.theta - way).abs() < 1e-8 && s.x.theta_dot == 0.0,
            "{h}: {:?} {way}",
            s.x
        );
        let angle = s.x.theta;
        run(&plant, &mut s, h, 1.0, |_| 0.0);
        assert_eq!(s.x.theta, angle);
    }
}

#[test]
fn both_axes_stick_for_a_minute_without_moving_a_bit() {
    let p = qube();
    let c = p.coefficients();
    let lean = 0.05_f64;
    for friction in [
        &[
            ("arm.coulomb", &[1.01 * c.drive][..]),
            ("pendulum.coulomb", &[1.01 * c.weight * lean.sin()][..]),
        ][..],
        &[
            ("arm.stribeck", &[0.5 * c.drive, 1.01 * c.drive, 0.1][..]),
            ("pendulum.coulomb", &[1.01 * c.weight * lean.sin()][..]),
        ][..],
    ] {
        let plant = plant(&p, friction);
        // the pendulum leans a little off upright; a volt pushes the arm
        let mut s = plant.rest(State::new(0.3, lean, 0.0, 0.0));
        run(&plant, &mut s, 1e-3, 60.0, |_| 1.0);
        assert_eq!(s.x, State::new(0.3, lean, 0.0, 0.0));
        // a little more and both go
        run(&plant, &mut s, 1e-3, 0.5, |_| 1.2);
        assert!(s.x.theta > 0.3 && s.x.alpha != lean);
    }
}

#[test]
fn stick_and_slip_converge_as_the_step_shrinks() {
    // A slow sine across stiction: reversals, stops and breakaways at all times. The reference has steps 64 times
    // shorter.
    let plant = plant(
        &qube(),
        &[
            ("arm.stribeck", &[2e-3, 4e-3, 0.2]),
            ("pendulum.coulomb", &[2e-4]),
        ],
    );
    let end = |h: f64| {
        let mut s = plant.rest(State::hanging());
        // the command is held for 8 ms whatever the step
        run(&plant, &mut s, h, 4.0, |t| {
            1.2 * (9.0 * (t / 8e-3 + 1e-9).floor() * 8e-3).sin()
        });
        s.x
    };
    let reference = end(1.25e-4);
    let error = |h| {
        (end(h) - reference)
            .to_array()
            .iter()
            .fold(0.0_f64, |m, e| m.max(e.abs()))
    };
    let (coarse, fine) = (error(4e-3), error(1e-3));
    // far below an encoder count (3e-3 rad); speeds likewise
    assert!(fine < 2e-5 && coarse < 1e-3, "{coarse} {fine}");
}

/// The stop angle of a braked arm and the way through a drive's backlash, with derivatives with respect to the effect's
/// parameter.
#[test]
fn derivatives_are_exact_through_events() {
    type Number = Jet<f64, { crate::FEW }>;
    let p = bare_arm();
    let number = |v: f64| Number::from_f64(v);
    let cases: [(&str, &[f64]); 4] = [
        ("arm.coulomb", &[1e-4]),
        ("drive.backlash", &[0.05, 0.4, 0.0]),
        ("motor.delay", &[0.0137]),
        ("disturbance.arm_kick", &[1e-4, 0.0513, 0.0207, 0.0]),
    ];
    for (id, values) in cases {
        // kick: when it comes; the others: their first parameter
        let which = usize::from(id == "disturbance.arm_kick");
        let at = |value: f64| {
            let mut v: Vec<_> = values.iter().map(|v| number(*v)).collect();
            v[which] = Number::variable(value, 0);
            let plant = Plant::new(&p.cast(), &[Effect::new(id, &v).expect("valid")]).expect("one");
            let mut s = plant.rest(State::new(0.0, PI, 0.5, 0.0).map(number));
            for k in 0..400 {
                let u = if (k / 40) % 2 == 0 { -0.01 } else { 0.008 };
                plant.step(&mut s, number(u), 2e-3);
            }
            plant.measure(&s)[0]
        };
        let e = 1e-6 * values[which];
        let difference = (at(values[which] + e).v - at(values[which] - e).v) / (2.0 * e);
        let exact = at(values[which]).d[0];
        // central differences of a smooth function: 1e-6 relative squared, and rounding 1e-16 over the step
        let rounding = 1e-13 / e;
        assert!(
            exact != 0.0 && (exact - difference).abs() < 1e-5 * exact.abs() + rounding,
            "{id}: {exact} {difference}"
        );
    }
}

#[test]
fn play_opens_and_closes_where_it_should() {
    // The arm rests at one end of the backlash; the motor pulls away: the rotor falls freely through the gap, then
    // takes the arm along with the speed that keeps the momentum.
    let p = bare_arm();
    let (gap, share) = (0.1, 0.4);
    let plant = plant(&p, &[("drive.backlash", &[gap, share, 1.0])]);
    let c = plant.coefficients;
    let (rotor, torque) = (share * c.hub, -0.02 * c.drive);
    let mut s = plant.rest_under(State::hanging(), 0.02);
    let start = plant.measure(&s)[0];
    assert!(
        (start - gap / 2.0).abs() < 1e-15,
        "touching in the direction of the push"
    );
    let fall = (2.0 * gap * rotor / -torque).sqrt();
    let h = 2e-3;
    let steps = (fall / h).ceil() as usize + 25;
    for _ in 0..steps {
        plant.step(&mut s, -0.02, h);
    }
    let after = steps as f64 * h - fall;
    let speed = torque / rotor * fall * rotor / c.arm;
    let expected = speed + torque / c.arm * after;
    let angle = speed * after + 0.5 * torque / c.arm * after * after;
    assert!(
        (s.x.theta_dot - expected).abs() < 1e-9 * expected.abs(),
        "{} {expected}",
        s.x.theta_dot
    );
    assert!((s.x.theta - angle).abs() < 1e-9, "{} {angle}", s.x.theta);
    assert!((plant.measure(&s)[0] - (s.x.theta - gap / 2.0)).abs() < 1e-15);
}

#[test]
fn a_flexible_coupling_rings_at_its_frequency() {
    // Two inertias and a spring: w² = k (1/J1 + 1/J2); at rest twisted, let go, back after a period.
    let p = bare_arm();
    let (stiffness, share) = (0.5, 0.3);
    let plant = plant(&p, &[("drive.compliance", &[stiffness, 0.0, share, 0.0])]);
    let c = plant.coefficients;
    let (rotor, load) = (share * c.hub, c.arm - share * c.hub);
    let w = (stiffness * (1.0 / rotor + 1.0 / load)).sqrt();
    let period = 2.0 * PI / w;
    // Stalled by a steady push against nothing: twisted as rest_under says, then let go.
    let mut s = plant.rest_under(State::hanging(), 0.5);
    let speed = |s: &PlantState<f64>| s.x.theta_dot;
    run(&plant, &mut s, period / 16.0, period, |_| 0.0);
    let twisted = plant.rest_under(State::hanging(), 0.5);
    // after a whole period both speeds are back to zero, but for RK4's error at 25 steps a period
    let quarter = {
        let mut q = twisted;
        run(&plant, &mut q, period / 16.0, period / 4.0, |_| 0.0);
        speed(&q)
    };
    assert!(
        quarter > 0.0 && speed(&s).abs() < 1e-3 * quarter,
        "{} {quarter}",
        speed(&s)
    );
}

/// A rotor behind a spring takes a way of its own through a step, where nothing that rubs rests or turns. A kick that
/// never comes has the same plant look for events in each: both come to the same digits, derivatives included.
#[test]
fn a_step_behind_a_spring_has_the_digits_of_one_that_looks_for_events() {
    type Dual = Jet<f64, { crate::FEW }>;
    let never: (&str, &[f64]) = ("disturbance.kick", &[1e-3, 1e6, 0.1, 0.0]);
    let spring: (&str, &[f64]) = ("drive.compliance", &[0.05, 1e-4, 0.3, 0.0]);
    let beside: [&[(&str, &[f64])]; 5] = [
        &[],
        &[("arm.coulomb", &[3e-4]), ("pendulum.coulomb", &[4e-4])],
        &[("arm.cogging", &[1e-3, 4.0, 0.3])],
        &[("motor.lag", &[0.004]), ("pendulum.coulomb", &[4e-4])],
        &[
            ("arm.stribeck", &[2e-4, 2.0, 0.5]),
            ("arm.spring", &[2e-3, 0.1]),
        ],
    ];
    for others in beside {
        let with = |extra: &[(&str, &[f64])]| {
            plant(&qube(), &[&[spring], others, extra].concat()).cast::<Dual>()
        };
        let plants = [with(&[]), with(&[never])];
        let start = State::from(std::array::from_fn(|i| {
            Dual::variable([0.1, 2.0, 0.3, -0.2][i], i)
        }));
        let mut states = plants.each_ref().map(|plant| plant.rest(start));
        let mut rested = false;
        for k in 0..2000 {
            let u = Dual::from_f64(if k < 1500 {
                (0.02 * f64::from(k)).sin()
            } else {
                0.0
            });
            for (plant, s) in plants.iter().zip(&mut states) {
                plant.step(s, u, 2e-3);
            }
            let [a, b] = states.each_ref().map(|s| s.x.to_array());
            for (a, b) in a.iter().zip(&b) {
                assert_eq!(
                    a.v.to_bits(),
                    b.v.to_bits(),
                    "{others:?} at step {k}: {a:?} {b:?}"
                );
                assert_eq!(a.d, b.d, "{others:?} at step {k}");
            }
            rested |= a[3].v == 0.0;
        }
        let rubs = others.iter().any(|(id, _)| *id == "pendulum.coulomb");
        assert!(!rubs || rested, "the pendulum never stuck: {others:?}");
    }
}

#[test]
fn stiff_and_rigid_couplings_move_alike() {
    let p = qube();
    let rigid = plant(&p, &[]);
    let stiff = plant(&p, &[("drive.compliance", &[500.0, 0.05, 0.3, 0.0])]);
    let (mut a, mut b) = (rigid.rest(State::hanging()), stiff.rest(State::hanging()));
    stiff.check_period(1e-3).expect("64 steps are enough");
    run(&rigid, &mut a, 1e-3, 2.0, |t| 2.0 * (5.0 * t).sin());
    run(&stiff, &mut b, 1e-3, 2.0, |t| 2.0 * (5.0 * t).sin());
    // the twist itself: torque / stiffness, some 0.02 N m / 500 N m/rad
    assert!(
        (a.x - b.x).to_array().iter().all(|d| d.abs() < 2e-3),
        "{:?} {:?}",
        a.x,
        b.x
    );
    let limp = plant(&p, &[("drive.compliance", &[1e5, 0.05, 0.3, 0.0])]);
    let message = limp.check_period(1e-2).expect_err("too stiff").to_string();
    assert!(
        message.contains("rad/s") && message.contains("shorter period"),
        "{message}"
    );
}

#[test]
fn a_kick_leaves_its_impulse_in_its_own_run_alone() {
    let p = bare_arm();
    let (torque, time, duration) = (1e-4, 0.0513, 0.0207);
    let plant = plant(
        &p,
        &[("disturbance.arm_kick", &[torque, time, duration, 2.0])],
    );
    let mut s = plant.rest(State::hanging());
    run(&plant, &mut s, 1e-2, 0.2, |_| 0.0);
    // sin(pi) in floating point moves it by 1e-28
    assert!(s.x.theta.abs() < 1e-20, "not this run");
    let mut s = plant.rest(State::hanging());
    s.run = 2;
    run(&plant, &mut s, 1e-2, 0.2, |_| 0.0);
    let speed = torque * duration / plant.coefficients.arm;
    let angle = speed * (0.2 - time - duration / 2.0);
    assert!((s.x.theta_dot - speed).abs() < 1e-9 * speed);
    assert!(
        (s.x.theta - angle).abs() < 1e-9 * angle,
        "{} {angle}",
        s.x.theta
    );
}

#[test]
fn bristles_are_a_spring_first_and_friction_later() {
    // Dahl's law over a way d from relaxed: torque (1 - exp(-stiffness d / torque)).
    let (torque, stiffness) = (2e-3, 0.1);
    let e: Effect<f64> = Effect::new("arm.presliding", &[torque, stiffness]).expect("valid");
    let p = bare_arm();
    let plant = Plant::new(&p, &[e]).expect("one");
    // A motor that pushes with a little less than the friction: the arm creeps forward by the bristles' bend and swings
    // about it.
    let push = 0.5 * torque / plant.coefficients.drive;
    let mut s = plant.rest(State::hanging());
    run(&plant, &mut s, 1e-3, 5.0, |_| push);
    // Dahl's bristles lose energy with each turn: it comes to rest at some bend that carries the push, half of the
    // friction or more than that way
    let least = 0.5 * torque / stiffness;
    assert!(
        s.x.theta > least && s.x.theta < 20.0 * least,
        "{}",
        s.x.theta
    );
    // Pushed harder, it slides with the excess.
    let mut s = plant.rest(State::hanging());
    let push = 2.0 * torque / plant.coefficients.drive;
    run(&plant, &mut s, 1e-3, 0.5, |_| push);
    let rise = s.x.theta_dot;
    run(&plant, &mut s, 1e-3, 0.1, |_| push);
    let expected = 0.1 * torque / plant.coefficients.arm;
    assert!(((s.x.theta_dot - rise) - expected).abs() < 1e-6 * expected);
}

/// While bristles bend by little, LuGre's are a spring and a damper: an arm that is let go swings as they say. Sliding,
/// the damper does nothing.
#[test]
fn damped_bristles_are_a_spring_and_a_damper_first() {
    let (torque, stiffness, damping) = (10.0, 0.1, 5e-4);
    let p = bare_arm();
    let plant = plant(&p, &[("arm.lugre", &[torque, stiffness, damping])]);
    let inertia = plant.coefficients.arm;
    let (decay, w) = (damping / (2.0 * inertia), (stiffness / inertia).sqrt());
    let rate = (w * w - decay * decay).sqrt();
    // From rest under a constant push.
    let push = 0.01;
    let most = push * plant.coefficients.drive / stiffness;
    let mut s = plant.rest(State::hanging());
    let period = 1e-3;
    for k in 1..400 {
        plant.step(&mut s, push, period);
        let t = f64::from(k) * period;
        let swing = (rate * t).cos() + decay / rate * (rate * t).sin();
        let expected = most * (1.0 - (-decay * t).exp() * swing);
        // So far is the law from a spring and a damper: by the part of their way that the bristles bend, over some
        // swings.
        assert!(
            (s.x.theta - expected).abs() < most * (10.0 * most * stiffness / torque),
            "{t}: {} {expected}",
            s.x.theta
        );
    }
    let plant = self::plant(&p, &[("arm.lugre", &[2e-3, 0.1, damping])]);
    let mut s = plant.rest(State::hanging());
    let push = 2.0 * 2e-3 / plant.coefficients.drive;
    run(&plant, &mut s, 1e-3, 0.5, |_| push);
    let rise = s.x.theta_dot;
    run(&plant, &mut s, 1e-3, 0.1, |_| push);
    let expected = 0.1 * 2e-3 / inertia;
    assert!(((s.x.theta_dot - rise) - expected).abs() < 1e-6 * expected);
    // Both laws remember the same way: there is one of them.
    let both = [
        ("arm.lugre", &[torque, stiffness, damping][..]),
        ("arm.presliding", &[torque, stiffness][..]),
    ]
    .map(|(id, values)| Effect::new(id, values).expect("valid"));
    let error = Plant::<f64>::new(&p, &both).expect_err("two");
    assert!(
        error
            .to_string()
            .contains("arm.lugre and arm.presliding are two laws of one friction")
    );
}

#[test]
fn a_tilted_base_pulls_by_the_gradient_of_its_potential() {
    let (angle, direction, unbalance) = (0.09, 2.7, 0.4);
    let p = qube();
    let plant = plant(&p, &[("arm.tilt", &[angle, direction, unbalance])]);
    let c = plant.coefficients;
    let potential = |theta: f64, alpha: f64| {
        let e = theta - direction;
        c.weight * alpha.cos() * angle.cos()
            - angle.sin()
                * ((1.0 + unbalance) * c.lever * e.cos() + c.weight * alpha.sin() * e.sin())
    };
    for (theta, alpha) in [(0.0, 0.3), (1.0, 2.0), (-2.0, PI), (4.0, -1.0)] {
        let a = plant.rate(0.0, &State::new(theta, alpha, 0.0, 0.0), 0.0, 1e3);
        let m = furuta_model::dynamics::mass_matrix(&c, furuta_model::dynamics::Angle::of(alpha));
        let torque = [
            m.arm * a.theta_dot + m.coupling * a.alpha_dot,
            m.coupling * a.theta_dot + m.pendulum * a.alpha_dot,
        ];
        let h = 1e-5;
        let slope = [
            (potential(theta - h, alpha) - potential(theta + h, alpha)) / (2.0 * h),
            (potential(theta, alpha - h) - potential(theta, alpha + h)) / (2.0 * h),
        ];
        for i in 0..2 {
            assert!(
                (torque[i] - slope[i]).abs() < 1e-8 * c.weight.max(c.lever),
                "{torque:?} {slope:?}"
            );
        }
    }
    // The lowest place: arm downhill, pendulum hanging along gravity.
    let still = plant.rate(0.0, &State::new(direction, PI, 0.0, 0.0), 0.0, 1e3);
    assert!(still.theta_dot.abs() < 1e-9 && still.alpha_dot.abs() < 1e-9);
    let uphill = plant.rate(
        0.0,
        &State::new(direction + FRAC_PI_2, PI, 0.0, 0.0),
        0.0,
        1e3,
    );
    assert!(uphill.theta_dot < 0.0, "it rolls down");
}

#[test]
fn late_encoders_and_late_commands_read_alike() {
    // The same recording, whatever lies between: only the true state tells them apart.
    let delay = 0.0073;
    let (command, sensor) = (
        plant(&qube(), &[("motor.delay", &[delay])]),
        plant(&qube(), &[("sensor.delay", &[delay])]),
    );
    let (mut a, mut b) = (
        command.rest(State::hanging()),
        sensor.rest(State::hanging()),
    );
    for k in 0..1000 {
        let u = 2.0 * (f64::from(k) * 0.01).sin();
        command.step(&mut a, u, 2e-3);
        sensor.step(&mut b, u, 2e-3);
        let (read, late) = (command.measure(&a), sensor.measure(&b));
        for i in 0..2 {
            // the cubic between two samples 2 ms apart
            assert!((read[i] - late[i]).abs() < 2e-7, "{k}: {read:?} {late:?}");
        }
    }
    assert!(a.x != b.x);
}

/// Every effect of the catalogue, anywhere, for half a second: finite, and no friction that drives.
fn any_effect() -> impl Strategy<Value = (usize, f64)> {
    (0..furuta_model::CATALOGUE.len(), 0.1..5.0_f64)
}

proptest! {
    #[test]
    fn every_effect_stays_finite((which, size) in any_effect(), start in prop::array::uniform4(-3.0..3.0_f64),
        u in -10.0..10.0_f64, h in 1e-4..1e-2_f64) {
        let p = qube();
        let spec = furuta_model::CATALOGUE[which];
        let values: Vec<f64> = spec
            .parameters
            .iter()
            .map(|q| {
                let value = (q.off + size * q.typical(&p)).clamp(q.min, q.max);
                if q.kind.is_continuous() { value } else { value.floor() }
            })
            .collect();
        let plant = plant(&p, &[(spec.id, &values)]);
        prop_assume!(plant.check_period(h).is_ok());
        let mut s = plant.rest(State::from(start));
        for k in 0..(0.5 / h) as usize {
            plant.step(&mut s, u * (f64::from(u32::try_from(k).expect("small")) * 0.3).sin(), h);
            prop_assert!(s.x.is_finite(), "{} {values:?}", spec.id);
        }
    }

    /// Without motor and viscous friction, whatever only rubs never adds energy.
    #[test]
    fn what_rubs_never_drives(which in 0..6_usize, size in 0.1..3.0_f64,
        start in prop::array::uniform4(-3.0..3.0_f64)) {
        let id = ["arm.coulomb", "arm.stribeck", "arm.quadratic", "pendulum.coulomb", "pendulum.quadratic",
            "drive.backlash"][which];
        let p = qube();
        let parameters = spec(id).expect("known").parameters.iter();
        let values: Vec<f64> = parameters.map(|q| (size * q.typical(&p)).min(q.max).floor_if(q.kind)).collect();
        let mut plant = plant(&p, &[(id, &values)]);
        plant.coefficients.arm_damping = 0.0;
        plant.coefficients.pendulum_damping = 0.0;
        let mut s = plant.rest(State::from(start));
        let total = |s: &PlantState<f64>| energy::total(&plant.coefficients, &s.x);
        let mut before = total(&s);
        for _ in 0..500 {
            plant.step(&mut s, 0.0, 1e-3);
            if id != "drive.backlash" {
                let now = total(&s);
                // RK4's own error over a step
                prop_assert!(now <= before + 1e-7 * (plant.coefficients.weight + before.abs()), "{id}: {before} {now}");
                before = now;
            }
        }
        // Rotor and arm apart: the arm's own energy is below the whole's at the start.
        prop_assert!(total(&s) <= before + 1e-5 * (plant.coefficients.weight + before.abs()), "{id}");
    }
}

trait FloorIf {
    fn floor_if(self, kind: furuta_model::effects::Kind) -> f64;
}

impl FloorIf for f64 {
    fn floor_if(self, kind: furuta_model::effects::Kind) -> f64 {
        if kind.is_amount() {
            self
        } else {
            self.floor().min(1.0)
        }
    }
}
