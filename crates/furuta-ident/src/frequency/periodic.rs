//! The response to a periodic signal, a multisine above all: whole periods have no leakage, their spread is the noise,
//! and what repeats at harmonics that nothing excites is nonlinear distortion.

use nalgebra::Complex;
use realfft::RealFftPlanner;

use super::error::{FrequencyError, FrequencyNotice, LEAST_PERIOD};
use super::response::Frf;
use super::spectra::{self, Settings, Stretch};

/// Lines with less than this share of the strongest one's power are not excited.
const EXCITED: f64 = 1e-4;
/// A periodic input may differ by so much of its power from period to period: a loop's feedback, a missed command.
const REPEATS: f64 = 0.1;

/// The response at the excited lines, from whole periods, and what it says of nonlinear distortion.
///
/// `H = mean(Y) / mean(U)` over `M` periods, its variance from what each period leaves:
/// `sum |Y_m - H U_m|² / (M (M - 1) |mean U|²)`. Where the stretches have an external signal, the periodic one is that,
/// and the same quotient is the joint input-output estimate: what the controller adds to the input repeats with it or
/// averages out.
///
/// An input of odd harmonics alone, some of them left out, tells distortion from noise
/// ([`Harmonics::Detecting`](furuta_model::signals::Harmonics), Pintelon and Schoukens 2012, chapter 4): an even
/// nonlinearity shows at even harmonics, an odd one at the odd ones left out, and there as large as at their excited
/// neighbours, where it cannot be seen. It does not average out, so it is added to the deviation, and given apart in
/// [`Frf::distortion`].
///
/// `discard` periods at the start of each stretch are left out: those in which the start still rings.
///
/// ```
/// use furuta_ident::frequency::{Stretch, periodic};
/// // Two sines through y[k+1] = 0.5 y[k] + u[k], four periods of 50 samples.
/// use std::f64::consts::PI;
/// let u: Vec<f64> = (0..200).map(|k| 0.04 * PI * f64::from(k)).map(|p| p.sin() + (3.0 * p).cos()).collect();
/// let mut y = vec![0.0; 200];
/// for k in 0..199 {
///     y[k + 1] = 0.5 * y[k] + u[k];
/// }
/// let (frf, _) = periodic::response(&[Stretch { u: &u, y: &y, r: None }], 0.01, 0.5, 1)?;
/// assert_eq!(frf.frequency, [2.0, 6.0]);
/// let z = nalgebra::Complex::from_polar(1.0_f64, 0.04 * PI);
/// let exact = (z - 0.5).inv();
/// assert!((frf.response[0] - exact).norm() < 1e-9); // no leakage: exact but for the start, which died away
/// # Ok::<(), furuta_ident::frequency::FrequencyError>(())
/// ```
///
/// # Errors
/// A period that is no whole number of samples or with fewer than two periods left, an input that does not repeat, and
/// as [`Spectra::of`](super::Spectra::of).
pub fn response(
    stretches: &[Stretch<'_>],
    sample_period: f64,
    period: f64,
    discard: usize,
) -> Result<(Frf, Option<FrequencyNotice>), FrequencyError> {
    let samples = period / sample_period;
    let n = samples.round();
    // 1 % of a sample a period is 1 % of the phase at half the sampling rate.
    if !(n >= LEAST_PERIOD && (samples - n).abs() < 0.01) {
        return Err(FrequencyError::PeriodNotWhole {
            period,
            samples,
            sample_period,
        });
    }
    let n = n as usize;
    spectra::check(stretches, sample_period, &Settings::new(n))?;
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(n);
    let (mut time, mut scratch) = (fft.make_input_vec(), fft.make_scratch_vec());
    let mut transform = |signal: &[f64]| {
        let mut out = fft.make_output_vec();
        let mean = signal.iter().sum::<f64>() / n as f64;
        for (t, x) in time.iter_mut().zip(signal) {
            *t = x - mean;
        }
        // It fails on wrong lengths alone, and these are its own.
        let _ = fft.process_with_scratch(&mut time, &mut out, &mut scratch);
        out
    };
    // Each period's input, output and periodic signal.
    let mut periods = Vec::new();
    for s in stretches {
        for first in (discard..s.u.len() / n).map(|m| m * n) {
            let cut = |signal: &[f64]| signal[first..first + n].to_vec();
            let (u, y) = (transform(&cut(s.u)), transform(&cut(s.y)));
            let r = s.r.map_or_else(|| u.clone(), |r| transform(&cut(r)));
            periods.push((u, y, r));
        }
    }
    let count = periods.len();
    if count < 2 {
        return Err(FrequencyError::TooFewPeriods {
            found: count,
            period,
            discarded: discard,
        });
    }
    type Period = (Vec<Complex<f64>>, Vec<Complex<f64>>, Vec<Complex<f64>>);
    let mean = |part: fn(&Period) -> &[Complex<f64>], k: usize| {
        periods.iter().map(|p| part(p)[k]).sum::<Complex<f64>>() / count as f64
    };
    let lines = n / 2 + 1;
    let excitation: Vec<Complex<f64>> = (0..lines).map(|k| mean(|p| &p.2, k)).collect();
    let (mut all, mut differs) = (0.0, 0.0);
    for (_, _, r) in &periods {
        for k in 1..lines {
            all += r[k].norm_sqr();
            differs += (r[k] - excitation[k]).norm_sqr();
        }
    }
    if differs > REPEATS * all {
        return Err(FrequencyError::NotPeriodic {
            period,
            percent: 100.0 * differs / all,
        });
    }
    let strongest = excitation
        .iter()
        .skip(1)
        .map(|e| e.norm_sqr())
        .fold(0.0, f64::max);
    // Half the sampling rate has no phase.
    let (excited, silent): (Vec<usize>, Vec<usize>) = (1..lines)
        .filter(|k| 2 * k < n)
        .partition(|k| excitation[*k].norm_sqr() > EXCITED * strongest);
    let mut measured = Vec::with_capacity(excited.len());
    let mut frf = Frf {
        frequency: Vec::new(),
        response: Vec::new(),
        coherence: Vec::new(),
        std: Vec::new(),
        distortion: Vec::new(),
        averages: count as f64,
        lines_for_one: 1.0,
        sample_period,
        method: format!("{count} periods of {period} s"),
    };
    for k in excited {
        let (u, y) = (mean(|p| &p.0, k), mean(|p| &p.1, k));
        let h = y / u;
        let spread: f64 = periods
            .iter()
            .map(|p| (p.1[k] - h * p.0[k]).norm_sqr())
            .sum();
        let powers: [f64; 2] = [
            periods.iter().map(|p| p.2[k].norm_sqr()).sum(),
            periods.iter().map(|p| p.1[k].norm_sqr()).sum(),
        ];
        let cross: Complex<f64> = periods.iter().map(|p| p.2[k].conj() * p.1[k]).sum();
        let count = count as f64;
        frf.frequency.push(k as f64 / (n as f64 * sample_period));
        frf.response.push(h);
        frf.coherence
            .push((cross.norm_sqr() / (powers[0] * powers[1])).clamp(0.0, 1.0));
        frf.std
            .push((spread / (count * (count - 1.0) * u.norm_sqr())).sqrt());
        measured.push(Excited {
            harmonic: k,
            response: h,
            input: u,
        });
    }
    let harmonics: Vec<Silent> = silent
        .into_iter()
        .filter_map(|k| {
            let h = between(&measured, k)?;
            // What the input has there by feedback, the response answers.
            let own = |p: &Period| p.1[k] - h * p.0[k];
            let shown = periods.iter().map(own).sum::<Complex<f64>>() / count as f64;
            let spread: f64 = periods.iter().map(|p| (own(p) - shown).norm_sqr()).sum();
            Some(Silent {
                harmonic: k,
                power: shown.norm_sqr() / h.norm_sqr(),
                noise: spread / ((count * (count - 1)) as f64 * h.norm_sqr()),
            })
        })
        .collect();
    let found = Distortion::of(&measured, &harmonics, count);
    if let Some(found) = &found {
        for (std, odd) in frf.std.iter_mut().zip(&found.odd) {
            *std = std.hypot(*odd);
        }
        frf.distortion.clone_from(&found.odd);
    }
    Ok((frf, found.map(Distortion::notice)))
}

/// An excited harmonic, over the mean of all periods.
struct Excited {
    harmonic: usize,
    response: Complex<f64>,
    input: Complex<f64>,
}

/// A harmonic that nothing excites: what the output has there, as an input would have caused it.
struct Silent {
    harmonic: usize,
    /// Of the mean of all periods.
    power: f64,
    /// Of which noise.
    noise: f64,
}

/// The response at a harmonic between excited ones, in a straight line from one to the next; `None` outside them.
fn between(excited: &[Excited], k: usize) -> Option<Complex<f64>> {
    let after = excited.iter().position(|e| e.harmonic > k)?;
    let [a, b] = [excited.get(after.checked_sub(1)?)?, excited.get(after)?];
    let part = (k - a.harmonic) as f64 / (b.harmonic - a.harmonic) as f64;
    Some(a.response * (1.0 - part) + b.response * part)
}

/// Nonlinear distortion of a response to odd harmonics.
struct Distortion {
    /// Deviation of the response by it, by excited line; 0 where none was detected.
    odd: Vec<f64>,
    /// Shares of the excited harmonics' power, per harmonic, as an input would have caused them: of odd and even
    /// distortion, and of noise.
    shares: [f64; 3],
}

/// Detection lines whose mean tells the distortion at an excited one.
const BESIDE: usize = 3;
/// Silent harmonics on either side whose noise is taken together.
const AROUND: usize = 4;
/// The 95 % quantile of the normal distribution.
const QUANTILE: f64 = 1.645;

impl Distortion {
    /// `None` where the excited harmonics are not odd, or none is left out between them.
    fn of(excited: &[Excited], silent: &[Silent], periods: usize) -> Option<Self> {
        let odd: Vec<&Silent> = silent.iter().filter(|s| s.harmonic % 2 == 1).collect();
        if odd.len() < BESIDE || excited.iter().any(|e| e.harmonic % 2 == 0) {
            return None;
        }
        let even: Vec<&Silent> = silent.iter().filter(|s| s.harmonic % 2 == 0).collect();
        // Where there is nothing but noise, power over noise has the distribution F(2, 2 q); its mean over all lines is
        // compared with the 95 % quantile of that mean.
        let noise_at = |s: &Silent| {
            let at = silent.partition_point(|other| other.harmonic < s.harmonic);
            let beside = &silent[at.saturating_sub(AROUND)..(at + AROUND + 1).min(silent.len())];
            beside.iter().map(|s| s.noise).sum::<f64>() / beside.len() as f64
        };
        let count = odd.len() as f64;
        let ratio: f64 = odd
            .iter()
            .map(|s| s.power / noise_at(s).max(f64::MIN_POSITIVE))
            .sum::<f64>()
            / count;
        let q = ((2 * AROUND + 1) * (periods - 1)) as f64;
        let mean = q / (q - 1.0);
        let detected = ratio > mean * (1.0 + QUANTILE / count.sqrt());
        let excess = |of: &[&Silent]| -> f64 {
            let sum: f64 = of.iter().map(|s| s.power - s.noise).sum();
            (sum / of.len().max(1) as f64).max(0.0)
        };
        let level = |e: &Excited| {
            if !detected {
                return 0.0;
            }
            let mut near = odd.clone();
            near.sort_by_key(|s| s.harmonic.abs_diff(e.harmonic));
            near.truncate(BESIDE);
            e.response.norm() * (excess(&near) / e.input.norm_sqr()).sqrt()
        };
        let input = excited.iter().map(|e| e.input.norm_sqr()).sum::<f64>() / excited.len() as f64;
        let noise = silent.iter().map(|s| s.noise).sum::<f64>() / silent.len() as f64;
        Some(Self {
            odd: excited.iter().map(level).collect(),
            shares: [excess(&odd), excess(&even), noise].map(|power| power / input),
        })
    }

    fn notice(self) -> FrequencyNotice {
        let [odd, even, noise] = self.shares;
        FrequencyNotice::Distortion {
            detected: self.odd.iter().any(|d| *d > 0.0),
            odd,
            even,
            noise,
        }
    }
}
