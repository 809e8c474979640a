//! Swing-up and balance of emulated rigs.

use crate::common;

use std::f64::consts::PI;

use common::{TempLog, qube, settings};
use furuta_hw::{
    Decision, EmulatedRig, Emulation, End, Measurement, Pace, Pilot, PtyRig, Reference,
    SerialTransport, Session, SwingUpBalance,
};
use furuta_log::{Metadata, Mode};
use furuta_model::{Effect, Rig};
use furuta_wire::{Command, MAX_FRAME, Message, encode};

type PilotState = <SwingUpBalance as Pilot>::State;

/// One tick without a wire.
fn step(
    emulated: &mut EmulatedRig,
    rig: &Rig,
    pilot: &SwingUpBalance,
    state: &mut PilotState,
) -> (Measurement, Decision) {
    let sample = emulated.tick();
    let m = Measurement {
        t: sample.t_us as f64 * 1e-6,
        periods: 1,
        theta: sample.theta.theta(rig.sensors.arm_counts_per_rev),
        alpha: sample.alpha.alpha(rig.sensors.pendulum_counts_per_rev),
        held: f64::from(sample.volts),
    };
    let d = pilot.process(state, &m);
    let mut buffer = [0; MAX_FRAME];
    let command = Message::Command(Command {
        seq: sample.seq,
        volts: d.volts as f32,
    });
    emulated.receive(encode(&command, &mut buffer).expect("fits"));
    (m, d)
}

/// Pilot and rig as fast as they go. Returns the time of the last change into balancing, and the largest arm and
/// pendulum angles in the last five seconds.
fn fly(
    rig: &Rig,
    hidden: Vec<Effect<f64>>,
    pilot: &SwingUpBalance,
    seconds: f64,
) -> (f64, f64, f64) {
    let mut emulated = EmulatedRig::new(
        rig,
        &Emulation {
            hidden,
            ..Emulation::default()
        },
    )
    .expect("valid");
    let mut state = pilot.start();
    let (mut caught, mut arm, mut pendulum) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    let mut last = Mode::Off;
    loop {
        let (m, d) = step(&mut emulated, rig, pilot, &mut state);
        if d.mode != last {
            caught = if d.mode == Mode::Balance {
                m.t
            } else {
                f64::INFINITY
            };
            last = d.mode;
        }
        if m.t > seconds - 5.0 {
            arm = arm.max(m.theta.abs());
            pendulum = pendulum.max(((m.alpha + PI).rem_euclid(2.0 * PI) - PI).abs());
        }
        if m.t > seconds {
            return (caught, arm, pendulum);
        }
    }
}

/// A QUBE with the friction that real ones have; the manual's is several times that, too much for an energy swing-up.
fn smooth_qube() -> Rig {
    let mut rig = qube();
    rig.params.arm.viscous = 2e-4;
    rig.params.pendulum.viscous = 6e-5;
    rig
}

fn steps() -> Reference {
    Reference::Steps {
        amplitude: 0.2,
        hold: 2.0,
    }
}

/// Rigs that differ tenfold in size and speed, each with and without what its model does not know of.
#[test]
fn swings_up_and_balances() {
    let builtin = |name| Rig::builtin(name).expect("built in");
    for rig in [
        builtin("shahzad2022-srv02"),
        builtin("fong2014-emecs"),
        smooth_qube(),
    ] {
        let stall = rig.params.coefficients().drive * rig.params.motor.command_limit;
        let effect = |id, values: &[f64]| vec![Effect::new(id, values).expect("valid")];
        for hidden in [
            vec![],
            effect("arm.spring", &[0.03 * stall, -0.3]),
            effect("arm.coulomb", &[0.05 * stall]),
        ] {
            let what = format!("{} {:?}", rig.name, hidden);
            let pilot = SwingUpBalance::design(&rig, 0.002, steps()).expect("stabilisable");
            let (caught, arm, pendulum) = fly(&rig, hidden, &pilot, 20.0);
            assert!(caught < 5.0, "{what}: up for good at {caught} s");
            // The arm steps between +-0.2 rad; the effects add some: with dry friction it hunts by 0.4 rad.
            assert!(
                arm < 0.8 && pendulum < 0.15,
                "{what}: arm {arm}, pendulum {pendulum}"
            );
        }
    }
}

/// The same through pseudo-terminal, loop and log, in real time; the rig is patient, so that a busy machine makes the
/// run longer and not another one.
#[test]
fn swings_up_and_balances_in_real_time_and_logs_it() {
    let true_rig = smooth_qube();
    let hidden = vec![Effect::new("arm.coulomb", &[1e-3]).expect("valid")];
    let emulation = Emulation {
        hidden,
        ..Emulation::default()
    };
    let rig = PtyRig::start(
        EmulatedRig::new(&true_rig, &emulation).expect("valid"),
        Pace::Patient,
    )
    .expect("a port");
    let mut session = Session::open(rig.path(), SerialTransport::BAUD).expect("there");
    assert_eq!(session.mismatches(&true_rig), []);
    let pilot = SwingUpBalance::design(&true_rig, session.period(), steps()).expect("stabilisable");
    let file = TempLog::new("swing-up");
    let metadata = Metadata {
        rig: true_rig.name.clone(),
        controller: pilot.describe(),
        ..Metadata::default()
    };
    let (summary, recorded) = session
        .run(&pilot, &settings(8.0), Some((&file.0, &metadata)))
        .expect("a log can be written");
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    assert!(recorded.is_some_and(|r| r.error.is_none() && r.records == summary.samples));
    let log = file.read();
    assert_eq!(
        (log.records.len() as u64, log.notice),
        (summary.samples, None)
    );
    assert_eq!(log.metadata.map(|m| m.controller), Some(pilot.describe()));
    assert_eq!(
        (log.records[0].mode, log.records[0].alpha),
        (Mode::SwingUp, PI)
    );
    let balanced = log
        .records
        .iter()
        .filter(|r| r.mode == Mode::Balance)
        .count();
    assert!(
        balanced > log.records.len() / 2,
        "{balanced} of {}",
        log.records.len()
    );
    // Estimated speeds are the derivatives of measured angles, over 20 ms; the arm moves at several rad/s.
    let errors = log
        .records
        .windows(11)
        .filter(|w| w[10].seq == w[0].seq + 10)
        .map(|w| (w[10].theta - w[0].theta) / (w[10].t - w[0].t) - w[5].theta_dot);
    let (n, sum) = errors.fold((0, 0.0), |(n, sum), e| (n + 1, sum + e * e));
    let rms = (sum / f64::from(n)).sqrt();
    assert!(n > 1000 && rms < 0.5, "{rms} rad/s");
}

/// The pilot finds its way back when a hand knocks the pendulum over.
#[test]
fn gets_up_again() {
    let rig = smooth_qube();
    let pilot =
        SwingUpBalance::design(&rig, 0.002, Reference::Constant(0.0)).expect("stabilisable");
    let start = furuta_model::State::new(0.0, 0.0, 0.0, 25.0); // upright, but far too fast
    let mut emulated = EmulatedRig::new(
        &rig,
        &Emulation {
            start,
            ..Emulation::default()
        },
    )
    .expect("valid");
    let mut state = pilot.start();
    let mut modes = Vec::new();
    for _ in 0..5000 {
        let d = step(&mut emulated, &rig, &pilot, &mut state).1;
        if modes.last() != Some(&d.mode) {
            modes.push(d.mode);
        }
    }
    assert_eq!(modes.last(), Some(&Mode::Balance), "{modes:?}");
    assert!(modes.contains(&Mode::SwingUp), "{modes:?}");
}

/// A rig file that knows the spring holds the arm where it is asked to be; one that does not is off by what the spring
/// pulls.
#[test]
fn a_repaired_rig_file_removes_the_arms_error() {
    let spring = Effect::new("arm.spring", &[2e-3, -0.5]).expect("valid");
    let error = |file: &Rig| {
        let pilot =
            SwingUpBalance::design(file, 0.002, Reference::Constant(0.3)).expect("stabilisable");
        let mut emulated = EmulatedRig::new(
            &smooth_qube(),
            &Emulation {
                hidden: vec![spring],
                ..Emulation::default()
            },
        )
        .expect("valid");
        let mut state = pilot.start();
        let thetas: Vec<_> = (0..10_000)
            .map(|_| {
                step(&mut emulated, &smooth_qube(), &pilot, &mut state)
                    .0
                    .theta
            })
            .collect();
        thetas[9000..].iter().sum::<f64>() / 1000.0 - 0.3
    };
    let repaired = Rig {
        effects: vec![spring],
        ..smooth_qube()
    };
    let (before, after) = (error(&smooth_qube()), error(&repaired));
    assert!(
        before.abs() > 0.05 && after.abs() < 0.005,
        "{before} {after}"
    );
}

/// Between two runs the rig goes on sending. What has piled up by then is not part of the second run.
#[test]
fn a_second_run_begins_with_a_fresh_sample() {
    let emulated = EmulatedRig::new(&qube(), &Emulation::default()).expect("valid");
    let rig = PtyRig::start(emulated, Pace::RealTime).expect("a port");
    let mut session = Session::open(rig.path(), SerialTransport::BAUD).expect("there");
    let pilot = SwingUpBalance::design(&qube(), session.period(), Reference::Constant(0.0))
        .expect("stabilisable");
    for _ in 0..2 {
        let (summary, _) = session
            .run(&pilot, &settings(0.5), None)
            .expect("no log to fail");
        assert!(matches!(summary.end, End::Finished), "{summary:?}");
        // Stale samples would show as a gap of some 400; a busy machine may lose a few.
        assert!(
            summary.samples + summary.lost >= 251 && summary.lost < 100,
            "{summary:?}"
        );
        std::thread::sleep(std::time::Duration::from_secs(1)); // the port's buffer holds 0.2 s
    }
}
