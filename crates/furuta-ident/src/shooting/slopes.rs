//! A linear form that serves again: the slopes of a window's samples where it was linearised, with which a simulation
//! without derivatives gives the gradient elsewhere (the chord method). It costs a fraction of linearising anew.

use furuta_model::vectors::Vectorised;
use nalgebra::{Cholesky, Const, DMatrix, Vector4};

use super::data::{Data, Window};
use super::model::Observed;
use super::predict::{Predicted, predict, some};
use super::start::{Start, is_worth_a_step};
use crate::least_squares::CONTRACTION;

/// Steps of a start by the same slopes: with each gaining less than [`CONTRACTION`] of the one before, a further one
/// gains a hundredth of the first.
const STEPS: usize = 3;

/// The weighted slopes of a window's samples, a row for each angle, with respect to its variables.
#[derive(Clone, Debug)]
pub(crate) struct Slopes {
    /// How many variables: a multiple of four. Those behind the last that there is move nothing.
    width: usize,
    rows: Vec<f64>,
}

impl Slopes {
    /// All zero, for a window of `len` samples.
    pub(super) fn new(width: usize, len: usize) -> Self {
        Self {
            width,
            rows: vec![0.0; 2 * len * width],
        }
    }

    /// Writes some slopes of an angle, times its weight, from the variable `first` on.
    #[inline(always)]
    pub(super) fn put<const N: usize>(
        &mut self,
        row: usize,
        first: usize,
        slopes: &[f64; N],
        weight: f64,
    ) {
        let at = row * self.width + first;
        for (to, slope) in self.rows[at..at + N].iter_mut().zip(slopes) {
            *to = slope * weight;
        }
    }

    /// The slopes of the angles of the `k`-th sample.
    pub(crate) fn of(&self, k: usize) -> [&[f64]; 2] {
        let at = 2 * k * self.width;
        let (theta, rest) = self.rows[at..].split_at(self.width);
        [theta, &rest[..self.width]]
    }

    /// The same, to be changed.
    pub(crate) fn of_mut(&mut self, k: usize) -> [&mut [f64]; 2] {
        let at = 2 * k * self.width;
        let (theta, rest) = self.rows[at..].split_at_mut(self.width);
        [theta, &mut rest[..self.width]]
    }

    /// The sum of the rows from `first` on, each times a number.
    pub(super) fn times(&self, first: usize, numbers: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.width];
        let rows = self.rows[first * self.width..].chunks_exact(self.width);
        for (row, r) in rows.zip(numbers) {
            for (sum, slope) in sum.iter_mut().zip(row) {
                *sum += slope * r;
            }
        }
        sum
    }
}

/// The sum of the rows' products with themselves, four by four columns at a time, which the processor holds in its
/// registers.
impl Vectorised for &Slopes {
    type Output = DMatrix<f64>;

    #[inline(always)]
    fn call(self) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.width, self.width);
        for i in 0..self.width / 4 {
            for j in i..self.width / 4 {
                let mut sum = [[0.0; 4]; 4];
                for row in self.rows.chunks_exact(self.width) {
                    let (of_four, _) = row.as_chunks::<4>();
                    let (p, q) = (of_four[i], of_four[j]);
                    for a in 0..4 {
                        for b in 0..4 {
                            sum[a][b] += p[a] * q[b];
                        }
                    }
                }
                for a in 0..4 {
                    for b in 0..4 {
                        out[(4 * i + a, 4 * j + b)] = sum[a][b];
                        out[(4 * j + b, 4 * i + a)] = sum[a][b];
                    }
                }
            }
        }
        out
    }
}

/// What a window costs from a start, and the gradient by slopes that were found elsewhere.
#[derive(Clone, Debug)]
pub(super) struct Along {
    pub(super) start: Start,
    pub(super) cost: f64,
    pub(super) gradient: Vec<f64>,
}

impl Along {
    pub(super) fn new(
        seen: &Observed<f64>,
        data: &Data,
        w: &Window,
        start: &Start,
        slopes: &Slopes,
    ) -> Self {
        let run = &data.runs[w.run];
        let mut out = Self {
            start: *start,
            cost: 0.0,
            gradient: vec![0.0; slopes.width],
        };
        let mut rows = slopes.rows.chunks_exact(slopes.width);
        let mut add = |p: Predicted<f64>| {
            for (c, y) in p.y.iter().enumerate() {
                let r = (y - run.y[p.sample][c]) * run.weight[p.sample][c] / data.noise[c];
                out.cost += r * r;
                let row = rows.next().unwrap_or_default();
                for (sum, slope) in out.gradient.iter_mut().zip(row) {
                    *sum += slope * r;
                }
            }
        };
        predict(seen, &mut some(&seen.plant), run, w, start, &mut add);
        if !out.cost.is_finite() {
            out.cost = f64::INFINITY;
        }
        out
    }

    /// The step of the start that the slopes give, and what it is predicted to gain.
    fn step(&self, own: &Cholesky<f64, Const<4>>) -> (Vector4<f64>, f64) {
        let gradient = Vector4::from_fn(|i, _| self.gradient[i]);
        let step = own.solve(&gradient);
        (step, step.dot(&gradient))
    }

    /// The start that costs least, found by these slopes; or the best on the way, where they hold no longer. `own` is
    /// the Gauss-Newton matrix of the start.
    pub(super) fn solved(
        seen: &Observed<f64>,
        data: &Data,
        w: &Window,
        start: &Start,
        (slopes, own): (&Slopes, &Cholesky<f64, Const<4>>),
    ) -> Result<Self, Start> {
        let mut here = Self::new(seen, data, w, start, slopes);
        if here.cost.is_infinite() {
            return Err(*start);
        }
        let (mut steps, mut last) = (0, f64::INFINITY);
        loop {
            let (step, predicted) = here.step(own);
            if !is_worth_a_step(predicted, here.cost) {
                return Ok(here);
            }
            if steps == STEPS || predicted >= CONTRACTION * last {
                return Err(here.start);
            }
            let next = Self::new(seen, data, w, &here.start.less(&step), slopes);
            last = here.cost - next.cost;
            if last <= 0.0 {
                return Err(here.start);
            }
            (here, steps) = (next, steps + 1);
        }
    }
}
