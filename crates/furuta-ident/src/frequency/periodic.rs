//! The response to a periodic signal, a multisine above all: whole periods have no leakage, and their spread is the
//! noise.

use nalgebra::Complex;
use realfft::RealFftPlanner;

use super::error::FrequencyError;
use super::response::Frf;
use super::spectra::{self, Settings, Stretch};

/// Lines with less than this share of the strongest one's power are not excited.
const EXCITED: f64 = 1e-4;
/// A periodic input may differ by so much of its power from period to period: a loop's feedback, a missed command.
const REPEATS: f64 = 0.1;

/// The response at the excited lines, from whole periods.
///
/// `H = mean(Y) / mean(U)` over `M` periods, its variance from what each period leaves:
/// `sum |Y_m - H U_m|² / (M (M - 1) |mean U|²)`. Where the stretches have an external signal, the periodic one is that,
/// and the same quotient is the joint input-output estimate: what the controller adds to the input repeats with it or
/// averages out.
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
/// let frf = periodic::response(&[Stretch { u: &u, y: &y, r: None }], 0.01, 0.5, 1)?;
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
) -> Result<Frf, FrequencyError> {
    let samples = period / sample_period;
    let n = samples.round();
    // 1 % of a sample a period is 1 % of the phase at half the sampling rate.
    if !(n >= 8.0 && (samples - n).abs() < 0.01) {
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
    let mut frf = Frf {
        frequency: Vec::new(),
        response: Vec::new(),
        coherence: Vec::new(),
        std: Vec::new(),
        averages: count as f64,
        lines_for_one: 1.0,
        sample_period,
        method: format!("{count} periods of {period} s"),
    };
    // Half the sampling rate has no phase.
    for k in (1..lines).filter(|k| 2 * k < n && excitation[*k].norm_sqr() > EXCITED * strongest) {
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
    }
    Ok(frf)
}
