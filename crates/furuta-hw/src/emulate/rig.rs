//! The rig's side of the protocol with a model in place of motor, arm and pendulum. No I/O, no clock: bytes in, ticks
//! out, so that the same rig runs in real time, as fast as it can, or in a unit test.

use std::f64::consts::{PI, TAU};

use furuta_model::{Effect, Plant, PlantError, PlantState, Rig, State};
use furuta_wire::{
    ArmCounts, Hello, PROTOCOL_VERSION, PendulumCounts, RIG_NAME_CAPACITY, RigEnd, RigLimits,
    RigName, Sample,
};

/// Longest step of the integrator (s): RK4 then errs by less than an encoder count on all built-in rigs.
const MAX_STEP: f64 = 1e-3;

/// Settings of an emulated rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Emulation {
    /// Sampling period (us).
    pub period_us: u32,
    /// Effects that act in addition to those of the rig file, and that no one is told of.
    pub hidden: Vec<Effect<f64>>,
    /// State at power-on. The encoders count from arm 0 and pendulum hanging whatever it is.
    pub start: State<f64>,
    /// Periods without a valid command after which the motor is switched off.
    pub watchdog_periods: u16,
}

impl Default for Emulation {
    /// 500 Hz, nothing hidden, hanging at rest, watchdog after 10 periods (20 ms).
    fn default() -> Self {
        Self {
            period_us: 2000,
            hidden: Vec::new(),
            start: State::new(0.0, PI, 0.0, 0.0),
            watchdog_periods: 10,
        }
    }
}

/// A rig cannot be emulated as asked.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
pub enum EmulationError {
    /// The plant cannot have these effects, or not at this period.
    #[error("{0}")]
    Plant(PlantError),
    /// The sampling period is outside its range.
    #[error("sampling period is {period_us} us, must be between 100 and 100000")]
    Period {
        /// The period asked for (us).
        period_us: u32,
    },
}

impl From<PlantError> for EmulationError {
    fn from(error: PlantError) -> Self {
        Self::Plant(error)
    }
}

/// An emulated rig.
///
/// ```
/// use furuta_hw::{EmulatedRig, Emulation};
/// use furuta_model::Rig;
/// use furuta_wire::{Command, MAX_FRAME, Message, Status, encode};
///
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let mut rig = EmulatedRig::new(&rig, &Emulation::default())?;
/// assert!(rig.tick().status.contains(Status::WATCHDOG)); // no command yet
///
/// let mut buffer = [0; MAX_FRAME];
/// rig.receive(encode(&Message::Command(Command { seq: 0, volts: 1.0 }), &mut buffer)?);
/// assert_eq!(rig.tick().volts, 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct EmulatedRig {
    plant: Plant<f64>,
    state: PlantState<f64>,
    end: RigEnd,
    substeps: u32,
    held: f64,
    t_us: u64,
}

impl EmulatedRig {
    /// An emulated rig at power-on.
    ///
    /// # Errors
    /// [`EmulationError`].
    pub fn new(rig: &Rig, emulation: &Emulation) -> Result<Self, EmulationError> {
        let Emulation {
            period_us,
            start,
            watchdog_periods,
            ..
        } = *emulation;
        if !(100..=100_000).contains(&period_us) {
            return Err(EmulationError::Period { period_us });
        }
        let effects: Vec<_> = rig
            .effects
            .iter()
            .chain(&emulation.hidden)
            .copied()
            .collect();
        let plant = Plant::new(&rig.params, &effects)?;
        let period = f64::from(period_us) * 1e-6;
        // At least 1 and at most 100, by the range of the period.
        let substeps = (period / MAX_STEP).ceil().max(1.0) as u32;
        plant.check_period(period / f64::from(substeps))?;
        let limit = |limit: Option<f64>| limit.map(|l| l as f32);
        let hello = Hello {
            version: PROTOCOL_VERSION,
            rig: short_name(&rig.name),
            period_us,
            arm_counts_per_rev: rig.sensors.arm_counts_per_rev,
            pendulum_counts_per_rev: rig.sensors.pendulum_counts_per_rev,
            command_limit: rig.params.motor.command_limit as f32,
            limits: RigLimits {
                arm_angle: limit(rig.limits.arm_angle),
                arm_speed: limit(rig.limits.arm_speed),
                pendulum_speed: limit(rig.limits.pendulum_speed),
            },
            watchdog_periods,
            actuation: rig.params.motor.actuation.code(),
        };
        Ok(Self {
            state: plant.rest(start),
            plant,
            end: RigEnd::new(hello),
            substeps,
            held: 0.0,
            t_us: 0,
        })
    }

    /// What the rig says of itself.
    #[must_use]
    pub fn settings(&self) -> &Hello {
        self.end.settings()
    }

    /// Sampling period (us).
    #[must_use]
    pub fn period_us(&self) -> u32 {
        self.end.settings().period_us
    }

    /// Counts per revolution of arm and pendulum.
    #[must_use]
    pub fn counts_per_rev(&self) -> [f64; 2] {
        let hello = self.end.settings();
        [hello.arm_counts_per_rev, hello.pendulum_counts_per_rev]
    }

    /// True state of the emulated mechanics: what no real rig would tell.
    #[must_use]
    pub fn state(&self) -> State<f64> {
        self.state.x
    }

    /// Moves the mechanics to another state, as a hand would that then holds them for a while: the motor's rotor comes
    /// along, and what is late shows the new state.
    pub fn set_state(&mut self, x: State<f64>) {
        let mut state = self.plant.rest_under(x, self.held);
        (state.run, state.t) = (self.state.run, self.state.t);
        state.voltage = self.state.voltage;
        self.state = state;
    }

    /// Takes bytes from the host.
    pub fn receive(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.end.receive(byte));
    }

    /// The answer to a query, if one came since the last call.
    pub fn hello(&mut self) -> Option<Hello> {
        self.end.hello()
    }

    /// True if the last sample has been answered, with whatever voltage.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.end.is_answered()
    }

    /// One tick: latches the newest command, reads the encoders, and moves the mechanics on to the next tick.
    pub fn tick(&mut self) -> Sample {
        let period_us = self.period_us();
        let [theta, alpha] = self.plant.measure(&self.state);
        let [arm, pendulum] = self.counts_per_rev();
        let sample = self.end.tick(
            self.t_us,
            ArmCounts(to_counts(theta, arm)),
            PendulumCounts(to_counts(alpha - PI, pendulum)),
        );
        let h = f64::from(period_us) * 1e-6 / f64::from(self.substeps);
        self.held = f64::from(sample.volts);
        for _ in 0..self.substeps {
            self.plant.step(&mut self.state, self.held, h);
        }
        self.t_us += u64::from(period_us);
        sample
    }
}

/// Encoder counts at an angle, to the nearest count. A cast saturates, so that a state gone wild makes no panic.
pub(crate) fn to_counts(angle: f64, per_rev: f64) -> i32 {
    (angle * per_rev / TAU).round() as i32
}

/// The first bytes of a name that fit, cut between characters.
fn short_name(name: &str) -> RigName {
    let mut short = RigName::new();
    for c in name.chars() {
        if short.len() + c.len_utf8() > RIG_NAME_CAPACITY {
            break;
        }
        short.push(c);
    }
    short
}

#[cfg(test)]
mod tests {
    use furuta_wire::{Command, MAX_FRAME, Message, Query, Status, encode};

    use super::*;

    fn rig(limits: furuta_model::Limits) -> EmulatedRig {
        let rig = Rig {
            limits,
            ..Rig::builtin("qube-servo-2").expect("built in")
        };
        EmulatedRig::new(&rig, &Emulation::default()).expect("valid")
    }

    fn say(rig: &mut EmulatedRig, message: Message) {
        let mut buffer = [0; MAX_FRAME];
        rig.receive(encode(&message, &mut buffer).expect("fits"));
    }

    /// Answers the last sample: there must have been one.
    fn command(rig: &mut EmulatedRig, volts: f32) {
        let seq = rig.end.seq().wrapping_sub(1);
        say(rig, Message::Command(Command { seq, volts }));
    }

    #[test]
    fn a_hanging_rig_reads_zero_counts_and_stays() {
        let mut rig = rig(Default::default());
        for k in 0..100 {
            let sample = rig.tick();
            assert_eq!((sample.seq, sample.t_us), (k, u64::from(k) * 2000));
            assert_eq!(
                (sample.theta, sample.alpha),
                (ArmCounts(0), PendulumCounts(0))
            );
        }
    }

    #[test]
    fn watchdog_switches_the_motor_off_and_a_command_on_again() {
        let mut rig = rig(Default::default());
        rig.tick();
        command(&mut rig, 2.0);
        let volts: Vec<_> = (0..14).map(|_| rig.tick()).collect();
        for (k, sample) in volts.iter().enumerate() {
            // The command's own tick, then nine held ones; the tenth silent period trips the watchdog.
            assert_eq!(sample.volts, if k < 10 { 2.0 } else { 0.0 }, "tick {k}");
            assert_eq!(
                sample.status.contains(Status::WATCHDOG),
                k >= 10,
                "tick {k}"
            );
            assert_eq!(sample.status.contains(Status::HELD), k >= 1, "tick {k}");
        }
        command(&mut rig, -1.0);
        assert_eq!((rig.tick().volts, Status::OK), (-1.0, Status::OK));
    }

    #[test]
    fn commands_are_clipped_and_nan_is_refused() {
        let mut rig = rig(Default::default());
        rig.tick();
        command(&mut rig, 1e9);
        let sample = rig.tick();
        assert_eq!((sample.volts, sample.status), (10.0, Status::CLIPPED));
        for bad in [f32::NAN, f32::INFINITY] {
            command(&mut rig, bad);
            let sample = rig.tick();
            assert!(
                sample.volts.is_finite() && sample.status.contains(Status::REFUSED | Status::HELD)
            );
        }
    }

    #[test]
    fn beyond_a_limit_the_motor_is_off() {
        let limits = furuta_model::Limits {
            arm_angle: Some(0.5),
            ..Default::default()
        };
        let mut rig = rig(limits);
        rig.tick();
        let mut tripped = None;
        for _ in 0..1000 {
            command(&mut rig, 3.0);
            let sample = rig.tick();
            let theta = sample.theta.theta(2048.0);
            assert_eq!(theta.abs() > 0.5, sample.status.contains(Status::LIMIT));
            if sample.status.contains(Status::LIMIT) {
                assert_eq!(sample.volts, 0.0);
                tripped = Some(theta);
            }
        }
        assert!(tripped.is_some(), "3 V drive the arm beyond 0.5 rad");
    }

    #[test]
    fn queries_are_answered_once_even_from_another_version() {
        let mut rig = rig(Default::default());
        assert_eq!(rig.hello(), None);
        say(
            &mut rig,
            Message::Query(Query {
                version: PROTOCOL_VERSION + 1,
            }),
        );
        assert_eq!(
            rig.hello().map(|h| h.rig.to_string()),
            Some("qube-servo-2".to_owned())
        );
        assert_eq!(rig.hello(), None);
    }

    #[test]
    fn a_host_of_another_version_is_told_and_not_obeyed() {
        let mut rig = rig(Default::default());
        let query = |version| Message::Query(Query { version });
        rig.tick();
        command(&mut rig, 2.0);
        assert_eq!(rig.tick().volts, 2.0);
        say(&mut rig, query(PROTOCOL_VERSION + 1));
        for _ in 0..3 {
            command(&mut rig, 2.0);
            let sample = rig.tick();
            assert_eq!(sample.volts, 0.0, "off at once");
            assert!(sample.status.contains(Status::REFUSED | Status::WATCHDOG));
        }
        assert_eq!(rig.hello().map(|h| h.version), Some(PROTOCOL_VERSION));
        // Another host, of this version.
        say(&mut rig, query(PROTOCOL_VERSION));
        command(&mut rig, 2.0);
        assert_eq!((rig.tick().volts, rig.tick().status), (2.0, Status::HELD));
    }

    /// Encoder counts of two seconds under steps to either side, by no whole number of volts.
    fn counts(hidden: Vec<Effect<f64>>, period_us: u32) -> Vec<(ArmCounts, PendulumCounts)> {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let emulation = Emulation {
            period_us,
            hidden,
            ..Emulation::default()
        };
        let mut rig = EmulatedRig::new(&rig, &emulation).expect("valid");
        rig.tick();
        (0..2_000_000 / period_us)
            .map(|k| {
                let volts = if (k * period_us / 250_000).is_multiple_of(2) {
                    6.3
                } else {
                    -6.3
                };
                command(&mut rig, volts);
                let sample = rig.tick();
                (sample.theta, sample.alpha)
            })
            .collect()
    }

    /// Whatever the sampling period: the longest exceeds what a flexible coupling's step may be, at the shortest a
    /// delay is many samples.
    #[test]
    fn every_effect_of_the_catalogue_is_served() {
        let params = Rig::builtin("qube-servo-2").expect("built in").params;
        for period_us in [100, 2000, 10_000, 100_000] {
            let plain = counts(vec![], period_us);
            for spec in furuta_model::CATALOGUE.iter().chain(furuta_model::RARE) {
                let effect = super::super::hidden_effect(spec.id, &params).expect(spec.id);
                assert!(
                    counts(vec![effect], period_us) != plain,
                    "{} at {period_us} us",
                    spec.id
                );
            }
        }
    }

    #[test]
    fn the_encoders_are_late() {
        let delay = |seconds| Effect::new("sensor.delay", &[seconds]).expect("valid");
        let plain = counts(vec![], 2000);
        let late = counts(vec![delay(0.006)], 2000);
        assert_eq!(late[3..], plain[..plain.len() - 3]);
    }

    #[test]
    fn an_encoder_on_the_motor_moves_within_the_play() {
        let backlash = |encoder| {
            let values = [0.4, 0.3, encoder];
            vec![Effect::new("drive.backlash", &values).expect("valid")]
        };
        let (arm, motor) = (counts(backlash(0.0), 2000), counts(backlash(1.0), 2000));
        let apart = |(a, m): (&(ArmCounts, _), &(ArmCounts, _))| (a.0.0 - m.0.0).abs();
        let most = arm.iter().zip(&motor).map(apart).max().unwrap_or(0);
        // Half of 0.4 rad is 65 of 2048 counts.
        assert!((64..=66).contains(&most), "{most}");
    }

    /// A hand that moves the arm takes the rotor along: the backlash does not hurl them at each other.
    #[test]
    fn a_hand_moves_the_rotor_as_well() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let backlash = Effect::new("drive.backlash", &[0.05, 0.3, 1.0]).expect("valid");
        let emulation = Emulation {
            hidden: vec![backlash],
            ..Emulation::default()
        };
        let mut rig = EmulatedRig::new(&rig, &emulation).expect("valid");
        rig.set_state(State::new(1.0, PI, 0.0, 0.0));
        for _ in 0..500 {
            // 1 rad is 326 of 2048 counts, half the backlash 8.
            let counts = rig.tick().theta.0;
            assert!((318..=334).contains(&counts), "{counts}");
        }
        assert!((rig.state().theta - 1.0).abs() < 1e-9, "{:?}", rig.state());
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let period = |period_us| {
            EmulatedRig::new(
                &rig,
                &Emulation {
                    period_us,
                    ..Emulation::default()
                },
            )
        };
        assert!(matches!(
            period(0),
            Err(EmulationError::Period { period_us: 0 })
        ));
        let hidden = vec![Effect::new("motor.bias", &[0.1]).expect("valid"); 20];
        assert!(
            EmulatedRig::new(
                &rig,
                &Emulation {
                    hidden,
                    ..Emulation::default()
                }
            )
            .is_err()
        );
    }

    #[test]
    fn a_long_name_is_cut_between_characters() {
        assert_eq!(short_name(&"ä".repeat(40)).as_str(), "ä".repeat(16));
    }
}
