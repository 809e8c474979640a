//! Measured angles beside what rig file and calibrated model predict, and how well they follow.

use super::Curve;
use super::fit::{CalibrationProblem, Fit};
use super::result::ChannelFit;
use crate::answer::{Channel, fit_percent};
use crate::recording::Recording;
use crate::shooting::Data;

/// Measured angles beside the predictions, window after window.
pub(super) fn curves(problem: &CalibrationProblem<'_>, as_given: &Fit, fitted: &Fit) -> Vec<Curve> {
    let predicted = [as_given, fitted].map(|f| problem.predictions(f));
    let data = problem.data;
    data.runs
        .iter()
        .enumerate()
        .map(|(i, run)| {
            let measured: [Vec<f64>; 2] =
                std::array::from_fn(|c| run.y.iter().map(|y| y[c]).collect());
            let joined = |predictions: &[Vec<[f64; 2]>]| {
                let mut series = [vec![f64::NAN; run.y.len()], vec![f64::NAN; run.y.len()]];
                for (w, values) in problem.windows.iter().zip(predictions) {
                    for (k, value) in values.iter().enumerate().filter(|_| w.run == i) {
                        for c in 0..2 {
                            series[c][w.start + 1 + k] = value[c];
                        }
                    }
                }
                series
            };
            Curve {
                run: run.name.clone(),
                t: (0..run.y.len()).map(|k| run.time(k)).collect(),
                u: run.u.clone(),
                nominal: joined(&predicted[0]),
                calibrated: joined(&predicted[1]),
                measured,
            }
        })
        .collect()
}

/// By recording and angle, over the windows; an angle that does not tell of the model has none.
pub(super) fn channel_fits(
    recordings: &[Recording],
    data: &Data,
    curves: &[Curve],
) -> Vec<ChannelFit> {
    let states = data.states();
    let state = |r: usize| states.get(r).copied().unwrap_or_default();
    let mut fits = Vec::new();
    for (r, recording) in recordings.iter().enumerate() {
        let tells = state(r).tells();
        let channels = Channel::ALL.into_iter().enumerate();
        for (c, channel) in channels.filter(|(c, _)| tells[*c]) {
            let of = |model: fn(&Curve) -> &[Vec<f64>; 2]| -> Vec<(f64, f64)> {
                curves
                    .iter()
                    .zip(&data.runs)
                    .filter(|(_, run)| run.recording == r)
                    .flat_map(|(curve, _)| {
                        let predicted = model(curve)[c].iter().copied();
                        curve.measured[c].iter().copied().zip(predicted)
                    })
                    .filter(|(_, p)| p.is_finite())
                    .collect()
            };
            let rms = |pairs: &[(f64, f64)]| {
                let sum: f64 = pairs.iter().map(|(y, p)| (y - p).powi(2)).sum();
                (sum / pairs.len() as f64).sqrt()
            };
            let calibrated = of(|curve| &curve.calibrated);
            fits.push(ChannelFit {
                run: recording.name.clone(),
                channel,
                nominal: rms(&of(|curve| &curve.nominal)),
                calibrated: rms(&calibrated),
                noise_floor: data.noise[c],
                fit_percent: fit_percent(&calibrated),
            });
        }
    }
    fits
}
