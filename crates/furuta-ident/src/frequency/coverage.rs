//! How often the intervals of fitted poles hold the truth, on emulated rigs whose truth is known; and from which swing
//! on a rig is no longer linear.
//!
//! The hanging rig, its effects left out, is driven by noise or by a multisine; what its encoder counts is measured and
//! fitted with the orders of its linear model, whose poles are the truth. A pendulum that swings is not linear: the
//! mean of the fitted poles lies beside the truth by a bias that grows with the square of the swing. A rig is called
//! linear up to the swing whose bias is half of a standard deviation: a 95 % interval that is off by that still holds
//! the truth 92.1 times of 100. Much less of a swing is no better: of an encoder's count or two the counts are no
//! noise.

use std::sync::atomic::{AtomicU64, Ordering};

use furuta_model::signals::{Harmonics, Multisine, Noise, Phases};
use furuta_model::{Rig, State};
use nalgebra::Complex;
use rayon::prelude::*;

use super::error::FrequencyError;
use super::first_principles::{Output, of_rig};
use super::fit::{Delay, Fit, Request, fit};
use super::fong2014::ExperimentError;
use super::hold::Hold;
use super::response::Frf;
use super::spectra::Stretch;
use super::transfer::Transfer;
use super::{local, periodic};

/// What drives the rig.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Band-limited noise, its response by [`local`].
    Noise,
    /// Multisines of odd harmonics with detection lines and random phases, their response by [`periodic`].
    Multisine,
}

/// A study of coverage.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// What drives the rig.
    pub drive: Drive,
    /// Recordings.
    pub seeds: u64,
    /// Length of each, s.
    pub duration: f64,
    /// Samples per second.
    pub rate: f64,
    /// Upper end of the excitation and of the fit, Hz.
    pub high: f64,
    /// RMS of the pendulum's angle from hanging, rad; the largest at which the rig is linear if not given.
    pub swing: Option<f64>,
    /// Distances of lines, Hz; a multisine has its own.
    pub resolutions: Vec<f64>,
}

impl Default for Study {
    /// 200 recordings of 180 s at 200 Hz, 0.1 to 23 Hz, resolutions of 0.05, 0.1 and 0.2 Hz.
    fn default() -> Self {
        Self {
            drive: Drive::Noise,
            seeds: 200,
            duration: 180.0,
            rate: 200.0,
            high: 23.0,
            swing: None,
            resolutions: vec![0.05, 0.1, 0.2],
        }
    }
}

/// Lower end of fits, Hz: below it a recording of 180 s has no 20 periods.
const LOW: f64 = 0.1;
/// Period of the multisine, s: up to 23 Hz its odd harmonics are as many as a signal can hold.
const PERIOD: f64 = 10.0;
/// The swing at which the search for the linear one begins, rad RMS: 10 degrees.
const LARGEST: f64 = 0.175;
/// Recordings whose mean tells the bias.
const FOR_BIAS: u64 = 8;
/// A bias of this many standard deviations leaves a 95 % interval 92.1 %.
const BIAS: f64 = 0.5;
/// The search goes down by the root of two, to a swing of less than an encoder's count.
const STEPS: usize = 16;

/// Real or imaginary part of a pole.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Part {
    /// Which pole: the truth, rad/s.
    pub pole: Complex<f64>,
    /// Whether it is the imaginary part.
    pub imaginary: bool,
    /// Mean of the fits less the truth, rad/s.
    pub bias: f64,
    /// Root of the mean square of their distance from their mean, rad/s.
    pub scatter: f64,
    /// Mean of their standard deviations, rad/s.
    pub std: f64,
    /// Share of 95 % intervals that hold the truth.
    pub held: f64,
}

/// One resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Distance of lines, Hz.
    pub resolution: f64,
    /// The poles' parts.
    pub parts: Vec<Part>,
    /// Share of all their intervals that hold the truth.
    pub held: f64,
    /// Share of the lines' 95 % circles that hold the true response.
    pub circles: f64,
    /// Recordings whose fit failed; they count as not held.
    pub failed: u64,
}

/// What came out.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// RMS of the command.
    pub rms: f64,
    /// RMS of the pendulum's angle, rad, of the linear model.
    pub swing: f64,
    /// By resolution.
    pub rows: Vec<Row>,
}

/// A fit with the response that it is of.
type Found = Result<(Frf, Fit), String>;

impl Study {
    /// The command's RMS over the swing's, of the linear model under noise that is flat up to the upper end.
    fn command_for(&self, model: &Transfer) -> f64 {
        // Fine enough for a resonance of a hundredth of a hertz.
        let lines = (self.high * 1e3) as usize;
        let square = |k: usize| model.response((k as f64 + 0.5) * 1e-3).norm_sqr();
        let mean = (0..lines).map(square).sum::<f64>() / lines as f64;
        1.0 / mean.sqrt()
    }

    /// Runs the study on a rig; `progress` hears of recordings done and of all.
    ///
    /// # Errors
    /// Settings or a rig that are not possible.
    pub fn run(
        &self,
        rig: &Rig,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Outcome, ExperimentError> {
        let model = of_rig(rig, Output::Alpha)?;
        let per_swing = self.command_for(&model);
        let swing = match self.swing {
            Some(swing) => swing,
            None => self.linear_swing(rig, &model, per_swing)?,
        };
        let rms = swing * per_swing;
        let done = AtomicU64::new(0);
        let by_seed: Vec<Vec<Found>> = (0..self.seeds)
            .into_par_iter()
            .map(|seed| {
                let found = self.fits(rig, &model, rms, seed, true);
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, self.seeds);
                found
            })
            .collect::<Result<_, _>>()?;
        let count = by_seed.first().map_or(0, Vec::len);
        let rows = (0..count).map(|i| {
            let found: Vec<&Found> = by_seed.iter().map(|f| &f[i]).collect();
            self.row(&model, i, &found)
        });
        Ok(Outcome {
            rms,
            swing,
            rows: rows.collect(),
        })
    }

    /// The largest swing (rad RMS) of a falling sequence at which the rig is linear.
    fn linear_swing(
        &self,
        rig: &Rig,
        model: &Transfer,
        per_swing: f64,
    ) -> Result<f64, ExperimentError> {
        let mut swing = LARGEST;
        for _ in 0..STEPS {
            let found = |encoders| -> Result<Row, ExperimentError> {
                let fits: Vec<Vec<Found>> = (0..FOR_BIAS)
                    .into_par_iter()
                    .map(|seed| self.fits(rig, model, swing * per_swing, seed, encoders))
                    .collect::<Result<_, _>>()?;
                let first: Vec<&Found> = fits.iter().filter_map(|f| f.first()).collect();
                Ok(self.row(model, 0, &first))
            };
            // Without encoders all that is left is the bias.
            let (exact, counted) = (found(false)?, found(true)?);
            let small = |(e, c): (&Part, &Part)| e.bias.abs() <= BIAS * c.std;
            if exact.failed + counted.failed == 0
                && exact.parts.iter().zip(&counted.parts).all(small)
            {
                break;
            }
            swing /= 2.0_f64.sqrt();
        }
        Ok(swing)
    }

    /// One recording, fitted at every resolution.
    fn fits(
        &self,
        rig: &Rig,
        model: &Transfer,
        rms: f64,
        seed: u64,
        encoders: bool,
    ) -> Result<Vec<Found>, ExperimentError> {
        let h = 1.0 / self.rate;
        let (u, alpha) = self.record(rig, rms, seed, encoders)?;
        let stretches = [Stretch {
            u: &u,
            y: &alpha,
            r: None,
        }];
        let band = Some([LOW, self.high]);
        let measured: Vec<Result<Frf, FrequencyError>> = match self.drive {
            Drive::Noise => self
                .resolutions
                .iter()
                .map(|df| Ok(local::response(&stretches, h, *df, band)?.0))
                .collect(),
            Drive::Multisine => vec![periodic::response(&stretches, h, PERIOD, 1).map(|f| f.0)],
        };
        let [zeros, poles] = model.orders();
        let request = Request {
            zeros,
            poles,
            hold: Hold::ZeroOrder(h),
            delay: Delay::Known(0.0),
        };
        let fitted = |frf: Result<Frf, FrequencyError>| -> Result<Found, ExperimentError> {
            let frf = frf?;
            let found = fit(&frf, &request);
            Ok(found.map(|f| (frf, f)).map_err(|e| e.to_string()))
        };
        measured.into_iter().map(fitted).collect()
    }

    /// Command and pendulum angle.
    fn record(
        &self,
        rig: &Rig,
        rms: f64,
        seed: u64,
        encoders: bool,
    ) -> Result<(Vec<f64>, Vec<f64>), ExperimentError> {
        let h = 1.0 / self.rate;
        let samples = (self.duration * self.rate).round() as usize;
        let times = (0..samples).map(|k| k as f64 * h);
        let u: Vec<f64> = match self.drive {
            Drive::Noise => {
                let noise = Noise::new(rms, 0.0, self.high, seed)?;
                times.map(|t| noise.volts(t)).collect()
            }
            Drive::Multisine => {
                let (harmonics, phases) = (Harmonics::Detecting(seed), Phases::Random(seed));
                let sines = Multisine::new(rms, 1.0 / PERIOD, LOW, self.high, harmonics, phases)?;
                times.map(|t| sines.volts(t)).collect()
            }
        };
        let plant = rig.nominal_plant();
        plant.check_period(h)?;
        let mut state = plant.rest(State::hanging());
        let mut alpha = Vec::with_capacity(samples);
        for volts in &u {
            let angles = plant.measure(&state);
            alpha.push(if encoders {
                rig.sensors.quantised(angles)[1]
            } else {
                angles[1]
            });
            plant.step(&mut state, *volts, h);
        }
        Ok((u, alpha))
    }

    fn row(&self, model: &Transfer, i: usize, found: &[&Found]) -> Row {
        let good: Vec<&(Frf, Fit)> = found.iter().filter_map(|f| f.as_ref().ok()).collect();
        let poles = model.poles().unwrap_or_default();
        let parts: Vec<Part> = poles
            .iter()
            .filter(|p| p.im >= 0.0)
            .flat_map(|p| [(*p, false), (*p, true)])
            .filter(|(p, imaginary)| !imaginary || p.im > 0.0)
            .map(|(pole, imaginary)| part(pole, imaginary, &good, found.len()))
            .collect();
        let hold = Hold::ZeroOrder(1.0 / self.rate);
        let (mut inside, mut lines) = (0, 0);
        for (frf, _) in &good {
            let radius = frf.confidence(0.95).unwrap_or_default();
            for ((f, h), radius) in frf.frequency.iter().zip(&frf.response).zip(radius) {
                let exact = hold.sampled(*f, |s| model.at(s));
                inside += usize::from((h - exact).norm() <= radius);
                lines += 1;
            }
        }
        let resolution = match self.drive {
            Drive::Noise => self.resolutions.get(i).copied().unwrap_or(0.0),
            Drive::Multisine => 2.0 / PERIOD,
        };
        Row {
            resolution,
            held: parts.iter().map(|p| p.held).sum::<f64>() / parts.len().max(1) as f64,
            parts,
            circles: inside as f64 / f64::max(1.0, lines as f64),
            failed: (found.len() - good.len()) as u64,
        }
    }
}

/// A part of the fitted poles that are nearest to a true one.
fn part(pole: Complex<f64>, imaginary: bool, good: &[&(Frf, Fit)], all: usize) -> Part {
    let of = |z: Complex<f64>| if imaginary { z.im } else { z.re };
    let nearest = |fit: &Fit| {
        let poles = fit.poles.iter().copied();
        poles.min_by(|a, b| {
            let distance = |p: Complex<f64>| (p - pole).norm();
            distance(a.value).total_cmp(&distance(b.value))
        })
    };
    let found: Vec<(f64, f64)> = good
        .iter()
        .filter_map(|(_, fit)| nearest(fit))
        .map(|p| (of(p.value) - of(pole), of(p.std)))
        .collect();
    let count = found.len().max(1) as f64;
    let bias = found.iter().map(|f| f.0).sum::<f64>() / count;
    let square: f64 = found.iter().map(|f| (f.0 - bias).powi(2)).sum();
    let held = found.iter().filter(|f| f.0.abs() <= 1.96 * f.1).count();
    Part {
        pole,
        imaginary,
        bias,
        scatter: (square / count).sqrt(),
        std: found.iter().map(|f| f.1).sum::<f64>() / count,
        held: held as f64 / all.max(1) as f64,
    }
}
