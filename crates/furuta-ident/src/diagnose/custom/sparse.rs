//! Which few terms: along the path of the lasso, refined by exchange, their number chosen on data that were not fitted.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus,
};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::library::Column;
use super::normal::{LibraryNormal, solver};

/// Points on the path of lambda, and how far down from where all coefficients are zero it goes.
const PATH: usize = 10;
const LAST: f64 = 0.01;
/// A coefficient (its term of unit effect) below this share of the largest is zero: interior points never reach it.
const NOTHING: f64 = 1e-3;
/// A term that initial states and parameters can follow to within this share is none of its own.
const OWN: f64 = 1e-3;
/// A further term must lower the linear model's held-out cost by this share of what is left above the noise.
const LEAST_SHARE: f64 = 0.08;
/// Rounds of exchanging one term for another.
const EXCHANGES: usize = 4;

/// The terms of the expression, and the step of the `p` parameters and these terms' coefficients that all data together
/// ask for.
pub(super) fn choose(
    parts: &[LibraryNormal],
    p: usize,
    library: &[Column],
    most: usize,
    floor: f64,
) -> Option<(Vec<Column>, DVector<f64>)> {
    let mut all = LibraryNormal::zero(p + library.len());
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
        if share > LEAST_SHARE {
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
fn held_out_cost(
    parts: &[LibraryNormal],
    p: usize,
    chosen: &[usize],
    library: &[Column],
) -> Option<f64> {
    let at: Vec<usize> = (0..p).chain(chosen.iter().map(|j| p + j)).collect();
    let mut cost = 0.0;
    for (i, part) in parts.iter().enumerate() {
        let mut others = LibraryNormal::zero(part.gradient.len());
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
    fn new(all: &LibraryNormal, p: usize, library: &[Column]) -> Option<Self> {
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

    /// The minimum for one lambda. Each coefficient is the difference of two that are not negative; where it must not
    /// be positive, less one.
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
