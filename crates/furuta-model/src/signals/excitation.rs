//! A signal with an end, ramps in and out, and a limit: what a run is given.

use super::error::{SignalError, seconds, size, within};
use super::{Signal, shown, sin_cos_turns};
use core::fmt;

const NAME: &str = "excitation";

/// A signal with an end, ramps in and out, and a limit.
///
/// `volts(t) = clamp(envelope(t) signal(t), -limit, limit)`. The envelope is one from end to end unless ramps are asked
/// for: then it rises and falls as half a cosine (a Tukey window), without a jump in its slope. It is 0 before the
/// start, after the end, and at a time that is no number. Ramps spare the rig a jolt; a frequency response from whole
/// periods of a [`super::Multisine`] is better taken without them.
///
/// ```
/// use furuta_model::signals::{Excitation, Step};
/// let plain = Excitation::new(Step::new(2.0, 0.0)?, 4.0)?;
/// assert_eq!([-0.1, 0.0, 4.0, 4.1, f64::NAN].map(|t| plain.volts(t)), [0.0, 2.0, 2.0, 0.0, 0.0]);
/// let soft = plain.faded(1.0, 0.5)?;
/// assert_eq!(soft.volts(0.0), 0.0);
/// assert!((soft.volts(0.5) - 1.0).abs() < 1e-12); // half the way at half the ramp
/// assert!((soft.volts(3.75) - 1.0).abs() < 1e-12);
/// assert_eq!(soft.to_string(), "step of 2 V, 4 s, ramped in over 1 s and out over 0.5 s");
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Excitation {
    signal: Signal,
    duration: f64,
    fade_in: f64,
    fade_out: f64,
    limit: f64,
}

impl Excitation {
    /// A signal that lasts `duration` seconds.
    ///
    /// # Errors
    /// A duration outside [1e-6, 1e6] s.
    pub fn new(signal: impl Into<Signal>, duration: f64) -> Result<Self, SignalError> {
        Ok(Self {
            signal: signal.into(),
            duration: seconds(NAME, "duration", duration)?,
            fade_in: 0.0,
            fade_out: 0.0,
            limit: f64::INFINITY,
        })
    }

    /// The same, ramped in and out over this time, s; 0 for a step.
    ///
    /// # Errors
    /// A ramp that is negative or longer than the signal, or both together longer.
    pub fn faded(self, fade_in: f64, fade_out: f64) -> Result<Self, SignalError> {
        let fade_in = within(NAME, "fade-in", fade_in, [0.0, self.duration], "s")?;
        let left = self.duration - fade_in;
        let fade_out = within(NAME, "fade-out", fade_out, [0.0, left], "s")?;
        Ok(Self {
            fade_in,
            fade_out,
            ..self
        })
    }

    /// The same, clipped at plus and minus `limit` (V).
    ///
    /// # Errors
    /// A limit outside [0, 1000] V.
    pub fn limited(self, limit: f64) -> Result<Self, SignalError> {
        let limit = size(NAME, "limit", limit)?;
        Ok(Self { limit, ..self })
    }

    /// Voltage (V) at time `t` (s) since the start; 0 before it, after the end, and where `t` is no number.
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        if t >= 0.0 && t <= self.duration {
            (self.envelope(t) * self.signal.volts(t)).clamp(-self.limit, self.limit)
        } else {
            0.0
        }
    }

    /// The signal inside.
    #[must_use]
    pub fn signal(&self) -> &Signal {
        &self.signal
    }

    /// How long it lasts (s).
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Whether samples `period` (s) apart can follow the signal.
    ///
    /// # Errors
    /// As [`Signal::check_sample_period`].
    pub fn check_sample_period(&self, period: f64) -> Result<(), SignalError> {
        self.signal.check_sample_period(period)
    }

    fn envelope(&self, t: f64) -> f64 {
        let (since, left) = (t, self.duration - t);
        let mut envelope = 1.0;
        if since < self.fade_in {
            envelope *= half_cosine(since / self.fade_in);
        }
        if left < self.fade_out {
            envelope *= half_cosine(left / self.fade_out);
        }
        envelope
    }
}

/// From 0 at 0 to 1 at 1.
fn half_cosine(x: f64) -> f64 {
    0.5 - 0.5 * sin_cos_turns(0.5 * x).1
}

/// JSON has no infinity: no limit is none.
#[cfg(feature = "std")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    signal: Signal,
    duration: f64,
    fade_in: f64,
    fade_out: f64,
    limit: Option<f64>,
}

#[cfg(feature = "std")]
impl serde::Serialize for Excitation {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let table = Table {
            signal: self.signal.clone(),
            duration: self.duration,
            fade_in: self.fade_in,
            fade_out: self.fade_out,
            limit: self.limit.is_finite().then_some(self.limit),
        };
        table.serialize(serializer)
    }
}

#[cfg(feature = "std")]
impl<'de> serde::Deserialize<'de> for Excitation {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let t = Table::deserialize(deserializer)?;
        Self::new(t.signal, t.duration)
            .and_then(|plain| plain.faded(t.fade_in, t.fade_out))
            .and_then(|soft| {
                t.limit
                    .map_or(Ok(soft.clone()), |limit| soft.limited(limit))
            })
            .map_err(serde::de::Error::custom)
    }
}

/// In words, with units.
impl fmt::Display for Excitation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} s", self.signal, shown(self.duration))?;
        if self.fade_in > 0.0 || self.fade_out > 0.0 {
            let (rise, fall) = (shown(self.fade_in), shown(self.fade_out));
            write!(f, ", ramped in over {rise} s and out over {fall} s")?;
        }
        if self.limit < f64::INFINITY {
            write!(f, ", clipped at {} V", shown(self.limit))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Chirp, Noise, Step, Sweep};
    use super::*;
    use proptest::prelude::*;

    fn step() -> Excitation {
        Excitation::new(Step::new(3.0, 0.0).expect("valid"), 10.0).expect("valid")
    }

    proptest! {
        #[test]
        fn never_beyond_its_limit(seed in 0_u64..1000, limit in 0.0..2.0_f64, t in -1.0..11.0_f64) {
            let noise = Noise::new(1.0, 0.5, 8.0, seed).expect("valid");
            let signal = Excitation::new(noise, 10.0).and_then(|s| s.limited(limit)).expect("valid");
            prop_assert!(signal.volts(t).abs() <= limit);
            prop_assert!((0.0..=10.0).contains(&t) || signal.volts(t) == 0.0);
        }

        #[test]
        fn a_ramp_never_falls_on_its_way_in(a in 0.0..2.0_f64, b in 0.0..2.0_f64) {
            let soft = step().faded(2.0, 3.0).expect("valid");
            let (early, late) = (a.min(b), a.max(b));
            prop_assert!(soft.volts(early) <= soft.volts(late));
            prop_assert!((soft.volts(10.0 - 1.5 * early) - soft.volts(early)).abs() < 1e-12);
        }
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_range() {
        let error = |r: Result<Excitation, SignalError>| r.expect_err("refused").to_string();
        assert_eq!(
            error(Excitation::new(Step::new(1.0, 0.0).expect("valid"), 0.0)),
            "excitation: duration = 0 is outside the allowed range [0.000001, 1000000] s"
        );
        assert_eq!(
            error(step().faded(6.0, 5.0)),
            "excitation: fade-out = 5 is outside the allowed range [0, 4] s"
        );
        assert!(error(step().faded(f64::NAN, 0.0)).contains("fade-in = NaN"));
        assert!(error(step().limited(-1.0)).contains("limit = -1"));
        let chirp = Chirp::new(1.0, 0.0, 50.0, 10.0, Sweep::Linear).expect("valid");
        let chirp = Excitation::new(chirp, 10.0).expect("valid");
        assert!(chirp.check_sample_period(0.01).is_err());
        assert!(chirp.check_sample_period(0.009).is_ok());
        assert!(chirp.check_sample_period(f64::NAN).is_err());
    }
}
