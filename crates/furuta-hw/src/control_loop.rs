//! The real-time loop: one thread, led by the rig's clock.
//!
//! Each sample is answered at once: counts to angles, [`Pilot::process`], command out, record into the ring. Nothing
//! here allocates, locks or writes to disk after the start. However the loop ends, by its duration, a limit, an error
//! or a panic of the pilot, the last thing the rig hears is 0 V.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use furuta_log::{Mode, Record};
use furuta_wire::{Hello, Message, Sample, Status};

use crate::clock::{ClockWatch, News};
use crate::delay::DelayMeter;
use crate::link::Link;
use crate::pilot::{Measurement, Pilot};
use crate::recorder::RecordSender;
use crate::safety::{SafeCommand, SafetyMonitor};
use crate::transport::{Transport, TransportError};

pub use crate::loop_settings::LoopSettings;
pub use crate::run_error::RunError;
pub use crate::summary::{End, ModeChange, Summary};

/// After a silence that was the host's own, what waited in the port is read within this time.
const CATCHING_UP: Duration = Duration::from_millis(100);
/// How often the last 0 V is sent, since one frame can be lost. The rig's watchdog is what remains.
const STOP_REPEATS: usize = 3;

/// Sends 0 V when dropped, so on every way out, a panic included.
struct MotorOff<'a, T: Transport> {
    link: &'a mut Link<T>,
    seq: u32,
}

impl<T: Transport> Drop for MotorOff<'_, T> {
    fn drop(&mut self) {
        for _ in 0..STOP_REPEATS {
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
    let mut run = LoopState {
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
        monitor: SafetyMonitor::new(settings.limits, settings.brake),
    };
    let end = run.until_the_end(&mut motor, records);
    let mut summary = run.summary;
    summary.end = end;
    summary.bad_frames = motor.link.bad_frames() - bad_frames_before;
    summary.unlogged = records.lost();
    summary
}

/// A loop under way.
struct LoopState<'a, P: Pilot> {
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
    monitor: SafetyMonitor,
}

impl<P: Pilot> LoopState<'_, P> {
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
            if self.monitor.is_stopping() {
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
        let SafeCommand { volts, mode, end } =
            self.monitor.check(sample.status, &measurement, &decision);
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

    /// Asks the rig who it is, now and then: it answers at once, so this tells how long the way there and back takes.
    /// After the command, so that it delays none.
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
