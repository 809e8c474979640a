//! Predicting recordings that the search never saw, by the models side by side.

use super::REPORT;
use super::predict::{self, Predictor, rms};
use super::result::{Channel, Curves, Diagnosis, RunCurves, VerificationRow};
use crate::shooting::{Data, Problem, with_zeros_found};

/// Adds to diagnosis and curves the predictions of these recordings: over their whole length where
/// the pendulum hangs, over the reported horizon where it does not (upright, no model predicts for long without its
/// controller).
pub(super) fn verify(
    data: &Data,
    models: &[Predictor; 3],
    diagnosis: &mut Diagnosis,
    curves: &mut Curves,
) {
    let models = &models.each_ref().map(|m| {
        let (hypothesis, z) = m.hypothesis.for_others(&m.z, data);
        let z = with_zeros_found(data, &hypothesis, &z);
        Predictor { hypothesis, z }
    });
    let unit = models[0].hypothesis.sheet.params.motor.actuation.unit();
    let windows = data.windows(REPORT, |r| !r.hangs());
    let problem = Problem::new(data, windows);
    let windowed = predict::of_each(models, |m| predict::windowed(&problem, m));
    for (i, run) in data.runs.iter().enumerate() {
        let whole = run.hangs();
        let series: [[Vec<f64>; 2]; 3] = std::array::from_fn(|m| {
            if whole {
                predict::whole(data, i, &models[m])
            } else {
                predict::joined(&problem, i, &windowed[m])
            }
        });
        let error = |m: usize| {
            let errors: Vec<[f64; 2]> = (1..run.y.len())
                .map(|k| std::array::from_fn(|c| predict::finite(series[m][c][k] - run.y[k][c])))
                .collect();
            rms(errors.iter())
        };
        let rms: [[f64; 2]; 3] = std::array::from_fn(error);
        for (c, channel) in Channel::ALL.into_iter().enumerate() {
            diagnosis.verification.push(VerificationRow {
                run: run.name.clone(),
                channel,
                nominal: rms[0][c],
                recalibrated: rms[1][c],
                repaired: rms[2][c],
            });
        }
        let restarts = if whole {
            vec![0]
        } else {
            problem
                .windows
                .iter()
                .filter(|w| w.run == i)
                .map(|w| w.start)
                .collect()
        };
        curves.verification.push(RunCurves {
            restarts,
            held_out: true,
            ..predict::curves(run, unit, series)
        });
    }
}
