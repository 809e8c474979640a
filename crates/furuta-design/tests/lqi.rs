//! Integral action on the nonlinear plant: no lasting error, and no overshoot from a motor at its limit.

use furuta_ctrl::Site;
use furuta_ctrl::controllers::{self, AnyController, Controller, Design, Lqi};
use furuta_ctrl::settings::Settings;
use furuta_design::closed_loop::{ClosedLoop, Sample, Sensing};
use furuta_model::{Effect, Plant, Rig, State};

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
    for name in Rig::BUILTIN {
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
