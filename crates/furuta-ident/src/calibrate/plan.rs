//! What to record so that the parameters are known well: D-optimal over a small family of test signals.
//!
//! The rig file is driven by each signal, as hard as its limits allow and more gently, and read by its encoders. Exact
//! sensitivities of that motion give the Fisher information `F`, in units of the parameters' own sizes, initial states
//! eliminated as in a fit. The best signal has the largest `log det (F + 1)`: its confidence ellipsoid is the smallest.
//! The unit matrix is what is known beforehand, that the rig file is right to within a factor of two or so; without it
//! a signal that says nothing about one parameter could not be compared with others. A sequence is chosen greedily:
//! each further experiment adds its information.

use furuta_model::Rig;
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fit::{CalibrationProblem, windows};
use super::parameters::Space;
use super::{CalibrateError, Options, identifiable, question, relative};
use crate::answer::{null_if_not_finite, significant};
use crate::experiment::{FAMILY, HALVED, LEVELS, SECONDS, Shape, record, rms, two_digits};
use crate::shooting::Data;

/// Version of the JSON contract, the field `schema`.
pub(super) const SCHEMA: u32 = 1;
/// Sample rates for which a plan is made, 1/s.
const RATES: [f64; 2] = [20.0, 10_000.0];

/// An experiment and what it would tell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    /// What is done, in words.
    pub excitation: String,
    /// The same for the command line, behind `furuta run --task` (or `furuta simulate --input`).
    pub arguments: String,
    /// Length, s.
    pub seconds: f64,
    /// The largest voltage, V.
    pub volts: f64,
    /// Its root mean square, V.
    #[serde(default)]
    pub volts_rms: f64,
    /// The largest arm angle, rad.
    pub arm: f64,
    /// `log det (F + 1)` of the parameters.
    pub log_det: f64,
    /// D-efficiency against the best: so much of its length would the best need to tell as much.
    pub efficiency: f64,
    /// Predicted relative standard deviations, in the order of [`Plan::parameters`]; 1 is what is known beforehand.
    pub std: Vec<f64>,
}

/// The result of [`plan`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Version of the JSON contract, 1.
    pub schema: u32,
    /// Name of the rig.
    pub rig: String,
    /// Samples per second.
    pub rate: f64,
    /// Keys of the parameters that are to become known.
    pub parameters: Vec<String>,
    /// All experiments that the rig bears, the most telling first.
    pub experiments: Vec<Experiment>,
    /// Which to make one after the other, as places in `experiments`.
    pub sequence: Vec<usize>,
    /// Relative standard deviations after each of these.
    pub after: Vec<Vec<f64>>,
    /// `log det (F + 1)` after the last.
    #[serde(with = "null_if_not_finite")]
    pub log_det: f64,
}

/// One signal at one level, simulated.
struct Tried {
    experiment: Experiment,
    information: DMatrix<f64>,
}

/// Proposes recordings by what they would tell about the parameters of a rig file, effects included.
///
/// `options` are those of the calibration to come; `rate` in samples per second, `count` how many experiments to
/// propose.
///
/// ```
/// use furuta_ident::calibrate::{Options, plan};
/// let rig = furuta_model::Rig::builtin("qube-servo-2").expect("built in");
/// let plan = plan(&rig, &Options::default(), 200.0, 2)?;
/// assert_eq!(plan.sequence.len(), 2);
/// // What is recorded second makes everything better known than the first did.
/// assert!(plan.after[1].iter().zip(&plan.after[0]).all(|(both, one)| both <= one));
/// # Ok::<(), furuta_ident::calibrate::CalibrateError>(())
/// ```
///
/// # Errors
/// Unknown keys, a rate outside its range, nothing that any signal would show.
pub fn plan(rig: &Rig, options: &Options, rate: f64, count: usize) -> Result<Plan, CalibrateError> {
    if !(RATES[0]..=RATES[1]).contains(&rate) {
        return Err(CalibrateError::OutOfRange {
            what: "rate",
            value: rate,
            min: RATES[0],
            max: RATES[1],
            unit: "samples per second",
        });
    }
    super::check_options(options, rig)?;
    let space = Space::new(rig, options.body_length, super::asks_transverse(options));
    let question = question(&space, options)?;
    let jobs: Vec<((&str, Shape), f64)> = FAMILY
        .iter()
        .flat_map(|one| LEVELS.map(|level| (*one, level)))
        // Letting go is letting go.
        .filter(|((_, shape), level)| !matches!(shape, Shape::Decay) || *level == 1.0)
        .collect();
    let mut tried: Vec<Tried> = jobs
        .into_par_iter()
        .filter_map(|(signal, level)| try_signal(&space, signal, level, rate, options.horizon))
        .collect();
    let size = space.parameters.len();
    let all = tried
        .iter()
        .fold(DMatrix::zeros(size, size), |sum, t| sum + &t.information);
    let (free, found) = identifiable::select(&question, &all);
    if free.is_empty() {
        return Err(super::nothing(&question, &found));
    }
    let among =
        |m: &DMatrix<f64>| DMatrix::from_fn(free.len(), free.len(), |a, b| m[(free[a], free[b])]);
    for t in &mut tried {
        let (log_det, std) = known(&among(&t.information));
        t.experiment.log_det = log_det;
        t.experiment.std = std;
    }
    tried.sort_by(|a, b| b.experiment.log_det.total_cmp(&a.experiment.log_det));
    let best = tried.first().map_or(0.0, |t| t.experiment.log_det);
    for t in &mut tried {
        t.experiment.efficiency = ((t.experiment.log_det - best) / free.len() as f64).exp();
    }
    let mut sum = DMatrix::zeros(free.len(), free.len());
    let (mut sequence, mut after, mut log_det) = (Vec::new(), Vec::new(), f64::NAN);
    for _ in 0..count.max(1) {
        let next = tried
            .iter()
            .enumerate()
            .map(|(i, t)| (i, known(&(&sum + among(&t.information)))))
            .max_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let Some((i, (value, std))) = next else { break };
        sum += among(&tried[i].information);
        sequence.push(i);
        after.push(std);
        log_det = value;
    }
    Ok(Plan {
        schema: SCHEMA,
        rig: rig.name.clone(),
        rate,
        parameters: free
            .iter()
            .map(|&i| space.parameters[i].key.clone())
            .collect(),
        experiments: tried.into_iter().map(|t| t.experiment).collect(),
        sequence,
        after,
        log_det,
    })
}

/// `log det (F + 1)` and the standard deviations.
fn known(information: &DMatrix<f64>) -> (f64, Vec<f64>) {
    let n = information.nrows();
    let Some(c) = (information + DMatrix::identity(n, n)).cholesky() else {
        return (f64::NEG_INFINITY, vec![1.0; n]);
    };
    let log_det = 2.0 * c.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let inverse = c.inverse();
    (log_det, (0..n).map(|i| inverse[(i, i)].sqrt()).collect())
}

/// What a signal would tell at a level of what the rig bears; `None` where it bears nothing of it.
fn try_signal(
    space: &Space,
    (words, shape): (&str, Shape),
    level: f64,
    rate: f64,
    horizon: f64,
) -> Option<Tried> {
    let rig = &space.rig;
    let limit = rig.params.motor.command_limit;
    let noise = rig.sensors.resolution().map(|q| q / 12.0_f64.sqrt());
    let recorded = |amplitude: f64| {
        let excitation = shape.excitation(amplitude, limit).ok()?;
        excitation.check_sample_period(1.0 / rate).ok()?;
        record(rig, shape, &excitation, 1.0 / rate, noise).filter(|data| within_limits(rig, data))
    };
    let mut amplitude = two_digits(shape.most() * if limit.is_finite() { limit } else { 10.0 });
    let mut halved = 0;
    while recorded(amplitude).is_none() {
        halved += 1;
        if halved > HALVED {
            return None;
        }
        amplitude = two_digits(0.5 * amplitude);
    }
    let amplitude = two_digits(level * amplitude);
    let data = recorded(amplitude)?;
    let problem = CalibrationProblem::new(&data, (space, true), windows(&data, horizon));
    let solved = problem.solve_states(&space.sheet());
    let everything: Vec<usize> = (0..space.parameters.len()).collect();
    let known = problem.information(&solved, &everything);
    let information = relative(space, &solved.values, known);
    let run = &data.runs[0];
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |m: f64, v| m.max(v.abs()));
    information.iter().all(|x| x.is_finite()).then(|| Tried {
        experiment: Experiment {
            excitation: words.to_owned(),
            arguments: shape.arguments(amplitude),
            seconds: SECONDS,
            volts: largest(&mut run.u.iter().copied()),
            volts_rms: rms(&run.u),
            arm: largest(&mut run.y.iter().map(|y| y[0])),
            log_det: f64::NEG_INFINITY,
            efficiency: 0.0,
            std: Vec::new(),
        },
        information,
    })
}

/// Whether speeds stay below what the rig file allows.
fn within_limits(rig: &Rig, data: &Data) -> bool {
    let limits = [rig.limits.arm_speed, rig.limits.pendulum_speed];
    data.runs
        .iter()
        .flat_map(|r| &r.speed)
        .all(|v| (0..2).all(|c| limits[c].is_none_or(|limit| v[c].abs() <= limit)))
}

impl Plan {
    /// The JSON contract, pretty-printed.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Maps have string keys and numbers are finite or null: nothing can fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// The plan for a person: all experiments by what they tell, the sequence to make, and the commands that make it.
    /// `rig` is how the rig file is named on the command line.
    #[must_use]
    pub fn summary(&self, rig: &str) -> String {
        let mut out = format!(
            "Predicted standard deviations after one experiment of {SECONDS} s at {} Hz, in per cent of each \
             parameter\n  {:<56} {:>6} {:>6} {:>5} {:>6}",
            self.rate, "", "V peak", "V RMS", "rad", "D-eff."
        );
        for key in &self.parameters {
            out += &format!(" {:>12}", short(key));
        }
        out.push('\n');
        for e in &self.experiments {
            out += &format!(
                "  {:<56} {:>6} {:>6} {:>5} {:>6.3}",
                e.excitation,
                significant(e.volts, 2),
                significant(e.volts_rms, 2),
                significant(e.arm, 2),
                e.efficiency
            );
            for s in &e.std {
                out += &format!(" {:>12}", significant(100.0 * s, 2));
            }
            out.push('\n');
        }
        out += "\nOne after the other:\n";
        for (i, (&place, after)) in self.sequence.iter().zip(&self.after).enumerate() {
            let Some(e) = self.experiments.get(place) else {
                continue;
            };
            out += &format!(
                "  {:<56} {:>26}",
                format!("{}. {}", i + 1, e.excitation),
                ""
            );
            for s in after {
                out += &format!(" {:>12}", significant(100.0 * s, 2));
            }
            out.push('\n');
        }
        out += "\nOn the rig, and in simulation:\n";
        for (i, &place) in self.sequence.iter().enumerate() {
            let Some(e) = self.experiments.get(place) else {
                continue;
            };
            let n = i + 1;
            out += &format!(
                "  furuta run --port PORT --rig {rig} --task {} --log experiment-{n}.mcap\n  furuta simulate --rig \
                 {rig} --rate {} --input {} --output experiment-{n}.csv\n",
                e.arguments, self.rate, e.arguments
            );
        }
        out
    }
}

/// `torque_constant` of `motor.torque_constant`, cut to what a column holds.
fn short(key: &str) -> String {
    let (group, name) = key.rsplit_once('.').unwrap_or(("", key));
    let group = group.chars().next().unwrap_or(' ');
    format!("{group}.{name}").chars().take(12).collect()
}
