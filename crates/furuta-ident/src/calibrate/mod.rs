//! Calibration in the time domain: the parameters of a rig file from recordings, with what they can tell and how sure.
//!
//! 1. A convex program gives the start from anywhere (`start`): the equations of motion are linear in what they are
//!    made of.
//! 2. There, exact sensitivities give the scaled Fisher information: rank, condition, which parameters show and which
//!    only together (`identifiable`).
//! 3. Those that show are fitted by multiple shooting, first over short windows, then over long ones (`fit`), within
//!    bounds that keep the rig physical.
//! 4. Standard deviations do not trust the noise to be white; the cost along a parameter says where they can be trusted
//!    (`profile`).

mod combinations;
mod curves;
mod error;
mod fit;
mod identifiable;
mod parameters;
mod plan;
mod profile;
pub mod result;
mod start;
mod words;

use std::borrow::Cow;
use std::time::Instant;

use furuta_model::Rig;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

pub use error::CalibrateError;
pub use plan::{Experiment, Plan, plan};
pub use result::{Calibration, Verification};

use crate::answer::nan_for_null;
use crate::insufficient;
use crate::pendulum::Pendulum;
use crate::recording::Recording;
use crate::shooting::Data;
use crate::stages::Stages;
use crate::validate::{self, validate_with};
use combinations::combinations;
use curves::{channel_fits, curves};
use fit::{CalibrationProblem, windows};
use identifiable::Question;
use parameters::Space;
use result::{Calibrated, SCHEMA};

/// Windows from which the fit sets out, s: there are no local minima.
const SHORT: f64 = 0.25;
/// The start is looked for in this many parameters, the first of the order.
const FIRST: usize = 6;
/// A model that is off by more than this many times the noise over short windows does not follow.
const DOES_NOT_FOLLOW: f64 = 100.0;
/// Residuals beyond this many times the noise are the model's, not the encoders'.
const EXPLAINED: f64 = 1.06;
/// Of the normal distribution: 95 % lie within this many standard deviations.
pub(crate) const NORMAL_95: f64 = 1.959_964;
/// The stages in their order, with the per cent done when each begins.
const BEGINS: Stages<6> = Stages([
    ("looking for a start", 0.0),
    ("asking what the recordings tell", 20.0),
    ("fitting", 40.0),
    ("fitting over long windows", 55.0),
    ("predicting", 80.0),
    ("profiling", 90.0),
]);

/// The names of the stages of [`calibrate_with`].
pub const STAGES: [&str; 6] = BEGINS.names();

/// Windows may be this long, s.
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
    /// Length of the predictions that are fitted where the pendulum hangs, s; near upright they are half a second at
    /// most.
    pub horizon: f64,
    /// Length of the pendulum's body from the hinge to its tip, m, where known: then neither centre of mass nor inertia
    /// lies beyond it.
    pub body_length: Option<f64>,
    /// What the rig was in the recordings: as it is built, or a part of it alone.
    pub pendulum: Pendulum,
    /// Whether all recordings count their angles from the rig's zeros: otherwise each has zeros of its own.
    pub same_zero: bool,
    /// Recordings of the same rig in other states, fitted together with these: one fit, the numbers of the rig file
    /// that both show shared. Those of the arm alone set its inertia apart from what the pendulum adds.
    pub beside: Vec<(Pendulum, Recording)>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            free: Vec::new(),
            hold: Vec::new(),
            profile: Vec::new(),
            horizon: 2.0,
            body_length: None,
            pendulum: Pendulum::Swings,
            same_zero: false,
            beside: Vec::new(),
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

impl Outcome {
    /// An outcome of parts that were kept: the answer from [`Calibration::from_json`].
    #[must_use]
    pub const fn kept(calibration: Calibration, rig: Rig, curves: Vec<Curve>) -> Self {
        Self {
            calibration,
            rig,
            curves,
        }
    }

    /// Judges rig file (`as_given`) and calibrated rig by recordings that the fit did not see; the answer is
    /// [`Calibration::verification`].
    ///
    /// # Errors
    /// As [`validate_with`].
    pub fn verify(
        &mut self,
        unseen: &[Recording],
        as_given: &Rig,
        options: validate::Options,
    ) -> Result<(), CalibrateError> {
        self.calibration.verification = Some(Verification {
            as_given: validate_with(unseen, as_given, options)?,
            calibrated: validate_with(unseen, &self.rig, options)?,
        });
        Ok(())
    }
}

/// A stretch of a recording with what was predicted over the windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Name of the recording.
    pub run: String,
    /// s.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub t: Vec<f64>,
    /// V.
    #[serde(deserialize_with = "nan_for_null::list")]
    pub u: Vec<f64>,
    /// `[theta, alpha]`, rad.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub measured: [Vec<f64>; 2],
    /// By the rig file as given, rad.
    #[serde(deserialize_with = "nan_for_null::pair")]
    pub nominal: [Vec<f64>; 2],
    /// By the calibrated model, rad.
    #[serde(deserialize_with = "nan_for_null::pair")]
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
/// let mut samples = Vec::new();
/// for k in 0..3000 {
///     let t = f64::from(k) * 0.002;
///     let u = 3.0 * (2.0 * t * (1.0 + t)).sin();
///     let [theta, alpha] = real.sensors.quantised(plant.measure(&x));
///     samples.push([t, u, theta, alpha]);
///     plant.step(&mut x, u, 0.002);
/// }
/// let (recording, _) = Recording::from_samples("sweep", samples)?;
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
    calibrate_with(recordings, rig, options, &|_, _| true)
}

/// [`calibrate`] that tells `listener` each stage ([`STAGES`]) as it begins and how much is done, per cent; where that
/// answers `false`, the calibration ends with [`CalibrateError::Stopped`].
///
/// ```
/// use furuta_ident::calibrate::{CalibrateError, Options, calibrate_with};
/// use furuta_ident::recording::Recording;
/// use furuta_model::{Plant, Rig, State};
/// let sheet = Rig::builtin("qube-servo-2").expect("built in");
/// let plant: Plant<f64> = Plant::new(&sheet.params, &[]).expect("no effects");
/// let mut x = plant.rest(State::hanging());
/// let mut samples = Vec::new();
/// for k in 0..3000 {
///     let t = f64::from(k) * 0.002;
///     let u = 3.0 * (2.0 * t * (1.0 + t)).sin();
///     let [theta, alpha] = plant.measure(&x);
///     samples.push([t, u, theta, alpha]);
///     plant.step(&mut x, u, 0.002);
/// }
/// let (recording, _) = Recording::from_samples("sweep", samples)?;
/// let until_fit = |stage: &str, _percent: f64| stage != "fitting";
/// let stopped = calibrate_with(&[recording], &sheet, &Options::default(), &until_fit);
/// assert_eq!(stopped.unwrap_err(), CalibrateError::Stopped { stage: "fitting" });
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`calibrate`], and where it is stopped.
pub fn calibrate_with(
    recordings: &[Recording],
    rig: &Rig,
    options: &Options,
    listener: &dyn Fn(&'static str, f64) -> bool,
) -> Result<Outcome, CalibrateError> {
    let begin = Instant::now();
    let enter = |stage: usize| match BEGINS.0[stage] {
        (name, percent) if listener(name, percent) => Ok(()),
        (stage, _) => Err(CalibrateError::Stopped { stage }),
    };
    enter(0)?;
    let mut all = Cow::Borrowed(recordings);
    if !options.beside.is_empty() {
        all.to_mut()
            .extend(options.beside.iter().map(|(_, r)| r.clone()));
    }
    let state = |r: usize| match r.checked_sub(recordings.len()) {
        None => options.pendulum,
        Some(i) => options.beside[i].0,
    };
    let data = Data::in_states(&all, rig, state);
    insufficient::check(&all, rig, &data)?;
    check_options(options, rig)?;
    let space = Space::new(rig, options.body_length, asks_transverse(options));
    let question = question(&space, options)?;
    let profiles = places(&space, &options.profile)?;

    // Where to set out: the rig file, or what the convex program says, whichever follows the recordings better.
    let own_zeros = !options.same_zero;
    let short = CalibrationProblem::new(&data, (&space, own_zeros), windows(&data, SHORT));
    let as_given = short.solve_states(&space.sheet());
    let begun = |free: &[usize]| {
        start::start(&space, &data, free)
            .map(|values| short.solve_states(&values))
            .filter(|found| found.cost < as_given.cost)
            .unwrap_or_else(|| as_given.clone())
    };
    let first: Vec<usize> = (0..FIRST.min(space.parameters.len())).collect();
    let begun_with_all = begun(&first);

    // What the recordings can tell.
    enter(1)?;
    let long = CalibrationProblem::new(&data, (&space, own_zeros), windows(&data, options.horizon));
    let everything: Vec<usize> = (0..space.parameters.len()).collect();
    let solved = long.solve_states(&begun_with_all.values);
    let information = relative(
        &space,
        &solved.values,
        long.information(&solved, &everything),
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
    enter(2)?;
    let same = free.len() == first.len() && free.iter().all(|i| first.contains(i));
    let from = if same { begun_with_all } else { begun(&free) };
    let near = short.fit(&from, &free);
    let chi = (near.cost / short.floor()).sqrt();
    if !chi.is_finite() || chi > DOES_NOT_FOLLOW {
        return Err(CalibrateError::DoesNotFollow {
            chi,
            horizon: SHORT,
        });
    }
    enter(3)?;
    let fitted = long.fit(&long.solve_states(&near.values), &free);
    let covariance = long.covariance(&fitted, &free);

    enter(4)?;
    let rig_fitted = space.rig(&fitted.values);
    let as_given_long = long.with_values(&fitted, space.sheet());
    let curves = curves(&long, &as_given_long, &fitted);
    let mut calibration = Calibration {
        schema: SCHEMA,
        rig: rig.name.clone(),
        parameters: Default::default(),
        fitted: free
            .iter()
            .map(|&i| space.parameters[i].key.clone())
            .collect(),
        correlation: correlation(covariance.as_ref(), free.len()),
        // They are ratios to the pendulum's weight, of the arm and of the pendulum.
        combinations: if data.states().iter().any(|state| state.is_whole()) {
            combinations(&space, &fitted, &free, covariance.as_ref())
        } else {
            Vec::new()
        },
        identifiability,
        fit: channel_fits(&all, &data, &curves),
        chi: (fitted.cost / long.floor()).sqrt(),
        horizon: options.horizon,
        noise: data.noise,
        profiles: Vec::new(),
        verification: None,
        notices: Vec::new(),
        seconds: 0.0,
    };
    for &i in &profiles {
        enter(5)?;
        let found = profile::profile(&long, &fitted, &free, covariance.as_ref(), i);
        calibration.profiles.push(found);
    }
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
                nominal: p.sheet,
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
    calibration
        .notices
        .extend(words::of_parts(recordings.len(), &data));
    calibration.seconds = begin.elapsed().as_secs_f64();
    Ok(Outcome {
        calibration,
        rig: rig_fitted,
        curves,
    })
}

/// The information in units of the values at which it was found, for sheets that are far off: a value of nearly zero
/// counts as a part of its scale.
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

/// Whether a caller asks for it.
fn asks_transverse(options: &Options) -> bool {
    let mut named = options.free.iter().chain(&options.profile);
    named.any(|key| key == TRANSVERSE)
}

fn check_options(options: &Options, rig: &Rig) -> Result<(), CalibrateError> {
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
    // The tip lies beyond the centre of mass, of which the rig file may be wrong where it is to be fitted.
    let is_fitted = options.free.iter().any(|key| key == "pendulum.com");
    let least = if is_fitted {
        1e-3
    } else {
        rig.params.pendulum.com
    };
    options.body_length.map_or(Ok(()), |length| {
        within("body length", length, [least, 10.0])
    })
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
    if let Some(both) = order.iter().find(|i| hold.contains(i)) {
        return Err(CalibrateError::FreeAndHeld {
            key: space.parameters[*both].key.clone(),
        });
    }
    let asked = !order.is_empty();
    if !asked {
        // Effects of the rig file come after the five that every rig has, before lengths and masses that a ruler and a
        // balance know.
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
    // A slender rod has no inertia about its axis, unless a caller asks for one.
    if !asked {
        order.retain(|&i| {
            let p = &space.parameters[i];
            // Nor is gravity what a pendulum's owner wants to know.
            p.key != "environment.gravity" && (p.key != "pendulum.inertia_axial" || p.sheet > 0.0)
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
