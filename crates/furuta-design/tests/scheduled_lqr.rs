//! Gains that follow the arm's speed, on the nonlinear plant.

#[path = "data/scheduled_lqr.rs"]
mod answers;

use furuta_ctrl::Site;
use furuta_ctrl::controllers::{Controller, Design, SPEEDS, ScheduledLqr, StateFeedback, settings};
use furuta_ctrl::settings::Settings;
use furuta_model::{Effect, Rig, State};
use nalgebra::RowVector4;

const PERIOD: f64 = 0.002;

fn rig(name: &str) -> Rig {
    Rig::builtin(name).expect("built in")
}

fn designed<C: Design>(kind: &str, rig: &Rig, given: &[(&str, &[f64])]) -> C {
    let start: Settings = settings(kind).expect("listed");
    let given = given.iter().fold(start, |s, (name, values)| {
        s.with(name, values).expect("in range")
    });
    C::design(&given, &Site::of(rig, PERIOD)).expect("a gain")
}

/// SciPy's gains at the speeds that `fastest` makes the last ones.
#[test]
fn the_gains_are_scipys() {
    for (name, speed, expected) in answers::GAINS {
        let rig = rig(name);
        let r = [1.0 / rig.params.motor.command_limit.powi(2)];
        let (q, fastest) = ([1.0 / 16.0, 4.0, 0.0, 0.0], [speed]);
        let mut given = vec![("q", &q[..]), ("r", &r[..])];
        if speed > 0.0 {
            given.push(("fastest", &fastest[..]));
        }
        let control: ScheduledLqr<f64> = designed("scheduled_lqr", &rig, &given);
        for (k, e) in control.gain_at(speed).iter().zip(expected) {
            assert!((k - e).abs() < 1e-7 * e.abs(), "{name} {speed}: {k} {e}");
        }
    }
}

/// An arm at rest has the LQR's commands, bit for bit, springs of the rig file included.
#[test]
fn at_rest_it_is_the_lqr() {
    for name in Rig::VOLTAGE {
        let mut rig = rig(name);
        rig.effects
            .push(Effect::new("arm.spring", &[0.004, 0.1]).expect("sound"));
        let fixed: StateFeedback<f64> = designed("lqr", &rig, &[]);
        let control: ScheduledLqr<f64> = designed("scheduled_lqr", &rig, &[]);
        assert_eq!(control.surrogate(), Some(fixed));
        for k in 0..50 {
            let s = f64::from(k - 25) * 0.01;
            let x = State::new(2.0 * s, s, 0.0, -3.0 * s);
            let wanted = fixed.update(&mut (), &x, &State::upright(), PERIOD);
            assert_eq!(
                control.update(&mut (), &x, &State::upright(), PERIOD),
                wanted
            );
        }
    }
}

/// From gain to gain the command has no jump, and turning the other way is the mirror image.
#[test]
fn the_gain_is_continuous() {
    for name in Rig::VOLTAGE {
        let control: ScheduledLqr<f64> = designed("scheduled_lqr", &rig(name), &[]);
        for k in 0..=SPEEDS {
            #[allow(clippy::cast_precision_loss)]
            let w = control.fastest * (k as f64 / (SPEEDS - 1) as f64).sqrt();
            let (below, above) = (
                control.gain_at(w * (1.0 - 1e-9)),
                control.gain_at(w * (1.0 + 1e-9)),
            );
            for (a, b) in below.iter().zip(above) {
                assert!((a - b).abs() <= 1e-7 * a.abs(), "{name} {w}: {a} {b}");
            }
            assert_eq!(control.gain_at(-w), control.gain_at(w));
        }
        assert_eq!(control.gain_at(1e9), control.gains[SPEEDS - 1]);
    }
}

/// The largest lean (rad) from which the pendulum comes back upright while the arm turns at `w`.
fn reach<C: Controller<f64>>(rig: &Rig, control: &C, w: f64) -> f64 {
    let plant = rig.plant::<f64>();
    let comes_back = |lean: f64| {
        let mut memory = control.start();
        let mut truth = plant.rest(State::new(0.0, lean, w, 0.0));
        for k in 0..1500 {
            let wanted = State::new(w * f64::from(k) * PERIOD, 0.0, w, 0.0);
            let u = control.update(&mut memory, &truth.x, &wanted, PERIOD);
            plant.step(&mut truth, u, PERIOD);
            // A NaN counts as a fall.
            let standing = truth.x.alpha.abs() < 1.5;
            if !standing {
                return false;
            }
        }
        truth.x.alpha.abs() < 0.05
    };
    let (mut held, mut lost) = (0.0, 1.0);
    for _ in 0..8 {
        let lean = 0.5 * (held + lost);
        if comes_back(lean) {
            held = lean;
        } else {
            lost = lean;
        }
    }
    held
}

/// At speed it holds at least what the fixed gain holds, and where the fixed one's loop is unstable it still does.
#[test]
fn at_speed_it_holds_more_than_the_fixed_gain() {
    for name in Rig::VOLTAGE {
        let rig = rig(name);
        let control: ScheduledLqr<f64> = designed("scheduled_lqr", &rig, &[]);
        // The fixed gain, with the voltage that the speed needs.
        let fixed = ScheduledLqr {
            gains: [control.gains[0]; SPEEDS],
            ..control
        };
        for share in [0.0, 0.3, 0.7] {
            let w = share * control.fastest;
            let (with, without) = (reach(&rig, &control, w), reach(&rig, &fixed, w));
            println!("{name} at {w:.1} rad/s: {with:.3} rad scheduled, {without:.3} rad fixed");
            assert!(with >= without, "{name} at {w}: {with} {without}");
            if share == 0.7 {
                assert!(with > 1.05 * without, "{name} at {w}: {with} {without}");
            }
        }
    }
    // By the linear loop: the fixed gain loses the pendulum of a fast arm, the scheduled one does not.
    let rig = rig("qube-servo-2");
    let control: ScheduledLqr<f64> = designed("scheduled_lqr", &rig, &[]);
    let w = 0.7 * control.fastest;
    let at = furuta_model::linearize(
        &rig.nominal_plant(),
        State::new(0.0, 0.0, w, 0.0),
        control.drag * w,
    );
    let (a, b) = furuta_model::discretize::zero_order_hold(&at.a, &at.b, PERIOD);
    let size = |k: [f64; 4]| furuta_ctrl::design::spectral_radius(&(a - b * RowVector4::from(k)));
    assert!(size(control.gain_at(0.0)) > 1.002);
    assert!(size(control.gain_at(w)) < 0.995);
}
