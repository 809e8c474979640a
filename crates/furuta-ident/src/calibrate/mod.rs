//! Calibration in the time domain: the parameters of a rig file from recordings, with what they can tell and how sure.
//!
//! 1. A convex program gives the start from anywhere (`start`): the equations of motion are linear in what they are made of.
//! 2. There, exact sensitivities give the scaled Fisher information: rank, condition, which parameters show and which only together (`identifiable`).
//! 3. Those that show are fitted by multiple shooting, first over short windows, then over long ones (`fit`), within bounds that keep the rig physical.
//! 4. Standard deviations do not trust the noise to be white; the cost along a parameter says where they can be trusted (`profile`).

mod error;
mod fit;
mod identifiable;
mod parameters;
mod plan;
mod profile;
pub mod result;
mod start;
mod words;

use std::time::Instant;

use furuta_model::Rig;
use furuta_model::params::Coefficients;
use nalgebra::{DMatrix, DVector};

pub use error::CalibrateError;
pub(crate) use error::check;
pub use plan::{Experiment, Plan, plan};
pub use result::Calibration;

use crate::diagnose::data::Data;
use crate::diagnose::result::Channel;
use crate::diagnose::shooting::MAX_FREE;
use crate::recording::Recording;
use crate::validate::LatePlant;
use fit::{Fit, Problem, windows};
use identifiable::Question;
use parameters::Space;
use result::{Calibrated, ChannelFit, Combination, SCHEMA};

/// Windows from which the fit sets out, s: there are no local minima.
const SHORT: f64 = 0.25;
/// The start is looked for in so many parameters, the first of the order.
const FIRST: usize = 6;
/// A model that is off by more than so many times the noise over short windows does not follow.
const DOES_NOT_FOLLOW: f64 = 100.0;
/// Residuals beyond so many times the noise are the model's, not the encoders'.
const EXPLAINED: f64 = 1.06;
/// Of the normal distribution: 95 % lie within so many standard deviations.
pub(crate) const NORMAL_95: f64 = 1.959_964;
/// Windows may be so long, s.
const HORIZON: [f64; 2] = [0.1, 60.0];

/// What may be asked of a calibration.
#[derive(Clone, Debug)]
pub struct Options {
    /// Keys of the parameters to fit (`arm.inertia`, `arm.coulomb.torque`); empty: all that the recordings determine.
    pub free: Vec<String>,
    /// Keys of parameters to hold although they show.
    pub hold: Vec<String>,
    /// Keys of parameters whose profile likelihood is wanted, fitted or held.
    pub profile: Vec<String>,
    /// Length of the predictions that are fitted where the pendulum hangs, s; near upright they are half a second at most.
    pub horizon: f64,
    /// Length of the pendulum's body from the hinge to its tip, m, where known: then neither centre of mass nor inertia lies beyond it.
    pub body_length: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            free: Vec::new(),
            hold: Vec::new(),
            profile: Vec::new(),
            horizon: 2.0,
            body_length: None,
        }
    }
}

/// Everything a calibration gives.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// The answer, as in the JSON contract.
    pub calibration: Calibration,
    /// The rig with the fitted values.
    pub rig: Rig,
    /// Measured angles and predictions, by stretch.
    pub curves: Vec<Curve>,
}

/// A stretch of a recording with what was predicted over the windows.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name of the recording.
    pub run: String,
    /// s.
    pub t: Vec<f64>,
    /// V.
    pub u: Vec<f64>,
    /// `[theta, alpha]`, rad.
    pub measured: [Vec<f64>; 2],
    /// By the rig file as given, rad.
    pub nominal: [Vec<f64>; 2],
    /// By the calibrated model, rad.
    pub calibrated: [Vec<f64>; 2],
}

/// Fits the parameters of a rig file to recordings of the rig.
///
/// The same input gives the same output, whatever the number of threads.
///
/// ```
/// use furuta_ident::calibrate::{Options, calibrate};
/// use furuta_ident::recording::Recording;
/// use furuta_model::{Plant, Rig, State};
///
/// // A rig whose arm is half as heavy again as its sheet says.
/// let sheet = Rig::builtin("qube-servo-2").expect("built in");
/// let mut real = sheet.clone();
/// real.params.arm.inertia *= 1.5;
/// let plant: Plant<f64> = Plant::new(&real.params, &[]).expect("no effects");
/// let mut x = plant.rest(State::hanging());
/// let mut csv = String::from("t,u,theta,alpha\n");
/// for k in 0..3000 {
///     let t = f64::from(k) * 0.002;
///     let u = 3.0 * (2.0 * t * (1.0 + t)).sin();
///     let [theta, alpha] = plant.measure(&x);
///     let [p, q] = real.sensors.resolution();
///     csv += &format!("{t},{u},{},{}\n", (theta / p).round() * p, (alpha / q).round() * q);
///     plant.step(&mut x, u, 0.002);
/// }
/// let (recording, _) = Recording::from_csv("sweep.csv", csv.as_bytes())?;
/// let outcome = calibrate(&[recording], &sheet, &Options::default())?;
/// let inertia = &outcome.calibration.parameters["arm.inertia"];
/// assert!((inertia.fitted - real.params.arm.inertia).abs() < 4.0 * inertia.std);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`CalibrateError`]: nothing moves, too short, nothing to be determined, unknown keys, a model that does not follow.
pub fn calibrate(
    recordings: &[Recording],
    rig: &Rig,
    options: &Options,
) -> Result<Outcome, CalibrateError> {
    let begin = Instant::now();
    let data = Data::new(recordings, rig);
    error::check(recordings, rig, &data)?;
    check_options(options)?;
    let space = Space::new(rig, options.body_length, asks_transverse(options));
    let question = question(&space, options)?;
    let profiles = places(&space, &options.profile)?;

    // Where to set out: the rig file, or what the convex program says, whichever follows the recordings better.
    let short = Problem::new(&data, &space, windows(&data, SHORT));
    let as_given = short.settle(&space.nominal());
    let begun = |free: &[usize]| {
        start::start(&space, &data, free)
            .map(|values| short.settle(&values))
            .filter(|found| found.cost < as_given.cost)
            .unwrap_or_else(|| as_given.clone())
    };
    let first: Vec<usize> = (0..FIRST.min(space.parameters.len())).collect();
    let begun_with_all = begun(&first);

    // What the recordings can tell.
    let long = Problem::new(&data, &space, windows(&data, options.horizon));
    let everything: Vec<usize> = (0..space.parameters.len()).collect();
    let settled = long.settle(&begun_with_all.values);
    let information = relative(
        &space,
        &settled.values,
        long.linearise(&settled, &everything).matrix,
    );
    if information.iter().any(|x| !x.is_finite()) {
        return Err(CalibrateError::DoesNotFollow {
            chi: f64::INFINITY,
            horizon: options.horizon,
        });
    }
    let (free, identifiability) = identifiable::select(&question, &information);
    if free.is_empty() {
        return Err(nothing(&question, &identifiability));
    }

    // The fit.
    let from = if free == first {
        begun_with_all
    } else {
        begun(&free)
    };
    let near = short.fit(&from, &free);
    let chi = (near.cost / short.floor()).sqrt();
    if !chi.is_finite() || chi > DOES_NOT_FOLLOW {
        return Err(CalibrateError::DoesNotFollow {
            chi,
            horizon: SHORT,
        });
    }
    let fitted = long.fit(&long.settle(&near.values), &free);
    let covariance = long.covariance(&fitted, &free);

    let rig_fitted = space.rig(&fitted.values);
    let nominal = long.with_values(&fitted, space.nominal());
    let curves = curves(&long, &nominal, &fitted);
    let mut calibration = Calibration {
        schema: SCHEMA,
        rig: rig.name.clone(),
        parameters: Default::default(),
        fitted: free
            .iter()
            .map(|&i| space.parameters[i].key.clone())
            .collect(),
        correlation: correlation(covariance.as_ref(), free.len()),
        combinations: combinations(&space, &fitted, &free, covariance.as_ref()),
        identifiability,
        fit: channel_fits(recordings, &data, &curves),
        chi: (fitted.cost / long.floor()).sqrt(),
        horizon: options.horizon,
        noise: data.noise,
        profiles: profiles
            .iter()
            .map(|&i| profile::profile(&long, &fitted, &free, covariance.as_ref(), i))
            .collect(),
        notices: Vec::new(),
        seconds: 0.0,
    };
    let values = &fitted.values;
    let bounds = space.bounds(&fitted.values, &free);
    for (i, p) in space.parameters.iter().enumerate() {
        let at = free.iter().position(|&f| f == i);
        let std = match (&covariance, at) {
            (Some(c), Some(k)) => c[(k, k)].sqrt() * p.scale,
            _ => f64::NAN,
        };
        let bound = at.map(|k| bounds[k]);
        let at_bound = bound.is_some_and(|(low, high)| values[i] <= low || values[i] >= high);
        let interval = bound.filter(|_| std.is_finite()).map(|(low, high)| {
            let reach = NORMAL_95 * std;
            [(values[i] - reach).max(low), (values[i] + reach).min(high)]
        });
        calibration.parameters.insert(
            p.key.clone(),
            Calibrated {
                nominal: p.nominal,
                fitted: values[i],
                std,
                interval,
                unit: p.unit.clone(),
                identifiable: at.is_some(),
                at_bound,
            },
        );
    }
    if let (true, Some(inertia)) = (
        space.follows(),
        calibration.parameters.get("pendulum.inertia"),
    ) {
        let follower = inertia.clone();
        calibration
            .parameters
            .insert(TRANSVERSE.to_owned(), follower);
    }
    calibration.notices = words::notices(&calibration, &space, &free);
    calibration.seconds = begin.elapsed().as_secs_f64();
    Ok(Outcome {
        calibration,
        rig: rig_fitted,
        curves,
    })
}

/// The plant of a rig file with constants for parameters, and by how much everything is late (s).
pub(crate) fn late_plant(rig: &Rig) -> LatePlant {
    let space = Space::new(rig, None, true);
    space.plant::<4>(&space.nominal(), &[], 4)
}

/// The information in units of the values at which it was found, for sheets that are far off: a value of nearly zero counts as a part of its scale.
fn relative(space: &Space, values: &[f64], mut information: DMatrix<f64>) -> DMatrix<f64> {
    const LEAST: f64 = 0.1;
    for (i, (p, value)) in space.parameters.iter().zip(values).enumerate() {
        let unit = (value.abs() / p.scale).max(LEAST);
        information.row_mut(i).scale_mut(unit);
        information.column_mut(i).scale_mut(unit);
    }
    information
}

/// The inertia that follows another in a rod.
const TRANSVERSE: &str = "pendulum.inertia_transverse";

/// Whether somebody asks for it.
fn asks_transverse(options: &Options) -> bool {
    let mut named = options.free.iter().chain(&options.profile);
    named.any(|key| key == TRANSVERSE)
}

fn check_options(options: &Options) -> Result<(), CalibrateError> {
    let within = |what, value: f64, [min, max]: [f64; 2]| {
        if (min..=max).contains(&value) {
            return Ok(());
        }
        Err(CalibrateError::OutOfRange {
            what,
            value,
            min,
            max,
            unit: if what == "horizon" { "s" } else { "m" },
        })
    };
    within("horizon", options.horizon, HORIZON)?;
    options
        .body_length
        .map_or(Ok(()), |length| within("body length", length, [1e-3, 10.0]))
}

/// Keys to places.
fn places(space: &Space, keys: &[String]) -> Result<Vec<usize>, CalibrateError> {
    keys.iter()
        .map(|key| {
            space
                .find(key)
                .ok_or_else(|| CalibrateError::UnknownParameter {
                    key: key.clone(),
                    known: words::keys(space),
                })
        })
        .collect()
}

fn question<'a>(space: &'a Space, options: &Options) -> Result<Question<'a>, CalibrateError> {
    let mut order = places(space, &options.free)?;
    let hold = places(space, &options.hold)?;
    let asked = !order.is_empty();
    if !asked {
        // Effects of the rig file come after the five that every rig has, before lengths and masses that a ruler and a balance know.
        const COMMON: usize = 5;
        let rigs = space
            .parameters
            .iter()
            .take_while(|p| furuta_model::params::RANGES.iter().any(|r| r.key == p.key))
            .count();
        order = (0..COMMON.min(rigs))
            .chain(rigs..space.parameters.len())
            .chain(COMMON.min(rigs)..rigs)
            .collect();
    }
    // A slender rod has no inertia about its axis, unless somebody asks.
    if !asked {
        order.retain(|&i| {
            let p = &space.parameters[i];
            // Nor is gravity what a pendulum's owner wants to know.
            p.key != "environment.gravity" && (p.key != "pendulum.inertia_axial" || p.nominal > 0.0)
        });
    }
    let mut seen = Vec::new();
    order.retain(|i| {
        let new = !seen.contains(i);
        seen.push(*i);
        new && !hold.contains(i)
    });
    Ok(Question {
        keys: space.parameters.iter().map(|p| p.key.as_str()).collect(),
        order,
        asked,
    })
}

fn nothing(question: &Question<'_>, found: &result::Identifiability) -> CalibrateError {
    let keys: Vec<&str> = question.order.iter().map(|&i| question.keys[i]).collect();
    let reason = found
        .held
        .iter()
        .find(|h| keys.first() == Some(&h.key.as_str()))
        .map_or_else(|| "all are held".to_owned(), |h| h.sentence.clone());
    CalibrateError::NothingIdentifiable {
        keys: keys.join(", "),
        reason,
    }
}

fn correlation(covariance: Option<&DMatrix<f64>>, n: usize) -> Vec<Vec<Option<f64>>> {
    let of = |a: usize, b: usize| {
        let c = covariance?;
        let r = c[(a, b)] / (c[(a, a)] * c[(b, b)]).sqrt();
        r.is_finite().then_some(r)
    };
    (0..n).map(|a| (0..n).map(|b| of(a, b)).collect()).collect()
}

/// Names, formulas and units of the ratios to the weight's moment.
const COMBINATIONS: [(&str, &str, &str); 7] = [
    (
        "arm inertia",
        "(arm.inertia + mass·length² + inertia_axial) / (mass·g·com)",
        "s2",
    ),
    (
        "swing inertia",
        "(mass·com² + inertia_transverse − inertia_axial) / (mass·g·com)",
        "s2",
    ),
    ("coupling", "arm.length / g", "s2"),
    (
        "pendulum inertia",
        "(pendulum.inertia + mass·com²) / (mass·g·com)",
        "s2",
    ),
    (
        "drive",
        "amplifier_gain·torque_constant·gear_ratio·efficiency / resistance / (mass·g·com)",
        "1/V",
    ),
    (
        "arm damping",
        "(arm.viscous + back-EMF) / (mass·g·com)",
        "s",
    ),
    ("pendulum damping", "pendulum.viscous / (mass·g·com)", "s"),
];

/// The seven over the weight.
fn ratios<S: furuta_model::Scalar>(c: &Coefficients<S>) -> [S; 7] {
    [
        c.arm,
        c.swing,
        c.coupling,
        c.pendulum,
        c.drive,
        c.arm_damping,
        c.pendulum_damping,
    ]
    .map(|x| x / c.weight)
}

fn combinations(
    space: &Space,
    fitted: &Fit,
    free: &[usize],
    covariance: Option<&DMatrix<f64>>,
) -> Vec<Combination> {
    let nominal = ratios(&space.coefficients::<1>(&space.nominal(), &[], 0));
    let found = ratios(&space.coefficients::<{ 4 + MAX_FREE }>(&fitted.values, free, 0));
    COMBINATIONS
        .iter()
        .zip(nominal.iter().zip(&found))
        .map(|((name, formula, unit), (nominal, found))| {
            let slope = DVector::from_fn(free.len(), |k, _| found.d[k]);
            // What is at a bound is held: its slopes count for nothing.
            let std = covariance.map_or(f64::NAN, |c| {
                let c = c.map(|x| if x.is_finite() { x } else { 0.0 });
                (&c * &slope).dot(&slope).max(0.0).sqrt()
            });
            Combination {
                name: (*name).to_owned(),
                formula: (*formula).to_owned(),
                nominal: nominal.v,
                fitted: found.v,
                std: if std > 0.0 { std } else { f64::NAN },
                unit: (*unit).to_owned(),
            }
        })
        .collect()
}

/// Measured angles beside the predictions, window after window.
fn curves(problem: &Problem<'_>, nominal: &Fit, fitted: &Fit) -> Vec<Curve> {
    let predicted = [nominal, fitted].map(|f| problem.predictions(f));
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
                t: (0..run.y.len())
                    .map(|k| run.t0 + k as f64 * run.h)
                    .collect(),
                u: run.u.clone(),
                nominal: joined(&predicted[0]),
                calibrated: joined(&predicted[1]),
                measured,
            }
        })
        .collect()
}

/// `100 (1 - |y - ŷ| / |y - mean y|)` over the samples that were predicted.
pub(crate) fn fit_percent(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|p| p.0).sum::<f64>() / n;
    let left: f64 = pairs.iter().map(|(y, p)| (y - p).powi(2)).sum();
    let spread: f64 = pairs.iter().map(|(y, _)| (y - mean).powi(2)).sum();
    100.0 * (1.0 - (left / spread).sqrt())
}

fn channel_fits(recordings: &[Recording], data: &Data, curves: &[Curve]) -> Vec<ChannelFit> {
    let mut fits = Vec::new();
    for (r, recording) in recordings.iter().enumerate() {
        for (c, channel) in Channel::ALL.into_iter().enumerate() {
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
