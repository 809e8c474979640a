//! The real-time loop: one thread, led by the rig's clock.
//!
//! Each sample is answered at once: counts to angles, [`Pilot::process`], command out, record into the ring. Nothing
//! here allocates, locks or writes to disk after the start. However the loop ends, by its duration, a limit, an error
//! or a panic of the pilot, the last thing the rig hears is 0 V.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use arrayvec::ArrayVec;
use furuta_ctrl::supervisor::{Brake, Fault};
use furuta_log::{Mode, Record, Timing};
use furuta_model::{Limits, Rig};
use furuta_wire::{Hello, Message, Sample, Status};

use crate::clock::{Against, ClockWatch, News, OldSample, RigClock, looks};
use crate::delay::DelayMeter;
use crate::link::Link;
use crate::pilot::{Measurement, Pilot};
use crate::real_time::{Granted, RealTime};
use crate::recorder::RecordSender;
use crate::transport::{Transport, TransportError};
use crate::verdict::{self, Judge, Verdict};

/// Changes of mode that a summary can hold; later ones are only counted.
const MODE_CHANGES: usize = 64;
/// After a silence that was the host's own, what waited in the port is read within this time.
const CATCHING_UP: Duration = Duration::from_millis(100);
/// The last 0 V is sent so many times, since one frame can be lost. The rig's watchdog is what remains.
const FAREWELLS: usize = 3;

/// Settings of the loop: [`LoopSettings::new`] for those of a rig, and what shall be otherwise.
///
/// ```
/// use furuta_hw::LoopSettings;
/// use std::time::Duration;
/// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let settings = LoopSettings {
///     probe: Some(LoopSettings::PROBE),
///     ..LoopSettings::new(&rig, 0.002, Duration::from_secs(10))
/// };
/// assert_eq!(settings.limits, rig.limits);
/// assert_eq!(settings.brake.periods(), 125); // a quarter of a second
/// # Ok::<(), &str>(())
/// ```
#[derive(Copy, Clone, Debug)]
pub struct LoopSettings<'a> {
    /// The run ends after this time of the rig's clock.
    pub duration: Duration,
    /// The run ends where one of these is exceeded.
    pub limits: Limits,
    /// How the arm is stopped there; [`Brake::none`] only cuts the motor off. A replay takes it to be that of [`LoopSettings::new`].
    pub brake: Brake<f64>,
    /// The run ends where no sample comes for so long; one that is repeated or old counts as none.
    pub silence: Duration,
    /// Whether the rig's clock is compared with the host's; and how long the run may last on that, whatever the rig's says: [`RigClock::longest`].
    pub clock: RigClock,
    /// Set from elsewhere, for example on Ctrl-C, to end the run.
    pub stop: Option<&'a AtomicBool>,
    /// How often the way to the rig and back is timed, by a query after a command; never where not given.
    pub probe: Option<Duration>,
    /// What [`crate::Session::run`] asks of the system.
    pub real_time: RealTime,
}

impl LoopSettings<'_> {
    /// A run of this length on this rig at this sample period (s): the rig file's limits, and [`Brake::new`] up to its command limit where one is
    /// exceeded; [`Self::SILENCE`]; a rig whose clock shows real time; nobody stops it, the line is not timed, nothing is asked of the system.
    #[must_use]
    pub fn new(rig: &Rig, period: f64, duration: Duration) -> Self {
        Self {
            duration,
            limits: rig.limits,
            brake: verdict::brake(rig, period),
            silence: Self::SILENCE,
            clock: RigClock::Real,
            stop: None,
            probe: None,
            real_time: RealTime::default(),
        }
    }

    /// Silence after which a rig counts as dead where nothing else is said: long against any hiccup of an operating
    /// system, since the rig's own watchdog has long switched the motor off by then.
    pub const SILENCE: Duration = Duration::from_millis(500);
    /// How often the way there and back is timed where nothing else is said: a query and its answer are 80 bytes at most, once in 50 periods of 2 ms.
    pub const PROBE: Duration = Duration::from_millis(100);
}

/// Why a run ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The way to the rig.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// The rig sends no samples (any more).
    #[error(
        "no sample from the rig for {waited:.1?} (after {samples} samples): see that it is switched on; reset it"
    )]
    Silent {
        /// How long was waited.
        waited: Duration,
        /// Samples before.
        samples: u64,
    },
    /// The rig began counting anew.
    #[error(
        "the rig restarted at t = {t:.3} s (sample number fell from {last} to {seq}): see its power supply"
    )]
    RigReset {
        /// Time (s).
        t: f64,
        /// Number of the last sample before.
        last: u32,
        /// Number of the first sample after.
        seq: u32,
    },
    /// Samples come, and none is news.
    #[error(
        "no new sample from the rig for {waited:.1?} (after {samples} samples): {why}; reset the rig, and see its firmware's `seq` and `t_us`"
    )]
    OldSamples {
        /// How long was waited.
        waited: Duration,
        /// Samples before.
        samples: u64,
        /// Why the last one was no news.
        why: OldSample,
    },
    /// The rig's clock stepped.
    #[error(
        "the rig's clock stepped by {step:.3} s at t = {t:.3} s: its time stamps are no measure any more; reset the rig"
    )]
    RigClock {
        /// Time before (s).
        t: f64,
        /// By how much it stepped (s).
        step: f64,
    },
    /// The rig's clock runs at another rate than it must.
    #[error(
        "the rig's time stamps {} at t = {t:.3} s: motor off; have its firmware count microseconds in `t_us`, and see what its timer's clock is divided by{}",
        looks(*.rate, *.against), emulated(*.against)
    )]
    RigTimeStamps {
        /// Time by the stamps (s).
        t: f64,
        /// Their rate: 1 for microseconds.
        rate: f64,
        /// Compared with what.
        against: Against,
    },
    /// The rig's samples come at another rate than it announced.
    #[error(
        "the rig's samples come every {actual_us:.0} us by its own clock and the host's, its hello says period_us = {period_us:.0} (t = {t:.3} s): motor off; \
         correct the period in its firmware"
    )]
    RigPeriod {
        /// Time (s).
        t: f64,
        /// What it announced (us).
        period_us: f64,
        /// What it keeps (us).
        actual_us: f64,
    },
    /// The run lasts longer than it can.
    #[error(
        "a run of {:.1} s has lasted {:.1} s of the host's clock, and the rig's clock shows {seconds:.3} s: motor off; see the rig's clock",
        .duration.as_secs_f64(), .lasted.as_secs_f64()
    )]
    Overtime {
        /// What was asked for.
        duration: Duration,
        /// What it lasted.
        lasted: Duration,
        /// The rig's clock from first to last sample (s).
        seconds: f64,
    },
    /// A limit of the rig file is exceeded.
    #[error(
        "{quantity} is {value:.3} {unit} at t = {t:.3} s, its limit is {limit} {unit}: motor off; bring the arm back to its middle"
    )]
    Limit {
        /// What.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Its limit.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
        /// Time (s).
        t: f64,
    },
    /// The rig itself found a limit exceeded.
    #[error(
        "the rig switched its motor off at t = {t:.3} s because a limit of its own is exceeded: bring the arm back to its middle"
    )]
    RigLimit {
        /// Time (s).
        t: f64,
    },
    /// The supervisor found a limit of its own exceeded, or a measurement that is not a number.
    #[error("{fault} at t = {t:.3} s: motor off; bring the arm back to its middle")]
    Fault {
        /// What it found.
        fault: Fault,
        /// Time (s).
        t: f64,
    },
    /// Estimator or controller produced what is not a number.
    #[error(
        "{quantity} is not a finite number at t = {t:.3} s: motor off; see the controller's gains"
    )]
    NotFinite {
        /// What.
        quantity: &'static str,
        /// Time (s).
        t: f64,
    },
}

fn emulated(against: Against) -> &'static str {
    match against {
        Against::Host => "; where the rig is an emulated one on a busy machine, give --any-clock",
        Against::Period => "",
    }
}

/// How a run ended.
#[derive(Debug)]
pub enum End {
    /// Its duration was over.
    Finished,
    /// The stop flag was set.
    Stopped,
    /// Something was wrong.
    Failed(RunError),
}

/// A change of mode.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ModeChange {
    /// When (s).
    pub t: f64,
    /// The mode from then on.
    pub mode: Mode,
}

/// What happened in a run.
#[derive(Debug)]
pub struct Summary {
    /// How it ended.
    pub end: End,
    /// The rig's clock from first to last sample (s).
    pub seconds: f64,
    /// Samples received.
    pub samples: u64,
    /// Samples lost on the wire, or left out as no news.
    pub lost: u64,
    /// Samples that were no news, repeated or old: they got no command.
    pub old: u64,
    /// Samples that arrived more than a period later than the promptest.
    pub late: u64,
    /// Periods in which the rig heard no valid command and held the last one: the host was late, or the frame lost.
    pub held: u64,
    /// Periods in which the rig's watchdog had the motor off after the run had begun.
    pub watchdog: u64,
    /// Frames that were not valid.
    pub bad_frames: u64,
    /// Records that are not in the log: its writer did not keep up, or gave up.
    pub unlogged: u64,
    /// First changes of mode, in order.
    pub modes: ArrayVec<ModeChange, MODE_CHANGES>,
    /// Number of changes of mode, the first mode included.
    pub mode_changes: u64,
    /// How punctual the loop was.
    pub timing: Timing,
    /// What the system granted.
    pub granted: Granted,
}

impl Summary {
    fn new(period_ns: u64) -> Self {
        Self {
            end: End::Finished,
            seconds: 0.0,
            samples: 0,
            lost: 0,
            old: 0,
            late: 0,
            held: 0,
            watchdog: 0,
            bad_frames: 0,
            unlogged: 0,
            modes: ArrayVec::new(),
            mode_changes: 0,
            timing: Timing::new(period_ns),
            granted: Granted::default(),
        }
    }

    /// The error that ended the run, if one did.
    #[must_use]
    pub fn error(&self) -> Option<&RunError> {
        match &self.end {
            End::Failed(error) => Some(error),
            End::Finished | End::Stopped => None,
        }
    }
}

/// Sends 0 V when dropped, so on every way out, a panic included.
struct MotorOff<'a, T: Transport> {
    link: &'a mut Link<T>,
    seq: u32,
}

impl<T: Transport> Drop for MotorOff<'_, T> {
    fn drop(&mut self) {
        for _ in 0..FAREWELLS {
            // Where this fails the wire is gone, and the rig's watchdog does it.
            let _ = self.link.command(self.seq, 0.0);
        }
    }
}

/// Runs the loop until its end.
///
/// The summary tells how the run ended; what was recorded up to then is in the log in any case.
pub fn run<T: Transport, P: Pilot>(
    link: &mut Link<T>,
    hello: &Hello,
    pilot: &P,
    settings: &LoopSettings<'_>,
    records: &mut RecordSender,
) -> Summary {
    let bad_frames_before = link.bad_frames();
    let mut motor = MotorOff { link, seq: 0 };
    let begin = motor.link.now();
    let mut run = Run {
        summary: Summary::new(u64::from(hello.period_us) * 1000),
        hello,
        settings,
        pilot,
        state: pilot.start(),
        delay: DelayMeter::new(),
        clock: ClockWatch::new(hello.period_us, settings.clock),
        begin,
        first: None,
        lost_before: 0,
        probed: None,
        // Not at once: an answer to the connection's own queries may still be on its way.
        probe_due: begin + settings.probe.unwrap_or_default(),
        judge: Judge::new(settings.limits, settings.brake),
    };
    let end = run.until_the_end(&mut motor, records);
    let mut summary = run.summary;
    summary.end = end;
    summary.bad_frames = motor.link.bad_frames() - bad_frames_before;
    summary.unlogged = records.lost();
    summary
}

/// A loop under way.
struct Run<'a, P: Pilot> {
    summary: Summary,
    hello: &'a Hello,
    settings: &'a LoopSettings<'a>,
    pilot: &'a P,
    state: P::State,
    delay: DelayMeter,
    clock: ClockWatch,
    begin: Instant,
    /// When the first sample arrived.
    first: Option<Instant>,
    lost_before: u32,
    /// When the query left that has not been answered yet.
    probed: Option<Instant>,
    probe_due: Instant,
    judge: Judge,
}

impl<P: Pilot> Run<'_, P> {
    fn until_the_end<T: Transport>(
        &mut self,
        motor: &mut MotorOff<'_, T>,
        records: &mut RecordSender,
    ) -> End {
        let longest = self.settings.clock.longest(self.settings.duration);
        // A run of centuries needs no deadline.
        let over = self.begin.checked_add(longest);
        let mut heard = self.begin;
        // Since when nothing but old samples has come after a silence.
        let mut overdue = None;
        loop {
            let silent = heard.checked_add(self.settings.silence);
            let deadline = [over, silent].into_iter().flatten().min();
            let deadline = deadline.unwrap_or_else(|| motor.link.now() + LoopSettings::SILENCE);
            let message = match motor.link.receive(deadline) {
                Ok(message) => message,
                Err(error) => return End::Failed(error.into()),
            };
            let arrived = motor.link.now();
            let fresh = match message {
                Some(Message::Sample(sample)) => {
                    match self.answer(&sample, arrived, motor, records) {
                        Ok(fresh) => fresh,
                        Err(error) => return End::Failed(error),
                    }
                }
                Some(Message::Hello(_)) => {
                    self.probe_answered(arrived);
                    false
                }
                Some(Message::Query(_) | Message::Command(_)) | None => false,
            };
            if fresh {
                (heard, overdue) = (arrived, None);
            }
            // Asked whatever comes: a rig that sends no news must not keep a run alive.
            if over.is_some_and(|over| arrived >= over) {
                return End::Failed(RunError::Overtime {
                    duration: self.settings.duration,
                    lasted: arrived.duration_since(self.begin),
                    seconds: self.summary.seconds,
                });
            }
            let waited = arrived.duration_since(heard);
            if waited >= self.settings.silence {
                let since = *overdue.get_or_insert(arrived);
                if message.is_none() || arrived.duration_since(since) >= CATCHING_UP {
                    return End::Failed(self.silence(waited));
                }
            }
            if self.judge.is_stopping() {
                continue; // not for long
            }
            if fresh && self.summary.seconds >= self.settings.duration.as_secs_f64() {
                return End::Finished;
            }
            let stopped = |stop: &AtomicBool| stop.load(Ordering::Relaxed);
            if !matches!(message, Some(Message::Hello(_)))
                && self.settings.stop.is_some_and(stopped)
            {
                return End::Stopped;
            }
        }
    }

    fn silence(&self, waited: Duration) -> RunError {
        let samples = self.summary.samples;
        match self.clock.old() {
            Some(why) => RunError::OldSamples {
                waited,
                samples,
                why,
            },
            None => RunError::Silent { waited, samples },
        }
    }

    /// One sample: everything that happens in a period. False for one that is no news, and is not answered.
    fn answer<T: Transport>(
        &mut self,
        sample: &Sample,
        arrived: Instant,
        motor: &mut MotorOff<'_, T>,
        records: &mut RecordSender,
    ) -> Result<bool, RunError> {
        let begun = Instant::now();
        let first = *self.first.get_or_insert(arrived);
        let since = arrived.duration_since(first);
        let News::Fresh { periods } = self.clock.sample(sample, since)? else {
            self.summary.old += 1;
            return Ok(false);
        };
        self.lost_before = periods - 1;
        self.summary.lost += u64::from(self.lost_before);
        let t = self.clock.seconds(sample.t_us);
        let measurement = Measurement {
            t,
            periods,
            theta: sample.theta.theta(self.hello.arm_counts_per_rev),
            alpha: sample.alpha.alpha(self.hello.pendulum_counts_per_rev),
            held: f64::from(sample.volts),
        };
        let decision = self.pilot.process(&mut self.state, &measurement);
        let Verdict { volts, mode, end } =
            self.judge.verdict(sample.status, &measurement, &decision);
        motor.seq = sample.seq;
        let sent = motor.link.command(sample.seq, volts as f32);

        let compute = begun.elapsed().as_secs_f64();
        let delay = self.delay.delay(since.as_secs_f64(), t);
        self.count(sample, t, mode, compute, delay);
        records.send(Record {
            t,
            u: measurement.held,
            theta: measurement.theta,
            alpha: measurement.alpha,
            theta_dot: decision.theta_dot,
            alpha_dot: decision.alpha_dot,
            reference: decision.reference,
            command: volts,
            mode,
            seq: sample.seq,
            status: sample.status.bits(),
            lost: self.lost_before,
            delay,
            compute,
        });
        match end {
            Some(error) => Err(error),
            None => {
                sent.and_then(|()| self.probe(motor))?;
                Ok(true)
            }
        }
    }

    /// Asks the rig who it is, now and then: it answers at once, so this tells how long the way there and back takes. After the command, so that it delays none.
    fn probe<T: Transport>(&mut self, motor: &mut MotorOff<'_, T>) -> Result<(), TransportError> {
        let Some(every) = self.settings.probe else {
            return Ok(());
        };
        let now = motor.link.now();
        // An unanswered query was lost by then.
        if now < self.probe_due {
            return Ok(());
        }
        self.probe_due = now + every;
        self.probed = Some(now);
        motor.link.query()
    }

    fn probe_answered(&mut self, arrived: Instant) {
        if let Some(left) = self.probed.take() {
            let ns = arrived.duration_since(left).as_nanos();
            let times = &mut self.summary.timing.round_trip;
            times.record(u64::try_from(ns).unwrap_or(u64::MAX));
        }
    }

    fn count(&mut self, sample: &Sample, t: f64, mode: Mode, compute: f64, delay: f64) {
        let s = &mut self.summary;
        s.samples += 1;
        s.seconds = t;
        // The first two samples were sent before the rig could have heard from us.
        if s.samples > 2 {
            s.held += u64::from(sample.status.contains(Status::HELD));
            s.watchdog += u64::from(sample.status.contains(Status::WATCHDOG));
        }
        s.late += u64::from(delay > f64::from(self.hello.period_us) * 1e-6);
        s.timing.sample(delay, compute);
        if s.modes.last().is_none_or(|last| last.mode != mode) {
            s.mode_changes += 1;
            // A full list keeps its first entries.
            let _ = s.modes.try_push(ModeChange { t, mode });
        }
    }
}
