//! Averaged spectra (Welch), as SciPy's `csd` computes them.

use nalgebra::Complex;
use realfft::RealFftPlanner;

use super::error::FrequencyError;
use super::window::Window;

/// How spectra are averaged.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Settings {
    /// Samples in a segment (SciPy: `nperseg`); lines lie `1 / (segment h)` Hz apart.
    pub segment: usize,
    /// Samples that a segment shares with the next (SciPy: `noverlap`).
    pub overlap: usize,
    /// The window on each segment, from which its mean was taken away before (SciPy: `detrend="constant"`).
    pub window: Window,
}

impl Settings {
    /// Segments of this many samples, half overlapping, under Hann's window.
    #[must_use]
    pub fn new(segment: usize) -> Self {
        Self {
            segment,
            overlap: segment / 2,
            window: Window::Hann,
        }
    }
}

/// Signals taken together, evenly sampled, without a gap.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Stretch<'a> {
    /// The plant's input.
    pub u: &'a [f64],
    /// Its output.
    pub y: &'a [f64],
    /// What no controller chose: the input itself in open loop (`None`), a reference or an added excitation in closed
    /// loop.
    pub r: Option<&'a [f64]>,
}

/// Spectral densities, one-sided, and cross spectra `S_xy = mean(conj(X) Y)`: unit of `x` times unit of `y` per Hz.
///
/// The same numbers as `scipy.signal.csd(x, y, fs, window, nperseg, noverlap)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectra {
    /// Lines, Hz, from 0 to half the sampling rate.
    pub frequency: Vec<f64>,
    /// Density of the input.
    pub uu: Vec<f64>,
    /// Density of the output.
    pub yy: Vec<f64>,
    /// From input to output.
    pub uy: Vec<Complex<f64>>,
    /// With the external signal, where there is one: its density, from it to the input, from it to the output.
    pub external: Option<External>,
    /// Segments averaged.
    pub segments: usize,
    /// Independent averages that they amount to: overlapping ones are correlated.
    pub averages: f64,
    /// Stretches that were too short for a segment.
    pub unused: usize,
    /// The window.
    pub window: Window,
    /// Time between samples, s.
    pub sample_period: f64,
}

/// Spectra with an external signal.
#[derive(Clone, Debug, PartialEq)]
pub struct External {
    /// Its density.
    pub rr: Vec<f64>,
    /// From it to the input.
    pub ru: Vec<Complex<f64>>,
    /// From it to the output.
    pub ry: Vec<Complex<f64>>,
}

impl Spectra {
    /// Averages over all segments of all stretches, samples `sample_period` s apart.
    ///
    /// ```
    /// use furuta_ident::frequency::{Settings, Spectra, Stretch};
    /// let u: Vec<f64> = (0..400).map(|k| (f64::from(k) * 1.7).sin() + (f64::from(k * k) * 0.01).cos()).collect();
    /// let y: Vec<f64> = u.iter().map(|u| 3.0 * u).collect();
    /// let s = Spectra::of(&[Stretch { u: &u, y: &y, r: None }], 0.01, &Settings::new(100))?;
    /// assert_eq!((s.segments, s.frequency.len(), s.frequency[1]), (7, 51, 1.0));
    /// assert!((s.uy[20] / s.uu[20] - 3.0).norm() < 1e-12);
    /// # Ok::<(), furuta_ident::frequency::FrequencyError>(())
    /// ```
    ///
    /// # Errors
    /// Signals of different lengths or with numbers that are not finite, settings out of range, a constant input,
    /// stretches that are all shorter than a segment.
    pub fn of(
        stretches: &[Stretch<'_>],
        sample_period: f64,
        settings: &Settings,
    ) -> Result<Self, FrequencyError> {
        check(stretches, sample_period, settings)?;
        let n = settings.segment;
        let step = n - settings.overlap;
        let window = settings.window.samples(n);
        let fft = RealFftPlanner::<f64>::new().plan_fft_forward(n);
        let (mut time, mut scratch) = (fft.make_input_vec(), fft.make_scratch_vec());
        let lines = n / 2 + 1;
        let [mut u, mut y, mut r] = [0; 3].map(|_| vec![Complex::new(0.0, 0.0); lines]);
        let mut transform = |signal: &[f64], out: &mut [Complex<f64>]| {
            let mean = signal.iter().sum::<f64>() / n as f64;
            for ((t, x), w) in time.iter_mut().zip(signal).zip(&window) {
                *t = (x - mean) * w;
            }
            // It fails on wrong lengths alone, and these are its own.
            let _ = fft.process_with_scratch(&mut time, out, &mut scratch);
        };
        let external = stretches.iter().any(|s| s.r.is_some());
        let [mut uu, mut yy, mut rr] = [0; 3].map(|_| vec![0.0; lines]);
        let [mut uy, mut ru, mut ry] = [0; 3].map(|_| vec![Complex::new(0.0, 0.0); lines]);
        let (mut segments, mut unused, mut averages) = (0, 0, 0.0);
        let overlaps = overlaps(&window, step);
        for stretch in stretches {
            if stretch.u.len() < n {
                unused += 1;
                continue;
            }
            let count = (stretch.u.len() - n) / step + 1;
            for first in (0..count).map(|k| k * step) {
                transform(&stretch.u[first..first + n], &mut u);
                transform(&stretch.y[first..first + n], &mut y);
                for k in 0..lines {
                    uu[k] += u[k].norm_sqr();
                    yy[k] += y[k].norm_sqr();
                    uy[k] += u[k].conj() * y[k];
                }
                if let Some(signal) = stretch.r {
                    transform(&signal[first..first + n], &mut r);
                    for k in 0..lines {
                        rr[k] += r[k].norm_sqr();
                        ru[k] += r[k].conj() * u[k];
                        ry[k] += r[k].conj() * y[k];
                    }
                }
            }
            segments += count;
            averages += independent(count, &overlaps);
        }
        if segments == 0 {
            let longest = stretches.iter().map(|s| s.u.len()).max().unwrap_or(0) as f64;
            return Err(FrequencyError::TooShort {
                resolution: 1.0 / (n as f64 * sample_period),
                needed: n as f64 * sample_period,
                longest: longest * sample_period,
                possible: 2.0 / (longest * sample_period),
            });
        }
        // One-sided: twice, but for the lines that are their own mirror images.
        let power: f64 = window.iter().map(|w| w * w).sum();
        let scale = |k: usize| {
            let mirrored = k == 0 || (n.is_multiple_of(2) && k == n / 2);
            (if mirrored { 1.0 } else { 2.0 }) * sample_period / (power * segments as f64)
        };
        for density in [&mut uu, &mut yy, &mut rr] {
            for (k, s) in density.iter_mut().enumerate() {
                *s *= scale(k);
            }
        }
        for cross in [&mut uy, &mut ru, &mut ry] {
            for (k, s) in cross.iter_mut().enumerate() {
                *s *= scale(k);
            }
        }
        Ok(Self {
            frequency: (0..lines)
                .map(|k| k as f64 / (n as f64 * sample_period))
                .collect(),
            uu,
            yy,
            uy,
            external: external.then_some(External { rr, ru, ry }),
            segments,
            averages,
            unused,
            window: settings.window,
            sample_period,
        })
    }
}

/// How much the spectra of two segments, one, two, ... steps apart, know of each other: the square of the correlation
/// of what the window lets through of white noise.
fn overlaps(window: &[f64], step: usize) -> Vec<f64> {
    let power: f64 = window.iter().map(|w| w * w).sum();
    let shared = |shift: usize| -> f64 {
        let both: f64 = window
            .iter()
            .zip(&window[shift..])
            .map(|(a, b)| a * b)
            .sum();
        (both / power).powi(2)
    };
    (1..)
        .map(|j| j * step)
        .take_while(|shift| *shift < window.len())
        .map(shared)
        .collect()
}

/// Independent averages in this many overlapping segments (Welch 1967).
fn independent(count: usize, overlaps: &[f64]) -> f64 {
    let count = count as f64;
    let more: f64 = overlaps
        .iter()
        .enumerate()
        .map(|(j, rho)| (1.0 - (j as f64 + 1.0) / count).max(0.0) * rho)
        .sum();
    count / (1.0 + 2.0 * more)
}

pub(super) fn check(
    stretches: &[Stretch<'_>],
    sample_period: f64,
    settings: &Settings,
) -> Result<(), FrequencyError> {
    let range = |name, value, min, max, unit| {
        if value >= min && value <= max {
            return Ok(());
        }
        Err(FrequencyError::OutOfRange {
            name,
            value,
            min,
            max,
            unit,
        })
    };
    range("sample period", sample_period, 1e-7, 1e3, "s")?;
    range("segment", settings.segment as f64, 8.0, 1e8, "samples")?;
    range(
        "overlap",
        settings.overlap as f64,
        0.0,
        settings.segment as f64 - 1.0,
        "samples",
    )?;
    let first = stretches.first().ok_or(FrequencyError::NoData)?;
    for stretch in stretches {
        let named = [("output", Some(stretch.y)), ("reference", stretch.r)];
        for (name, signal) in named {
            let Some(signal) = signal else {
                if stretch.r.is_some() != first.r.is_some() {
                    return Err(FrequencyError::Lengths {
                        signal: name.to_owned(),
                        given: 0,
                        expected: stretch.u.len(),
                    });
                }
                continue;
            };
            finite(name, signal)?;
            if signal.len() != stretch.u.len() {
                return Err(FrequencyError::Lengths {
                    signal: name.to_owned(),
                    given: signal.len(),
                    expected: stretch.u.len(),
                });
            }
        }
        finite("input", stretch.u)?;
    }
    moves("input", stretches.iter().map(|s| s.u))?;
    if first.r.is_some() {
        moves("reference", stretches.iter().filter_map(|s| s.r))?;
    }
    moves("output", stretches.iter().map(|s| s.y))
}

fn finite(signal: &str, values: &[f64]) -> Result<(), FrequencyError> {
    match values.iter().position(|x| !x.is_finite()) {
        Some(sample) => Err(FrequencyError::NotFinite {
            signal: signal.to_owned(),
            sample,
            value: values[sample],
        }),
        None => Ok(()),
    }
}

/// A signal that is constant within each stretch says nothing.
fn moves<'a>(
    signal: &str,
    mut stretches: impl Iterator<Item = &'a [f64]>,
) -> Result<(), FrequencyError> {
    let mut value = f64::NAN;
    let changes = |s: &'a [f64]| {
        value = s.first().copied().unwrap_or(value);
        s.iter().any(|x| *x != value)
    };
    if stretches.any(changes) {
        return Ok(());
    }
    Err(FrequencyError::Constant {
        signal: signal.to_owned(),
        value,
    })
}
