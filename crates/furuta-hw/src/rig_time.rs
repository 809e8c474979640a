//! The rig's time in words: whose it is, what it is compared with, why a sample is no news.

use std::time::Duration;

/// Whose time the rig's clock shows.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum RigClock {
    /// That of every clock: it is compared with the host's.
    #[default]
    Real,
    /// That of an emulated rig, which stands still while its host or its machine is busy, or runs as fast as both can:
    /// only its time stamps and its numbers of samples are compared.
    Emulated,
}

impl RigClock {
    /// How long a run of `duration` may last on the host's clock. For a real rig half as much again and 2 s: more than
    /// its clock may be slow by before that is found (a third, 0.7 s, and the longest silence). For an emulated one ten
    /// times as long and a minute.
    #[must_use]
    pub fn longest(self, duration: Duration) -> Duration {
        let (factor, seconds) = match self {
            Self::Real => (1.5, 2.0),
            Self::Emulated => (10.0, 60.0),
        };
        let seconds = duration.as_secs_f64() * factor + seconds;
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }
}

/// What the time stamps are measured against.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Against {
    /// The host's monotonic clock.
    Host,
    /// The rig's own numbers of samples, a period each.
    Period,
}

impl std::fmt::Display for Against {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Host => "the host's clock",
            Self::Period => "its own samples' period",
        })
    }
}

/// What time stamps at this rate (1: microseconds) look like.
pub(crate) fn looks(rate: f64, against: Against) -> String {
    const UNITS: [(&str, &str, f64); 3] = [
        ("milliseconds", "ms", 1e-3),
        ("seconds", "s", 1e-6),
        ("nanoseconds", "ns", 1e3),
    ];
    let unit = UNITS
        .into_iter()
        .find(|(.., of)| (rate / of - 1.0).abs() < 0.25);
    match unit {
        Some((name, short, of)) => format!(
            "look like {name} ({:.3} of them per {short} of {against}; the protocol counts microseconds)",
            rate / of
        ),
        None if rate.abs() < 1e-9 => "stand still".to_owned(),
        None if rate < 0.0 => format!("run backwards ({rate:.3} us per us of {against})"),
        None => format!("run {rate:.3} times as fast as {against}"),
    }
}

/// Why the samples that come are no news.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum OldSample {
    /// The last one again.
    Repeated {
        /// Its number.
        seq: u32,
    },
    /// One of before.
    Number {
        /// Its number.
        seq: u32,
        /// That of the last that was news.
        last: u32,
    },
    /// A new number, and a time that is not newer.
    Time {
        /// Its time (us).
        t_us: u64,
        /// That of the last that was news.
        last_us: u64,
    },
}

impl std::fmt::Display for OldSample {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Repeated { seq } => write!(f, "sample {seq} comes again and again"),
            Self::Number { seq, last } => {
                write!(f, "sample {seq} comes after sample {last}")
            }
            Self::Time { t_us, last_us } if t_us == last_us => {
                write!(f, "the rig's time stamps stand still at {t_us} us")
            }
            Self::Time { t_us, last_us } => {
                write!(
                    f,
                    "the rig's time stamps went back from {last_us} to {t_us} us"
                )
            }
        }
    }
}
