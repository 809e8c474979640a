//! What no effect of the catalogue explains: an empirical expression for it, sparse and judged on data that were not
//! fitted.
//!
//! About the fit with all that was named, a small torque on either axis moves the predictions linearly (the same
//! impulse responses as in `screen`). Each term of the library of [`TERMS`] on each axis is such a torque, so the cost
//! is a quadratic in their coefficients, the windows' initial states and all fitted parameters eliminated. A lasso on
//! it,
//!
//! ```text
//! minimise  ½ c'G c - b'c + lambda |c|_1,   c <= 0 for terms that can only drag or only drive
//! ```
//!
//! is solved along a path of lambda; the few terms that come in first are refined by exchange, their number is chosen
//! on the folds of `held_out`, and the expression is fitted like any hypothesis and kept if it lowers the error on
//! held-out data clearly. It is no cause: the verdict does not change.

mod library;
mod normal;
mod sparse;

use furuta_model::Spec;
use furuta_model::effects::{EMPIRICAL, TERMS};
use nalgebra::DVector;

use self::library::{Column, library};
use self::normal::{LibraryNormal, normals};
use self::sparse::choose;
use super::Fit;
use super::held_out::{self, Asked, Folds, Unseen};
use super::hypothesis::Sheet;
use super::predict::{self, rms};
use super::repair;
use super::result::{CustomTerm, Expression};
use crate::shooting::{Effort, MAX_FREE, Model, Problem};

/// An expression has at most this many terms: more are not readable.
const MOST_TERMS: usize = 3;
/// The whole must lower the squared error on held-out data by this share.
const LEAST_GAIN: f64 = 0.1;
/// In the place of the effects named it must leave less than half of the cost that it leaves beside them.
const INSTEAD: f64 = 0.5;
/// So often terms are looked for.
const ROUNDS: usize = 2;
/// A coefficient within this many standard deviations of zero is none.
const SIGNIFICANT: f64 = 3.0;

/// An expression and the fit that has it.
pub(super) struct Custom {
    /// With the terms behind the effects that were named.
    pub(super) fit: Fit,
    expression: Expression,
    /// Its errors on held-out data, rad.
    pub(super) errors: Vec<[f64; 2]>,
    columns: Vec<Column>,
}

/// An expression for what no effect explains, where one helps on held-out data: beside the effects that were named and
/// convince beside it, or in the place of all of them, where that explains the recordings and the other does not, or
/// leaves far less (effects named by mistake each take a part of what one expression says). `without` are the errors of
/// `named` on held-out data.
pub(super) fn propose(
    problem: &Problem<'_>,
    folds: &Folds,
    refitted: &Fit,
    (named, without): (&Fit, &Unseen),
) -> Option<Custom> {
    let beside = grow(problem, folds, named).map(|grown| needed(problem, grown));
    let left = |grown: &Option<Grown>| grown.as_ref().map_or(named.cost, |(fit, _)| fit.cost);
    let explains = |grown: &Option<Grown>| grown.as_ref().is_some_and(|(f, _)| problem.explains(f));
    let instead = (!named.model.effects.is_empty())
        .then(|| grow(problem, folds, refitted))
        .flatten()
        .filter(|instead| {
            (problem.explains(&instead.0) && !explains(&beside))
                || instead.0.cost < INSTEAD * left(&beside)
        });
    let (fit, columns) = instead.or(beside)?;
    let fit = problem.fit(&fit.model, fit.z.clone(), &fit.states, Effort::FULL);
    if !lasts(problem, &[refitted, named], &fit) {
        return None;
    }
    let with = held_out::unseen(problem.data, folds, &fit, Asked::ERRORS, problem.stop);
    if problem.stop.wanted() {
        return None;
    }
    let gain = with.removes_of(without);
    if gain.is_nan() || gain < LEAST_GAIN {
        return None;
    }
    let expression = Expression {
        terms: terms(&fit, &columns),
        held_out_gain: gain,
        without: rms(without.errors.iter()).into(),
        with: rms(with.errors.iter()).into(),
    };
    Some(Custom {
        fit,
        expression,
        errors: with.errors,
        columns,
    })
}

/// Whether the model with the expression predicts whole runs no worse than any of those without: what imitates for a
/// quarter of a second may run away.
fn lasts(problem: &Problem<'_>, without: &[&Fit], with: &Fit) -> bool {
    let error = |fit: &Fit| predict::open_loop(problem.data, fit);
    let least = without.iter().map(|f| error(f)).fold(f64::MAX, f64::min);
    error(with) <= least
}

/// A fit and the terms in it, which are its last effects.
type Grown = (Fit, Vec<Column>);

/// Without the effects, one after the other, that do not convince beside the terms.
fn needed(problem: &Problem<'_>, (mut fit, columns): Grown) -> Grown {
    loop {
        let names = &fit.model.effects[..fit.model.effects.len() - columns.len()];
        let weakest = (names.iter())
            .map(|spec| problem.without(&fit, spec.id, Effort::FULL))
            .filter(|smaller| !problem.evidence(smaller, &fit).convinces())
            .min_by(|a, b| a.cost.total_cmp(&b.cost));
        match weakest {
            Some(smaller) => fit = smaller,
            None => return (fit, columns),
        }
    }
}

/// Adds terms to `start` as long as they help, each round about the fit with those before.
fn grow(problem: &Problem<'_>, folds: &Folds, start: &Fit) -> Option<Grown> {
    let sheet = &start.model.sheet;
    let library = library(&sheet.coefficients, sheet.moved());
    let (mut here, mut columns) = (start.clone(), Vec::new());
    for _ in 0..ROUNDS {
        if problem.explains(&here) {
            break;
        }
        let Some((found, step)) = further(problem, folds, &here, &library, columns.len()) else {
            break;
        };
        let mut trial = with_terms(problem, &here, columns.len(), &found, &step)?;
        let mut more = columns.clone();
        more.extend(found);
        // What the straight model asked for, and the curved one does not.
        while let Some(i) = insignificant(&trial, more.len()) {
            more.remove(i);
            trial = without_term(problem, &trial, more.len(), i);
        }
        let drives = (more.iter().enumerate())
            .any(|(i, c)| c.drags && trial.z[coefficient(&trial, more.len(), i)] > 0.0);
        if drives || more.len() <= columns.len() || !problem.evidence(&here, &trial).helps() {
            break;
        }
        (here, columns) = (trial, more);
    }
    (!columns.is_empty()).then_some((here, columns))
}

/// The terms that a rig file holds.
fn slots(sheet: &Sheet) -> Vec<&'static Spec> {
    let taken = |s: &Spec| sheet.present.iter().any(|e| e.spec().id == s.id);
    EMPIRICAL.iter().copied().filter(|s| !taken(s)).collect()
}

/// Where the coefficient of the `i`-th of `count` terms stands among the parameters.
fn coefficient(fit: &Fit, count: usize, i: usize) -> usize {
    let h = &fit.model;
    h.offset(h.effects.len() - count + i)
}

/// The fit with further terms; `before` are there already, `step` says where parameters and coefficients start.
fn with_terms(
    problem: &Problem<'_>,
    here: &Fit,
    before: usize,
    found: &[Column],
    step: &DVector<f64>,
) -> Option<Fit> {
    let p = here.z.len();
    let mut h = here.model.clone();
    let mut z: Vec<f64> = (0..p).map(|i| here.z[i] + step[i]).collect();
    let slots = slots(&here.model.sheet);
    for (i, column) in found.iter().enumerate() {
        let spec = slots.get(before + i)?;
        let typical = spec.parameters[0].typical(&here.model.sheet.params);
        let values = [
            step[p + i] / typical,
            column.axis as f64,
            column.term as f64,
        ];
        z = h.extended(&z, &values);
        h = h.with(spec);
    }
    Some(problem.fit(&h, z, &here.states, Effort::QUICK))
}

/// The term whose coefficient is the least certain, if that may as well be zero.
fn insignificant(fit: &Fit, count: usize) -> Option<usize> {
    let certainty = |i: usize| {
        let at = coefficient(fit, count, i);
        fit.z[at].abs() / fit.std[at]
    };
    (0..count)
        .filter(|i| certainty(*i).is_nan() || certainty(*i) < SIGNIFICANT)
        .min_by(|a, b| certainty(*a).total_cmp(&certainty(*b)))
}

/// The fit without the `i`-th term; `left` are left.
fn without_term(problem: &Problem<'_>, fit: &Fit, left: usize, i: usize) -> Fit {
    let at = coefficient(fit, left + 1, i);
    let mut h = fit.model.clone();
    let mut z = fit.z.clone();
    z.drain(at..at + EMPIRICAL[0].parameters.len());
    // Those behind it move up: the terms of a rig are numbered without a gap.
    h.effects.pop();
    problem.fit(&h, z, &fit.states, Effort::QUICK)
}

/// Terms for what `here` leaves, in which there are `before` already, and the step of its parameters and their
/// coefficients.
fn further(
    problem: &Problem<'_>,
    folds: &Folds,
    here: &Fit,
    library: &[Column],
    before: usize,
) -> Option<(Vec<Column>, DVector<f64>)> {
    // A fit holds a limited number of parameters.
    let free = MAX_FREE.saturating_sub(here.model.layout().local()) / EMPIRICAL[0].parameters.len();
    let slots = slots(&here.model.sheet).len().min(MOST_TERMS);
    let most = free.min(slots.saturating_sub(before));
    let p = here.z.len();
    let mut parts = vec![LibraryNormal::zero(p + library.len()); folds.count()];
    for (w, n) in normals(problem, here, library) {
        parts[folds.part(problem.data, w)].add(&n);
    }
    choose(&parts, p, library, most, problem.floor())
}

/// The terms as they are reported, with the values of `fit`, whose last effects they are.
fn terms(fit: &Fit, columns: &[Column]) -> Vec<CustomTerm> {
    let first = fit.model.effects.len() - columns.len();
    columns
        .iter()
        .enumerate()
        .map(|(i, column)| {
            let parameters = repair::effect_parameters(fit, first + i);
            let term = &TERMS[column.term];
            CustomTerm::new(fit.model.effects[first + i].id, term, parameters)
        })
        .collect()
}

impl Custom {
    /// The expression with the values of another fit of the same hypothesis.
    pub(super) fn refitted(&self, fit: &Fit) -> Expression {
        Expression {
            terms: terms(fit, &self.columns),
            ..self.expression.clone()
        }
    }
}
