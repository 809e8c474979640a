//! The gap between recordings and models: how large, where, and which torque would close it.

use super::location::{self, Residual};
use super::predict::{self, Predictor, rms};
use super::result::{Curves, Diagnosis, RunCurves, Verdict};
use super::{REPORT, torque};
use crate::shooting::{Data, Problem};

/// Prediction errors over the reported horizon by model, where they sit, and the curves.
pub(super) fn gap(
    data: &Data,
    models: &[Predictor; 3],
    diagnosis: &mut Diagnosis,
    curves: &mut Curves,
) {
    let problem = Problem::new(data, data.windows(REPORT, |_| true));
    let predictions = predict::of_each(models, |m| predict::windowed(&problem, m));
    let errors = predictions.each_ref().map(|p| predict::errors(&problem, p));
    let [as_given, refitted, repaired] = errors.each_ref().map(|e| rms(e.iter().flatten()).into());
    let gap = &mut diagnosis.gap;
    gap.horizon = REPORT;
    (gap.nominal, gap.recalibrated, gap.augmented) = (as_given, refitted, repaired);
    gap.noise_floor = data.noise.into();
    let mut residuals = Vec::new();
    for (i, w) in problem.windows.iter().enumerate() {
        for (k, (before, after)) in errors[1][i].iter().zip(&errors[2][i]).enumerate() {
            let squared = |e: &[f64; 2]| std::array::from_fn(|c| (e[c] / data.noise[c]).powi(2));
            residuals.push(Residual {
                run: w.run,
                sample: w.start + 1 + k,
                refitted: squared(before),
                repaired: squared(after),
            });
        }
    }
    let unit = models[0].hypothesis.sheet.params.motor.actuation.unit();
    (curves.bars, diagnosis.location) = location::locate(data, &residuals, unit);
    let [_, before, after] = models;
    let (before, after) = rayon::join(
        || torque::Responses::new(&problem, before),
        || torque::Responses::new(&problem, after),
    );
    (curves.torque_by_state, diagnosis.missing_torque) = torque::by_state(&before, &after);
    if matches!(diagnosis.verdict, Verdict::NoGap | Verdict::ParametersOnly) {
        diagnosis.missing_torque.clear();
    }
    curves.torque_in_time = torque::in_time(&problem, &before, &after);
    for (i, run) in data.runs.iter().enumerate() {
        let series = predictions
            .each_ref()
            .map(|p| predict::joined(&problem, i, p));
        let windows = problem.windows.iter().filter(|w| w.run == i);
        curves.runs.push(RunCurves {
            restarts: windows.map(|w| w.start).collect(),
            ..predict::curves(run, unit, series)
        });
    }
}
