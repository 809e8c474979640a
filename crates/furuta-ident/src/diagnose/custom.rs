//! What no effect of the catalogue explains: an empirical expression for it, sparse and judged on data that were not fitted.
//!
//! About the fit with all that was named, a small torque on either axis moves the predictions linearly (the same impulse responses as in `scout`).
//! Each term of the library of [`TERMS`] on each axis is such a torque, so the cost is a quadratic in their coefficients, the windows' initial
//! states and all fitted parameters eliminated. A lasso on it,
//!
//! ```text
//! minimise  ½ c'G c - b'c + lambda |c|_1,   c <= 0 for terms that can only drag or only drive
//! ```
//!
//! is solved along a path of lambda; the few terms that come in first are refined by exchange, their number is chosen on the folds of `held_out`, and the
//! expression is fitted like any hypothesis and kept if it lowers the error on held-out data clearly. It is no cause: the verdict does not change.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};
use furuta_model::dynamics::{Angle, mass_matrix};
use furuta_model::effects::{Clock, EMPIRICAL, Instant, TERMS, Term};
use furuta_model::params::Coefficients;
use furuta_model::{Spec, State};
use nalgebra::{Cholesky, DMatrix, DVector, Vector4};
use rayon::prelude::*;

use super::data::Window;
use super::evidence::EXPLAINED;
use super::fit::{Effort, Fit, Problem};
use super::held_out::{self, Folds};
use super::hypothesis::{Hypothesis, Nominal, TIMING, is_late};
use super::predict::{self, rms};
use super::repair;
use super::result::{CustomTerm, Expression};
use super::shooting::{Inner, MAX_FREE, Traced};

/// An expression has at most so many terms: more are no longer read as one.
const MOST_TERMS: usize = 3;
/// Points on the path of lambda, and how far down from where all coefficients are zero it goes.
const PATH: usize = 10;
const LAST: f64 = 0.01;
/// A coefficient (its term of unit effect) below this share of the largest is zero: interior points never reach it.
const NOTHING: f64 = 1e-3;
/// A term that initial states and parameters can follow to within this share is none of its own.
const OWN: f64 = 1e-3;
/// A further term must lower the linear model's held-out cost by this share of what is left above the noise.
const WORTH: f64 = 0.08;
/// The whole must lower the squared error on held-out data by this share.
const LEAST_GAIN: f64 = 0.1;
/// In the place of the effects named it must leave less than half of the cost that it leaves beside them.
const INSTEAD: f64 = 0.5;
/// So often terms are looked for.
const ROUNDS: usize = 2;
/// A coefficient within so many standard deviations of zero is none.
const SIGNIFICANT: f64 = 3.0;
/// Rounds of exchanging one term for another.
const EXCHANGES: usize = 4;

/// An expression and the fit that has it.
pub(super) struct Custom {
    /// With the terms behind the effects that were named.
    pub(super) fit: Fit,
    expression: Expression,
    /// Its errors on held-out data, rad.
    pub(super) errors: Vec<[f64; 2]>,
    columns: Vec<Column>,
}

/// A term of the library on one axis.
#[derive(Clone, Copy, Debug)]
struct Column {
    /// 0 arm, 1 pendulum.
    axis: usize,
    /// Its place in [`TERMS`].
    term: usize,
    /// Whether the torque can only act with the axis' motion: then its coefficient must not be positive.
    drags: bool,
}

/// Normal equations over the fitted parameters and, behind them, the columns of the library; initial states eliminated.
#[derive(Clone)]
struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    cost: f64,
}

impl Normal {
    fn zero(n: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            cost: 0.0,
        }
    }

    fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.gradient += &other.gradient;
        self.cost += other.cost;
    }

    /// What is left with the first `p` variables free.
    fn eliminate(&self, p: usize) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let m = self.gradient.len() - p;
        let own = solver(self.matrix.view((0, 0), (p, p)).into_owned())?;
        let cross = self.matrix.view((0, p), (p, m)).into_owned();
        let matrix = self.matrix.view((p, p), (m, m)) - cross.tr_mul(&own.solve(&cross));
        let known: DVector<f64> = self.gradient.rows(0, p).into_owned();
        let gradient = self.gradient.rows(p, m) - cross.tr_mul(&own.solve(&known));
        Some((matrix, gradient))
    }

    /// The best step of the variables `at`.
    fn step(&self, at: &[usize]) -> Option<DVector<f64>> {
        let g = DVector::from_fn(at.len(), |i, _| self.gradient[at[i]]);
        Some(solver(self.among(at))?.solve(&g))
    }

    fn among(&self, at: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(at.len(), at.len(), |i, j| self.matrix[(at[i], at[j])])
    }

    /// The cost after a step of the variables `at`.
    fn cost_after(&self, at: &[usize], step: &DVector<f64>) -> f64 {
        let g: f64 = at
            .iter()
            .zip(step)
            .map(|(i, s)| self.gradient[*i] * s)
            .sum();
        self.cost - 2.0 * g + (self.among(at) * step).dot(step)
    }
}

fn solver(mut m: DMatrix<f64>) -> Option<Cholesky<f64, nalgebra::Dyn>> {
    for i in 0..m.nrows() {
        m[(i, i)] += 1e-9 + 1e-9 * m[(i, i)];
    }
    m.cholesky()
}

/// An expression for what no effect explains, where one helps on held-out data: in the place of all effects that were named, where it explains the
/// recordings or leaves far less than beside them (effects named by mistake each take a part of what one expression says), otherwise beside them.
pub(super) fn propose(
    problem: &Problem<'_>,
    folds: &Folds,
    recalibrated: &Fit,
    named: &Fit,
) -> Option<Custom> {
    let (data, nominal) = (problem.data, problem.nominal);
    let instead = grow(problem, folds, recalibrated);
    let explains = |fit: &Fit| problem.chi(fit).powi(2) <= EXPLAINED;
    let alone = named.hypothesis.effects.is_empty();
    let (fit, columns) = match instead {
        Some(grown) if alone || explains(&grown.0) => grown,
        None if alone => return None,
        instead => match (grow(problem, folds, named), instead) {
            (Some(beside), Some(instead)) if instead.0.cost < INSTEAD * beside.0.cost => instead,
            (None, Some(instead)) if instead.0.cost < INSTEAD * named.cost => instead,
            (beside, _) => beside?,
        },
    };
    let fit = problem.fit(&fit.hypothesis, fit.z.clone(), &fit.states, Effort::FULL);
    if !lasts(problem, &[recalibrated, named], &fit) {
        return None;
    }
    let (without, with) = rayon::join(
        || held_out::errors(data, nominal, folds, named),
        || held_out::errors(data, nominal, folds, &fit),
    );
    let gain = held_out::removed(data, &without, &with);
    if gain.is_nan() || gain < LEAST_GAIN {
        return None;
    }
    let expression = Expression {
        terms: terms(nominal, &fit, &columns),
        held_out_gain: gain,
        without: rms(without.iter()).into(),
        with: rms(with.iter()).into(),
    };
    Some(Custom {
        fit,
        expression,
        errors: with,
        columns,
    })
}

/// Whether the model with the expression predicts whole runs no worse than any of those without: what imitates for a quarter of a second may run away.
fn lasts(problem: &Problem<'_>, without: &[&Fit], with: &Fit) -> bool {
    let error = |fit: &Fit| predict::open_loop(problem.data, problem.nominal, fit);
    let least = without.iter().map(|f| error(f)).fold(f64::MAX, f64::min);
    error(with) <= least
}

/// Adds terms to `start` as long as they help, each round about the fit with those before.
fn grow(problem: &Problem<'_>, folds: &Folds, start: &Fit) -> Option<(Fit, Vec<Column>)> {
    let library = library(&problem.nominal.coefficients);
    let (mut here, mut columns) = (start.clone(), Vec::new());
    for _ in 0..ROUNDS {
        if problem.chi(&here).powi(2) <= EXPLAINED {
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

/// The terms that a rig file has room for.
fn slots(nominal: &Nominal) -> Vec<&'static Spec> {
    let taken = |s: &Spec| nominal.present.iter().any(|e| e.spec().id == s.id);
    EMPIRICAL.iter().copied().filter(|s| !taken(s)).collect()
}

/// Where the coefficient of the `i`-th of `count` terms stands among the parameters.
fn coefficient(fit: &Fit, count: usize, i: usize) -> usize {
    let h = &fit.hypothesis;
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
    let mut h = here.hypothesis.clone();
    let mut z: Vec<f64> = (0..p).map(|i| here.z[i] + step[i]).collect();
    let slots = slots(problem.nominal);
    for (i, column) in found.iter().enumerate() {
        let spec = slots.get(before + i)?;
        h = h.with(spec);
        let typical = (spec.parameters[0].typical)(&problem.nominal.params);
        z.extend([
            step[p + i] / typical,
            column.axis as f64,
            column.term as f64,
        ]);
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
    let mut h = fit.hypothesis.clone();
    let mut z = fit.z.clone();
    z.drain(at..at + EMPIRICAL[0].parameters.len());
    // Those behind it move up: the terms of a rig are numbered without a gap.
    h.effects.pop();
    problem.fit(&h, z, &fit.states, Effort::QUICK)
}

/// Terms for what `here` leaves, in which there are `before` already, and the step of its parameters and their coefficients.
fn further(
    problem: &Problem<'_>,
    folds: &Folds,
    here: &Fit,
    library: &[Column],
    before: usize,
) -> Option<(Vec<Column>, DVector<f64>)> {
    // A fit has room for so many numbers.
    let room = MAX_FREE.saturating_sub(here.z.len()) / EMPIRICAL[0].parameters.len();
    let slots = slots(problem.nominal).len().min(MOST_TERMS);
    let most = room.min(slots.saturating_sub(before));
    let p = here.z.len();
    let mut parts = vec![Normal::zero(p + library.len()); folds.count()];
    for (w, n) in normals(problem, here, library) {
        parts[folds.part(problem.data, w)].add(&n);
    }
    choose(&parts, p, library, most, problem.floor())
}

/// The terms as they are reported, with the values of `fit`, whose last effects they are.
fn terms(nominal: &Nominal, fit: &Fit, columns: &[Column]) -> Vec<CustomTerm> {
    let first = fit.hypothesis.effects.len() - columns.len();
    columns
        .iter()
        .enumerate()
        .map(|(i, column)| {
            let parameters = repair::effect_parameters(nominal, fit, first + i);
            let term = &TERMS[column.term];
            CustomTerm::new(fit.hypothesis.effects[first + i].id, term, parameters)
        })
        .collect()
}

impl Custom {
    /// The expression with the values of another fit of the same hypothesis.
    pub(super) fn refitted(&self, nominal: &Nominal, fit: &Fit) -> Expression {
        Expression {
            terms: terms(nominal, fit, &self.columns),
            ..self.expression.clone()
        }
    }
}

/// Every term on every axis.
fn library(coefficients: &Coefficients<f64>) -> Vec<Column> {
    (0..2)
        .flat_map(|axis| {
            (0..TERMS.len()).map(move |term| Column {
                axis,
                term,
                drags: drags(&TERMS[term], axis, coefficients),
            })
        })
        .collect()
}

/// Whether a torque by this term never changes its direction against the axis' motion: then only one sign is friction, the other would drive for ever.
fn drags(term: &Term, axis: usize, coefficients: &Coefficients<f64>) -> bool {
    const ANGLES: [f64; 5] = [-2.1, -0.7, 0.0, 0.9, 2.3];
    const SPEEDS: [f64; 4] = [-3.1, -0.4, 0.6, 2.9];
    let mut power = 0.0;
    for theta in ANGLES {
        for alpha in ANGLES {
            for theta_dot in SPEEDS {
                for alpha_dot in SPEEDS {
                    for volts in [-1.7, 2.2] {
                        let x = State::new(theta, alpha, theta_dot, alpha_dot);
                        let speed = [theta_dot, alpha_dot][axis];
                        let now = speed * term.value(&instant(0.0, &x, coefficients, volts));
                        if now < 0.0 {
                            return false;
                        }
                        power += now;
                    }
                }
            }
        }
    }
    power > 0.0
}

fn instant<'a>(
    t: f64,
    x: &'a State<f64>,
    coefficients: &'a Coefficients<f64>,
    volts: f64,
) -> Instant<'a, f64> {
    Instant {
        clock: Clock::at(t),
        x,
        angle: Angle::of(x.alpha),
        coefficients,
        memory: 0.0,
        volts,
    }
}

/// Every window's normal equations about `fit`.
fn normals<'a>(
    problem: &'a Problem<'_>,
    fit: &Fit,
    library: &[Column],
) -> Vec<(&'a Window, Normal)> {
    const N: usize = 4 + MAX_FREE;
    let inner = Inner::<N>::new(&fit.hypothesis, &fit.z, problem.nominal);
    let coefficients = inner.plain().coefficients;
    let bounds = fit.hypothesis.bounds(problem.nominal, &fit.z);
    let free: Vec<bool> = bounds.iter().map(|(low, high)| low < high).collect();
    // What is late is no torque: it moves the whole prediction.
    let late: Vec<f64> = lateness(&fit.hypothesis, problem.nominal);
    problem
        .windows
        .par_iter()
        .zip(&fit.states)
        .filter_map(|(w, x0)| {
            let mut steps = inner.trace(problem.data, w, *x0).steps;
            let run = &problem.data.runs[w.run];
            let predictions = inner.predictions(problem.data, w, *x0);
            let mut before = [x0.theta, x0.alpha];
            for ((step, y), measured) in steps
                .iter_mut()
                .zip(&predictions)
                .zip(&run.y[w.start + 1..])
            {
                for c in 0..2 {
                    let speed = (y[c] - before[c]) / run.h;
                    for (i, late) in late.iter().enumerate() {
                        step.y[c].d[4 + i] -= late * speed;
                    }
                    step.left[c] = measured[c] - y[c];
                }
                before = *y;
            }
            Some((w, normal(&steps, &free, library, &coefficients, run.h)?))
        })
        .collect()
}

/// By how many seconds a unit of each parameter makes the readings late.
fn lateness(h: &Hypothesis, nominal: &Nominal) -> Vec<f64> {
    let scales = h.scales(nominal);
    let mut late = vec![0.0; scales.len()];
    late[TIMING] = scales[TIMING];
    for (i, _) in h.effects.iter().enumerate().filter(|(_, e)| is_late(e)) {
        late[h.offset(i)] = scales[h.offset(i)];
    }
    late
}

fn normal<const N: usize>(
    steps: &[Traced<N>],
    free: &[bool],
    library: &[Column],
    coefficients: &Coefficients<f64>,
    h: f64,
) -> Option<Normal> {
    let (p, m) = (free.len(), library.len());
    let mut rows = DMatrix::zeros(2 * steps.len(), 4 + p + m);
    let mut left = DVector::zeros(2 * steps.len());
    let mut moved = vec![Vector4::zeros(); m];
    for (k, step) in steps.iter().enumerate() {
        // Torque of the step's middle, as an impulse there.
        let x = match steps.get(k + 1) {
            Some(next) => (step.x + next.x).map(|v| 0.5 * v),
            None => step.x,
        };
        let inverse = mass_matrix(coefficients, Angle::of(x.alpha)).inverse();
        // An axis that sticks forgets its speed: impulses there do little.
        let back = step.transition.try_inverse().unwrap_or_default();
        let impulse = [
            [inverse.arm, inverse.coupling],
            [inverse.coupling, inverse.pendulum],
        ]
        .map(|[arm, pendulum]| {
            let late = -0.5 * h;
            back * Vector4::new(late * arm, late * pendulum, arm, pendulum) * h
        });
        let at = instant(step.t + 0.5 * h, &x, coefficients, step.volts);
        for (j, column) in library.iter().enumerate() {
            moved[j] += impulse[column.axis] * TERMS[column.term].value(&at);
        }
        for c in 0..2 {
            let (i, weight) = (2 * k + c, step.weight[c]);
            let slope = Vector4::from_fn(|a, _| step.y[c].d[a] * weight);
            left[i] = step.left[c] * weight;
            for a in 0..4 {
                rows[(i, a)] = slope[a];
            }
            for a in 0..p {
                rows[(i, 4 + a)] = if free[a] {
                    step.y[c].d[4 + a] * weight
                } else {
                    0.0
                };
            }
            for j in 0..m {
                rows[(i, 4 + p + j)] = slope.dot(&moved[j]);
            }
        }
    }
    let all = Normal {
        matrix: rows.tr_mul(&rows),
        gradient: rows.tr_mul(&left),
        cost: 0.0,
    };
    let states: [usize; 4] = [0, 1, 2, 3];
    let settled = all.step(&states)?;
    let (matrix, gradient) = all.eliminate(4)?;
    let cost = left.norm_squared() - settled.dot(&all.gradient.rows(0, 4));
    (matrix.iter().all(|v| v.is_finite()) && cost.is_finite()).then_some(Normal {
        matrix,
        gradient,
        cost,
    })
}

/// The terms of the expression, and the step of the `p` parameters and these terms' coefficients that all data together ask for.
fn choose(
    parts: &[Normal],
    p: usize,
    library: &[Column],
    most: usize,
    floor: f64,
) -> Option<(Vec<Column>, DVector<f64>)> {
    let mut all = Normal::zero(p + library.len());
    for part in parts {
        all.add(part);
    }
    let reduced = Reduced::new(&all, p, library)?;
    let mut best: Option<(f64, Vec<usize>)> = None;
    let mut known = held_out_cost(parts, p, &[], library)?;
    for chosen in reduced.supports(most) {
        let Some(cost) = held_out_cost(parts, p, &chosen, library) else {
            continue;
        };
        let share = (known - cost) / (known - floor).max(1e-3 * floor);
        if share > WORTH {
            known = cost;
            best = Some((cost, chosen));
        }
    }
    let (_, chosen) = best?;
    let at: Vec<usize> = (0..p).chain(chosen.iter().map(|j| p + j)).collect();
    let step = all.step(&at)?;
    Some((chosen.iter().map(|j| library[*j]).collect(), step))
}

/// Cost of every part with the step that the others ask for.
fn held_out_cost(parts: &[Normal], p: usize, chosen: &[usize], library: &[Column]) -> Option<f64> {
    let at: Vec<usize> = (0..p).chain(chosen.iter().map(|j| p + j)).collect();
    let mut cost = 0.0;
    for (i, part) in parts.iter().enumerate() {
        let mut others = Normal::zero(part.gradient.len());
        for (j, other) in parts.iter().enumerate() {
            if i != j {
                others.add(other);
            }
        }
        let step = others.step(&at)?;
        let driven = chosen
            .iter()
            .zip(step.iter().skip(p))
            .any(|(j, c)| library[*j].drags && *c > 0.0);
        if driven {
            return None;
        }
        cost += part.cost_after(&at, &step);
    }
    Some(cost)
}

/// The quadratic in the coefficients of those terms that nothing else can follow, each scaled to unit effect.
struct Reduced {
    /// Their places in the library.
    columns: Vec<usize>,
    drags: Vec<bool>,
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Reduced {
    fn new(all: &Normal, p: usize, library: &[Column]) -> Option<Self> {
        let (matrix, gradient) = all.eliminate(p)?;
        let columns: Vec<usize> = (0..library.len())
            .filter(|j| {
                let raw = all.matrix[(p + j, p + j)];
                raw > 0.0 && matrix[(*j, *j)] > OWN * raw
            })
            .collect();
        if columns.is_empty() {
            return None;
        }
        let scale: Vec<f64> = columns
            .iter()
            .map(|j| matrix[(*j, *j)].sqrt().recip())
            .collect();
        let n = columns.len();
        Some(Self {
            drags: columns.iter().map(|j| library[*j].drags).collect(),
            matrix: DMatrix::from_fn(n, n, |i, j| {
                matrix[(columns[i], columns[j])] * scale[i] * scale[j]
            }),
            gradient: DVector::from_fn(n, |i, _| gradient[columns[i]] * scale[i]),
            columns,
        })
    }

    /// The best supports of one, two, … terms (places in the library).
    fn supports(&self, most: usize) -> Vec<Vec<usize>> {
        let path = self.path();
        (1..=most.min(self.columns.len()))
            .filter_map(|size| {
                let mut starts: Vec<Vec<usize>> = path
                    .iter()
                    .filter(|c| c.len() >= size)
                    .map(|c| c[..size].to_vec())
                    .collect();
                starts.dedup();
                starts
                    .into_iter()
                    .map(|s| self.exchanged(s))
                    .max_by(|a, b| a.0.total_cmp(&b.0))
            })
            .map(|(_, s)| s.iter().map(|i| self.columns[*i]).collect())
            .collect()
    }

    /// Along the path of lambda, the terms that are in, the largest first.
    fn path(&self) -> Vec<Vec<usize>> {
        let highest = (0..self.columns.len())
            .map(|i| {
                if self.drags[i] {
                    -self.gradient[i]
                } else {
                    self.gradient[i].abs()
                }
            })
            .fold(0.0, f64::max);
        (1..=PATH)
            .into_par_iter()
            .filter_map(|k| {
                let c = self.lasso(highest * LAST.powf(k as f64 / PATH as f64))?;
                let largest = c.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
                let mut support: Vec<usize> = (0..c.len())
                    .filter(|i| c[*i].abs() > NOTHING * largest)
                    .collect();
                support.sort_by(|a, b| c[*b].abs().total_cmp(&c[*a].abs()));
                Some(support)
            })
            .collect()
    }

    /// The minimum for one lambda. Each coefficient is the difference of two that are not negative; where it must not be positive, less one.
    fn lasso(&self, lambda: f64) -> Option<Vec<f64>> {
        let n = self.columns.len();
        let signed: Vec<(usize, f64)> = (0..n)
            .flat_map(|i| {
                let up = (!self.drags[i]).then_some((i, 1.0));
                up.into_iter().chain([(i, -1.0)])
            })
            .collect();
        let size = signed.len();
        let (mut row, mut column, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for (j, (b, sb)) in signed.iter().enumerate() {
            for (i, (a, sa)) in signed.iter().enumerate().take(j + 1) {
                row.push(i);
                column.push(j);
                // A little curvature between the two halves of a coefficient.
                let ridge = if i == j { 1e-9 } else { 0.0 };
                values.push(self.matrix[(*a, *b)] * sa * sb + ridge);
            }
        }
        let square = CscMatrix::new_from_triplets(size, size, row, column, values);
        let cost: Vec<f64> = signed
            .iter()
            .map(|(i, s)| lambda - s * self.gradient[*i])
            .collect();
        let diagonal: Vec<usize> = (0..size).collect();
        let negative =
            CscMatrix::new_from_triplets(size, size, diagonal.clone(), diagonal, vec![-1.0; size]);
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .build()
            .ok()?;
        let cones = [NonnegativeConeT(size)];
        let zeros = vec![0.0; size];
        let mut solver =
            DefaultSolver::new(&square, &cost, &negative, &zeros, &cones, settings).ok()?;
        solver.solve();
        if !matches!(
            solver.solution.status,
            SolverStatus::Solved | SolverStatus::AlmostSolved
        ) {
            return None;
        }
        let mut c = vec![0.0; n];
        for ((i, s), x) in signed.iter().zip(&solver.solution.x) {
            c[*i] += s * x;
        }
        Some(c)
    }

    /// Fall of the cost with these terms; none where one of them would drive.
    fn gain(&self, support: &[usize]) -> f64 {
        let n = support.len();
        let m = DMatrix::from_fn(n, n, |i, j| self.matrix[(support[i], support[j])]);
        let g = DVector::from_fn(n, |i, _| self.gradient[support[i]]);
        let Some(c) = solver(m).map(|s| s.solve(&g)) else {
            return 0.0;
        };
        let driven = (support.iter().zip(c.iter())).any(|(i, c)| self.drags[*i] && *c > 0.0);
        if driven { 0.0 } else { c.dot(&g) }
    }

    /// One term after the other exchanged for the best there is in its place: the lasso shrinks what is correlated.
    fn exchanged(&self, mut support: Vec<usize>) -> (f64, Vec<usize>) {
        let mut best = self.gain(&support);
        for _ in 0..EXCHANGES {
            let before = best;
            for place in 0..support.len() {
                for other in 0..self.columns.len() {
                    if support.contains(&other) {
                        continue;
                    }
                    let mut trial = support.clone();
                    trial[place] = other;
                    let gain = self.gain(&trial);
                    if gain > best {
                        best = gain;
                        support = trial;
                    }
                }
            }
            if best <= before {
                break;
            }
        }
        (best, support)
    }
}
