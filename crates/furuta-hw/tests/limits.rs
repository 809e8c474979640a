//! A limit hit at speed: the arm is braked, for a quarter of a second at most, and then the motor is off. On every
//! built-in rig, found by the host, by the rig itself, or by both.

use crate::common;

use std::time::Duration;

use common::settings;
use furuta_ctrl::supervisor::Brake;
use furuta_hw::{
    EmulatedRig, EmulatedTransport, Emulation, End, Excitation, Link, LoopSettings, OpenLoop,
    Pilot, RecordSender, Reference, RunError, Summary, SwingUpBalance, Transport, TransportError,
    run,
};
use furuta_log::Mode;
use furuta_model::signals::Step;
use furuta_model::{Limits, Rig, State};

const PERIOD: f64 = 0.002;
/// Longest braking, in samples.
const BRAKING: usize = 125;

/// Where the arm is limited in these tests, rad.
const LIMIT: f64 = 0.8;

fn limits() -> Limits {
    Limits {
        arm_angle: Some(LIMIT),
        ..Limits::default()
    }
}

/// A rig that is watched.
struct Watched {
    line: EmulatedTransport,
    /// True states and voltages held, tick by tick.
    states: Vec<(State<f64>, f64)>,
}

impl Watched {
    fn tick(&mut self) {
        let sample = self.line.rig().tick();
        let x = self.line.rig().state();
        self.states.push((x, f64::from(sample.volts)));
    }

    fn furthest(&self) -> f64 {
        self.states
            .iter()
            .fold(0.0, |max, (x, _)| x.theta.abs().max(max))
    }

    /// Where it was first beyond the limit.
    fn beyond(&self) -> usize {
        self.states
            .iter()
            .position(|(x, _)| x.theta.abs() > LIMIT)
            .unwrap_or(self.states.len())
    }
}

impl Transport for Watched {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let n = self.line.read(buffer, timeout)?;
        // The rig has ticked in this read: what it holds comes with its next sample, so take it from what it was told.
        let x = self.line.rig().state();
        self.states.push((x, f64::NAN));
        Ok(n)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.line.write(bytes)
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        self.line.discard_input()
    }

    fn now(&self) -> std::time::Instant {
        self.line.now()
    }
}

/// Who knows of the limit.
#[derive(Copy, Clone, Debug, PartialEq)]
enum Knows {
    Host,
    Rig,
    Both,
}

fn drive<P: Pilot>(rig: &Rig, pilot: &P, brake: Brake<f64>, who: Knows) -> (Summary, Watched) {
    let on = Rig {
        limits: if who == Knows::Host {
            Limits::default()
        } else {
            limits()
        },
        ..rig.clone()
    };
    let emulated = EmulatedRig::new(&on, &Emulation::default()).expect("valid");
    let mut line = Watched {
        line: EmulatedTransport::new(emulated),
        states: Vec::new(),
    };
    let (mut link, hello) = Link::connect(&mut line, Duration::from_secs(1)).expect("it answers");
    let settings = LoopSettings {
        limits: if who == Knows::Rig {
            Limits::default()
        } else {
            limits()
        },
        brake,
        ..settings(10.0)
    };
    let summary = run(
        &mut link,
        &hello,
        pilot,
        &settings,
        &mut RecordSender::nowhere(),
    );
    let before = line.states.len();
    // The host is silent from now on; what it said last, 0 V, is latched at the next tick.
    for _ in 0..1000 {
        line.tick();
    }
    assert!(
        line.states
            .iter()
            .skip(before + 1)
            .all(|(_, volts)| *volts == 0.0),
        "{}, {who:?}: off for good",
        rig.name
    );
    assert!(
        before - line.beyond() <= BRAKING + 2,
        "{}, {who:?}: off after {} samples",
        rig.name,
        before - line.beyond()
    );
    (summary, line)
}

/// That of every run.
fn brake(rig: &Rig) -> Brake<f64> {
    LoopSettings::new(rig, PERIOD, Duration::ZERO).brake
}

/// A constant voltage into the limit.
fn push(rig: &Rig, share: f64) -> OpenLoop {
    let volts = share * rig.params.motor.command_limit;
    let step = Step::new(volts, 0.1).expect("possible");
    let excitation = Excitation::new(step, 10.0).expect("possible");
    OpenLoop::new(rig, PERIOD, excitation)
}

#[test]
fn a_limit_hit_at_speed_is_a_ramped_stop() {
    println!(
        "{:<20} {:>5} {:>9} {:>9} {:>9}",
        "rig", "volts", "rad/s", "cut, rad", "braked"
    );
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        for share in [-0.5, 1.0] {
            let pilot = push(&rig, share);
            let (_, cut) = drive(&rig, &pilot, Brake::none(), Knows::Host);
            let speed = cut.states[cut.beyond()].0.theta_dot;
            for who in [Knows::Host, Knows::Rig, Knows::Both] {
                let (summary, braked) = drive(&rig, &pilot, brake(&rig), who);
                let error = summary.error().expect("the limit");
                let expected = match who {
                    Knows::Rig => matches!(error, RunError::RigLimit { .. }),
                    _ => matches!(
                        error,
                        RunError::Limit {
                            quantity: "arm angle",
                            ..
                        }
                    ),
                };
                assert!(expected, "{name}, {who:?}: {error}");
                assert!(error.to_string().contains("motor off"), "{error}");
                assert_eq!(summary.modes.last().map(|m| m.mode), Some(Mode::Brake));
                let (plain, ramped) = (cut.furthest() - LIMIT, braked.furthest() - LIMIT);
                if who == Knows::Both {
                    println!(
                        "{name:<20} {:>5.1} {speed:>9.2} {plain:>9.3} {ramped:>9.3}",
                        share * rig.params.motor.command_limit
                    );
                }
                assert!(
                    ramped < plain,
                    "{name}, {who:?}: {ramped} rad beyond its limit, {plain} without braking"
                );
            }
        }
    }
}

/// The swing-up drives the arm to where its own limits are wider than the host's: the supervisor's fault, and the
/// loop's.
#[test]
fn a_swing_up_into_a_limit_ends_with_the_motor_off() {
    let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    let pilot = SwingUpBalance::design(&rig, PERIOD, Reference::Constant(0.0)).expect("possible");
    let narrow = Rig {
        limits: Limits {
            arm_angle: Some(0.2),
            ..Limits::default()
        },
        ..rig.clone()
    };
    for rig in [&rig, &narrow] {
        let limited = LoopSettings {
            limits: narrow.limits,
            ..LoopSettings::new(rig, PERIOD, Duration::from_secs(10))
        };
        let emulated = EmulatedRig::new(rig, &Emulation::default()).expect("valid");
        let mut line = EmulatedTransport::new(emulated);
        let (mut link, hello) =
            Link::connect(&mut line, Duration::from_secs(1)).expect("it answers");
        let summary = run(
            &mut link,
            &hello,
            &pilot,
            &limited,
            &mut RecordSender::nowhere(),
        );
        assert_eq!(line.rig().tick().volts, 0.0);
        assert!(
            matches!(summary.end, End::Failed(RunError::Limit { .. })),
            "{summary:?}"
        );
    }
}
