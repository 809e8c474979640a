//! Fitting a model by multiple shooting: Levenberg and Marquardt's method on its parameters, every window's initial
//! state solved for at each trial.
//!
//! The recordings are cut into windows. Each has its own initial state, a nuisance that is eliminated (Schur
//! complement), so that an unstable plant can be fitted and an early error does not spoil what follows. Sensitivities
//! are exact: the same plant is run on dual numbers.

use nalgebra::DVector;

use super::bounded::{bounded_step, past};
use super::data::{Data, Window};
use super::eliminate::{About, Keep, Reduced};
use super::model::{Model, Prior};
use super::slopes::Along;
use super::start::Start;
use super::zeros::turned_back;
use crate::least_squares::{LeastSquares, Rules, minimise};
use crate::stop::Stop;

/// What a model is fitted to.
pub(crate) struct Problem<'a> {
    pub(crate) data: &'a Data,
    pub(crate) windows: Vec<Window>,
    /// When it is wanted, fits end where they are.
    pub(crate) stop: Stop<'a>,
}

/// A fitted model.
#[derive(Clone, Debug)]
pub(crate) struct Fit<M> {
    pub(crate) model: M,
    /// Parameters, in the model's units.
    pub(crate) z: Vec<f64>,
    /// Start of each window, its state from the zeros of its recording.
    pub(crate) states: Vec<Start>,
    /// What each window cost when it was started again in vain, since it fits far worse than the others: it is not its
    /// start that is wrong. Infinite: it was not.
    pub(super) in_vain: Vec<f64>,
    /// Cost of each window: squared residuals in units of the noise.
    pub(crate) costs: Vec<f64>,
    /// What each parameter costs by what is known of it beforehand, in units of what is left per sample.
    pub(crate) priors: Vec<f64>,
    /// Sum of both.
    pub(crate) cost: f64,
    /// By how much errors that are correlated widen standard deviations: root mean square over the free numbers, at
    /// least 1.
    pub(crate) widened: f64,
    /// Standard deviations of `z`, robust against errors that are correlated within a window, and over longer blocks
    /// where more than the noise is left.
    pub(crate) std: Vec<f64>,
    /// The same of each number if those that tell how it acts ([`Model::shape`]) are known.
    pub(crate) std_by_itself: Vec<f64>,
    /// How far beyond its bound each number of `z` would go, were there none; 0 within.
    pub(crate) past: Vec<f64>,
}

impl<M: Model> Fit<M> {
    /// What a model leaves per sample is what its errors are: where that is more than the noise, what is known
    /// beforehand counts as much more (the likelihood of errors of unknown size).
    pub(super) fn add_up(&mut self, floor: f64) {
        let of = |(prior, z): (&Option<Prior>, &f64)| {
            prior.map_or(0.0, |p| ((z - p.mean) / p.std).powi(2))
        };
        self.priors = self.model.priors().iter().zip(&self.z).map(of).collect();
        let left: f64 = self.costs.iter().sum();
        self.cost = left + prior_weight(left, floor) * self.priors.iter().sum::<f64>();
    }

    /// The same in the windows that are `kept`, what is known beforehand not counted.
    pub(crate) fn in_windows(&self, kept: &[bool]) -> Self {
        let windows = || (0..self.costs.len()).filter(|&i| kept[i]);
        let costs: Vec<f64> = windows().map(|i| self.costs[i]).collect();
        Self {
            model: self.model.clone(),
            z: self.z.clone(),
            states: windows().map(|i| self.states[i]).collect(),
            in_vain: windows().map(|i| self.in_vain[i]).collect(),
            cost: costs.iter().sum(),
            costs,
            priors: self.priors.clone(),
            widened: self.widened,
            std: self.std.clone(),
            std_by_itself: self.std_by_itself.clone(),
            past: self.past.clone(),
        }
    }

    /// What the prior of everything that windows share costs, and of the zeros of each recording.
    pub(crate) fn prior_by_recording(&self) -> (f64, Vec<f64>) {
        let layout = self.model.layout();
        let (shared, zeros) = self.priors.split_at(layout.shared);
        let zeros = zeros.chunks(layout.zeros.max(1)).map(|z| z.iter().sum());
        (shared.iter().sum(), zeros.collect())
    }
}

/// Up to this mean square of the residuals over the noise's a fit leaves noise alone: the floor is estimated to 3 %
/// (its square to 6), and models at the truth leave 1.00 to 1.06 (docs/diagnosis.md).
pub(crate) const WHITE: f64 = 1.12;
/// How much what is known beforehand counts where the windows leave this much.
fn prior_weight(left: f64, floor: f64) -> f64 {
    (left / floor).max(1.0)
}

/// How long a fit may go on.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Effort {
    pub(crate) iterations: usize,
    /// Stop when a step gains less than this share of the cost, or of what noise alone leaves where the cost is less:
    /// a gain far below that moves no number by a part of its standard deviation that shows.
    pub(crate) tolerance: f64,
    /// The cost to which the fit must come down: it is abandoned when it will not.
    pub(crate) goal: f64,
    /// Stop when a step gains less than [`FINE`] of what the cost is above this.
    pub(crate) reference: f64,
}

/// A difference of two fits is known well enough to this share of itself.
const FINE: f64 = 1e-2;

impl Effort {
    pub(crate) const QUICK: Self = Self {
        iterations: 8,
        tolerance: 1e-2,
        goal: f64::INFINITY,
        reference: f64::INFINITY,
    };
    pub(crate) const FULL: Self = Self {
        iterations: 40,
        tolerance: 1e-4,
        goal: f64::INFINITY,
        reference: f64::INFINITY,
    };
    /// For parameters whose deviations matter.
    pub(crate) const TIGHT: Self = Self {
        iterations: 40,
        tolerance: 1e-5,
        goal: f64::INFINITY,
        reference: f64::INFINITY,
    };

    /// For errors on data that the fit has not seen, which are known to per cents.
    pub(crate) const APART: Self = Self {
        iterations: 40,
        tolerance: 1e-3,
        goal: f64::INFINITY,
        reference: f64::INFINITY,
    };

    /// The same, ended when what the cost is above `reference` is known to some hundredths.
    pub(crate) const fn above(self, reference: f64) -> Self {
        Self { reference, ..self }
    }

    /// The same, abandoned when the cost cannot come down to `goal`.
    pub(crate) const fn towards(self, goal: f64) -> Self {
        Self { goal, ..self }
    }

    /// The same, cut short where a fit creeps along a valley, as two effects do that stand for one.
    pub(crate) const fn within(self, iterations: usize) -> Self {
        Self { iterations, ..self }
    }
}

/// Damping of the parameters' steps.
const RULES: Rules = Rules {
    iterations: 0,
    damping: 1e-3,
    ease: (0.2, 1e-8),
    stiffen: (8.0, 1e-4),
    most: 1e4,
    abandoned: 1e-5,
};
/// Abandonment ratio: what is still missing after a step may be this many times what the step has gained, at first, and
/// less and less with each five.
const RATIO: f64 = 8.0;
const RATIO_LASTS: usize = 5;
/// Far from the noise the first steps may gain little: three are made before a fit is abandoned. A chi² per sample of
/// less than two is not far.
const PATIENCE: usize = 3;
pub(super) const NEAR: f64 = 2.0;
/// Steps with which initial states follow their parameters.
pub(super) const FOLLOWING: usize = 2;

impl<'a> Problem<'a> {
    pub(crate) fn new(data: &'a Data, windows: Vec<Window>) -> Self {
        Self {
            data,
            windows,
            stop: Stop::NEVER,
        }
    }

    /// The same problem, to be ended when `stop` says so.
    pub(crate) fn until(self, stop: Stop<'a>) -> Self {
        Self { stop, ..self }
    }

    /// Sum of the weights of all samples: the cost that noise alone leaves, but for the degrees of freedom.
    pub(crate) fn samples(&self) -> f64 {
        self.windows.iter().map(|w| self.data.samples(w)).sum()
    }

    /// Cost that a perfect model leaves: one per sample, less those of each window that its initial state takes.
    pub(crate) fn floor(&self) -> f64 {
        self.windows.iter().map(|w| self.data.floor(w)).sum()
    }

    /// Mean square of the residuals of each window, in units of the noise.
    pub(crate) fn left_in_windows<M>(&self, fit: &Fit<M>) -> Vec<f64> {
        let windows = self.windows.iter().zip(&fit.costs);
        windows.map(|(w, cost)| cost / self.data.floor(w)).collect()
    }

    /// Root mean square of the residuals over the noise: 1 is the floor.
    pub(crate) fn chi<M>(&self, fit: &Fit<M>) -> f64 {
        (fit.cost / self.floor()).sqrt()
    }

    /// Mean square of the residuals in units of the noise, and at least that: the unit in which costs are compared.
    pub(crate) fn per_sample<M>(&self, fit: &Fit<M>) -> f64 {
        (fit.cost / self.floor()).max(1.0)
    }

    /// Fits `model` from the parameters and states given. What repeats with the arm's angle is as good whole turns
    /// farther: zeros of theta that end more than half a turn off are tried whole turns back, as their prior has them.
    pub(crate) fn fit<M: Model>(
        &self,
        model: &M,
        z: Vec<f64>,
        states: &[Start],
        effort: Effort,
    ) -> Fit<M> {
        let here = self.fit_from(model, z, states, effort);
        let back = turned_back(&model.layout(), &here.z);
        if back == here.z || self.stop.wanted() {
            return here;
        }
        let there = self.fit_from(model, back, &here.states, effort.towards(here.cost));
        if there.cost < here.cost { there } else { here }
    }

    fn fit_from<M: Model>(
        &self,
        model: &M,
        z: Vec<f64>,
        states: &[Start],
        effort: Effort,
    ) -> Fit<M> {
        let bounds = model.bounds(&z);
        let z: Vec<f64> = z
            .iter()
            .zip(&bounds)
            .map(|(z, (low, high))| z.clamp(*low, *high))
            .collect();
        let mut here = Fit {
            model: model.clone(),
            states: states.to_vec(),
            in_vain: vec![f64::INFINITY; states.len()],
            costs: Vec::new(),
            priors: Vec::new(),
            cost: 0.0,
            widened: 1.0,
            std: vec![f64::NAN; z.len()],
            std_by_itself: vec![f64::NAN; z.len()],
            past: vec![0.0; z.len()],
            z,
        };
        let Some(windows) = self.entered(&mut here) else {
            return here;
        };
        let linear = self.about(&here).reduced(Keep::Slopes);
        let along = self.refine(&mut here, &windows, &linear);
        if !here.cost.is_finite() {
            return here;
        }
        let search = Fitting {
            problem: self,
            bounds: &bounds,
            effort,
            floor: self.floor(),
        };
        let rules = Rules {
            iterations: effort.iterations,
            ..RULES
        };
        let mut start = At {
            fit: here,
            along,
            linear: None,
        };
        start.linear = search.again(&mut start, linear);
        let (At { fit: mut here, .. }, linear) = minimise(&search, start, &rules);
        let r = linear.unwrap_or_else(|| self.linearise(&here));
        let deviations = self.deviations(&here, &r, &bounds);
        here.std = deviations.std;
        here.std_by_itself = deviations.std_by_itself;
        here.widened = deviations.widened;
        here.past = past(&here.z, &r, &bounds);
        here
    }

    /// All windows linearised about a fit.
    pub(crate) fn linearise<M: Model>(&self, f: &Fit<M>) -> Reduced {
        self.about(f).reduced(Keep::Sums)
    }

    pub(super) fn about<'f, M>(&'f self, f: &'f Fit<M>) -> About<'f, M> {
        About {
            model: &f.model,
            z: &f.z,
            data: self.data,
            windows: &self.windows,
            states: &f.states,
            prior_weight: prior_weight(f.costs.iter().sum(), self.floor()),
        }
    }
}

/// A fit, and what its windows say by the slopes with which it was reached.
struct At<M> {
    fit: Fit<M>,
    along: Vec<Option<Along>>,
    /// All windows linearised there, where that is known.
    linear: Option<Reduced>,
}

/// A fit as a problem of least squares.
struct Fitting<'a, 'b> {
    problem: &'a Problem<'b>,
    bounds: &'a [(f64, f64)],
    effort: Effort,
    /// What noise alone leaves.
    floor: f64,
}

impl Fitting<'_, '_> {
    /// Whether a fit that must come down to a goal may be abandoned: far from the noise, the first steps may gain
    /// little.
    fn may_end<M>(&self, here: &Fit<M>, iteration: usize) -> bool {
        iteration >= PATIENCE || here.cost < NEAR * self.floor
    }

    /// Whether a gain that led to a cost is too small for another step.
    fn is_small(&self, gain: f64, cost: f64) -> bool {
        gain < self.effort.tolerance * cost.max(self.floor)
            || gain < FINE * (cost - self.effort.reference)
    }

    fn ratio(iteration: usize) -> f64 {
        RATIO / (1 + iteration / RATIO_LASTS) as f64
    }
}

/// One model's fit; the model is a type of the implementation, not of the problem.
impl<M: Model> LeastSquares<At<M>> for Fitting<'_, '_> {
    type Linear = Reduced;
    type Step = DVector<f64>;

    fn cost(&self, place: &At<M>) -> f64 {
        place.fit.cost
    }

    fn linearise(&self, place: &mut At<M>) -> Reduced {
        let known = place.linear.take();
        known.unwrap_or_else(|| self.problem.about(&place.fit).reduced(Keep::Slopes))
    }

    fn again(&self, place: &mut At<M>, before: Reduced) -> Option<Reduced> {
        let along: Vec<Option<Along>> = (std::mem::take(&mut place.along).into_iter())
            .zip(&place.fit.states)
            // It may have been started again.
            .map(|(along, start)| along.filter(|along| along.start == *start))
            .collect();
        let any = along.iter().any(Option::is_some);
        any.then(|| self.problem.about(&place.fit).again(before, &along))
    }

    fn step(&self, at: &At<M>, r: &Reduced, damping: f64) -> Option<(DVector<f64>, f64)> {
        if self.problem.stop.wanted() {
            return None;
        }
        let step = bounded_step(&at.fit.z, r, self.bounds, damping)?;
        let predicted = 2.0 * r.gradient.dot(&step) - (&r.matrix * &step).dot(&step);
        Some((step, predicted))
    }

    fn trial(&self, at: &At<M>, r: &Reduced, step: &DVector<f64>, _: bool) -> At<M> {
        let (fit, along) = self.problem.follow(&at.fit, r, step);
        At {
            fit,
            along,
            linear: None,
        }
    }

    fn is_worth_a_step(&self, at: &At<M>, predicted: f64, iteration: usize) -> bool {
        let missing = at.fit.cost - self.effort.goal;
        let may_end = self.may_end(&at.fit, iteration);
        !(may_end && missing > Self::ratio(iteration) * predicted.max(0.0))
    }

    fn reached(&self, at: &mut At<M>, gain: f64, iteration: usize) -> bool {
        let place = &mut at.fit;
        let before = place.cost + gain;
        // Before a fit ends, every window is looked at once more.
        let ends = self.is_small(gain, place.cost);
        let reached = place.cost;
        if ends {
            self.problem.restart_worse(place);
        } else {
            self.problem.restart_far_worse(place);
        }
        let small = ends && self.is_small(reached - place.cost, place.cost);
        let missing = place.cost - self.effort.goal;
        let abandoned = self.may_end(place, iteration)
            && missing > Self::ratio(iteration) * (before - place.cost);
        !small && !abandoned
    }

    /// A fit that begins where it has to end takes no step: its windows are looked at all the same.
    fn mend(&self, at: &mut At<M>) -> bool {
        let place = &mut at.fit;
        let reached = place.cost;
        self.problem.restart_worse(place);
        !self.is_small(reached - place.cost, place.cost)
    }
}
