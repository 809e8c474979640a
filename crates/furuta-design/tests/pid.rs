//! The PID pair on the nonlinear plant: no lasting error, no overshoot from a motor at its limit, no bump.

use furuta_ctrl::controllers::{self, Controller, Design, Pid};
use furuta_ctrl::{Config, Site};
use furuta_design::rehearsal::rehearse;
use furuta_design::relay::{Relay, RelayError, ultimate};
use furuta_design::rig_loop::RigLoop;
use furuta_model::linear_plant::Amplitudes;
use furuta_model::{Actuation, Effect, Rig, State};

const PERIOD: f64 = 0.002;

fn standard(rig: &Rig) -> Pid<f64> {
    let settings = controllers::settings("pid").expect("listed");
    Pid::design(&settings, &Site::of(rig, PERIOD)).expect("a gain")
}

/// The arm's place after `seconds` at the target 0.3 rad, an amplifier off by a twentieth of its largest voltage.
fn ends(rig: &Rig, control: &Pid<f64>, seconds: f64) -> State<f64> {
    let mut biased = rig.clone();
    let bias = 0.05 * rig.params.motor.command_limit;
    biased
        .effects
        .push(Effect::new("motor.bias", &[bias]).expect("in range"));
    let plant = biased.plant::<f64>();
    let wanted = State::new(0.3, 0.0, 0.0, 0.0);
    let (mut memory, mut truth) = (control.start(), plant.rest(State::upright()));
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    for _ in 0..(seconds / PERIOD) as usize {
        let u = control.update(&mut memory, &truth.x, &wanted, PERIOD);
        plant.step(&mut truth, u, PERIOD);
    }
    truth.x
}

#[test]
fn a_constant_pull_leaves_no_error() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let control = standard(&rig);
        let x = ends(&rig, &control, 60.0);
        assert!(
            (x.theta - 0.3).abs() < 1e-4 && x.alpha.abs() < 1e-4,
            "{name}: {x:?}"
        );
        // Without the arm's integral there is one.
        let [kp, _, kd] = control.arm;
        let without = Pid {
            arm: [kp, 0.0, kd],
            ..control
        };
        let x = ends(&rig, &without, 60.0);
        assert!((x.theta - 0.3).abs() > 0.05, "{name}: {x:?}");
    }
}

/// The whole control system with it, encoders, delay and limit included, holds every rig.
#[test]
fn it_holds_every_rig() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let config = Config::with_controller(controllers::settings("pid").expect("listed"));
        let told = rehearse(&config, &rig, PERIOD, 0.0).expect("possible");
        assert_eq!(told.fell, None, "{name}: {told}");
    }
}

/// After five seconds at its limit, of an integral that is led back only what fills the command up to the limit is left
/// when the error ends; one that is hardly led back is at the limit by itself.
#[test]
fn the_integral_is_led_back() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let after = |tracking: f64| {
        let control = Pid {
            tracking,
            ..standard(&rig)
        };
        let mut state = control.start();
        let far = State::new(3.0, 0.0, 0.0, 0.0);
        for _ in 0..2500 {
            control.update(&mut state, &State::upright(), &far, PERIOD);
        }
        // Where it was asked to be, at rest: what is left is the integral.
        let Pid { filter, .. } = control;
        let still = Pid {
            filter: filter.min(1e-2),
            ..control
        };
        still.update(&mut state, &far, &far, PERIOD).abs() / control.command_limit
    };
    let (led, loose) = (after(0.05), after(1e4));
    println!("{led} {loose} of the limit left");
    assert!(led < 0.5 * loose && loose > 0.9, "{led} {loose}");
}

/// A controller that takes over begins with the command that it finds.
#[test]
fn it_takes_over_without_a_bump() {
    for name in Rig::VOLTAGE {
        let control = standard(&Rig::builtin(name).expect("built in"));
        let (x, upright) = (State::new(0.1, 0.002, -0.03, 0.01), State::upright());
        let u = 0.12 * control.command_limit;
        let mut state = control.take_over(&x, &upright, u);
        let first = control.update(&mut state, &x, &upright, PERIOD);
        assert!((first - u).abs() < 1e-9, "{name}: {first} {u}");
    }
}

/// The derivative is a difference quotient through a first-order low pass: its step response is `1 - exp(-w t)`.
#[test]
fn the_derivative_is_filtered() {
    let control = Pid {
        pendulum: [0.0, 0.0, 1.0],
        arm: [0.0; 3],
        filter: 50.0,
        tracking: 1.0,
        command_limit: 1e3,
    };
    let mut state = control.start();
    control.update(&mut state, &State::upright(), &State::upright(), PERIOD);
    for k in 1..200 {
        let t = f64::from(k) * PERIOD;
        // A pendulum that falls at 2 rad/s from now on.
        let x = State::new(0.0, 2.0 * t, 0.0, 0.0);
        let u: f64 = control.update(&mut state, &x, &State::upright(), PERIOD);
        assert!(
            (u + 2.0 * (1.0 - (-50.0 * t).exp())).abs() < 1e-9,
            "{t}: {u}"
        );
    }
}

/// Rigs on which a relay oscillates: where the command is the arm's acceleration, the loop turns by more than half a
/// turn at every frequency.
fn swinging() -> impl Iterator<Item = Rig> {
    let rigs = Rig::BUILTIN
        .iter()
        .map(|name| Rig::builtin(name).expect("built in"));
    rigs.filter(|rig| rig.params.motor.actuation != Actuation::Acceleration)
}

fn near(name: &str, what: &str, found: f64, by: f64, share: f64) {
    let off = (found / by - 1.0).abs();
    assert!(off < share, "{name}, {what}: {found}, {by}");
}

/// Encoders so fine that they do not count: the ultimate gain and period are within 17 % and 10 % of the linear model's
/// with an ideal relay (samples are what is left), and within 2 % of the same model where the loop turns by what the
/// relay's own phase leaves, which the run says.
#[test]
fn a_relay_finds_the_ultimate_gain() {
    for mut rig in swinging() {
        rig.sensors.pendulum_counts_per_rev = 16_777_216.0;
        let name = rig.name.as_str();
        for share in [0.1, 0.3] {
            let relay = Relay {
                amplitude: Some(share * rig.params.motor.command_limit),
                ..Relay::default()
            };
            let found = relay.run(&rig).expect("oscillates");
            let of = |phase| {
                ultimate(&rig, PERIOD, phase)
                    .expect("linear")
                    .expect("has one")
            };
            let (gain, period) = of(0.0);
            near(name, "ideal gain", found.gain, gain, 0.17);
            near(name, "ideal period", found.period, period, 0.1);
            let (gain, period) = of(found.phase);
            near(name, "gain", found.gain, gain, 0.02);
            near(name, "period", found.period, period, 0.02);
            // The describing function takes the peak for the fundamental.
            near(name, "described", found.described, found.gain, 0.25);
        }
    }
}

/// With the encoders' steps: the point of the loop that is found is the linear model's, within 3 %. Tuned by it, the
/// loop is stable with sound margins on every rig, and the whole control system holds it.
#[test]
fn a_relay_tunes_every_rig() {
    for rig in swinging() {
        let name = rig.name.as_str();
        let found = Relay::default().run(&rig).expect("oscillates");
        let at = ultimate(&rig, PERIOD, found.phase).expect("linear");
        let (gain, period) = at.expect("has one");
        near(name, "gain", found.gain, gain, 0.03);
        near(name, "period", found.period, period, 0.03);
        let gains = found.gains(&rig, PERIOD).expect("it holds");
        let closed =
            RigLoop::new(&rig, gains.law(), Some(PERIOD), &Amplitudes::NONE).expect("linear");
        let margins = closed.delayed(PERIOD).margins();
        assert!(
            margins.stable && margins.gain[0] < 0.5 && margins.gain[1] > 2.0,
            "{name}: {margins:?}"
        );
        assert!(margins.disk > 0.5, "{name}: {margins:?}");
        let pid = controllers::settings("pid").expect("listed");
        let pid = pid
            .with("pendulum", &gains.pendulum)
            .and_then(|pid| pid.with("arm", &gains.arm))
            .expect("in range");
        let told = rehearse(&Config::with_controller(pid), &rig, PERIOD, 0.0).expect("possible");
        assert_eq!(told.fell, None, "{name}: {told}");
    }
}

#[test]
fn a_relay_says_what_is_wrong() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let with = |relay: Relay| relay.run(&rig).expect_err("nothing to find");
    let strong = Relay {
        amplitude: Some(20.0),
        ..Relay::default()
    };
    let text = with(strong).to_string();
    assert!(
        text.contains("amplitude = 20 V is outside the allowed range (0, 10] V"),
        "{text}"
    );
    let short = Relay {
        time_limit: 0.3,
        ..Relay::default()
    };
    assert!(matches!(with(short), RelayError::Late { needed: 16, .. }));
    // A pendulum that swings by a step of the encoder, with a hysteresis of two.
    let faint = Relay {
        amplitude: Some(0.5),
        hysteresis: 0.0062,
        ..Relay::default()
    };
    let error = with(faint);
    assert!(matches!(error, RelayError::Fell { .. }), "{error}");
    // The command is the arm's acceleration.
    let rig = Rig::builtin("stepper-kit").expect("built in");
    assert_eq!(Relay::default().run(&rig), Err(RelayError::NoUltimate));
}
