//! Whether the rig's time is time: what is news, and whether the rig's clock, its period and the host's clock agree. No
//! clock of its own: every time is an argument.
//!
//! Three times pass in a run. The rig's time stamps (`t_us`), its numbers of samples times `period_us` of the hello,
//! and the host's monotonic clock at which samples arrive. Any two may differ by `Tolerance::rate` and by
//! `Tolerance::slack` on top, over windows of `WINDOW` seconds:
//!
//! | | rate | slack, s | held for, s | why |
//! |---|---|---|---|---|
//! | stamps and numbers | 0.1 | 0.25 | 0 | one crystal makes both: a timer that cannot make the period exactly is 1e-3 off, a loop that sleeps between its ticks some 5e-2; ticks are late where the rig's processor is busy |
//! | stamps and host | 0.25 | 0.5 | 0.25 | a crystal is 1e-4 off, a microcontroller's RC oscillator up to 0.1, the smallest wrong factor of a timer 1.5; a host that was busy reads what waited for it within milliseconds, so lateness that stays is the clock's |
//!
//! So a factor of 1.5 and more either way does not pass, nor a clock that stands still: found after 0.3 s (stamps and
//! numbers, a factor of ten) to 6 s (all of the rig at half its speed).

use std::time::Duration;

use furuta_wire::Sample;

use crate::run_error::RunError;

pub use crate::rig_time::{Against, OldSample, RigClock};

/// How long a comparison looks back, at least; twice that at most (s).
const WINDOW: f64 = 4.0;
/// A rig's clock may differ from the number of samples by this from one sample to the next (s): ticks come late where a
/// processor is busy.
const CLOCK_STEP: f64 = 0.25;
/// A rig that was reset counts from 0. What the host hears first is a sample within so long of it (s): the rig is heard
/// again before the host gives up on it.
const RESTARTED_WITHIN: f64 = 1.0;
/// This number of samples in a row, each newer than the one before, makes a restart of what could be one old sample.
const RESTART_EVIDENCE: u32 = 4;

/// By how much two times may differ.
#[derive(Copy, Clone, Debug)]
struct Tolerance {
    /// As a part of the time that has passed.
    rate: f64,
    /// In any case, s.
    slack: f64,
    /// Slower is believed where it is so for this long, s.
    hold: f64,
}

const STAMPS_AND_NUMBERS: Tolerance = Tolerance {
    rate: 0.1,
    slack: 0.25,
    hold: 0.0,
};
const STAMPS_AND_HOST: Tolerance = Tolerance {
    rate: 0.25,
    slack: 0.5,
    hold: 0.25,
};

/// A moment: another time, and by how much the stamps were behind it (s).
#[derive(Copy, Clone, Debug)]
struct Moment {
    at: f64,
    behind: f64,
}

/// The time stamps against another time.
#[derive(Copy, Clone, Debug)]
struct Comparison {
    tolerance: Tolerance,
    base: Moment,
    /// The promptest of the window under way: the base of the next.
    next: Moment,
    window_from: f64,
    slow_since: Option<f64>,
}

impl Comparison {
    fn new(tolerance: Tolerance) -> Self {
        let zero = Moment {
            at: 0.0,
            behind: 0.0,
        };
        Self {
            tolerance,
            base: zero,
            next: zero,
            window_from: 0.0,
            slow_since: None,
        }
    }

    /// The stamps' rate in terms of the other time, since the base; `None` where the two agree.
    fn disagreement(&mut self, at: f64, stamps: f64) -> Option<f64> {
        let now = Moment {
            at,
            behind: at - stamps,
        };
        let passed = at - self.base.at;
        let behind = now.behind - self.base.behind;
        let allowed = self.tolerance.slack + self.tolerance.rate * passed.max(0.0);
        if behind > allowed {
            let since = *self.slow_since.get_or_insert(at);
            if at - since >= self.tolerance.hold {
                return Some(self.rate(at, stamps));
            }
        } else {
            self.slow_since = None;
        }
        if -behind > allowed {
            return Some(self.rate(at, stamps));
        }
        if at - self.window_from > WINDOW {
            self.base = self.next;
            self.next = now;
            self.window_from = at;
        } else if now.behind <= self.next.behind {
            self.next = now;
        }
        None
    }

    fn rate(&self, at: f64, stamps: f64) -> f64 {
        let passed = at - self.base.at;
        1.0 - (at - stamps - self.base.behind) / passed
    }
}

/// What a sample is.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum News {
    /// News: `periods` after the last that was.
    Fresh {
        /// 1 where none was lost.
        periods: u32,
    },
    /// Repeated or old: to be left alone.
    Old,
}

/// Number and time stamp of a sample.
#[derive(Copy, Clone, Debug)]
struct Stamp {
    seq: u32,
    t_us: u64,
}

/// Samples that may be those of a rig that was reset.
#[derive(Copy, Clone, Debug)]
struct Restart {
    first: u32,
    newest: u32,
    samples: u32,
}

/// Follows the rig's time through a run.
#[derive(Clone, Debug)]
pub(crate) struct ClockWatch {
    period: f64,
    clock: RigClock,
    first_us: u64,
    begin: Duration,
    /// The last sample that was news.
    fresh: Option<Stamp>,
    /// The last with a newer number, whatever its time.
    last: Stamp,
    /// Time by the numbers of samples, s; and at the last that was news.
    counted: f64,
    counted_at_fresh: f64,
    restart: Option<Restart>,
    by_number: Comparison,
    by_host: Comparison,
    old: Option<OldSample>,
}

impl ClockWatch {
    pub(crate) fn new(period_us: u32, clock: RigClock) -> Self {
        Self {
            period: f64::from(period_us) * 1e-6,
            clock,
            first_us: 0,
            begin: Duration::ZERO,
            fresh: None,
            last: Stamp { seq: 0, t_us: 0 },
            counted: 0.0,
            counted_at_fresh: 0.0,
            restart: None,
            by_number: Comparison::new(STAMPS_AND_NUMBERS),
            by_host: Comparison::new(STAMPS_AND_HOST),
            old: None,
        }
    }

    /// The rig's time at a sample since the first (s).
    pub(crate) fn seconds(&self, t_us: u64) -> f64 {
        t_us.saturating_sub(self.first_us) as f64 * 1e-6
    }

    /// Why the samples since the last that was news were none; `None` where there were none.
    pub(crate) fn old(&self) -> Option<OldSample> {
        self.old
    }

    /// What to make of a sample that arrived at `now` of the host's clock.
    ///
    /// # Errors
    /// The rig was reset, or its time is none.
    pub(crate) fn sample(&mut self, sample: &Sample, now: Duration) -> Result<News, RunError> {
        let stamp = Stamp {
            seq: sample.seq,
            t_us: sample.t_us,
        };
        let Some(fresh) = self.fresh else {
            (self.first_us, self.begin) = (stamp.t_us, now);
            (self.fresh, self.last) = (Some(stamp), stamp);
            return Ok(News::Fresh { periods: 1 });
        };
        let periods = stamp.seq.wrapping_sub(self.last.seq);
        if periods == 0 {
            self.old = Some(OldSample::Repeated { seq: stamp.seq });
            return Ok(News::Old);
        }
        if periods > u32::MAX / 2 {
            self.old = Some(OldSample::Number {
                seq: stamp.seq,
                last: fresh.seq,
            });
            return self.restarted(stamp.seq, fresh).map(|()| News::Old);
        }
        self.restart = None;
        self.step(stamp, periods)?;
        self.last = stamp;
        self.counted += f64::from(periods) * self.period;
        self.compare(stamp, fresh, now)?;
        if stamp.t_us <= fresh.t_us {
            self.old = Some(OldSample::Time {
                t_us: stamp.t_us,
                last_us: fresh.t_us,
            });
            return Ok(News::Old);
        }
        let periods = stamp.seq.wrapping_sub(fresh.seq);
        (self.fresh, self.old) = (Some(stamp), None);
        self.counted_at_fresh = self.counted;
        Ok(News::Fresh { periods })
    }

    /// One old sample may be a frame that lay somewhere; a rig that counts anew was reset.
    fn restarted(&mut self, seq: u32, fresh: Stamp) -> Result<(), RunError> {
        let restart = match self.restart {
            Some(before) if seq.wrapping_sub(before.newest).wrapping_sub(1) < u32::MAX / 2 => {
                Restart {
                    newest: seq,
                    samples: before.samples + 1,
                    ..before
                }
            }
            Some(same) if seq == same.newest => same,
            _ if f64::from(seq) * self.period <= RESTARTED_WITHIN => Restart {
                first: seq,
                newest: seq,
                samples: 1,
            },
            _ => {
                self.restart = None;
                return Ok(());
            }
        };
        self.restart = Some(restart);
        if restart.samples < RESTART_EVIDENCE {
            return Ok(());
        }
        Err(RunError::RigReset {
            t: self.seconds(fresh.t_us),
            last: fresh.seq,
            seq: restart.first,
        })
    }

    /// A clock that jumps from one sample to the next.
    fn step(&self, stamp: Stamp, periods: u32) -> Result<(), RunError> {
        let seconds = |us: u64| us as f64 * 1e-6;
        let expected = f64::from(periods) * self.period;
        let step = seconds(stamp.t_us) - seconds(self.last.t_us) - expected;
        if step.abs() <= CLOCK_STEP.max(0.5 * expected) {
            return Ok(());
        }
        Err(RunError::RigClock {
            t: self.seconds(self.last.t_us),
            step,
        })
    }

    /// A clock that runs at another rate.
    fn compare(&mut self, stamp: Stamp, fresh: Stamp, now: Duration) -> Result<(), RunError> {
        let stamps = stamp.t_us as f64 * 1e-6 - self.first_us as f64 * 1e-6;
        let host = now.saturating_sub(self.begin).as_secs_f64();
        let t = self.seconds(stamp.t_us);
        let per_host = self.by_host.rate(host, stamps);
        let by_host = match self.clock {
            RigClock::Real => self.by_host.disagreement(host, stamps),
            RigClock::Emulated => None,
        };
        if let Some(per_period) = self.by_number.disagreement(self.counted, stamps) {
            let (mut rate, against) = match self.clock {
                RigClock::Real if per_host.is_finite() => (per_host, Against::Host),
                _ => (per_period, Against::Period),
            };
            // By the host's clock the stamps are right, or nearer to it than the numbers: so the period announced is
            // not.
            let numbers_per_host = per_host / per_period;
            if against == Against::Host && (rate - 1.0).abs() < (numbers_per_host - 1.0).abs() {
                let period_us = self.period * 1e6;
                return Err(RunError::RigPeriod {
                    t,
                    period_us,
                    actual_us: period_us * per_period,
                });
            }
            if stamp.t_us <= fresh.t_us {
                // What it does now, and not on the average.
                let back = (fresh.t_us - stamp.t_us) as f64 * 1e-6;
                rate = -back / (self.counted - self.counted_at_fresh);
            }
            return Err(RunError::RigTimeStamps { t, rate, against });
        }
        match by_host {
            Some(rate) => Err(RunError::RigTimeStamps {
                t,
                rate,
                against: Against::Host,
            }),
            None => Ok(()),
        }
    }
}
