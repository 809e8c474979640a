//! A linear form that serves again: the slopes of a window's samples where it was linearised, with which a simulation
//! without derivatives gives the gradient elsewhere (the chord method). It costs a fraction of linearising anew.

use nalgebra::{Cholesky, Const, Vector4};

use super::data::{Data, Window};
use super::model::Observed;
use super::predict::{Predicted, predict, some};
use super::start::{Start, is_worth_a_step};
use crate::least_squares::CONTRACTION;

/// Steps of a start by the same slopes: with each gaining less than [`CONTRACTION`] of the one before, a further one
/// gains a hundredth of the first.
const STEPS: usize = 3;

/// The weighted slopes of a window's samples, angle by angle, with respect to its first variables.
#[derive(Clone, Debug)]
pub(super) struct Slopes {
    /// How many variables.
    width: usize,
    rows: Vec<f64>,
}

impl Slopes {
    /// For a window of `len` samples.
    pub(super) fn new(width: usize, len: usize) -> Self {
        Self {
            width,
            rows: Vec::with_capacity(2 * len * width),
        }
    }

    /// Adds the slopes of the next angle.
    #[inline(always)]
    pub(super) fn push<const N: usize>(&mut self, slopes: &[f64; N]) {
        self.rows.extend_from_slice(&slopes[..self.width]);
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
