//! A sum of sines on a grid of frequencies.

use super::error::{SLOWEST, SignalError, frequency, size, within};
use super::random::uniform;
use super::{fraction, shown, sin_cos_turns};
use arrayvec::ArrayVec;
use core::f64::consts::{PI, TAU};
use core::fmt;

/// The most sines one signal can hold.
pub const MAX_LINES: usize = 128;

/// The highest multiple of the fundamental frequency.
const MAX_HARMONIC: u32 = 2048;

/// One sine: `cos(2 pi harmonic f0 t + phase)`.
#[derive(Copy, Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Line {
    /// Multiple of the fundamental frequency.
    pub harmonic: u32,
    /// Phase at the start, rad.
    pub phase: f64,
}

/// Which multiples of the fundamental frequency within the band.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Harmonics {
    /// All.
    All,
    /// The odd ones: what shows at an even one in the response is a nonlinearity that is even.
    Odd,
    /// The odd ones, of each four one left out at random (a seed): what the response has at those is a nonlinearity
    /// that is odd, what it has at even ones one that is even (Pintelon, Schoukens 2012, chapter 4).
    Detecting(u64),
    /// This many (or all, if there are no more), spaced as evenly in their logarithm as whole numbers can be.
    Logarithmic(usize),
}

/// Which phases.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Phases {
    /// Those of Schroeder (IEEE Trans. Inf. Theory 16 (1970) 85), `-pi i (i + 1) / N`, which keep the sines from adding
    /// up.
    Schroeder,
    /// Random ones of a seed: several signals with the same spectrum.
    Random(u64),
}

/// Sines of equal amplitude `rms sqrt(2 / N)` at whole multiples of a fundamental frequency `f0`.
///
/// The signal repeats after `1 / f0` seconds exactly. Over whole periods of a response in its steady state, a discrete
/// Fourier transform finds each sine in a bin of its own, so a frequency response is free of leakage. How well a
/// limited voltage is used is told by [`Multisine::crest_factor`]; `Multisine::optimised` (feature `std`) improves it.
///
/// ```
/// use furuta_model::signals::{Harmonics, Multisine, Phases};
/// let signal = Multisine::new(1.0, 0.1, 0.2, 6.0, Harmonics::Logarithmic(12), Phases::Schroeder)?;
/// assert_eq!(signal.period(), 10.0);
/// let n = 10_000;
/// let power = (0..n).map(|k| signal.volts(f64::from(k) * 1e-3).powi(2)).sum::<f64>() / f64::from(n);
/// assert!((power - 1.0).abs() < 1e-12);
/// assert_eq!(signal.to_string(), "12 sines from 0.2 to 6 Hz, 1 V RMS");
/// # Ok::<(), furuta_model::signals::SignalError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Multisine {
    rms: f64,
    fundamental: f64,
    pub(super) lines: ArrayVec<Line, MAX_LINES>,
}

impl Multisine {
    /// Name in one word.
    pub const NAME: &'static str = "multisine";

    /// Sines of `rms` (V) together, at multiples of `fundamental` (Hz) from `low` to `high` (Hz).
    ///
    /// # Errors
    /// An RMS outside [0, 1000] V; a fundamental outside [1e-4, 1e5] Hz; a band that is not `0 <= low <= high <= 2048
    /// fundamental`, holds no multiple of the fundamental, or more than [`MAX_LINES`]; no lines at all.
    pub fn new(
        rms: f64,
        fundamental: f64,
        low: f64,
        high: f64,
        harmonics: Harmonics,
        phases: Phases,
    ) -> Result<Self, SignalError> {
        let rms = size(Self::NAME, "rms", rms)?;
        let fundamental = frequency(Self::NAME, "fundamental", fundamental, SLOWEST)?;
        let highest = f64::from(MAX_HARMONIC) * fundamental;
        let high = within(Self::NAME, "high", high, [0.0, highest], "Hz")?;
        let low = within(Self::NAME, "low", low, [0.0, high], "Hz")?;
        // A band edge meant to be a multiple can be some bits beside it.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most MAX_HARMONIC
        let [first, last] = [
            libm::ceil(low / fundamental - 1e-9).max(1.0) as u32,
            libm::floor(high / fundamental + 1e-9) as u32,
        ];
        let all = first..last + 1;
        if let Harmonics::Logarithmic(most) = harmonics {
            // More of them than the band holds are all.
            let lines = most.min(MAX_LINES) as f64;
            within(Self::NAME, "lines", lines, [1.0, MAX_LINES as f64], "")?;
        }
        let lines = match harmonics {
            Harmonics::All => lines(all)?,
            Harmonics::Odd => lines(all.filter(|k| k % 2 == 1))?,
            Harmonics::Detecting(seed) => {
                let odd = all.filter(|k| k % 2 == 1).enumerate();
                let kept = odd.filter(|(i, _)| i % 4 != left_out(seed, i / 4));
                lines(kept.map(|(_, k)| k))?
            }
            Harmonics::Logarithmic(most) => lines(spaced(first, last, most.min(all.len())))?,
        };
        if lines.is_empty() {
            return Err(SignalError::NoHarmonic {
                fundamental,
                low,
                high,
            });
        }
        let mut signal = Self {
            rms,
            fundamental,
            lines,
        };
        signal.set_phases(phases);
        Ok(signal)
    }

    pub(super) fn set_phases(&mut self, phases: Phases) {
        let n = self.lines.len() as f64;
        for (i, line) in self.lines.iter_mut().enumerate() {
            line.phase = match phases {
                Phases::Schroeder => -PI * (i * (i + 1)) as f64 / n,
                Phases::Random(seed) => TAU * uniform(seed, i as u64),
            };
        }
    }

    /// Voltage (V) at time `t` (s).
    #[must_use]
    pub fn volts(&self, t: f64) -> f64 {
        let turn = fraction(t * self.fundamental);
        let sum: f64 = self
            .lines
            .iter()
            .map(|line| sin_cos_turns(f64::from(line.harmonic) * turn + line.phase / TAU).1)
            .sum();
        self.amplitude() * sum
    }

    /// The sines.
    #[must_use]
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Amplitude of each sine (V).
    #[must_use]
    pub fn amplitude(&self) -> f64 {
        self.rms * libm::sqrt(2.0 / self.lines.len() as f64)
    }

    /// Fundamental frequency (Hz).
    #[must_use]
    pub fn fundamental(&self) -> f64 {
        self.fundamental
    }

    /// The fundamental frequency (Hz) with which a run of `duration` s holds whole periods, each of 20 s at most: so
    /// its spectrum has no leakage, and longer runs hold several, whose spread shows the noise.
    ///
    /// ```
    /// use furuta_model::signals::Multisine;
    /// assert_eq!([10.0, 60.0, 70.0].map(Multisine::fundamental_for), [0.1, 0.05, 4.0 / 70.0]);
    /// ```
    #[must_use]
    pub fn fundamental_for(duration: f64) -> f64 {
        const LONGEST_PERIOD: f64 = 20.0;
        libm::ceil(duration / LONGEST_PERIOD) / duration
    }

    /// The time after which the signal repeats (s).
    #[must_use]
    pub fn period(&self) -> f64 {
        1.0 / self.fundamental
    }

    /// The highest frequency (Hz).
    #[must_use]
    pub fn highest(&self) -> f64 {
        f64::from(self.highest_harmonic()) * self.fundamental
    }

    /// Largest voltage over RMS voltage: 1.41 for one sine, `sqrt(2 N)` for `N` sines in phase.
    ///
    /// ```
    /// use furuta_model::signals::{Harmonics, Multisine, Phases};
    /// let sine = Multisine::new(2.0, 1.0, 1.0, 1.0, Harmonics::All, Phases::Random(7))?;
    /// assert!((sine.crest_factor() - 2.0_f64.sqrt()).abs() < 1e-3);
    /// # Ok::<(), furuta_model::signals::SignalError>(())
    /// ```
    #[must_use]
    pub fn crest_factor(&self) -> f64 {
        // Sixteen points in a period of the highest sine see its peak to 2 %; the parabola through three, to 1e-3.
        let points = 16 * u64::from(self.highest_harmonic());
        let sum = |i: u64| -> f64 {
            let cosine = |line: &Line| {
                let turn = (u64::from(line.harmonic) * i % points) as f64 / points as f64;
                sin_cos_turns(turn + line.phase / TAU).1
            };
            self.lines.iter().map(cosine).sum()
        };
        let (mut before, mut here) = (sum(points - 1), sum(0));
        let mut peak = 0.0_f64;
        for i in 0..points {
            let after = sum(i + 1);
            if here.abs() >= before.abs() && here.abs() >= after.abs() {
                let (slope, bend) = (after - before, after - 2.0 * here + before);
                let top = if bend == 0.0 {
                    here
                } else {
                    here - slope * slope / (8.0 * bend)
                };
                peak = peak.max(top.abs());
            }
            (before, here) = (here, after);
        }
        peak / libm::sqrt(0.5 * self.lines.len() as f64)
    }

    pub(super) fn highest_harmonic(&self) -> u32 {
        self.lines.last().map_or(1, |line| line.harmonic)
    }
}

/// Which of the four lines of a group is left out.
fn left_out(seed: u64, group: usize) -> usize {
    // Below 1, so below 4.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let place = (4.0 * uniform(seed, group as u64)) as usize;
    place
}

/// Sines at these harmonics, phase 0.
fn lines(harmonics: impl Iterator<Item = u32>) -> Result<ArrayVec<Line, MAX_LINES>, SignalError> {
    let mut lines = ArrayVec::new();
    let mut count = 0;
    for harmonic in harmonics {
        // One too many is counted and dropped.
        let _ = lines.try_push(Line {
            harmonic,
            phase: 0.0,
        });
        count += 1;
    }
    if count > MAX_LINES {
        return Err(SignalError::TooManyLines {
            lines: count,
            most: MAX_LINES,
        });
    }
    Ok(lines)
}

/// `count` different whole numbers from `first` to `last`, spaced as evenly in their logarithm as they can be; both
/// ends are among them where there are at least two.
fn spaced(first: u32, last: u32, count: usize) -> impl Iterator<Item = u32> {
    let ratio = libm::log(f64::from(last) / f64::from(first));
    let mut next = first;
    (0..count).map(move |i| {
        let part = i as f64 / (count as f64 - 1.0).max(1.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most MAX_HARMONIC
        let [ideal, left] = [
            libm::round(f64::from(first) * libm::exp(part * ratio)) as u32,
            (count - 1 - i) as u32,
        ];
        let k = ideal.max(next).min(last - left);
        next = k + 1;
        k
    })
}

/// With its lines, whose phases may have been optimised, and not with the arguments that once gave them.
#[cfg(feature = "std")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    rms: f64,
    fundamental: f64,
    lines: Vec<Line>,
}

#[cfg(feature = "std")]
impl serde::Serialize for Multisine {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let table = Table {
            rms: self.rms,
            fundamental: self.fundamental,
            lines: self.lines.to_vec(),
        };
        table.serialize(serializer)
    }
}

#[cfg(feature = "std")]
impl<'de> serde::Deserialize<'de> for Multisine {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let t = Table::deserialize(deserializer)?;
        let harmonics = || t.lines.iter().map(|line| line.harmonic);
        let rising = harmonics().zip(harmonics().skip(1)).all(|(a, b)| a < b);
        let sound = harmonics().all(|k| (1..=MAX_HARMONIC).contains(&k))
            && t.lines.iter().all(|line| line.phase.is_finite());
        if !(rising && sound) || t.lines.is_empty() {
            return Err(D::Error::custom(
                "multisine: its lines must be of rising harmonics from 1 to 2048, with finite phases",
            ));
        }
        let checked = || -> Result<Self, SignalError> {
            let mut lines = lines(harmonics())?;
            for (to, from) in lines.iter_mut().zip(&t.lines) {
                to.phase = from.phase;
            }
            Ok(Self {
                rms: size(Self::NAME, "rms", t.rms)?,
                fundamental: frequency(Self::NAME, "fundamental", t.fundamental, SLOWEST)?,
                lines,
            })
        };
        checked().map_err(D::Error::custom)
    }
}

impl fmt::Display for Multisine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lowest = self.lines.first().map_or(1, |line| line.harmonic);
        let low = shown(f64::from(lowest) * self.fundamental);
        let (high, rms) = (shown(self.highest()), shown(self.rms));
        match self.lines.len() {
            1 => write!(f, "1 sine of {low} Hz, {rms} V RMS"),
            n => write!(f, "{n} sines from {low} to {high} Hz, {rms} V RMS"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn signal(harmonics: Harmonics, phases: Phases) -> Multisine {
        Multisine::new(1.0, 0.25, 0.25, 8.0, harmonics, phases).expect("valid")
    }

    fn harmonics(signal: &Multisine) -> Vec<u32> {
        signal.lines().iter().map(|line| line.harmonic).collect()
    }

    #[test]
    fn grids() {
        assert_eq!(
            harmonics(&signal(Harmonics::All, Phases::Schroeder)),
            (1..=32).collect::<Vec<_>>()
        );
        let odd: Vec<u32> = (1..32).step_by(2).collect();
        assert_eq!(harmonics(&signal(Harmonics::Odd, Phases::Schroeder)), odd);
        for seed in 0..20 {
            let kept = harmonics(&signal(Harmonics::Detecting(seed), Phases::Schroeder));
            assert!(kept.iter().all(|k| odd.contains(k)));
            // Of each whole group of four one is left out, of a part of one at most one.
            for group in odd.chunks(4) {
                let left_out = group.iter().filter(|k| !kept.contains(k)).count();
                assert!(
                    left_out == 1 || group.len() < 4 && left_out == 0,
                    "{seed}: {group:?}"
                );
            }
        }
        let few = harmonics(&signal(Harmonics::Logarithmic(6), Phases::Schroeder));
        assert_eq!(few, [1, 2, 4, 8, 16, 32]);
        let more = harmonics(&signal(Harmonics::Logarithmic(100), Phases::Schroeder));
        assert_eq!(more, (1..=32).collect::<Vec<_>>());
        let one = Multisine::new(
            1.0,
            1.0,
            3.0,
            3.0,
            Harmonics::Logarithmic(1),
            Phases::Schroeder,
        );
        assert_eq!(harmonics(&one.expect("one")), [3]);
        // 0.1 * 3 is not 0.3: the edge counts all the same.
        let edges = Multisine::new(1.0, 0.1, 0.3, 0.7, Harmonics::All, Phases::Schroeder);
        assert_eq!(harmonics(&edges.expect("five")), [3, 4, 5, 6, 7]);
    }

    #[test]
    fn schroeder_phases_keep_peaks_low() {
        // Zero phases would add up to sqrt(2 * 32) = 8 times the RMS.
        let crest = signal(Harmonics::All, Phases::Schroeder).crest_factor();
        assert!((1.41..1.8).contains(&crest), "{crest}");
        let random = signal(Harmonics::All, Phases::Random(1)).crest_factor();
        assert!((1.8..4.5).contains(&random), "{random}");
    }

    proptest! {
        #[test]
        fn logarithmic_grids_rise_from_end_to_end(first in 1_u32..100, more in 1_u32..1000, part in 0.0..1.0_f64) {
            let last = first + more;
            let count = 2 + (part * f64::from(more - 1)) as usize;
            let grid: Vec<u32> = spaced(first, last, count).collect();
            prop_assert!(grid.len() == count && grid[0] == first && grid[count - 1] == last);
            prop_assert!(grid.windows(2).all(|pair| pair[0] < pair[1]));
        }

        #[test]
        fn repeats_after_its_period(seed: u64, t in 0.0..100.0_f64) {
            let signal = signal(Harmonics::All, Phases::Random(seed));
            // 2 pi 8 Hz times the rounding of t near 100 s
            prop_assert!((signal.volts(t) - signal.volts(t + signal.period())).abs() < 1e-11);
        }

        #[test]
        fn nothing_exceeds_the_crest_factor(seed: u64, t in 0.0..4.0_f64) {
            let signal = signal(Harmonics::Odd, Phases::Random(seed));
            prop_assert!(signal.volts(t).abs() <= 1.001 * signal.crest_factor());
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let new = |f0, low, high, h| {
            Multisine::new(1.0, f0, low, high, h, Phases::Schroeder)
                .expect_err("refused")
                .to_string()
        };
        assert!(
            new(1.0, 0.2, 0.8, Harmonics::All)
                .contains("no multiple of 1 Hz lies between 0.2 and 0.8 Hz")
        );
        assert!(new(1.0, 2.0, 2.0, Harmonics::Odd).contains("no multiple"));
        assert!(
            new(1.0, 2.0, 5.0, Harmonics::Logarithmic(0))
                .contains("lines = 0 is outside the allowed range [1, 128]")
        );
        assert!(
            new(0.01, 0.0, 8.0, Harmonics::All).contains("800 sines are too many (at most 128)")
        );
        assert!(
            new(0.01, 0.1, 8.0, Harmonics::Logarithmic(200))
                .contains("200 sines are too many (at most 128)")
        );
        assert!(
            new(1.0, 6.0, 5.0, Harmonics::All)
                .contains("low = 6 is outside the allowed range [0, 5] Hz")
        );
        assert!(new(1e-4, 0.0, 8.0, Harmonics::All).contains("high = 8"));
        assert!(new(0.0, 0.0, 8.0, Harmonics::All).contains("fundamental = 0"));
        assert!(new(1.0, f64::NAN, 8.0, Harmonics::All).contains("low = NaN"));
    }
}
