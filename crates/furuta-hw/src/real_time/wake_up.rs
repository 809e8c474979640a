//! Waking up on time, and how late that is.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use furuta_log::Histogram;

/// Wakes its thread at multiples of an interval, by absolute deadlines on the monotonic clock (`clock_nanosleep` with
/// `TIMER_ABSTIME`): lateness does not add up, and steps of the time of day do nothing.
///
/// ```
/// use furuta_hw::Metronome;
/// use std::time::{Duration, Instant};
/// let begin = Instant::now();
/// let mut metronome = Metronome::new(Duration::from_millis(2));
/// for _ in 0..5 {
///     metronome.wait();
/// }
/// assert!(begin.elapsed() >= Duration::from_millis(10));
/// ```
#[derive(Copy, Clone, Debug)]
pub struct Metronome {
    due: clock::Time,
    interval: Duration,
}

/// One wake-up.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct WakeUp {
    /// How long after its deadline the thread was running.
    pub late: Duration,
    /// Deadlines left out because they had passed by then.
    pub missed: u64,
}

impl Metronome {
    /// The first deadline is an interval from now; an interval of 0 counts as 1 us.
    #[must_use]
    pub fn new(interval: Duration) -> Self {
        let interval = interval.max(Duration::from_micros(1));
        Self {
            due: clock::now() + interval,
            interval,
        }
    }

    /// Sleeps until the next deadline.
    pub fn wait(&mut self) -> WakeUp {
        clock::sleep_until(self.due);
        let now = clock::now();
        let late = now.saturating_sub(self.due);
        self.due += self.interval;
        let mut missed = 0;
        while self.due < now {
            self.due += self.interval;
            missed += 1;
        }
        WakeUp { late, missed }
    }
}

/// Times since the clock's own beginning.
#[cfg(target_os = "linux")]
mod clock {
    use std::time::Duration;

    use rustix::thread::{ClockId as SleepClock, clock_nanosleep_absolute};
    use rustix::time::{ClockId, Timespec, clock_gettime};

    pub(super) type Time = Duration;

    pub(super) fn now() -> Time {
        let now = clock_gettime(ClockId::Monotonic);
        // Neither is ever negative on this clock.
        Duration::new(
            now.tv_sec.unsigned_abs(),
            u32::try_from(now.tv_nsec).unwrap_or(0),
        )
    }

    pub(super) fn sleep_until(due: Time) {
        let at = Timespec {
            tv_sec: due.as_secs().cast_signed(),
            tv_nsec: due.subsec_nanos().into(),
        };
        // A signal may end the sleep early.
        while clock_nanosleep_absolute(SleepClock::Monotonic, &at).is_err() && now() < due {}
    }
}

/// Without absolute deadlines: from now on until then.
#[cfg(not(target_os = "linux"))]
mod clock {
    use std::sync::OnceLock;
    use std::time::{Duration, Instant};

    pub(super) type Time = Duration;

    pub(super) fn now() -> Time {
        static BEGIN: OnceLock<Instant> = OnceLock::new();
        BEGIN.get_or_init(Instant::now).elapsed()
    }

    pub(super) fn sleep_until(due: Time) {
        std::thread::sleep(due.saturating_sub(now()));
    }
}

/// Wakes up `loops` times and returns how late each was, and how many deadlines were missed. `stop` ends it early.
///
/// ```
/// use furuta_hw::measure_wake_up;
/// use std::time::Duration;
/// let (late, missed) = measure_wake_up(Duration::from_millis(1), 20, None);
/// assert_eq!(late.count(), 20);
/// assert!(late.max() >= late.quantile(0.5) && missed < 10_000);
/// ```
#[must_use]
pub fn measure_wake_up(
    interval: Duration,
    loops: u64,
    stop: Option<&AtomicBool>,
) -> (Histogram, u64) {
    let (mut late, mut missed) = (Histogram::new(), 0);
    let mut metronome = Metronome::new(interval);
    for _ in 0..loops {
        if stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            break;
        }
        let wake_up = metronome.wait();
        late.record(u64::try_from(wake_up.late.as_nanos()).unwrap_or(u64::MAX));
        missed += wake_up.missed;
    }
    (late, missed)
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    #[test]
    fn deadlines_that_passed_are_left_out_and_the_beat_goes_on() {
        let interval = Duration::from_millis(5);
        let begin = Instant::now();
        let mut metronome = Metronome::new(interval);
        metronome.wait();
        std::thread::sleep(Duration::from_millis(52));
        let after = metronome.wait();
        assert!(
            after.missed >= 9 && after.late >= Duration::from_millis(40),
            "{after:?}"
        );
        let missed = after.missed + metronome.wait().missed;
        // Three beats, and those left out: each at its multiple of the interval, or later.
        assert!(begin.elapsed() >= interval * u32::try_from(3 + missed).expect("few"));
    }
}
