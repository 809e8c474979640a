//! End stops, cables that relax, windings, discs and friction under load, against closed forms.

use furuta_model::{Effect, Jet, Params, Plant, Rig, State};
use proptest::prelude::*;
use std::f64::consts::PI;

/// An arm with next to no pendulum and no friction of its own. `back_emf`: with the motor's back-EMF.
fn bare_arm(back_emf: bool) -> Params<f64> {
    let mut p = Rig::builtin("qube-servo-2").expect("built in").params;
    p.pendulum.mass = 1e-12;
    p.pendulum.inertia = 1e-12;
    p.pendulum.inertia_transverse = 0.0;
    p.pendulum.viscous = 0.0;
    p.arm.viscous = 0.0;
    if !back_emf {
        p.motor.back_emf_constant = 0.0;
    }
    p
}

fn plant(p: &Params<f64>, id: &str, values: &[f64]) -> Plant<f64> {
    Plant::new(p, &[Effect::new(id, values).expect("valid")]).expect("valid")
}

/// The arm's angle and speed after `seconds` from `x`, under the command `u`.
fn after(plant: &Plant<f64>, x: [f64; 2], u: f64, seconds: f64, h: f64) -> [f64; 2] {
    let mut s = plant.rest(State::new(x[0], PI, x[1], 0.0));
    for _ in 0..(seconds / h).round() as usize {
        plant.step(&mut s, u, h);
    }
    [s.x.theta, s.x.theta_dot]
}

proptest! {
    /// A mass that meets a spring with a damper which cannot pull: it leaves where its acceleration is zero, at
    /// `w t = (pi - 2 asin z)/sqrt(1 - z²)`, with `exp(-z w t)` of its speed (K. L. Johnson, Contact Mechanics, has the
    /// undamped case).
    #[test]
    fn an_end_stop_throws_the_arm_back(ratio in 0.0..0.8_f64, side in prop::bool::ANY, middle in -1.0..1.0_f64,
        h in prop::sample::select(vec![1e-3, 2e-3, 3.7e-3])) {
        let p = bare_arm(false);
        let (w, v, angle) = (30.0, 2.0, 0.3);
        let inertia = p.coefficients().arm;
        let (stiffness, damping) = (inertia * w * w, 2.0 * ratio * inertia * w);
        let plant = plant(&p, "arm.stop", &[stiffness, angle, damping, middle]);
        let root = (1.0 - ratio * ratio).sqrt();
        let contact = (PI - 2.0 * ratio.asin()) / (w * root);
        let depth = v / (w * root) * (-ratio * w * contact).exp() * (w * root * contact).sin();
        let left = v * (-ratio * w * contact).exp();
        // There, in the stop, and on the way back.
        let seconds: f64 = 0.35;
        let n = (seconds / h).round();
        let expected = angle + depth - left * (n * h - angle / v - contact);
        let sign = if side { 1.0 } else { -1.0 };
        let [theta, speed] = after(&plant, [middle, sign * v], 0.0, seconds, h);
        prop_assert!((speed + sign * left).abs() < 2e-5 * v, "{speed} {left}");
        prop_assert!((theta - middle - sign * expected).abs() < 2e-5, "{theta} {expected}");
    }

    /// `theta'' = -k/J z`, `z' = theta' - z/tau`: the stretch is a damped oscillation, and the arm's speed follows from
    /// it.
    #[test]
    fn a_cable_that_relaxes_is_a_damped_oscillation(tau in 0.05..2.0_f64, v in -3.0..3.0_f64) {
        let p = bare_arm(false);
        let w = 8.0; // of the spring alone
        prop_assume!(w * tau > 0.7);
        let plant = plant(&p, "arm.relaxation", &[p.coefficients().arm * w * w, tau]);
        let ringing = (w * w - 0.25 / (tau * tau)).sqrt();
        let t: f64 = 1.2;
        let decay = (-0.5 * t / tau).exp();
        let (sin, cos) = (ringing * t).sin_cos();
        // z = v/r exp(-t/2tau) sin(r t); theta' = z' + z/tau.
        let speed = v * decay * (cos + 0.5 / (tau * ringing) * sin);
        let found = after(&plant, [0.1, v], 0.0, t, 2e-3);
        prop_assert!((found[1] - speed).abs() < 1e-7, "{found:?} {speed}");
    }

    /// `tau J w'' + J w' + b w = drive u` with back-EMF, from rest.
    #[test]
    fn an_inductance_delays_the_current_behind_the_back_emf(tau in 0.002..0.05_f64, u in -5.0..5.0_f64,
        share in 0.0..1.0_f64) {
        let p = bare_arm(true);
        let c = p.coefficients();
        let plant = plant(&p, "motor.inductance", &[tau, share]);
        // What is not back-EMF acts at once: tau J w'' + (J + tau rest) w' + b w = drive u.
        let rest = (1.0 - share) * c.arm_damping;
        let (a, b) = (tau * c.arm, c.arm + tau * rest);
        let root = (b * b - 4.0 * a * c.arm_damping).sqrt();
        prop_assume!(root.is_finite() && root > 0.0);
        let (fast, slow) = (-(b + root) / (2.0 * a), -(b - root) / (2.0 * a));
        let t: f64 = 0.2;
        let end = c.drive * u / c.arm_damping;
        let speed = end * (1.0 + (slow * (fast * t).exp() - fast * (slow * t).exp()) / (fast - slow));
        let found = after(&plant, [0.0, 0.0], u, t, 1e-3);
        prop_assert!((found[1] - speed).abs() < 1e-5 * (1.0 + speed.abs()), "{found:?} {speed}");
    }

    /// What is remembered of a motion is what a plant that goes through it has.
    #[test]
    fn what_was_before_is_remembered(tau in 0.01..0.5_f64, speeds in prop::collection::vec(-5.0..5.0_f64, 1..60),
        u in -3.0..3.0_f64) {
        let h = 2e-3;
        let p = bare_arm(true);
        let plant = plant(&p, "arm.relaxation", &[1e-2, tau]);
        let mut s = plant.rest(State::new(0.0, PI, 0.0, 0.0));
        let past = speeds.iter().map(|v| (State::new(0.0, PI, *v, 0.0), u));
        plant.remember(&mut s, past, h);
        // Each piece of the way is stretched once and fades from then on.
        let stretch: f64 = speeds.iter().rev().enumerate().map(|(k, v)| {
            v * tau * (1.0 - (-h / tau).exp()) * (-h * k as f64 / tau).exp()
        }).sum();
        // A resting arm, released: the stretch is its acceleration.
        let tiny = 1e-6;
        plant.step(&mut s, 0.0, tiny);
        let expected = -1e-2 * stretch / p.coefficients().arm * tiny;
        prop_assert!((s.x.theta_dot - expected).abs() < 1e-3 * expected.abs() + 1e-12, "{:?} {expected}", s.x);
    }
}

#[test]
fn friction_under_load_takes_its_share_and_holds() {
    let p = bare_arm(false);
    let c = p.coefficients();
    let geared = plant(&p, "arm.load_friction", &[0.3, 1.0]);
    let (u, t) = (2.0, 0.5);
    let [theta, speed] = after(&geared, [0.0, 0.0], u, t, 1e-3);
    let acceleration = 0.7 * c.drive * u / c.arm;
    assert!((speed - acceleration * t).abs() < 1e-9 * speed, "{speed}");
    assert!((theta - 0.5 * acceleration * t * t).abs() < 1e-9);
    // Against a brake the friction helps it: half as much again as the voltage alone.
    let [_, braked] = after(&geared, [0.0, 10.0], -u, 0.01, 1e-3);
    assert!((braked - (10.0 - 1.3 * c.drive * u / c.arm * 0.01)).abs() < 1e-9);
    // Without a voltage nothing is passed on, and nothing rubs.
    assert_eq!(after(&geared, [0.0, 1.0], 0.0, 0.1, 1e-3)[1], 1.0);
}

#[test]
fn friction_by_angle_takes_the_energy_of_its_way() {
    let p = bare_arm(false);
    let (torque, depth, order, phase, v) = (2e-4, 0.7, 3.0, 0.4, 2.5);
    let plant = plant(&p, "arm.angle_friction", &[torque, depth, order, phase]);
    for h in [1e-3, 4e-3] {
        let [way, speed] = after(&plant, [0.0, v], 0.0, 4.0, h);
        assert_eq!(speed, 0.0);
        let work = torque * (way + depth / order * (phase.cos() - (order * way + phase).cos()));
        let energy = 0.5 * p.coefficients().arm * v * v;
        assert!((work / energy - 1.0).abs() < 1e-6, "{h}: {work} {energy}");
    }
}

#[test]
fn a_current_limit_lets_the_voltage_act_at_speed() {
    let p = bare_arm(true);
    let c = p.coefficients();
    let u = 8.0;
    let limit = 0.5 * c.drive * u;
    let limited = plant(&p, "motor.current_limit", &[limit, 1.0]);
    let slow = limited.rate(0.0, &State::new(0.0, PI, 0.0, 0.0), u, 1e3);
    assert!((slow.theta_dot * c.arm / limit - 1.0).abs() < 1e-6);
    // At 0.8 of the speed at which the back-EMF is the voltage, the current is 0.2 of the largest: no limit.
    let fast = State::new(0.0, PI, 0.8 * c.drive * u / c.arm_damping, 0.0);
    let free: Plant<f64> = Plant::new(&p, &[]).expect("valid");
    assert_eq!(
        limited.rate(0.0, &fast, u, 1e3),
        free.rate(0.0, &fast, u, 1e3)
    );
}

#[test]
fn levels_of_the_command() {
    let p = bare_arm(true);
    let plant = plant(&p, "motor.resolution", &[0.5]);
    for (u, level) in [
        (0.2, 0.0),
        (0.3, 0.5),
        (-0.3, -0.5),
        (1.2, 1.0),
        (1.3, 1.5),
        (-9.9, -10.0),
    ] {
        assert_eq!(plant.volts(u), level);
    }
}

/// The disc's error belongs to the place in the turn, wherever the encoder was zeroed.
#[test]
fn an_eccentric_disc_errs_once_a_turn() {
    let p = bare_arm(true);
    let (a, phase) = (0.05, 0.7);
    let theta = plant(&p, "sensor.theta.eccentricity", &[a, phase]);
    let alpha = plant(&p, "sensor.alpha.eccentricity", &[a, phase]);
    for k in 0..50 {
        let angles = [0.3 * f64::from(k), PI - 0.2 * f64::from(k)];
        let zeros = [0.4, -0.1];
        let expected = [0, 1].map(|i| angles[i] + a * (angles[i] + phase).sin());
        assert!((theta.reading(angles)[0] - expected[0]).abs() < 1e-12);
        assert_eq!(theta.reading(angles)[1], angles[1]);
        assert!((alpha.reading(angles)[1] - expected[1]).abs() < 1e-12);
        let counted = theta.reading_from(angles, zeros, (0, 0.0));
        assert!((counted[0] - (expected[0] - zeros[0])).abs() < 1e-12);
        assert_eq!(counted[1], angles[1] - zeros[1]);
    }
}

/// Jitter scatters readings in proportion to the speed, as much as it says and the same every time; of both angles by
/// one time.
#[test]
fn jitter_scatters_with_the_speed() {
    let p = bare_arm(true);
    let spread = 2e-3;
    let plant = plant(&p, "sensor.jitter", &[spread, 7.0]);
    let read = |run: usize, k: u32, speeds: [f64; 2]| {
        let mut s = plant.rest(State::new(0.0, 0.0, speeds[0], speeds[1]));
        (s.run, s.t) = (run, 2e-3 * f64::from(k));
        plant.measure(&s)
    };
    let late: Vec<f64> = (0..4000).map(|k| read(0, k, [1.0, 0.0])[0]).collect();
    for (k, late) in (0..).zip(&late) {
        assert_eq!(read(0, k, [0.0, 0.0]), [0.0, 0.0]);
        let [theta, alpha] = read(0, k, [-2.0, 3.0]);
        assert!((theta + 2.0 * late).abs() < 1e-15 && (alpha - 3.0 * late).abs() < 1e-15);
        assert_eq!(read(0, k, [1.0, 0.0])[0], *late);
    }
    let n = late.len() as f64;
    let moment = |lag: usize| {
        late.iter()
            .zip(&late[lag..])
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / n
    };
    // Of 4000: the variance is known to 2.2 %, correlations to 0.016; four times that.
    assert!((moment(0) / spread.powi(2) - 1.0).abs() < 0.09);
    assert!((1..5).all(|lag| moment(lag).abs() < 0.064 * spread.powi(2)));
    let other: Vec<f64> = (0..4000).map(|k| read(1, k, [1.0, 0.0])[0]).collect();
    let cross = late.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / n;
    assert!(cross.abs() < 0.064 * spread.powi(2));
}

/// Counts are lost for good, from a moment of one run on; the motion is the same bit by bit.
#[test]
fn lost_counts_stay_lost() {
    let p = bare_arm(true);
    let (size, time, h) = (0.05, 0.1011, 2e-3);
    for (id, axis) in [
        ("sensor.theta.lost_counts", 0),
        ("sensor.alpha.lost_counts", 1),
    ] {
        let (plain, lossy) = (
            Plant::new(&p, &[]).expect("none"),
            plant(&p, id, &[size, time, 1.0]),
        );
        for run in [0, 1] {
            let start = State::new(0.2, 2.0, 1.0, 0.0);
            let (mut a, mut b) = (plain.rest(start), lossy.rest(start));
            (a.run, b.run) = (run, run);
            for k in 0..100 {
                assert_eq!(a.x, b.x);
                let (shown, expected) = (lossy.measure(&b), plain.measure(&a));
                let gone = run == 1 && f64::from(k) * h > time;
                let off = if gone { size } else { 0.0 };
                assert_eq!(shown[axis], expected[axis] + off, "{id} {run} {k}");
                assert_eq!(shown[1 - axis], expected[1 - axis]);
                plain.step(&mut a, 1.0, h);
                lossy.step(&mut b, 1.0, h);
            }
        }
    }
}

/// How the arm's way out of a stop depends on where the stop is, on its spring and on its damper: dual numbers against
/// differences.
#[test]
fn a_stop_has_exact_derivatives() {
    type Number = Jet<f64, { crate::FEW }>;
    let p = bare_arm(true);
    let inertia = p.coefficients().arm;
    let values = [inertia * 900.0, 0.3, 0.4 * inertia * 30.0, 0.0];
    let end = |values: &[f64; 4]| {
        let plant = plant(&p, "arm.stop", values);
        after(&plant, [0.0, 2.0], 0.5, 0.5, 2e-3)
    };
    let jets: Vec<Number> = values
        .iter()
        .enumerate()
        .map(|(i, v)| {
            if i < 3 {
                Number::variable(*v, i)
            } else {
                Number::constant(*v)
            }
        })
        .collect();
    let c = p.cast::<Number>().coefficients();
    let stop = Effect::checked(
        furuta_model::effects::spec("arm.stop").expect("known"),
        &jets,
    )
    .expect("valid");
    let plant = Plant::from_coefficients(c, &[stop]).expect("one");
    let x = State::new(0.0, PI, 2.0, 0.0);
    let mut s = plant.rest(State::from(x.to_array().map(Number::constant)));
    for _ in 0..250 {
        plant.step(&mut s, Number::constant(0.5), 2e-3);
    }
    for i in 0..3 {
        let step = 1e-5 * values[i];
        let (mut low, mut high) = (values, values);
        low[i] -= step;
        high[i] += step;
        let slope = (end(&high)[0] - end(&low)[0]) / (2.0 * step);
        let found = s.x.theta.d[i];
        assert!((found / slope - 1.0).abs() < 1e-4, "{i}: {found} {slope}");
    }
}

/// A winding remembers the voltage as a lag of it lets it rise, not as it was commanded: of two plants after the same
/// second, one simulated and one entered, the motor pulls alike.
#[test]
fn a_winding_remembers_what_the_voltage_did() {
    let p = bare_arm(true);
    let c = p.coefficients();
    let hanging = State::new(0.0, PI, 0.0, 0.0);
    let with_lag = |lag: f64| -> Plant<f64> {
        let effects = [
            Effect::new("motor.lag", &[lag]).expect("valid"),
            Effect::new("motor.inductance", &[0.06, 0.5]).expect("valid"),
        ];
        Plant::new(&p, &effects).expect("valid")
    };
    let (lag, h) = (0.02, 1e-3);
    let plant = with_lag(lag);
    let mut s = plant.rest(hanging);
    let (mut past, mut commands) = (Vec::new(), Vec::new());
    for k in 0..1000 {
        // Steps of 5 V: behind the lag they are weak, and a winding that took them whole would be far off.
        let u = if k / 40 % 2 == 0 { 3.0 } else { -2.0 };
        let before = s.x;
        plant.step(&mut s, u, h);
        let speed = 0.5 * (before.theta_dot + s.x.theta_dot);
        past.push((State::new(s.x.theta, PI, speed, 0.0), u));
        commands.push(u);
    }
    let mut entered = plant.resume(s.x, s.t, &commands, h);
    plant.remember(&mut entered, past, h);
    let pulled = |mut s: furuta_model::PlantState<f64>| {
        let before = s.x.theta_dot;
        plant.step(&mut s, 0.0, 1e-6);
        (s.x.theta_dot - before) / 1e-6
    };
    let (simulated, remembered) = (pulled(s), pulled(entered));
    // The middle of each millisecond, for the mean of a voltage that fades: (h/lag)^2/24 of what 5 V pull.
    let tolerance = (h / lag).powi(2) / 24.0 * 5.0 * c.drive / c.arm;
    assert!(
        (simulated - remembered).abs() < tolerance,
        "{simulated} {remembered} {tolerance}"
    );
    // The slower of the two says for how long that goes back.
    assert_eq!(plant.forgetting(0.0, &hanging, 0.0), Some(1.0 / 0.06));
    assert_eq!(with_lag(0.2).forgetting(0.0, &hanging, 0.0), Some(5.0));
}
