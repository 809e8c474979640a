//! The rig's end of the wire: what every rig must do whatever its motor and its encoders are.

use core::f32::consts::TAU;

use arrayvec::ArrayVec;

use crate::{
    ArmCounts, Command, Decoder, FrameError, Hello, Message, PendulumCounts, RigLimits, Sample,
    Status,
};

/// Beyond a limit a command that brakes the arm is obeyed for so long, us; then the motor is off whatever is said.
const BRAKING_US: u32 = 250_000;

/// Speeds for the limits are taken over this many periods, since a single count per period is already fast.
const SPEED_WINDOW: usize = 10;

/// The rig's end of the wire: takes the host's bytes, decides at each tick what the motor gets. Holds the watchdog, the
/// command limit and the limits of angle and speed that the hello announces: beyond one of these the motor gets nothing
/// but what brakes the arm on its way out, for a quarter of a second at most. No I/O, no clock.
///
/// A command counts where it answers one of the last `watchdog_periods` samples, and a newer one than the command
/// obeyed before. Any other (repeated, late, of the time before a reset) does not feed the watchdog and drives nothing;
/// only its 0 V is taken, since off is always allowed.
///
/// ```
/// use furuta_wire::{ArmCounts, Command, Hello, MAX_FRAME, Message, PendulumCounts, RigEnd};
/// use furuta_wire::{RigLimits, RigName, Status, encode};
///
/// let hello = Hello {
///     version: furuta_wire::PROTOCOL_VERSION,
///     rig: RigName::from("my-rig").unwrap_or_default(),
///     period_us: 2000,
///     arm_counts_per_rev: 2048.0,
///     pendulum_counts_per_rev: 2048.0,
///     command_limit: 10.0,
///     limits: RigLimits::default(),
///     watchdog_periods: 10,
///     actuation: 0,
/// };
/// let mut rig = RigEnd::new(hello);
/// let first = rig.tick(0, ArmCounts(0), PendulumCounts(0));
/// let mut buffer = [0; MAX_FRAME];
/// let frame = encode(&Message::Command(Command { seq: first.seq, volts: 12.0 }), &mut buffer)?;
/// frame.iter().for_each(|&byte| rig.receive(byte));
/// let sample = rig.tick(2000, ArmCounts(0), PendulumCounts(0));
/// assert_eq!((sample.volts, sample.status), (10.0, Status::CLIPPED)); // what the motor is to get from now on
/// for k in 1..=10 {
///     frame.iter().for_each(|&byte| rig.receive(byte)); // repeated: as good as silence
///     let silent = rig.tick(2000 + 2000 * k, ArmCounts(0), PendulumCounts(0));
///     assert_eq!(silent.volts, if k < 10 { 10.0 } else { 0.0 }); // the watchdog
/// }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct RigEnd {
    hello: Hello,
    decoder: Decoder,
    queried: bool,
    /// The last query was of another version of the protocol.
    foreign: bool,
    fresh: Option<Asked>,
    refused: bool,
    /// The sample that the last command obeyed answers; the one before the first where there was none.
    obeyed: u32,
    answered: bool,
    held: f32,
    silent: u32,
    commanded: bool,
    seq: u32,
    /// Counts at the last ticks, the oldest first.
    recent: ArrayVec<[i32; 2], SPEED_WINDOW>,
    /// Ticks in a row beyond a limit.
    beyond: u32,
}

/// What was asked for since the last tick.
#[derive(Copy, Clone, Debug)]
struct Asked {
    volts: f32,
    /// Whether it is a sign of life.
    feeds: bool,
}

/// What the encoders say of the limits.
struct Motion {
    beyond: bool,
    /// The arm, rad and rad/s.
    theta: f32,
    theta_dot: f32,
}

impl RigEnd {
    /// At power-on: the motor is off until the first valid command.
    #[must_use]
    pub fn new(hello: Hello) -> Self {
        Self {
            hello,
            decoder: Decoder::new(),
            queried: false,
            foreign: false,
            fresh: None,
            refused: false,
            obeyed: u32::MAX,
            answered: false,
            held: 0.0,
            silent: 0,
            commanded: false,
            seq: 0,
            recent: ArrayVec::new(),
            beyond: 0,
        }
    }

    /// What the rig says of itself.
    #[must_use]
    pub fn settings(&self) -> &Hello {
        &self.hello
    }

    /// Takes a byte from the host. A host whose query is of another version of the protocol is told this rig's, in a
    /// hello, and nothing that it commands is obeyed: the motor is off until a query of this version.
    pub fn receive(&mut self, byte: u8) {
        match self.decoder.push(byte) {
            Some(Ok(Message::Command(command))) => {
                self.answered |= command.seq == self.seq.wrapping_sub(1);
                if self.foreign {
                    self.refused = true;
                } else {
                    self.answer(command);
                }
            }
            Some(Ok(Message::Query(_))) => {
                self.queried = true;
                self.foreign = false;
            }
            Some(Err(FrameError::Version { .. })) => {
                // The hello tells the host why. What it means by a command is not known.
                self.queried = true;
                self.foreign = true;
                self.fresh = None;
                self.commanded = false;
            }
            _ => {}
        }
    }

    /// A host's command, which may be anything.
    fn answer(&mut self, command: Command) {
        // How many samples ago the one was sent that this answers: huge for one that was never sent.
        let newest = self.seq.wrapping_sub(1);
        let age = |seq: u32| newest.wrapping_sub(seq);
        let is_recent = age(command.seq) < u32::from(self.hello.watchdog_periods).min(self.seq);
        let is_newer = age(command.seq) < age(self.obeyed);
        if is_recent && is_newer && command.volts.is_finite() {
            self.obeyed = command.seq;
            self.command(command.volts);
        } else if command.volts == 0.0 {
            let feeds = self.fresh.is_some_and(|asked| asked.feeds);
            self.fresh = Some(Asked { volts: 0.0, feeds });
        } else {
            self.refused = true;
        }
    }

    /// The motor voltage asked for from the next tick on (V): for a controller on the rig itself, which feeds the
    /// watchdog by it.
    pub fn command(&mut self, volts: f32) {
        if volts.is_finite() {
            self.fresh = Some(Asked { volts, feeds: true });
        } else {
            self.refused = true;
        }
    }

    /// The answer to a query, if one came since the last call.
    pub fn hello(&mut self) -> Option<Hello> {
        core::mem::take(&mut self.queried).then_some(self.hello)
    }

    /// True if the last sample has been answered, with whatever voltage.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.answered
    }

    /// Number of the next sample.
    #[must_use]
    pub fn seq(&self) -> u32 {
        self.seq
    }

    /// One tick at `t_us` of the rig's clock, the encoders being at these counts: the sample to be sent. Its `volts`
    /// are what the motor must get from now on.
    pub fn tick(&mut self, t_us: u64, theta: ArmCounts, alpha: PendulumCounts) -> Sample {
        let (volts, status) = self.latch([theta.0, alpha.0]);
        let seq = self.seq;
        self.seq = seq.wrapping_add(1);
        Sample {
            seq,
            t_us,
            theta,
            alpha,
            volts,
            status,
        }
    }

    /// The voltage from this tick on, and why.
    fn latch(&mut self, counts: [i32; 2]) -> (f32, Status) {
        let mut status = Status::OK;
        self.answered = false;
        if core::mem::take(&mut self.refused) {
            status = status | Status::REFUSED;
        }
        let asked = self.fresh.take();
        if let Some(Asked { volts, .. }) = asked {
            let limit = self.hello.command_limit;
            if volts.abs() > limit {
                status = status | Status::CLIPPED;
            }
            // Not `clamp`, which panics where the limit is no number: then the motor gets nothing.
            self.held = volts.min(limit).max(-limit);
        }
        if asked.is_some_and(|asked| asked.feeds) {
            self.silent = 0;
            self.commanded = true;
        } else {
            self.silent = self.silent.saturating_add(1);
            status = status | Status::HELD;
        }
        if !self.commanded || self.silent >= u32::from(self.hello.watchdog_periods) {
            self.held = 0.0;
            status = status | Status::WATCHDOG;
        }
        let motion = self.motion(counts);
        if motion.beyond {
            status = status | Status::LIMIT;
            self.beyond = self.beyond.saturating_add(1);
            if !self.brakes(&motion) {
                self.held = 0.0;
            }
        } else {
            self.beyond = 0;
        }
        (self.held, status)
    }

    /// Whether the voltage held does nothing beyond a limit but to stop the arm on its way out, and has not done so for
    /// too long.
    fn brakes(&self, motion: &Motion) -> bool {
        let longest = BRAKING_US.checked_div(self.hello.period_us).unwrap_or(0);
        let against = self.held * motion.theta_dot < 0.0;
        let limit = self.hello.limits.arm_angle;
        let outside = limit.is_some_and(|limit| motion.theta.abs() > limit);
        let outwards = motion.theta * motion.theta_dot > 0.0;
        self.beyond <= longest && against && (outwards || !outside)
    }

    fn motion(&mut self, counts: [i32; 2]) -> Motion {
        #[allow(clippy::cast_possible_truncation)] // counts per turn have few digits
        let per_count = [
            TAU / self.hello.arm_counts_per_rev as f32,
            TAU / self.hello.pendulum_counts_per_rev as f32,
        ];
        let angle = |axis: usize, counts: i32| counts as f32 * per_count[axis];
        let RigLimits {
            arm_angle,
            arm_speed,
            pendulum_speed,
        } = self.hello.limits;
        let mut speeds = [0.0; 2];
        if self.recent.is_full() {
            let old = self.recent.remove(0);
            let window = SPEED_WINDOW as f32 * self.hello.period_us as f32 * 1e-6;
            speeds = [
                angle(0, counts[0].wrapping_sub(old[0])) / window,
                angle(1, counts[1].wrapping_sub(old[1])) / window,
            ];
        }
        // There is room: a full window has lost its oldest just now.
        let _ = self.recent.try_push(counts);
        let beyond = |value: f32, limit: Option<f32>| limit.is_some_and(|l| value.abs() > l);
        let theta = angle(0, counts[0]);
        Motion {
            beyond: beyond(theta, arm_angle)
                || beyond(speeds[0], arm_speed)
                || beyond(speeds[1], pendulum_speed),
            theta,
            theta_dot: speeds[0],
        }
    }
}
