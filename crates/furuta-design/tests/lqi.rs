//! Integral action on the nonlinear plant: no lasting error, and no overshoot from a motor at its limit.

#[path = "data/lqi.rs"]
mod answers;

use furuta_ctrl::Site;
use furuta_ctrl::controllers::{self, AnyController, Controller, Design, Lqi};
use furuta_ctrl::design::{Weights, poles, sampled_lqi};
use furuta_ctrl::settings::Settings;
use furuta_design::closed_loop::{ClosedLoop, Model, Sample, Sensing};
use furuta_design::rig_loop::{Law, RigLoop};
use furuta_model::discretize::zero_order_hold;
use furuta_model::linear_plant::Amplitudes;
use furuta_model::{Effect, Linear, Plant, Rig, State};
use nalgebra::{Complex, Matrix5, RowVector4, RowVector5, Vector5};

const PERIOD: f64 = 0.002;

fn run(
    rig: &Rig,
    kind: &str,
    effects: &[Effect<f64>],
    start: State<f64>,
    target: f64,
) -> Vec<Sample> {
    let settings = controllers::settings(kind).expect("listed");
    let control = AnyController::<f64>::design(&settings, &Site::of(rig, PERIOD)).expect("a gain");
    ClosedLoop {
        plants: vec![(0.0, Plant::new(&rig.params, effects).expect("sound").into())],
        start,
        period: PERIOD,
        substeps: 1,
        duration: 40.0,
        sensing: Sensing::Perfect,
    }
    .run(&control, |_| State::new(target, 0.0, 0.0, 0.0))
}

/// An amplifier that is off by a twentieth of its largest voltage moves the arm under an LQR for good, and for a while
/// under an LQI.
#[test]
fn a_constant_pull_leaves_no_error() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let limit = rig.params.motor.command_limit;
        let bias = Effect::new("motor.bias", &[0.05 * limit]).expect("in range");
        let end = |kind| {
            let samples = run(&rig, kind, &[bias], State::upright(), 0.3);
            samples.last().expect("some").x
        };
        assert!(
            (end("lqr").theta - 0.3).abs() > 0.05,
            "{name}: {:?}",
            end("lqr")
        );
        let x = end("lqi");
        assert!(
            (x.theta - 0.3).abs() < 1e-4 && x.alpha.abs() < 1e-4,
            "{name}: {x:?}"
        );
    }
}

/// What is integrated never asks for more than the full command, and not at all for more where the motor is at its
/// limit.
#[test]
fn the_integral_does_not_wind_up() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let settings = Settings::new(controllers::settings("lqi").expect("listed").spec());
    let control = Lqi::<f64>::design(&settings, &Site::of(&rig, PERIOD)).expect("a gain");
    let mut state = control.start();
    // An hour at a target that is never reached.
    let (x, far) = (State::upright(), State::new(5.0, 0.0, 0.0, 0.0));
    for _ in 0..1_800_000 {
        control.update(&mut state, &x, &far, PERIOD);
    }
    // Once there, the command falls below the limit within a sample of going the other way.
    let there = control.update(&mut state, &far, &far, PERIOD);
    assert!(there.abs() <= control.command_limit);
    let mut seconds = 0.0;
    let beyond = State::new(5.5, 0.0, 0.0, 0.0);
    while control.update(&mut state, &beyond, &far, PERIOD) * there > 0.0 {
        seconds += PERIOD;
        assert!(seconds < 60.0, "still wound up");
    }
}

/// A controller that takes over begins with the command that it finds.
#[test]
fn it_takes_over_without_a_bump() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let settings = controllers::settings("lqi").expect("listed");
    let control = Lqi::<f64>::design(&settings, &Site::of(&rig, PERIOD)).expect("a gain");
    let (x, upright) = (State::new(0.1, 0.02, -0.3, 0.1), State::upright());
    let mut state = control.take_over(&x, &upright, 1.25);
    let u = control.update(&mut state, &x, &upright, PERIOD);
    assert!((u - 1.25).abs() < 1e-12, "{u}");
}

const ARM: RowVector4<f64> = RowVector4::new(1.0, 0.0, 0.0, 0.0);

fn upright(rig: &Rig) -> Linear {
    Site::of(rig, PERIOD).linear().expect("rests")
}

/// The rig with the integral of theta, sampled.
fn extended(up: &Linear, period: f64) -> (Matrix5<f64>, Vector5<f64>) {
    let mut a = Matrix5::zeros();
    a.fixed_view_mut::<4, 4>(0, 0).copy_from(&up.a);
    a[(4, 0)] = 1.0;
    let b = Vector5::from_fn(|i, _| if i < 4 { up.b[i] } else { 0.0 });
    zero_order_hold(&a, &b, period)
}

/// The integral is sampled with the rig, not by Euler's rule: SciPy's gains, down to 50 Hz.
#[test]
fn the_sampled_gain_is_scipys() {
    for (name, rate, expected) in answers::GAINS {
        let rig = Rig::builtin(name).expect("built in");
        let up = upright(&rig);
        let weights = Weights::diagonal([5.0, 1.0, 0.1, 0.1, 20.0], [0.1]);
        let k = sampled_lqi::<f64, 4, 5>(&up.a, &up.b, &ARM, 1.0 / rate, &weights)
            .expect("a gain")
            .gain;
        for (k, e) in k.iter().zip(expected) {
            assert!((k - e).abs() < 1e-8 * e.abs(), "{name} {rate}: {k} {e}");
        }
        // The controller of a file designs the same.
        let settings = controllers::settings("lqi").expect("listed");
        let settings = settings
            .with("q", &[5.0, 1.0, 0.1, 0.1, 20.0])
            .and_then(|s| s.with("r", &[0.1]))
            .expect("in range");
        let control = Lqi::<f64>::design(&settings, &Site::of(&rig, 1.0 / rate)).expect("a gain");
        assert!(
            (control.integral_gain - k[4]).abs() < 1e-12 * k[4].abs(),
            "{name} {rate}"
        );
    }
}

/// The loop that designs are judged by has the very poles of the design, late by any share of a sample too.
#[test]
fn the_loop_has_the_designs_poles() {
    for (name, rate, k) in answers::GAINS {
        let rig = Rig::builtin(name).expect("built in");
        let law = Law {
            gain: [k[0], k[1], k[2], k[3]],
            integral: k[4],
        };
        let closed = RigLoop::new(&rig, law, Some(1.0 / rate), &Amplitudes::NONE).expect("a loop");
        let (a, b) = extended(&upright(&rig), 1.0 / rate);
        let near = |of: &[Complex<f64>], pole: &Complex<f64>| {
            of.iter()
                .map(|p| (p - pole).norm())
                .fold(f64::INFINITY, f64::min)
        };
        let designed = poles(&(a - b * RowVector5::from(k))).expect("poles");
        for pole in &designed {
            assert!(near(&closed.poles(), pole) < 1e-8, "{name} {rate}: {pole}");
        }
        // On the unit circle the response is that of the poles: at its delay margin the loop is on its edge.
        let margins = closed.margins();
        let edge = closed.delayed(margins.delay).growth();
        assert!(
            margins.stable && edge.abs() < 1e-6,
            "{name} {rate}: {edge} {margins:?}"
        );
        let l = closed.response(margins.at[2]);
        assert!((l.norm() - 1.0).abs() < 1e-9, "{name} {rate}: {l}");
    }
}

/// What the controller adds up from angles and speeds alone is the true integral: its commands on the linear plant are
/// those of the exact law, at 50 Hz as well.
#[test]
fn the_controller_integrates_what_the_design_does() {
    for (name, rate, k) in answers::GAINS {
        let rig = Rig::builtin(name).expect("built in");
        let (up, period) = (upright(&rig), 1.0 / rate);
        let control = Lqi {
            gain: [k[0], k[1], k[2], k[3]],
            integral_gain: k[4],
            command_limit: 1e6,
        };
        let start = State::new(0.3, 0.1, -0.5, 0.4);
        let samples = ClosedLoop {
            plants: vec![(0.0, Model::Linear(up))],
            start,
            period,
            substeps: 1,
            duration: 3.0,
            sensing: Sensing::Perfect,
        }
        .run(&control, |_| State::upright());
        let (a, b) = extended(&up, period);
        let mut x = Vector5::new(0.3, 0.1, -0.5, 0.4, 0.0);
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for sample in &samples {
            let u = -(RowVector5::from(k) * x)[0];
            worst = worst.max((sample.u - u).abs());
            largest = largest.max(u.abs());
            x = a * x + b * u;
        }
        println!("{name} {rate}: {worst:e} of {largest:e}");
        let allowed = if rate < 100.0 { 5e-6 } else { 2e-7 };
        assert!(
            worst < allowed * largest,
            "{name} {rate}: {worst} of {largest}"
        );
    }
}
