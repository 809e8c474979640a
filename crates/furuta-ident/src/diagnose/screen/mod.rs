//! The grid screen: the score statistic of each effect, and where its fit should start.
//!
//! The answer to any course of torque comes from impulse responses computed once, and thousands of orders, frequencies
//! or moments are tried without simulating (`scan`). Where an effect is no torque, one simulation with it gives a score
//! statistic. What the free initial states and the base parameters would absorb is projected out; what is left says how
//! much the cost would fall, and at which strength.
//!
//! An effect that depends on the arm's absolute angle meets each recording at another one, since each encoder was
//! zeroed elsewhere: its place in the turn is looked for recording by recording.

use furuta_model::Spec;
use furuta_model::effects::{Acts, Kind, ParameterSpec};
use furuta_model::params::Coefficients;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SVector, Vector4};

mod counts;
mod levels;
mod scan;
mod spectrum;
mod stops;
mod sums;

use super::Fit;
use super::hypothesis::{FIRST_EFFECT, Hypothesis, TIMING};
use crate::shooting::{ImpulseResponse, Model, Problem, Windows, ZEROS, impulse_responses};

/// Strength (in units of the typical one) at which a candidate that starts from none is tried.
pub(super) const TOUCH: f64 = 0.3;
/// Curvature of what is held: nothing moves it.
const HELD: f64 = 1e100;
/// An angle over which a torque's slope is taken, rad.
const SLOPE: f64 = 1e-3;

/// What follows in a window: the base parameters, and the zeros of its recording.
pub(super) const FOLLOW: usize = FIRST_EFFECT + ZEROS;
pub(super) type Response = ImpulseResponse<FOLLOW>;

/// The impulse responses about a fit, whose base parameters and zeros follow; what is held or at its bound does not.
pub(super) fn responses(problem: &Problem<'_>, fit: &Fit) -> (Coefficients<f64>, Vec<Response>) {
    let layout = fit.model.layout();
    let bounds = fit.model.bounds(&fit.z);
    let (low, high) = bounds[TIMING];
    let mut held = [false; FOLLOW];
    held[TIMING] = fit.z[TIMING] <= low || fit.z[TIMING] >= high;
    for k in 0..ZEROS {
        let is_held = |r: usize| {
            let (low, high) = bounds[layout.zero(r, k)];
            low == high
        };
        held[FIRST_EFFECT + k] = layout.zeros == 0 || (0..layout.recordings).all(is_held);
    }
    impulse_responses::<FOLLOW, _>(problem, fit, held)
}

/// A score statistic from one simulation, in units of the noise; what initial states and base parameters can follow
/// taken out.
#[derive(Clone, Debug)]
pub(super) struct Score {
    /// Sum of the squares of what the effect changes.
    pub(super) square: f64,
    /// Sum of the products of that with what the fit leaves.
    pub(super) product: f64,
    /// How far the base parameters and the zeros go to mimic that.
    mimic: DVector<f64>,
}

impl Score {
    /// By how much the cost would fall if what the effects change about the predictions could be had at any strength,
    /// or `one_way` only with the sign it has.
    pub(super) fn statistic(&self, one_way: bool) -> f64 {
        if self.square <= 0.0 || (one_way && self.product <= 0.0) {
            0.0
        } else {
            self.product * self.product / self.square
        }
    }
}

/// What a fit says about any small torque.
pub(super) struct Screen {
    responses: Vec<Response>,
    coefficients: Coefficients<f64>,
    /// Normal equations of the base parameters and the zeros of all recordings, the initial states taken out.
    normal: Option<Cholesky<f64, Dyn>>,
    gradient: DVector<f64>,
    recordings: usize,
    /// Whether each recording has a zero of theta of its own that no effect of the fit tells.
    zeros_open: bool,
    longest: f64,
    period: f64,
    /// Between which angles the arm turned in each recording, rad.
    travel: Vec<[f64; 2]>,
}

/// How the grid screen looks for an effect's place.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Looks {
    /// A torque with a place in time, frequency or angle: a grid of places.
    Grid,
    /// A step of an encoder's zero: every moment between two samples.
    Moments,
    /// Levels of the command: every distance.
    Levels,
    /// End stops: where the arm turned back.
    Stops,
}

/// How the grid screen finds a start; `None` where it does not.
pub(super) fn looks(spec: &Spec) -> Option<Looks> {
    let has = |kind: Kind| spec.parameters.iter().any(|p| p.kind == kind);
    let places = |p: &ParameterSpec| !p.kind.is_amount() && !matches!(p.kind, Kind::Choice(_));
    let acts = spec.acts;
    if has(Kind::Moment) {
        Some(Looks::Moments)
    } else if has(Kind::Spacing) {
        Some(Looks::Levels)
    } else if acts.includes(Acts::CONTACT) {
        Some(Looks::Stops)
    } else {
        let placed = spec.sees_angle() || spec.parameters.iter().any(places);
        (acts.includes(Acts::TORQUE) && !acts.includes(Acts::MEMORY) && placed)
            .then_some(Looks::Grid)
    }
}

/// Whether an effect stays where the grid screen places it: no fit improves a moment between samples, or levels.
pub(super) fn stays_placed(spec: &Spec) -> bool {
    matches!(looks(spec), Some(Looks::Moments | Looks::Levels))
}

/// Whether one of many places was looked for: an order, a frequency, a moment, a distance of levels.
pub(super) fn is_scanned(spec: &Spec) -> bool {
    let scanned = |p: &ParameterSpec| {
        matches!(
            p.kind,
            Kind::Whole | Kind::Frequency | Kind::Time | Kind::Moment | Kind::Spacing
        )
    };
    spec.parameters.iter().any(scanned)
}

impl Screen {
    /// Computes the impulse responses about `fit`.
    pub(super) fn new(problem: &Problem<'_>, fit: &Fit) -> Self {
        let data = problem.data;
        let (coefficients, responses) = responses(problem, fit);
        let sheet = &fit.model.sheet;
        let size = followers(sheet.recordings);
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut gradient = DVector::<f64>::zeros(size);
        for response in &responses {
            for i in 0..FOLLOW {
                let at = follower(response.recording, i);
                gradient[at] += response.base_gradient[i];
                for j in 0..FOLLOW {
                    normal[(at, follower(response.recording, j))] += response.base_normal[(i, j)];
                }
            }
        }
        // What is known beforehand holds a parameter that the data leave open.
        let (priors, bounds) = (fit.model.priors(), fit.model.bounds(&fit.z));
        let layout = fit.model.layout();
        let weight = problem.per_sample(fit);
        for i in 0..size {
            normal[(i, i)] += 1e-9 + 1e-9 * normal[(i, i)];
            let place = if i < FIRST_EFFECT {
                i
            } else if layout.zeros > 0 {
                layout.shared + i - FIRST_EFFECT
            } else {
                continue;
            };
            if bounds[place].0 == bounds[place].1 {
                normal.row_mut(i).fill(0.0);
                normal.column_mut(i).fill(0.0);
                normal[(i, i)] = HELD;
                gradient[i] = 0.0;
            } else if let Some(prior) = priors[place] {
                let weight = weight * prior.std.powi(-2);
                normal[(i, i)] += weight;
                gradient[i] += weight * (prior.mean - fit.z[place]);
            }
        }
        let travel = (0..sheet.recordings).map(|r| {
            let runs = data.runs.iter().filter(|run| run.recording == r);
            let angles = runs.flat_map(|run| &run.y).map(|y| y[0]);
            angles.fold([f64::MAX, f64::MIN], |[a, b], y| [a.min(y), b.max(y)])
        });
        Self {
            responses,
            travel: travel.collect(),
            coefficients,
            normal: normal.cholesky(),
            gradient,
            recordings: sheet.recordings,
            zeros_open: sheet.own_zeros && !fit.model.sees_angle(),
            longest: sheet.end,
            period: sheet.period,
        }
    }

    /// How far the arm turned, rad, as if all recordings had one zero.
    fn turned(&self) -> f64 {
        let ends = |[a, b]: [f64; 2], [c, d]: &[f64; 2]| [a.min(*c), b.max(*d)];
        let [least, most] = self.travel.iter().fold([f64::MAX, f64::MIN], ends);
        most - least
    }

    /// What the effects in `z` change about the predictions, held against itself and against what the fit leaves;
    /// `None` where the data do not determine the base parameters.
    pub(super) fn score(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        h: &Hypothesis,
        z: &[f64],
    ) -> Option<Score> {
        let base = self.normal.as_ref()?;
        let windows = Windows::new(h, z);
        let (mut square, mut product) = (0.0, 0.0);
        let mut cross = DVector::<f64>::zeros(self.gradient.len());
        for response in &self.responses {
            let w = &problem.windows[response.window];
            let with = windows.predictions(problem.data, w, &fit.states[response.window]);
            let (mut own, mut left, mut shared) = (0.0, 0.0, Vector4::zeros());
            let mut towards = SVector::<f64, FOLLOW>::zeros();
            for (k, with) in with.iter().enumerate() {
                for (c, with) in with.iter().enumerate() {
                    let y = (with - response.y[k][c]) * response.weight[k][c];
                    own += y * y;
                    left += y * response.left[k][c];
                    shared += response.slopes[k][c] * y;
                    towards += response.base[k][c] * y;
                }
            }
            let absorbed = response.normal.solve(&shared);
            let gain = own - absorbed.dot(&shared);
            if !gain.is_finite() {
                continue;
            }
            square += gain;
            product += left - absorbed.dot(&response.gradient);
            let own = towards - response.absorbed.tr_mul(&shared);
            for i in 0..FOLLOW {
                cross[follower(response.recording, i)] += own[i];
            }
        }
        let mimic = base.solve(&cross);
        Some(Score {
            square: square - mimic.dot(&cross),
            product: product - mimic.dot(&self.gradient),
            mimic,
        })
    }

    /// Moves the base parameters and the zeros in `z` to where they fit best beside `share` times what `score` tells
    /// of, to first order. The free initial states follow when a fit begins.
    pub(super) fn follow(&self, h: &Hypothesis, z: &mut [f64], score: &Score, share: f64) {
        let Some(base) = &self.normal else {
            return;
        };
        let moves = base.solve(&self.gradient) - share * &score.mimic;
        let layout = h.layout();
        for (i, by) in moves.iter().enumerate() {
            if i < FIRST_EFFECT {
                z[i] += by;
            } else if layout.zeros > 0 {
                z[layout.shared + i - FIRST_EFFECT] += by;
            }
        }
    }
}

/// How many numbers follow: the base parameters, and each recording's zeros.
const fn followers(recordings: usize) -> usize {
    FIRST_EFFECT + recordings * ZEROS
}

/// Where the `i`-th number that follows in a window of a recording stands among all that do.
const fn follower(recording: usize, i: usize) -> usize {
    if i < FIRST_EFFECT {
        i
    } else {
        i + recording * ZEROS
    }
}
