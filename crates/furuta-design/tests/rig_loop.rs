//! The closed loop of a rig with its effects, against the nonlinear plant stepped by itself, and against what theory
//! says of margins.

use furuta_ctrl::design::{Weights, balance_weights, dlqr, lqr, place};
use furuta_design::rig_loop::{Law, RigLoop};
use furuta_model::discretize::zero_order_hold;
use furuta_model::linear_plant::{Amplitudes, Hold, linear_plant, rigid};
use furuta_model::{Effect, Plant, Rig, State};
use nalgebra::{Complex, DVector, Matrix2, Vector4};

/// An effect's id and its values.
type Named<'a> = (&'a str, &'a [f64]);

fn with(name: &str, effects: &[Named]) -> Rig {
    let mut rig = Rig::builtin(name).expect("built in");
    rig.effects = effects
        .iter()
        .map(|(id, values)| Effect::new(id, values).expect("sound"))
        .collect();
    rig
}

fn law(k: impl std::ops::Index<usize, Output = f64>) -> Law {
    Law::of_states([k[0], k[1], k[2], k[3]])
}

fn closed(rig: &Rig, law: Law, period: Option<f64>) -> RigLoop {
    RigLoop::new(rig, law, period, &Amplitudes::NONE).expect("a loop")
}

/// The sampled LQR of the rig as its file has it.
fn regulator(rig: &Rig, period: f64) -> Law {
    let plant = rig.plant();
    let up = rigid(&plant, Hold::Arm(0.0)).expect("rests");
    let (a, b) = zero_order_hold(&up.a, &up.b, period);
    law(dlqr(&a, &b, &balance_weights(&rig.params))
        .expect("a gain")
        .gain)
}

/// The spring of the issue: what a design without it promises, and what is true. By hand: `M q'' = F`.
#[test]
fn a_spring_moves_the_poles_as_by_hand() {
    for name in Rig::VOLTAGE {
        let stiffness = 0.005;
        let (bare, sprung) = (
            with(name, &[]),
            with(name, &[("arm.spring", &[stiffness, 0.3])]),
        );
        let c = bare.params.coefficients();
        let mass = Matrix2::new(c.arm, -c.coupling, -c.coupling, c.pendulum);
        let pull = mass.try_inverse().expect("positive definite")
            * nalgebra::Vector2::new(-stiffness, 0.0);
        let up = |rig: &Rig| rigid(&rig.plant(), Hold::Arm(0.0)).expect("rests");
        let (without, held) = (up(&bare), up(&sprung));
        let mut expected = without.a;
        (expected[(2, 0)], expected[(3, 0)]) = (pull[0], pull[1]);
        assert!(
            (held.a - expected).amax() < 1e-9 * expected.amax(),
            "{name}"
        );
        // The gain by the model without the spring does not do what it promises; by the model with it, it does.
        let wanted = [-3.0, -20.0, -6.0, -7.0].map(|p| Complex::new(p, 0.0));
        let blind = place(&without.a, &without.b, &wanted).expect("reached");
        let sighted = place(&held.a, &held.b, &wanted).expect("reached");
        let growth = |k| closed(&sprung, law(k), None).growth();
        let by_hand = furuta_ctrl::design::poles(&(expected - without.b * blind)).expect("poles");
        let slowest = by_hand.iter().map(|p| p.re).fold(f64::MIN, f64::max);
        assert!((growth(blind) - slowest).abs() < 1e-6, "{name}: {slowest}");
        assert!((slowest + 3.0).abs() > 0.01, "{name}: {slowest}");
        assert!((growth(sighted) + 3.0).abs() < 1e-6, "{name}");
        assert!(
            (closed(&bare, law(blind), None).growth() + 3.0).abs() < 1e-6,
            "{name}"
        );
    }
}

/// The loop's matrix predicts what the nonlinear plant does from near rest, its delays, lag and coupling included.
#[test]
fn the_matrix_is_the_plant_near_rest() {
    let spring: Named = ("arm.spring", &[0.004, 0.0]);
    let compliance: Named = ("drive.compliance", &[0.4, 2e-3, 0.3, 0.0]);
    let ringing: Named = ("motor.resonance", &[0.03, 0.15]);
    let (qube, kit) = ("qube-servo-2", "stepper-kit");
    let rigs: [(&str, &[Named]); 7] = [
        (qube, &[spring]),
        (qube, &[spring, ("motor.delay", &[0.0052])]),
        (qube, &[("motor.delay", &[0.004]), ("motor.lag", &[0.006])]),
        (qube, &[("motor.delay", &[0.0007]), compliance]),
        (
            qube,
            &[("motor.lag", &[0.003]), compliance, ("motor.bias", &[0.2])],
        ),
        (kit, &[ringing]),
        (
            kit,
            &[ringing, ("motor.lag", &[0.004]), ("motor.delay", &[0.003])],
        ),
    ];
    let period = 0.002;
    for (name, effects) in rigs {
        let rig = with(name, effects);
        let law = regulator(&rig, period);
        let found = closed(&rig, law, Some(period));
        let plant: Plant<f64> = rig.plant();
        let at = found.plant.at;
        let size = 1e-6;
        let x0 = Vector4::new(1.0, 0.5, -2.0, 1.0) * size;
        let mut state = plant.rest(State::from(Vector4::from(at.x) + x0));
        state.voltage = at.volts;
        let twist = furuta_model::Twist {
            angle: at.rotor - at.x.theta,
            speed: 0.0,
        };
        if plant.has_drive() {
            plant.set_twist(&mut state, twist);
        }
        let a = found.matrix();
        let n = a.nrows();
        let names = found.states();
        let mut z = DVector::zeros(n);
        for i in 0..4 {
            z[i] = x0[i];
        }
        for (i, name) in names.iter().enumerate() {
            match name.as_str() {
                "rotor" => z[i] = x0[0],
                "rotor_dot" => z[i] = x0[2],
                _ => {}
            }
        }
        if plant.has_drive() {
            plant.set_twist(&mut state, twist);
        }
        // Substeps as fine as the lag and the coupling ask for; the delay needs the same grid as the commands.
        for k in 0..60 {
            let e = Vector4::from(state.x) - Vector4::from(at.x);
            for i in 0..4 {
                let off = (e[i] - z[i]).abs();
                assert!(
                    off < 2e-3 * size * (1.0 + z.amax() / size),
                    "{effects:?} sample {k} state {i}: {} {}",
                    e[i],
                    z[i]
                );
            }
            let u = at.command - (0..4).map(|i| law.gain[i] * e[i]).sum::<f64>();
            plant.step(&mut state, u, period);
            z = &a * z;
        }
    }
}

/// A loop with its gain, its delay or its phase at the margin is on its edge, as the eigenvalues say.
#[test]
fn at_its_margins_a_loop_is_on_its_edge() {
    let rigs = [
        with("qube-servo-2", &[]),
        with(
            "shahzad2022-srv02",
            &[("motor.delay", &[0.0033]), ("arm.spring", &[0.002, 0.0])],
        ),
        with("fong2014-emecs", &[("motor.lag", &[0.01])]),
    ];
    for rig in &rigs {
        for period in [None, Some(0.002)] {
            let law = regulator(rig, 0.002);
            let found = closed(rig, law, period);
            let margins = found.margins();
            assert!(margins.stable, "{}", rig.name);
            for factor in margins.gain {
                if factor > 1e-6 && factor.is_finite() {
                    let scaled = |by: f64| {
                        let gain = law.gain.map(|k| by * factor * k);
                        let mut other = found.clone();
                        other.law.gain = gain;
                        other.growth()
                    };
                    let edge = scaled(1.0);
                    // Padé is not the delay itself.
                    let near = if period.is_none() && found.delay() > 0.0 {
                        0.05
                    } else {
                        1e-5
                    };
                    assert!(
                        edge.abs() < near,
                        "{} {period:?} gain {factor}: {edge}",
                        rig.name
                    );
                    let inside = if factor < 1.0 { 1.05 } else { 0.95 };
                    assert!(scaled(inside) < 0.0, "{}", rig.name);
                }
            }
            if margins.delay.is_finite() {
                let edge = found.delayed(margins.delay).growth();
                let near = if period.is_none() { 0.05 } else { 1e-6 };
                assert!(edge.abs() < near, "{} {period:?} delay: {edge}", rig.name);
            }
            // L lies on the unit circle there.
            let l = found.response(margins.at[2]);
            assert!(
                (l.norm() - 1.0).abs() < 1e-9 && ((-l).arg().abs() - margins.phase).abs() < 1e-9,
                "{} {period:?}: {margins:?} {l} {}",
                rig.name,
                l.norm() - 1.0
            );
            // What a disk guarantees is less than each alone.
            assert!(margins.disk_phase() <= margins.phase + 1e-9);
            let [low, high] = margins.disk_gain();
            assert!(low >= margins.gain[0] - 1e-9 && high <= margins.gain[1] + 1e-9);
        }
    }
}

/// R. Kalman's inequality: an LQR in continuous time has `|1 + L| >= 1`.
#[test]
fn an_lqr_has_the_margins_of_its_theory() {
    for name in Rig::VOLTAGE {
        let rig = with(name, &[]);
        let up = rigid(&rig.plant(), Hold::Arm(0.0)).expect("rests");
        let gain = lqr(
            &up.a,
            &up.b,
            &Weights::diagonal([1.0, 10.0, 0.0, 0.0], [0.1]),
        )
        .expect("a gain")
        .gain;
        let found = closed(&rig, law(gain), None);
        let margins = found.margins();
        assert!(
            margins.gain[0] <= 0.5 + 1e-9 && margins.gain[1] == f64::INFINITY,
            "{name}: {margins:?}"
        );
        assert!(
            margins.phase >= std::f64::consts::FRAC_PI_3 - 1e-9,
            "{name}: {margins:?}"
        );
        for k in -30..60 {
            let l = found.response(10f64.powf(0.1 * f64::from(k)));
            assert!((l + 1.0).norm() >= 1.0 - 1e-9, "{name}");
        }
    }
}

/// Dry friction by its describing function is `4 F/(pi A)` of damping.
#[test]
fn describing_functions_damp() {
    let rig = with("qube-servo-2", &[("arm.coulomb", &[0.002])]);
    let plant = rig.plant();
    let amplitudes = Amplitudes {
        arm_speed: 0.5,
        ..Amplitudes::NONE
    };
    let found = linear_plant(&plant, Hold::Arm(0.0), &amplitudes).expect("rests");
    let mut damped = with("qube-servo-2", &[]);
    damped.params.arm.viscous += 4.0 * 0.002 / (std::f64::consts::PI * 0.5);
    let expected = rigid(&damped.plant(), Hold::Arm(0.0)).expect("rests");
    assert!((found.rigid.a - expected.a).amax() < 1e-6 * expected.a.amax());
}

/// Where a tilted base lets the rig rest under a law, the nonlinear plant stays.
#[test]
fn a_tilted_rig_rests_where_newton_says() {
    let rig = with(
        "shahzad2022-srv02",
        &[
            ("arm.tilt", &[0.03, 0.7, 0.0]),
            ("arm.cable", &[0.004, 0.001, 0.002, 0.2]),
            ("motor.bias", &[0.1]),
        ],
    );
    let law = regulator(&rig, 0.002);
    let found = closed(&rig, law, Some(0.002));
    let at = found.plant.at;
    assert!(at.x.alpha.abs() > 1e-3 && at.x.theta.abs() > 1e-3, "{at:?}");
    let plant: Plant<f64> = rig.plant();
    let rate = plant.rate(0.0, &at.x, plant.volts(at.command), 1e3);
    assert!(
        rate.theta_dot.abs() < 1e-8 && rate.alpha_dot.abs() < 1e-8,
        "{rate:?}"
    );
    // And it is drawn there by the loop.
    let mut state = plant.rest(at.x + State::new(0.02, 0.01, 0.0, 0.0));
    for _ in 0..5000 {
        let e = state.x - at.x;
        let u = at.command - (0..4).map(|i| law.gain[i] * e.to_array()[i]).sum::<f64>();
        plant.step(&mut state, u, 0.002);
    }
    assert!((Vector4::from(state.x) - Vector4::from(at.x)).amax() < 1e-6);
}

/// Separation: with an estimator that knows the rig, the loop's poles are the law's on the state ahead and the
/// estimator's; looking ahead takes the law's delay away.
#[test]
fn an_estimator_that_knows_the_rig_adds_its_own_poles_alone() {
    use furuta_ctrl::estimators::{AnyEstimator, Estimator};
    use furuta_ctrl::{Config, Site};
    let period = 0.002;
    for effects in [
        &[][..],
        &[("motor.delay", &[0.004][..])],
        &[("arm.spring", &[0.004, 0.0][..])],
    ] {
        let rig = with("shahzad2022-srv02", effects);
        let law = regulator(&rig, period);
        let site = Site::of(&rig, period);
        let estimator =
            AnyEstimator::<f64>::design(&Config::default().estimator, &site).expect("possible");
        let linear = estimator.linear().expect("constant");
        let found = closed(&rig, law, Some(period))
            .observed(linear)
            .expect("sampled");
        let (a, b) = site.upright().expect("possible");
        let k = nalgebra::RowVector4::from(law.gain);
        let l = nalgebra::Matrix4x2::from_fn(|i, j| linear.correction[i][j]);
        let c = nalgebra::Matrix2x4::identity();
        let mut expected = Vec::new();
        expected.extend(furuta_ctrl::design::poles(&(a - b * k)).expect("poles"));
        expected.extend(furuta_ctrl::design::poles(&(a - a * l * c)).expect("poles"));
        let all = found.poles();
        for pole in &expected {
            let near = all
                .iter()
                .map(|p| (p - pole).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(near < 1e-6, "{effects:?}: {pole} in {all:?}");
        }
        // What is left is forgotten: at 0, where a defective pole is off by a root of rounding.
        let lasting = all.iter().filter(|p| p.norm() > 0.05).count();
        assert_eq!(
            lasting,
            expected.iter().filter(|p| p.norm() > 0.05).count(),
            "{all:?}"
        );
        let margins = found.margins();
        assert!(
            margins.stable && margins.delay > 0.0 && margins.disk > 0.0,
            "{margins:?}"
        );
        // At its limits the loop is on its edge, estimator included.
        for factor in margins
            .gain
            .into_iter()
            .filter(|f| *f > 1e-6 && f.is_finite())
        {
            let edge = found.with_errors(factor, 0.0).growth();
            assert!(edge.abs() < 1e-4, "{effects:?} {factor}: {edge}");
        }
        let edge = found.with_errors(1.0, margins.delay).growth();
        assert!(edge.abs() < 1e-4, "{effects:?}: {edge}");
    }
}
