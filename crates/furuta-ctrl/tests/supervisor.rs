//! Swing-up, catch and balance of the built-in rigs in simulation: real voltage limits, encoders, one sample of delay.

use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::supervisor::{Fault, Mode, Request, Supervisor};
use furuta_ctrl::{Config, Limits, Real, Site, wrap};
use furuta_model::{Rig, State};
use proptest::prelude::*;

/// What a run came to.
struct Run {
    /// When balancing began for good, s.
    caught: Option<f64>,
    /// Largest arm angle, rad.
    arm: f64,
    /// Largest distance from upright and largest command during the last two seconds.
    rest_angle: f64,
    rest_command: f64,
    fault: Option<Fault>,
}

fn run<T: Real>(rig: &Rig, start: State<f64>, h: f64, seconds: f64) -> Run {
    let supervisor = Supervisor::<T>::design(&Config::default(), &Site::of(rig, h)).unwrap();
    let mut state = supervisor.start();
    assert!(state.request(Request::Start));
    let plant = rig.plant::<f64>();
    let mut truth = plant.rest(start);
    let mut result = Run {
        caught: None,
        arm: 0.0,
        rest_angle: 0.0,
        rest_command: 0.0,
        fault: None,
    };
    let mut late = 0.0;
    let samples = (seconds / h) as usize;
    for k in 0..samples {
        let read = rig.sensors.quantised(plant.measure(&truth));
        let [theta, alpha] = read.map(T::from_f64);
        let measurement = Measurement::new(theta, alpha, T::from_f64(late));
        let out = supervisor.update(&mut state, &measurement, T::ZERO);
        let t = k as f64 * h;
        match (out.mode, result.caught) {
            (Mode::Balance, None) => result.caught = Some(t),
            (Mode::SwingUp, Some(_)) => result.caught = None,
            _ => {}
        }
        // The command computed from this sample acts one sample later.
        let substeps = (h / 1e-3).ceil();
        for _ in 0..substeps as usize {
            plant.step(&mut truth, late, h / substeps);
        }
        late = out.u.value();
        result.arm = result.arm.max(truth.x.theta.abs());
        if t > seconds - 2.0 {
            result.rest_angle = result.rest_angle.max(wrap(truth.x.alpha).abs());
            result.rest_command = result.rest_command.max(late.abs());
        }
    }
    result.fault = state.fault();
    result
}

/// Rig, pendulum friction used (`None`: the file's), command limit used, seconds allowed for swing-up.
///
/// The Qube cannot be swung up with the manual's pendulum friction (5e-4 N m s/rad) and 10 V: searching over all
/// voltages, bang-bang ones included, no run with the arm within half a turn either way came nearer than 0.5 rad. So it
/// is tried with more volts, and with less friction.
const RIGS: [(&str, Option<f64>, Option<f64>, f64); 5] = [
    ("fong2014-emecs", None, None, 10.0),
    ("shahzad2022-srv02", None, None, 10.0),
    ("ramos-velasco", None, None, 30.0),
    ("qube-servo-2", None, Some(15.0), 10.0),
    ("qube-servo-2", Some(1e-4), None, 10.0),
];

#[test]
fn swings_up_and_balances() {
    let mut failed = 0;
    for (name, friction, volts, seconds) in RIGS {
        let mut rig = Rig::builtin(name).unwrap();
        rig.params.pendulum.viscous = friction.unwrap_or(rig.params.pendulum.viscous);
        rig.params.motor.command_limit = volts.unwrap_or(rig.params.motor.command_limit);
        // Rates and starts the tuning has seen, and others.
        for h in [0.001, 0.002, 0.004, 0.005] {
            for offset in [0.0, 0.07, -0.3] {
                let start = State::new(offset, core::f64::consts::PI - 0.5 * offset, 0.0, 0.0);
                let r = run::<f64>(&rig, start, h, seconds + 8.0);
                println!(
                    "{name:18} {h} {offset:5}: caught {:?}, arm to {:.2} rad, at rest {:.4} rad, {:.2} V, {:?}",
                    r.caught, r.arm, r.rest_angle, r.rest_command, r.fault
                );
                // No fault: the arm stayed within its limit of a turn either way.
                let sound = r.fault.is_none() && r.caught.is_some_and(|t| t < seconds);
                // A few encoder counts' worth of limit cycle.
                let still =
                    r.rest_angle < 0.02 && r.rest_command < 0.3 * rig.params.motor.command_limit;
                if !(sound && still) {
                    failed += 1;
                }
            }
        }
    }
    assert_eq!(failed, 0, "see the table above");
}

#[test]
fn balances_every_rig_from_a_hand_held_start() {
    for name in Rig::BUILTIN {
        let rig = Rig::builtin(name).unwrap();
        let angle = if *name == "ramos-velasco" { 0.05 } else { 0.15 };
        let r = run::<f64>(&rig, State::new(0.3, angle, 0.0, 0.0), 0.002, 10.0);
        // A sample or two are spent on waiting for a smoother moment.
        assert!(r.caught.is_some_and(|t| t < 0.02), "{name}: {:?}", r.caught);
        assert!(
            r.fault.is_none() && r.rest_angle < 0.02,
            "{name}: {} rad",
            r.rest_angle
        );
    }
}

/// Commands that are a current or the arm's acceleration, in both precisions.
#[test]
fn swings_up_whatever_the_command_is() {
    for name in ["qube-servo-3", "stepper-kit"] {
        let rig = Rig::builtin(name).unwrap();
        let double = run::<f64>(&rig, State::hanging(), 0.002, 15.0);
        let single = run::<f32>(&rig, State::hanging(), 0.002, 15.0);
        for (caught, rest, fault) in [
            (double.caught, double.rest_angle, double.fault.is_some()),
            (single.caught, single.rest_angle, single.fault.is_some()),
        ] {
            assert!(
                caught.is_some() && rest < 0.02 && !fault,
                "{name}: {caught:?} {rest} rad, fault {fault}"
            );
        }
    }
}

#[test]
fn the_target_precision_does_it_too() {
    let rig = Rig::builtin("shahzad2022-srv02").unwrap();
    let r = run::<f32>(&rig, State::hanging(), 0.002, 15.0);
    assert!(
        r.caught.is_some() && r.rest_angle < 0.02,
        "{:?} {}",
        r.caught,
        r.rest_angle
    );
}

#[test]
fn modes_follow_the_table() {
    let rig = Rig::builtin("qube-servo-2").unwrap();
    let limits = Limits {
        arm_angle: Some(2.0),
        ..Limits::default()
    };
    let site = Site {
        limits,
        ..Site::of(&rig, 0.002)
    };
    let supervisor = Supervisor::<f64>::design(&Config::default(), &site).unwrap();
    let mut s = supervisor.start();
    let update = |s: &mut _, theta, alpha| {
        let m = Measurement::new(theta, alpha, 0.0);
        supervisor.update(s, &m, 0.0)
    };
    assert_eq!(update(&mut s, 0.0, 0.0).mode, Mode::Idle);
    assert!(!s.request(Request::Stop) && !s.request(Request::Reset));
    assert!(s.request(Request::Start));
    assert_eq!(
        update(&mut s, 0.0, 0.0).mode,
        Mode::Balance,
        "upright and at rest: caught at once"
    );
    assert!(s.request(Request::Stop));
    assert_eq!(update(&mut s, 0.0, 0.0).u, 0.0);
    for _ in 0..600 {
        update(&mut s, 0.0, 0.0);
    }
    assert_eq!(s.mode(), Mode::Idle, "at rest for more than half a second");
    // A limit, its reason, and that it holds until it is reset and the cause is gone.
    assert!(s.request(Request::Start));
    for _ in 0..20 {
        update(&mut s, 2.1, 0.01);
    }
    assert!(
        matches!(
            s.fault(),
            Some(Fault::ArmAngle { limit: 2.0, .. } | Fault::ArmSpeed { .. })
        ),
        "{:?}",
        s.fault()
    );
    assert_eq!(update(&mut s, 0.0, 0.01).mode, Mode::Fault);
    assert!(!s.request(Request::Start));
    assert!(s.request(Request::Reset));
    let out = update(&mut s, f64::NAN, 0.0);
    assert_eq!((out.mode, out.u), (Mode::Fault, 0.0));
    assert_eq!(s.fault(), Some(Fault::NotANumber));
}

proptest! {
    #[test]
    fn any_input_gives_a_finite_command_within_the_limit(
        samples in proptest::collection::vec(
            (proptest::num::f64::ANY, proptest::num::f64::ANY, proptest::num::f64::ANY),
            1..40,
        ),
        calm in proptest::collection::vec((-2.0f64..2.0, -7.0f64..7.0), 1..40),
    ) {
        let rig = Rig::builtin("qube-servo-2").unwrap();
        let limit = rig.params.motor.command_limit;
        let supervisor = Supervisor::<f64>::design(&Config::default(), &Site::of(&rig, 0.002)).unwrap();
        let mut s = supervisor.start();
        s.request(Request::Start);
        let calm = calm.into_iter().map(|(theta, alpha)| (theta, alpha, 0.0));
        for (theta, alpha, target) in calm.chain(samples.iter().copied()) {
            let m = Measurement { theta, alpha, held: target, periods: 1 };
            let u = supervisor.update(&mut s, &m, target).u;
            prop_assert!(u.is_finite() && u.abs() <= limit);
        }
    }
}
