//! Predicting recordings that the search never saw, by the models side by side.

use super::data::Data;
use super::fit::Problem;
use super::hypothesis::Nominal;
use super::predict::{self, Model, rms};
use super::result::{Channel, Curves, Diagnosis, RunCurves, VerificationRow};
use super::{REPORT, Request};

/// Adds to diagnosis and curves the predictions of the recordings in `request.verify`: over their whole length where the pendulum hangs, over
/// the reported horizon where it does not (upright, no model predicts for long without its controller).
pub(super) fn verify(
    request: &Request<'_>,
    nominal: &Nominal,
    models: [Model<'_>; 3],
    diagnosis: &mut Diagnosis,
    curves: &mut Curves,
) {
    let data = Data::new(request.verify, request.rig);
    let windows = data.windows(REPORT, |r| !r.hangs());
    let problem = Problem::new(&data, nominal, windows);
    let windowed = predict::of_each(models, |m| predict::windowed(&problem, m));
    for (i, run) in data.runs.iter().enumerate() {
        let whole = run.hangs();
        let series: [[Vec<f64>; 2]; 3] = std::array::from_fn(|m| {
            if whole {
                predict::whole(&data, i, models[m], nominal)
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
        let [nominal, recalibrated, augmented] = series;
        curves.verification.push(RunCurves {
            restarts,
            held_out: true,
            ..run.curves(nominal, recalibrated, augmented)
        });
    }
}
