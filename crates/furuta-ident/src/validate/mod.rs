//! Validation: how well a model predicts recordings that it was not fitted to, in the measures that users of system
//! identification know.
//!
//! - The fit in per cent, `100 (1 - |y - ŷ| / |y - mean y|)` (MATLAB's `compare`), of the whole run simulated from its
//!   best initial state; near upright, where no model can be simulated for long, of predictions over half a second.
//! - The residuals' autocorrelation and their correlation with the voltage, with the bounds within which 99 % of the
//!   lags of a perfect model stay (MATLAB's `resid`), and the Ljung-Box test.
//! - Prediction errors after fixed times, each from a state estimated from the quarter of a second before.

pub mod residuals;
mod words;

use furuta_model::Rig;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::answer::{Channel, fit_percent, null_if_not_finite};
use crate::insufficient::{self, Insufficient};
use crate::pendulum::Pendulum;
use crate::recording::Recording;
use crate::shooting::{AsGiven, Data, Model, Run, Window, Windows, with_zeros_found};
use residuals::{Autocorrelation, CrossCorrelation};

/// Version of the JSON contract, the field `schema`.
pub const SCHEMA: u32 = 1;
/// Lags of the residual tests, samples.
pub const LAGS: usize = 25;
/// The state from which a prediction sets out is estimated from so much before it, s.
const BEFORE: f64 = 0.25;
/// Predictions begin every so often, s.
const EVERY: f64 = 0.1;
/// After so long their errors are looked at, s.
pub const STEPS: [f64; 5] = [0.02, 0.1, 0.25, 0.5, 1.0];
/// Predictions near upright are so long at most, s.
const UPRIGHT: f64 = 0.5;
/// In stretches of so much, s, the initial state of a whole run is found.
const FIRST: f64 = 2.0;

/// Errors after a fixed time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepError {
    /// The time, s.
    pub seconds: f64,
    /// The same in samples.
    pub samples: usize,
    /// How many predictions.
    pub count: usize,
    /// RMS error, rad.
    #[serde(with = "null_if_not_finite")]
    pub rms: f64,
    /// Fit in per cent.
    #[serde(with = "null_if_not_finite")]
    pub fit_percent: f64,
}

/// One angle of one stretch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validated {
    /// Name of the recording.
    pub run: String,
    /// Which angle.
    pub channel: Channel,
    /// Whether the whole stretch was simulated at once; otherwise it was predicted over windows of half a second.
    pub simulated: bool,
    /// Fit in per cent.
    #[serde(with = "null_if_not_finite")]
    pub fit_percent: f64,
    /// RMS error, rad.
    #[serde(with = "null_if_not_finite")]
    pub rms: f64,
    /// What the encoder's noise alone would leave, rad.
    pub noise_floor: f64,
    /// Whether the residuals are white.
    pub whiteness: Autocorrelation,
    /// Whether they know the voltage.
    pub cross: CrossCorrelation,
    /// Errors after fixed times.
    pub steps: Vec<StepError>,
}

/// The result of [`validate`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Name of the rig.
    pub rig: String,
    /// By stretch and angle.
    pub channels: Vec<Validated>,
    /// What a person should know.
    pub notices: Vec<String>,
}

impl Validation {
    /// The JSON contract, pretty-printed.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Maps have string keys and numbers are finite or null: nothing can fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// A validation from its JSON.
    ///
    /// # Errors
    /// Text that is not of this contract.
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }
}

/// Judges a rig file by recordings that it was not fitted to.
///
/// ```
/// use furuta_ident::{recording::Recording, validate::validate};
/// use furuta_model::{Plant, Rig, State};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[]).expect("no effects");
/// let mut x = plant.rest(State::hanging());
/// let mut samples = Vec::new();
/// for k in 0..2000 {
///     let t = f64::from(k) * 0.002;
///     let u = 3.0 * (2.0 * t * (1.0 + t)).sin();
///     let [theta, alpha] = plant.measure(&x);
///     samples.push([t, u, theta, alpha]);
///     plant.step(&mut x, u, 0.002);
/// }
/// let (recording, _) = Recording::from_samples("sweep", samples)?;
/// let validation = validate(&[recording], &rig)?;
/// assert!(validation.channels.iter().all(|c| c.simulated && c.fit_percent > 99.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Insufficient`]: nothing moves, too short.
pub fn validate(recordings: &[Recording], rig: &Rig) -> Result<Validation, Insufficient> {
    validate_with(recordings, rig, Options::default())
}

/// What may be said of the recordings of a validation.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// What the rig was in the recordings: as it is built, or a part of it alone.
    pub pendulum: Pendulum,
    /// Whether all recordings count their angles from the rig's zeros: otherwise each has zeros of its own, found in
    /// its first seconds.
    pub same_zero: bool,
}

/// [`validate`] by recordings of which these `options` tell: of the arm alone, or of the pendulum alone, or from one
/// zero. Angles that do not tell of the model have no rows.
///
/// # Errors
/// As [`validate`].
pub fn validate_with(
    recordings: &[Recording],
    rig: &Rig,
    options: Options,
) -> Result<Validation, Insufficient> {
    let state = options.pendulum;
    let data = Data::in_states(recordings, rig, |_| state);
    insufficient::check(recordings, rig, &data)?;
    let model = AsGiven {
        rig,
        recordings: data.recordings,
        state,
        own_zeros: !options.same_zero,
    };
    let z = with_zeros_found(&data, &model, &vec![0.0; model.layout().len()]);
    let windows = Windows::new(&model, &z);
    let mut channels = Vec::new();
    let mut notices: Vec<String> = state.notice().map(str::to_owned).into_iter().collect();
    for (i, run) in data.runs.iter().enumerate() {
        let simulated = run.hangs();
        let predicted = if simulated {
            whole(&windows, &data, i)
        } else {
            windowed(&windows, &data, i)
        };
        let steps = steps(&windows, &data, i);
        if !simulated {
            notices.push(format!(
                "{} comes near upright, where no model can be simulated for long: its fit is that of predictions over \
                 {UPRIGHT} s",
                run.name
            ));
        }
        let angles = Channel::ALL.into_iter().enumerate();
        for (c, channel) in angles.filter(|(c, _)| state.tells()[*c]) {
            let pairs: Vec<(usize, f64, f64)> = predicted
                .iter()
                .map(|(k, p)| (*k, run.y[*k][c], p[c]))
                .collect();
            let both: Vec<(f64, f64)> = pairs.iter().map(|(_, y, p)| (*y, *p)).collect();
            let residual: Vec<f64> = both.iter().map(|(y, p)| y - p).collect();
            // The voltage that acted up to each sample.
            let volts: Vec<f64> = pairs.iter().map(|(k, _, _)| run.u[k - 1]).collect();
            let rms = (residual.iter().map(|e| e * e).sum::<f64>() / residual.len() as f64).sqrt();
            channels.push(Validated {
                run: run.name.clone(),
                channel,
                simulated,
                fit_percent: fit_percent(&both),
                rms,
                noise_floor: data.noise[c],
                whiteness: residuals::autocorrelation(&residual, LAGS),
                cross: residuals::cross_correlation(&residual, &volts, LAGS),
                steps: steps.iter().map(|s| s.of(c)).collect(),
            });
        }
    }
    Ok(Validation {
        schema: SCHEMA,
        rig: rig.name.clone(),
        channels,
        notices,
    })
}

/// The whole run simulated from its best initial state: sample and angles.
fn whole(windows: &Windows, data: &Data, run: usize) -> Vec<(usize, [f64; 2])> {
    let r = &data.runs[run];
    let last = r.y.len() - 1;
    let first = ((FIRST / r.h).round() as usize).clamp(1, last);
    let window = |len| Window { run, start: 0, len };
    let (x0, _) = windows.search(data, &window(first), None);
    let (x0, _) = windows.solve(data, &window(last), &x0, 10);
    windows
        .predictions(data, &window(last), &x0)
        .into_iter()
        .enumerate()
        .map(|(k, p)| (k + 1, p))
        .collect()
}

/// The run predicted over short windows, each from its best initial state.
fn windowed(windows: &Windows, data: &Data, run: usize) -> Vec<(usize, [f64; 2])> {
    let stretches: Vec<Window> = data
        .windows(UPRIGHT, |_| true)
        .into_iter()
        .filter(|w| w.run == run)
        .collect();
    stretches
        .into_par_iter()
        .flat_map_iter(|w| {
            let (x0, _) = windows.search(data, &w, None);
            windows
                .predictions(data, &w, &x0)
                .into_iter()
                .enumerate()
                .map(move |(k, p)| (w.start + k + 1, p))
        })
        .collect()
}

/// Predictions after a fixed time, both angles: measured and predicted.
struct Ahead {
    seconds: f64,
    samples: usize,
    pairs: Vec<[(f64, f64); 2]>,
}

impl Ahead {
    fn of(&self, channel: usize) -> StepError {
        let pairs: Vec<(f64, f64)> = self.pairs.iter().map(|p| p[channel]).collect();
        let sum: f64 = pairs.iter().map(|(y, p)| (y - p).powi(2)).sum();
        StepError {
            seconds: self.seconds,
            samples: self.samples,
            count: pairs.len(),
            rms: (sum / pairs.len() as f64).sqrt(),
            fit_percent: fit_percent(&pairs),
        }
    }
}

/// Predictions from many moments of a run, each from the state that the quarter of a second before says.
fn steps(windows: &Windows, data: &Data, run: usize) -> Vec<Ahead> {
    let r: &Run = &data.runs[run];
    let samples = |seconds: f64| ((seconds / r.h).round() as usize).max(1);
    let before = samples(BEFORE).max(8);
    let hangs = r.hangs();
    let wanted: Vec<(f64, usize)> = STEPS
        .iter()
        .filter(|s| hangs || **s <= UPRIGHT)
        .map(|s| (*s, samples(*s)))
        .filter(|(_, k)| before + k < r.y.len())
        .collect();
    let Some(&(_, longest)) = wanted.last() else {
        return Vec::new();
    };
    let starts: Vec<usize> = (0..r.y.len() - before - longest)
        .step_by(samples(EVERY))
        .collect();
    let courses: Vec<(usize, Vec<[f64; 2]>)> = starts
        .into_par_iter()
        .map(|start| {
            let known = Window {
                run,
                start,
                len: before,
            };
            let (x0, _) = windows.search(data, &known, None);
            let all = Window {
                len: before + longest,
                ..known
            };
            (start + before, windows.predictions(data, &all, &x0))
        })
        .collect();
    wanted
        .into_iter()
        .map(|(seconds, k)| Ahead {
            seconds,
            samples: k,
            pairs: courses
                .iter()
                .map(|(from, course)| {
                    let (y, p) = (r.y[from + k], course[before + k - 1]);
                    std::array::from_fn(|c| (y[c], p[c]))
                })
                .collect(),
        })
        .collect()
}
