//! Estimators against what they promise: covariances, disturbances, the state when a command begins to act.

use furuta_ctrl::Site;
use furuta_ctrl::design::{Noise, dlqe};
use furuta_ctrl::estimators::{self, AnyEstimator, Design, Estimator, ExtendedKalman, Measurement};
use furuta_ctrl::settings::Settings;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Effect, Plant, Rig, State, linearize};
use nalgebra::{SMatrix, SVector};

const PERIOD: f64 = 0.002;

fn srv02() -> Rig {
    Rig::builtin("shahzad2022-srv02").expect("built in")
}

fn settings(id: &str) -> Settings {
    estimators::settings(id).expect("in the catalogue")
}

/// Numbers that look random (xorshift), normally distributed by twelve uniform ones.
struct Normal(u64);

impl Normal {
    fn draw(&mut self) -> f64 {
        (0..12).fold(-6.0, |sum, _| {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            sum + (self.0 >> 11) as f64 / (1u64 << 53) as f64
        })
    }
}

/// Two ways to the same covariance: the extended filter's recursion, upright and at rest for long, and the Riccati
/// equation.
#[test]
fn the_extended_filter_settles_at_the_riccati_equation() {
    let (command, pendulum, reading) = (0.2, 3.0, [1e-3, 2e-3]);
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let site = Site::of(&rig, PERIOD);
        let given = settings("ekf")
            .with("command_noise", &[command])
            .and_then(|s| s.with("pendulum_noise", &[pendulum]))
            .and_then(|s| s.with("reading_noise", &reading))
            .expect("in range");
        let filter = ExtendedKalman::<f64>::design(&given, &site).expect("any rig");
        let mut memory = filter.start();
        for _ in 0..5000 {
            filter.update(&mut memory, &Measurement::new(0.0, 0.0, 0.0));
        }
        let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
        let (a, b) = zero_order_hold(&linear.a, &linear.b, PERIOD);
        let driven = b * command;
        let pushed = SVector::from([0.0, 0.5 * PERIOD * PERIOD, 0.0, PERIOD]) * pendulum;
        let mut c = SMatrix::<f64, 2, 4>::zeros();
        c.fill_diagonal(1.0);
        let noise = Noise::new(
            driven * driven.transpose() + pushed * pushed.transpose(),
            SMatrix::from_diagonal(&SVector::from(reading.map(|r| r * r))),
        );
        let steady = dlqe(&a, &c, &noise).expect("observable");
        let gain = steady.filter_gain(&c, &noise).expect("regular");
        let expected = (SMatrix::identity() - gain * c) * steady.covariance;
        let found = SMatrix::<f64, 4, 4>::from_fn(|i, j| memory.covariance()[i][j]);
        // The extended filter takes exp(A h), and what the noises do within a period, to second order: 2.3e-3 on the
        // fastest rig.
        let off = (found - expected).norm() / expected.norm();
        assert!(off < 5e-3, "{name}: {off:e}");
    }
}

/// The error that the extended filter makes, weighed with the covariance that it claims, is 4 on average: it has four
/// states and knows itself.
#[test]
fn the_extended_filter_knows_how_far_it_is_off() {
    let (command, reading) = (0.3, [1.5e-3, 1.5e-3]);
    let rig = srv02();
    let plant = rig.plant::<f64>();
    let site = Site::of(&rig, PERIOD);
    // The pendulum is pushed by nothing: as little as can be said.
    let given = settings("ekf")
        .with("command_noise", &[command])
        .and_then(|s| s.with("pendulum_noise", &[1e-6]))
        .and_then(|s| s.with("reading_noise", &reading))
        .expect("in range");
    let filter = ExtendedKalman::<f64>::design(&given, &site).expect("any rig");
    let mut random = Normal(0x1234_5678_9abc_def1);
    let (mut sum, mut count) = (0.0, 0.0);
    for _ in 0..40 {
        // Swings of a radian and more: not a linear system.
        let mut truth = plant.rest(State::new(0.0, 1.8, 0.0, 0.0));
        let mut memory = filter.start();
        for k in 0..1500 {
            let held = if (k / 100) % 2 == 0 { 2.0 } else { -2.0 };
            let theta = truth.x.theta + reading[0] * random.draw();
            let alpha = truth.x.alpha + reading[1] * random.draw();
            let said = filter
                .update(&mut memory, &Measurement::new(theta, alpha, held))
                .now;
            if k >= 500 && k % 50 == 0 {
                let p = SMatrix::<f64, 4, 4>::from_fn(|i, j| memory.covariance()[i][j]);
                let [e, x] = [said, truth.x].map(|x| SVector::from(x.to_array()));
                let weighed = p.try_inverse().expect("a covariance") * (e - x);
                sum += (e - x).dot(&weighed);
                count += 1.0;
            }
            plant.step(&mut truth, held + command * random.draw(), PERIOD);
        }
    }
    // 800 errors, correlated over some samples: the mean of chi-squared with 4 degrees of freedom is 4 with a standard
    // deviation of about 0.2.
    let mean: f64 = sum / count;
    assert!((mean - 4.0).abs() < 0.8, "{mean}");
}

/// What no encoder sees: an offset of the motor, and a cable.
#[test]
fn the_disturbance_observer_finds_the_voltage_beside_the_command() {
    let rig = srv02();
    let real = Plant::new(
        &rig.params,
        &[Effect::new("motor.bias", &[0.4]).expect("an effect")],
    )
    .expect("a plant");
    let observer =
        AnyEstimator::<f64>::design(&settings("disturbance_observer"), &Site::of(&rig, PERIOD))
            .expect("any rig");
    let (mut memory, mut truth) = (observer.start(), real.rest(State::hanging()));
    let mut found = 0.0;
    for k in 0..2000 {
        let held = if (k / 200) % 2 == 0 { 1.0 } else { -1.0 };
        let [theta, alpha] = real.measure(&truth);
        let m = Measurement::new(theta, alpha, held);
        found = observer.update(&mut memory, &m).disturbance;
        real.step(&mut truth, held, PERIOD);
    }
    // Exact but for how the pendulum's swing shows in it: the gain is that of upright.
    assert!((found - 0.4).abs() < 0.01, "{found} V");
}

/// `ahead` is the state at which a command given now begins to act: a period later, and the rig's own delay.
#[test]
fn estimators_look_ahead_over_the_delay() {
    let rig = srv02();
    for id in [
        "observer",
        "luenberger",
        "kalman",
        "ekf",
        "disturbance_observer",
    ] {
        // In periods: none, whole ones, and a part.
        for late in [0.0, 1.0, 5.0, 2.6] {
            let mut named = rig.clone();
            let delay = Effect::new("motor.delay", &[late * PERIOD]).expect("an effect");
            named.effects.push(delay);
            let plant = named.plant::<f64>();
            let estimator = AnyEstimator::<f64>::design(&settings(id), &Site::of(&named, PERIOD))
                .expect("any rig");
            let (mut memory, mut truth) = (
                estimator.start(),
                plant.rest(State::new(0.0, 2.5, 0.0, 0.0)),
            );
            let (mut said, mut states) = (Vec::new(), Vec::new());
            for k in 0..600 {
                let held = 3.0 * (f64::from(k) * 0.05).sin();
                let [theta, alpha] = plant.measure(&truth);
                let m = Measurement::new(theta, alpha, held);
                said.push(estimator.update(&mut memory, &m).ahead);
                states.push(truth.x);
                plant.step(&mut truth, held, PERIOD);
            }
            let whole = late.floor() as usize;
            for k in 300..590 {
                let [from, to] = [states[k + 1 + whole], states[k + 2 + whole]];
                let part = late - late.floor();
                let there = from.alpha + part * (to.alpha - from.alpha);
                // Whole periods exactly; between two, along a straight line: h^2/8 times 100 rad/s^2.
                let tolerance = if part == 0.0 { 1e-6 } else { 1e-4 };
                let off = (said[k].alpha - there).abs();
                assert!(off < tolerance, "{id}, {late} periods late: {off:e} rad");
            }
        }
    }
}

/// In single precision the same, within what its rounding does.
#[test]
fn single_precision_follows() {
    let rig = srv02();
    let plant = rig.plant::<f64>();
    for spec in estimators::CATALOGUE {
        let given = Settings::new(spec);
        let site = Site::of(&rig, PERIOD);
        let double = AnyEstimator::<f64>::design(&given, &site).expect(spec.id);
        let single = AnyEstimator::<f32>::design(&given, &site).expect(spec.id);
        let (mut a, mut b) = (double.start(), single.start());
        let mut truth = plant.rest(State::new(0.0, 2.0, 0.0, 0.0));
        for k in 0..2000 {
            let held = if k % 200 < 100 { 1.0 } else { -1.0 };
            let [theta, alpha] = plant.measure(&truth);
            let x = double
                .update(&mut a, &Measurement::new(theta, alpha, held))
                .now;
            #[allow(clippy::cast_possible_truncation)]
            let m = Measurement::new(theta as f32, alpha as f32, held as f32);
            let y = single.update(&mut b, &m).now;
            let off = (x.alpha_dot - f64::from(y.alpha_dot)).abs();
            // Angles of a few radians are rounded to 1e-7; a derivative multiplies that by its corner, 230 rad/s.
            assert!(off < 2e-3, "{}: {off:e} rad/s at sample {k}", spec.id);
            plant.step(&mut truth, held, PERIOD);
        }
    }
}
