//! Fong, Jamaludin, Abdullah 2014, section 3.2: a hanging pendulum is driven with band-limited white noise, and its
//! response measured and fitted.
//!
//! 1 kHz, 180 s, transfer functions with a numerator of order 2 or 3 and a denominator of order 4, by nonlinear least
//! squares in the frequency domain; the paper takes H1 under Hann's window, whose leakage biases the resonance, here
//! response and transient are estimated together ([`super::local`]); first-principles model (28), fit and response over
//! one another up to 23 Hz. What they measured is not printed but for the fit (29); in the measurement's place stands
//! the emulated rig: the nonlinear model with its encoders' counts.

use furuta_model::published::{Paper, Quantity};
use furuta_model::signals::{Noise, SignalError};
use furuta_model::{Plant, PlantError, Rig, State};

use super::bands::{Band, errors};
use super::error::FrequencyError;
use super::first_principles::{Output, of_rig};
use super::fit::{Delay, Fit, FitError, Request, fit};
use super::hold::Hold;
use super::local;
use super::orders::sweep;
use super::response::Frf;
use super::spectra::Stretch;
use super::transfer::{Transfer, TransferError};

/// The experiment's settings.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Length, s; the paper's 180.
    pub duration: f64,
    /// Samples per second; the paper's 1000.
    pub rate: f64,
    /// RMS of the noise, units of command; the paper does not say.
    pub rms: f64,
    /// Its upper end, Hz; the paper does not say.
    pub high: f64,
    /// Which noise.
    pub seed: u64,
    /// Distance of lines, Hz; the paper does not say.
    pub resolution: f64,
    /// The band that is looked at, Hz; the paper's figure ends at 23.
    pub band: [f64; 2],
}

impl Default for Experiment {
    /// The paper's settings, and where it is silent: 0.5 units of command up to 30 Hz, at which the pendulum swings by
    /// 5 degrees RMS; lines 0.05 Hz apart.
    fn default() -> Self {
        Self {
            duration: 180.0,
            rate: 1000.0,
            rms: 0.5,
            high: 30.0,
            seed: 1,
            resolution: 0.05,
            band: [0.1, 23.0],
        }
    }
}

/// Bands of the table, Hz: below, about and above the pendulum's resonance.
pub const EDGES: [f64; 5] = [0.1, 0.8, 2.0, 8.0, 23.0];

/// What came out.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The measured response, alpha over command.
    pub frf: Frf,
    /// The model (28), from the rig file, effects left out.
    pub first_principles: Transfer,
    /// The fits of orders 2/4 and 3/4 that the paper speaks of.
    pub paper_orders: Vec<Fit>,
    /// The fit of the orders that BIC chooses.
    pub chosen: Fit,
    /// Each model's errors: (28), the paper's orders, the chosen ones.
    pub bands: Vec<Vec<Band>>,
    /// RMS of the pendulum's angle from hanging, rad.
    pub swing: f64,
    /// What the reader should know.
    pub notices: Vec<String>,
}

/// Why the experiment cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// No plant.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// No such noise.
    #[error("{0}")]
    Signal(#[from] SignalError),
    /// No response.
    #[error("{0}")]
    Frequency(#[from] FrequencyError),
    /// No fit.
    #[error("{0}")]
    Fit(#[from] FitError),
    /// No model.
    #[error("{0}")]
    Transfer(#[from] TransferError),
}

/// The published fit (29), alpha over command.
///
/// ```
/// use furuta_ident::frequency::fong2014::published;
/// let poles = published().and_then(|g| g.poles()).expect("four");
/// assert!((poles[0].re + 6.480).abs() < 1e-3 && (poles[2].im - 10.527).abs() < 1e-3);
/// ```
#[must_use]
pub fn published() -> Option<Transfer> {
    let paper = Paper::of("fong2014-emecs")?;
    let printed = |quantity| paper.figure(quantity).map(|f| f.printed);
    let numerator: Option<Vec<f64>> = (0..4)
        .rev()
        .map(|k| printed(Quantity::HangingNumerator(k)))
        .collect();
    let rest: Option<Vec<f64>> = (0..4)
        .rev()
        .map(|k| printed(Quantity::HangingDenominator(k)))
        .collect();
    let mut denominator = vec![1.0];
    denominator.extend(rest?);
    Transfer::new(&numerator?, &denominator).ok()
}

impl Experiment {
    /// Drives the rig with its effects, and takes its file without them for the first-principles model.
    ///
    /// # Errors
    /// Settings or a rig that are not possible.
    pub fn run(&self, rig: &Rig) -> Result<Outcome, ExperimentError> {
        let h = 1.0 / self.rate;
        let (u, alpha) = self.record(rig)?;
        let mean = alpha.iter().sum::<f64>() / alpha.len() as f64;
        let square: f64 = alpha.iter().map(|a| (a - mean).powi(2)).sum();
        let stretch = Stretch {
            u: &u,
            y: &alpha,
            r: None,
        };
        let (frf, mut notices) = local::response(&[stretch], h, self.resolution, Some(self.band))
            .map(|(frf, notices)| {
            (
                frf,
                notices.iter().map(ToString::to_string).collect::<Vec<_>>(),
            )
        })?;
        let hold = Hold::ZeroOrder(h);
        let first_principles = of_rig(rig, Output::Alpha)?;
        let paper_orders = [2, 3]
            .into_iter()
            .map(|zeros| {
                let request = Request {
                    zeros,
                    poles: 4,
                    hold,
                    delay: Delay::Known(0.0),
                };
                fit(&frf, &request)
            })
            .collect::<Result<Vec<_>, _>>()?;
        let chosen = sweep(&frf, 5, hold, Delay::Known(0.0))
            .into_iter()
            .next()
            .unwrap_or_else(|| paper_orders[0].clone());
        for fit in paper_orders.iter().chain([&chosen]) {
            let [zeros, poles] = fit.transfer.orders();
            let said = fit
                .notices()
                .into_iter()
                .map(|n| format!("{zeros}/{poles}: {n}"));
            for notice in said.collect::<Vec<_>>() {
                if !notices.contains(&notice) {
                    notices.push(notice);
                }
            }
        }
        let fits = paper_orders.iter().chain([&chosen]).map(|f| &f.transfer);
        let bands = std::iter::once(&first_principles)
            .chain(fits)
            .map(|g| errors(&frf, &EDGES, |f| hold.sampled(f, |s| g.at(s))))
            .collect();
        Ok(Outcome {
            frf,
            first_principles,
            paper_orders,
            chosen,
            bands,
            swing: (square / alpha.len() as f64).sqrt(),
            notices,
        })
    }

    /// The command, clipped at the rig's limit, and what the pendulum's encoder counts.
    fn record(&self, rig: &Rig) -> Result<(Vec<f64>, Vec<f64>), ExperimentError> {
        let plant = Plant::new(&rig.params, &rig.effects)?;
        let h = 1.0 / self.rate;
        plant.check_period(h)?;
        let noise = Noise::new(self.rms, 0.0, self.high, self.seed)?;
        let limit = rig.params.motor.command_limit;
        let samples = (self.duration * self.rate).round() as usize;
        let mut state = plant.rest(State::hanging());
        let (mut u, mut alpha) = (Vec::with_capacity(samples), Vec::with_capacity(samples));
        for k in 0..samples {
            let volts = noise.volts(k as f64 * h).clamp(-limit, limit);
            alpha.push(rig.sensors.quantised(plant.measure(&state))[1]);
            u.push(volts);
            plant.step(&mut state, volts, h);
        }
        Ok((u, alpha))
    }
}
