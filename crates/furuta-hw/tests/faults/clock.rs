//! A rig whose clock is wrong, or that says the same for ever: the motor goes off, and soon. The host's clock is the
//! emulated rig's true time here, so each run is the same every time.

use std::time::{Duration, Instant};

use furuta_hw::{
    Against, EmulatedRig, EmulatedTransport, Emulation, End, LoopSettings, OldSample, RigClock,
    RunError, Summary, Transport, TransportError,
};
use furuta_wire::{Decoder, MAX_FRAME, Message, Sample, encode};

use super::common::{Constant, settings, srv02, unlogged};
use super::link;

/// What the rig says, altered on its way; and the host's time at each sample.
pub(crate) struct Altered<F> {
    pub(crate) transport: EmulatedTransport,
    decoder: Decoder,
    samples: u32,
    alter: F,
    /// The host's time (s) at this of the rig's.
    host: fn(f64) -> f64,
    began: Instant,
    written: u32,
}

impl<F: FnMut(u32, Sample) -> Option<Sample>> Altered<F> {
    /// Passes sample number k (from 0) on as `alter(k, sample)`.
    pub(crate) fn new(rig: EmulatedRig, alter: F) -> Self {
        let transport = EmulatedTransport::new(rig);
        Self {
            began: transport.now(),
            transport,
            decoder: Decoder::new(),
            samples: 0,
            alter,
            host: |t| t,
            written: 0,
        }
    }
}

impl<F: FnMut(u32, Sample) -> Option<Sample>> Transport for Altered<F> {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let mut raw = [0; 64];
        let n = self.transport.read(&mut raw, timeout)?;
        let mut filled = 0;
        for &byte in &raw[..n] {
            let message = match self.decoder.push(byte) {
                Some(Ok(Message::Sample(sample))) => {
                    self.samples += 1;
                    (self.alter)(self.samples - 1, sample).map(Message::Sample)
                }
                Some(Ok(other)) => Some(other),
                _ => None,
            };
            let Some(message) = message else { continue };
            let mut frame = [0; MAX_FRAME];
            let frame = encode(&message, &mut frame).expect("fits");
            buffer[filled..filled + frame.len()].copy_from_slice(frame);
            filled += frame.len();
        }
        Ok(filled)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.written += 1;
        self.transport.write(bytes)
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        self.transport.discard_input()
    }

    fn now(&self) -> Instant {
        let rig = self.transport.now().duration_since(self.began);
        self.began + Duration::from_secs_f64((self.host)(rig.as_secs_f64()))
    }
}

/// A rig whose watchdog never acts: what switches it off is the host.
fn without_watchdog() -> EmulatedRig {
    let emulation = Emulation {
        watchdog_periods: u16::MAX,
        ..Emulation::default()
    };
    EmulatedRig::new(&srv02(), &emulation).expect("valid")
}

fn three_seconds() -> LoopSettings<'static> {
    LoopSettings {
        clock: RigClock::Real,
        silence: LoopSettings::SILENCE,
        ..settings(3.0)
    }
}

/// A run of 3 s that drives with 1 V; how long it lasted on the host's clock. Afterwards the motor is off, by the
/// host's word.
fn drive(
    alter: impl FnMut(u32, Sample) -> Option<Sample>,
    host: fn(f64) -> f64,
    settings: &LoopSettings<'_>,
) -> (Summary, f64) {
    let mut line = Altered {
        host,
        ..Altered::new(without_watchdog(), alter)
    };
    let (summary, lasted) = {
        let (mut link, hello) = link(&mut line);
        let begin = link.now();
        let summary = unlogged(&mut link, &hello, &Constant(1.0), settings);
        (summary, link.now().duration_since(begin).as_secs_f64())
    };
    assert_eq!(line.transport.rig().tick().volts, 0.0, "{:?}", summary.end);
    let longest = settings.clock.longest(settings.duration).as_secs_f64();
    assert!(lasted <= longest + 0.01, "{lasted} s");
    (summary, lasted)
}

fn with_time(mut t_us: impl FnMut(u64) -> u64) -> impl FnMut(u32, Sample) -> Option<Sample> {
    move |_, sample| {
        Some(Sample {
            t_us: t_us(sample.t_us),
            ..sample
        })
    }
}

/// The rate that ends the run, and what one reads.
fn wrong_rate(summary: &Summary) -> (f64, String) {
    match summary.error() {
        Some(error @ RunError::RigTimeStamps { rate, against, .. }) => {
            assert_eq!(*against, Against::Host);
            (*rate, error.to_string())
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn time_stamps_in_another_unit_end_the_run() {
    type Unit = fn(u64) -> u64;
    let units: [(Unit, f64, &str); 5] = [
        (|t| t / 1000, 1e-3, "look like milliseconds (1.0"),
        (|t| t * 1000, 1e3, "look like nanoseconds"),
        (|t| 7_000_000 + t / 1_000_000, 1e-6, ""),
        (
            |t| t * 10,
            10.0,
            "run 10.000 times as fast as the host's clock",
        ),
        (
            |t| t / 10,
            0.1,
            "run 0.100 times as fast as the host's clock",
        ),
    ];
    for (unit, rate, says) in units {
        let (summary, lasted) = drive(with_time(unit), |t| t, &three_seconds());
        if says.is_empty() {
            // Within a second these stand still.
            let (found, text) = wrong_rate(&summary);
            assert!(found == 0.0 && text.contains("stand still"), "{text}");
        } else {
            match summary.error() {
                // A thousand times too fast is a step at every sample.
                Some(RunError::RigClock { .. }) => assert_eq!(rate, 1e3),
                _ => {
                    let (found, text) = wrong_rate(&summary);
                    assert!((found / rate - 1.0).abs() < 0.05, "{found}");
                    assert!(
                        text.contains(says) && text.contains("microseconds"),
                        "{text}"
                    );
                }
            }
        }
        assert!(lasted < 0.5, "{rate}: {lasted} s");
    }
}

#[test]
fn a_clock_that_stands_still_or_creeps_back_ends_the_run() {
    let frozen = with_time(|_| 5_000_000);
    let mut t = 5_000_000;
    let back = with_time(move |_| {
        t -= 1;
        t
    });
    let (summary, lasted) = drive(frozen, |t| t, &three_seconds());
    let (rate, text) = wrong_rate(&summary);
    assert!(rate == 0.0 && text.contains("stand still"), "{text}");
    assert!(summary.samples == 1 && lasted < 0.3, "{summary:?}");
    let (summary, lasted) = drive(back, |t| t, &three_seconds());
    let (rate, text) = wrong_rate(&summary);
    assert!(rate < 0.0 && text.contains("run backwards"), "{text}");
    assert!(summary.samples == 1 && lasted < 0.3, "{summary:?}");
    // Two seconds later: no sample is news, so there is no command either.
    let later = with_time(|t| t.min(2_000_000));
    let (summary, lasted) = drive(later, |t| t, &three_seconds());
    let (rate, text) = wrong_rate(&summary);
    assert!(rate == 0.0 && text.contains("stand still"), "{text}");
    assert!(summary.samples == 1001 && lasted < 2.7, "{summary:?}");
}

/// Ticks, time stamps and the period announced agree, and all of them are wrong.
#[test]
fn a_rig_at_another_speed_than_the_hosts_clock_ends_the_run() {
    type Host = fn(f64) -> f64;
    let speeds: [(Host, f64, f64); 6] = [
        (|t| 2.0 * t, 0.5, 3.0),
        (|t| 0.5 * t, 2.0, 1.0),
        (|t| 10.0 * t, 0.1, 1.5),
        (|t| 0.1 * t, 10.0, 0.2),
        (|t| 1.5 * t, 1.0 / 1.5, 7.0),
        (|t| t / 1.5, 1.5, 2.1),
    ];
    let ten_seconds = LoopSettings {
        duration: Duration::from_secs(10),
        ..three_seconds()
    };
    for (host, rate, within) in speeds {
        let (summary, lasted) = drive(|_, s| Some(s), host, &ten_seconds);
        let (found, _) = wrong_rate(&summary);
        assert!((found / rate - 1.0).abs() < 0.05, "{found}");
        assert!(lasted < within, "{rate}: {lasted} s");
    }
}

#[test]
fn another_period_than_announced_is_named() {
    // Every fifth sample of 2 ms is sent, numbered on: 10 ms.
    let fifth = |k: u32, sample: Sample| {
        k.is_multiple_of(5).then_some(Sample {
            seq: k / 5,
            ..sample
        })
    };
    let (summary, lasted) = drive(fifth, |t| t, &three_seconds());
    match summary.error() {
        Some(error @ RunError::RigPeriod { actual_us, .. }) => {
            assert!((actual_us - 10_000.0).abs() < 100.0, "{error}");
            assert!(error.to_string().contains("period_us = 2000"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    assert!(lasted < 0.5, "{lasted}");
}

#[test]
fn one_sample_repeated_for_ever_ends_the_run() {
    // The first of all, and one in mid-run.
    let mut first = None;
    let from_the_first = move |_: u32, sample: Sample| Some(*first.get_or_insert(sample));
    let mut middle = None;
    let from_the_middle = move |k: u32, sample: Sample| match k {
        0..300 => Some(sample),
        _ => Some(*middle.get_or_insert(sample)),
    };
    for (samples, (summary, lasted)) in [
        (1, drive(from_the_first, |t| t, &three_seconds())),
        (250, drive(from_the_middle, |t| t, &three_seconds())),
    ] {
        match summary.error() {
            Some(error @ RunError::OldSamples { why, .. }) => {
                assert!(matches!(why, OldSample::Repeated { .. }), "{error}");
                assert!(
                    error.to_string().contains("comes again and again"),
                    "{error}"
                );
            }
            other => panic!("{other:?}"),
        }
        assert!(
            summary.samples >= samples && summary.old > 200,
            "{summary:?}"
        );
        assert!(lasted < 1.3, "{lasted}");
    }
}

/// A repeated sample gets no command: the rig's watchdog hears nothing.
#[test]
fn an_old_sample_gets_no_command() {
    let mut first = None;
    let mut line = Altered::new(without_watchdog(), move |k, sample| match k {
        0..100 => Some(sample),
        _ => Some(*first.get_or_insert(sample)),
    });
    let (mut link, hello) = link(&mut line);
    let summary = unlogged(&mut link, &hello, &Constant(1.0), &three_seconds());
    let answered = summary.samples as u32;
    // What it took to connect, an answer to each that was news, and 0 V three times.
    assert!(
        (answered + 3..answered + 10).contains(&line.written),
        "{answered} {}",
        line.written
    );
}

/// The last line: whatever is wrong, a run does not last.
#[test]
fn a_run_has_an_end_on_the_hosts_clock() {
    let mut first = None;
    let repeated = move |_: u32, sample: Sample| Some(*first.get_or_insert(sample));
    let patient = LoopSettings {
        silence: Duration::MAX,
        ..three_seconds()
    };
    let (summary, lasted) = drive(repeated, |t| t, &patient);
    match summary.error() {
        Some(error @ RunError::Overtime { duration, .. }) => {
            assert_eq!(*duration, Duration::from_secs(3));
            assert!(error.to_string().contains("has lasted 6.5 s"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    assert!((6.5..6.51).contains(&lasted), "{lasted}");
    // Nothing at all.
    let (summary, lasted) = drive(|k, s| Some(s).filter(|_| k < 100), |t| t, &patient);
    assert!(matches!(summary.error(), Some(RunError::Overtime { .. })));
    assert!((6.5..6.51).contains(&lasted), "{lasted}");
}

/// Samples that are too few and far between are silence, or a clock that is slow.
#[test]
fn samples_that_come_too_slowly_end_the_run() {
    let (summary, lasted) = drive(|_, s| Some(s), |t| 200.0 * t, &three_seconds());
    let (rate, _) = wrong_rate(&summary);
    assert!(
        (rate - 0.005).abs() < 1e-3 && lasted < 2.0,
        "{rate} {lasted}"
    );
}

/// What is allowed: a crystal's drift, a period that the timer does not meet exactly, a host that is busy now and then.
#[test]
fn drift_and_jitter_pass() {
    type Host = fn(f64) -> f64;
    let hosts: [Host; 4] = [
        |t| t * (1.0 + 1e-4),
        |t| t * (1.0 - 1e-4),
        |t| t * 1.1,
        // Busy for 0.4 s in every second: what came meanwhile is read at once.
        |t| if t % 1.0 < 0.4 { t - t % 1.0 + 0.4 } else { t },
    ];
    let minute = LoopSettings {
        duration: Duration::from_secs(60),
        ..three_seconds()
    };
    for host in hosts {
        let mut line = Altered {
            host,
            ..Altered::new(without_watchdog(), |_, s| Some(s))
        };
        let (mut link, hello) = link(&mut line);
        let summary = unlogged(&mut link, &hello, &Constant(0.0), &minute);
        assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
        assert_eq!((summary.samples, summary.old), (30_001, 0));
    }
    // 2 ms announced, 2.08 ms kept.
    let slow = with_time(|t| t / 2000 * 2080);
    let (summary, _) = drive(slow, |t| t * 1.04, &three_seconds());
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
}

/// One sample of before, or one without a newer time, is left out and counted: no restart, no end.
#[test]
fn one_stale_sample_is_no_restart() {
    let mut old = None;
    let stale = move |k: u32, sample: Sample| match k {
        3 => {
            old = Some(sample);
            Some(sample)
        }
        700 | 800 | 900 => old,
        1000 => Some(Sample {
            t_us: sample.t_us - 2000,
            ..sample
        }),
        _ => Some(sample),
    };
    let (summary, _) = drive(stale, |t| t, &three_seconds());
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    assert_eq!((summary.old, summary.lost), (4, 4));
}
