//! How the cost depends on the coefficients of all terms of the library: a quadratic, from the impulse responses about
//! a fit.

use furuta_model::dynamics::{Angle, mass_matrix};
use furuta_model::effects::TERMS;
use furuta_model::params::Coefficients;
use nalgebra::{Cholesky, DMatrix, DVector, Vector4};
use rayon::prelude::*;

use super::super::Fit;
use super::super::hypothesis::{Hypothesis, TIMING};
use super::library::{Column, instant};
use crate::shooting::{Course, Layout, Model, Passes, Problem, Window, Windows, is_late};

/// Normal equations over the fitted parameters and, behind them, the columns of the library; initial states eliminated.
#[derive(Clone)]
pub(super) struct LibraryNormal {
    pub(super) matrix: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    pub(super) cost: f64,
}

impl LibraryNormal {
    pub(super) fn zero(n: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            cost: 0.0,
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.gradient += &other.gradient;
        self.cost += other.cost;
    }

    /// What is left with the first `p` variables free.
    pub(super) fn eliminate(&self, p: usize) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let m = self.gradient.len() - p;
        let own = solver(self.matrix.view((0, 0), (p, p)).into_owned())?;
        let cross = self.matrix.view((0, p), (p, m)).into_owned();
        let matrix = self.matrix.view((p, p), (m, m)) - cross.tr_mul(&own.solve(&cross));
        let known: DVector<f64> = self.gradient.rows(0, p).into_owned();
        let gradient = self.gradient.rows(p, m) - cross.tr_mul(&own.solve(&known));
        Some((matrix, gradient))
    }

    /// The best step of the variables `at`.
    pub(super) fn step(&self, at: &[usize]) -> Option<DVector<f64>> {
        let g = DVector::from_fn(at.len(), |i, _| self.gradient[at[i]]);
        Some(solver(self.among(at))?.solve(&g))
    }

    fn among(&self, at: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(at.len(), at.len(), |i, j| self.matrix[(at[i], at[j])])
    }

    /// The cost after a step of the variables `at`.
    pub(super) fn cost_after(&self, at: &[usize], step: &DVector<f64>) -> f64 {
        let g: f64 = at
            .iter()
            .zip(step)
            .map(|(i, s)| self.gradient[*i] * s)
            .sum();
        self.cost - 2.0 * g + (self.among(at) * step).dot(step)
    }
}

pub(super) fn solver(mut m: DMatrix<f64>) -> Option<Cholesky<f64, nalgebra::Dyn>> {
    for i in 0..m.nrows() {
        m[(i, i)] += 1e-9 + 1e-9 * m[(i, i)];
    }
    m.cholesky()
}

/// Every window's normal equations about `fit`.
pub(super) fn normals<'a>(
    problem: &'a Problem<'_>,
    fit: &Fit,
    library: &[Column],
) -> Vec<(&'a Window, LibraryNormal)> {
    let windows = Windows::new(&fit.model, &fit.z);
    let coefficients = windows.plain().plant.coefficients;
    let bounds = fit.model.bounds(&fit.z);
    let free: Vec<bool> = bounds.iter().map(|(low, high)| low < high).collect();
    let layout = fit.model.layout();
    let passes = Passes::new(&fit.model, &fit.z, layout.local());
    // What is late is no torque: it moves the whole prediction.
    let late: Vec<f64> = lateness(&fit.model);
    problem
        .windows
        .par_iter()
        .zip(&fit.states)
        .filter_map(|(w, start)| {
            let mut course = passes.course(problem.data, w, start);
            let run = &problem.data.runs[w.run];
            let predictions = windows.predictions(problem.data, w, start);
            let mut before = [start.x.theta, start.x.alpha];
            let steps = course.steps.iter_mut().zip(&predictions);
            for (k, (step, y)) in steps.enumerate() {
                let measured = run.y[w.start + 1 + k];
                for (c, row) in course.slopes.of_mut(k).into_iter().enumerate() {
                    let speed = (y[c] - before[c]) / step.h;
                    for (i, late) in late.iter().enumerate().take(layout.shared) {
                        row[4 + layout.local_of(i)] -= late * speed * step.weight[c];
                    }
                    step.left[c] = measured[c] - y[c];
                }
                before = *y;
            }
            Some((
                w,
                normal(
                    &course,
                    (&free, &layout, run.recording),
                    library,
                    &coefficients,
                )?,
            ))
        })
        .collect()
}

/// By how many seconds a unit of each parameter makes the readings late.
fn lateness(h: &Hypothesis) -> Vec<f64> {
    let scales = h.scales();
    let mut late = vec![0.0; scales.len()];
    late[TIMING] = scales[TIMING];
    for (i, _) in h.effects.iter().enumerate().filter(|(_, e)| is_late(e)) {
        late[h.offset(i)] = scales[h.offset(i)];
    }
    late
}

fn normal(
    course: &Course,
    (free, layout, recording): (&[bool], &Layout, usize),
    library: &[Column],
    coefficients: &Coefficients<f64>,
) -> Option<LibraryNormal> {
    let (p, m, steps) = (free.len(), library.len(), &course.steps);
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
            let late = -0.5 * step.h;
            back * Vector4::new(late * arm, late * pendulum, arm, pendulum) * step.h
        });
        let at = instant(step.t + 0.5 * step.h, &x, coefficients, step.volts);
        for (j, column) in library.iter().enumerate() {
            moved[j] += impulse[column.axis] * TERMS[column.term].value(&at);
        }
        for (c, slopes) in course.slopes.of(k).into_iter().enumerate() {
            let i = 2 * k + c;
            let slope = Vector4::from_fn(|a, _| slopes[a]);
            left[i] = step.left[c] * step.weight[c];
            for a in 0..4 {
                rows[(i, a)] = slope[a];
            }
            for a in 0..layout.local() {
                let place = layout.place(recording, a);
                if free[place] {
                    rows[(i, 4 + place)] = slopes[4 + a];
                }
            }
            for j in 0..m {
                rows[(i, 4 + p + j)] = slope.dot(&moved[j]);
            }
        }
    }
    let all = LibraryNormal {
        matrix: rows.tr_mul(&rows),
        gradient: rows.tr_mul(&left),
        cost: 0.0,
    };
    let states: [usize; 4] = [0, 1, 2, 3];
    let solved = all.step(&states)?;
    let (matrix, gradient) = all.eliminate(4)?;
    let cost = left.norm_squared() - solved.dot(&all.gradient.rows(0, 4));
    (matrix.iter().all(|v| v.is_finite()) && cost.is_finite()).then_some(LibraryNormal {
        matrix,
        gradient,
        cost,
    })
}
