//! What each window says about any small torque in it, without a further simulation.
//!
//! A small torque along a window moves the predicted angles by what the window's sensitivities to its state pass on: an impulse at sample `k` is a
//! change of speed there, which is the same as some change of the initial state.

use furuta_model::dynamics::{Angle, mass_matrix};
use furuta_model::params::Coefficients;
use furuta_model::{Plant, State};
use nalgebra::{Cholesky, Const, Matrix4, SMatrix, SVector, Vector4};
use rayon::prelude::*;

use super::fit::{Fit, Problem};
use super::hypothesis::{FIRST_EFFECT, TIMING};
use super::shooting::{Inner, Trace};

/// A torque that does not jump is heard in blocks of so many seconds.
const BLOCK: f64 = 0.008;
/// A state of which less is left is lost in rounding.
const FORGOTTEN: f64 = 1e-13;

/// What a window says about any small torque in it.
pub(super) struct Echo {
    pub(super) window: usize,
    pub(super) recording: usize,
    /// Weighted slopes of the two angles after each step with respect to the initial state, and what is left of the measurement.
    pub(super) slopes: Vec<[Vector4<f64>; 2]>,
    pub(super) left: Vec<[f64; 2]>,
    pub(super) normal: Cholesky<f64, Const<4>>,
    pub(super) gradient: Vector4<f64>,
    /// The two angles after each step.
    pub(super) y: Vec<[f64; 2]>,
    /// Their weights.
    pub(super) weight: Vec<[f64; 2]>,
    /// Weighted slopes with respect to the base parameters, and what the initial state absorbs of them.
    pub(super) base: Vec<[Base; 2]>,
    pub(super) absorbed: SMatrix<f64, 4, FIRST_EFFECT>,
    /// Normal equations of the base parameters, the initial state taken out.
    pub(super) base_normal: SMatrix<f64, FIRST_EFFECT, FIRST_EFFECT>,
    pub(super) base_gradient: Base,
    /// The steps one by one, for a torque that jumps, and some taken together, for others.
    pub(super) steps: Vec<Block>,
    pub(super) blocks: Vec<Block>,
}

/// One or some steps of a window, so few that a torque is the same in all of them.
#[derive(Clone)]
pub(super) struct Block {
    /// Time (s) and state in the middle.
    pub(super) t: f64,
    pub(super) x: State<f64>,
    /// Voltage at the motor then.
    pub(super) volts: f64,
    /// The initial state's change that a torque of one on arm or pendulum over the block is equal to.
    pub(super) impulse: [Vector4<f64>; 2],
    /// The share of that which has happened by the ends of its steps, on average.
    pub(super) share: f64,
    /// Sums over the block's steps and both angles: slopes times slopes, slopes times what is left.
    pub(super) square: Matrix4<f64>,
    pub(super) product: Vector4<f64>,
    /// The same, slopes times those with respect to the base parameters.
    pub(super) base: SMatrix<f64, 4, FIRST_EFFECT>,
}

/// One number for each parameter that every hypothesis has.
pub(super) type Base = SVector<f64, FIRST_EFFECT>;

/// What every window says about `fit`; those that say nothing that can be computed with are left out.
pub(super) fn echoes(problem: &Problem<'_>, fit: &Fit) -> (Coefficients<f64>, Vec<Echo>) {
    const N: usize = 4 + FIRST_EFFECT;
    let inner = Inner::<N>::new(&fit.hypothesis, &fit.z, problem.nominal);
    let data = problem.data;
    // A timing at its bound follows nobody.
    let (low, high) = fit.hypothesis.bounds(problem.nominal, &fit.z)[TIMING];
    let fixed = fit.z[TIMING] <= low || fit.z[TIMING] >= high;
    let echoes = problem
        .windows
        .par_iter()
        .zip(&fit.states)
        .enumerate()
        .filter_map(|(window, (w, x0))| {
            let run = &data.runs[w.run];
            let trace = inner.trace(data, w, *x0);
            echo(inner.plain(), (window, run.recording), run.h, trace, fixed)
        })
        .collect();
    (inner.plain().coefficients, echoes)
}

fn echo(
    plant: &Plant<f64>,
    (window, recording): (usize, usize),
    h: f64,
    trace: Trace<{ 4 + FIRST_EFFECT }>,
    timing_is_fixed: bool,
) -> Option<Echo> {
    let count = trace.steps.len();
    let mut out = Echo {
        window,
        recording,
        slopes: Vec::with_capacity(count),
        left: Vec::with_capacity(count),
        normal: Matrix4::identity().cholesky()?,
        gradient: Vector4::zeros(),
        y: Vec::with_capacity(count),
        weight: Vec::with_capacity(count),
        base: Vec::with_capacity(count),
        absorbed: SMatrix::zeros(),
        base_normal: SMatrix::zeros(),
        base_gradient: Base::zeros(),
        steps: Vec::with_capacity(count),
        blocks: Vec::new(),
    };
    let mut normal = Matrix4::zeros();
    for step in trace.steps {
        // An axis that sticks forgets its speed: nothing that happens to it later is like a change of the initial state.
        let remembers = step.transition.determinant().abs() > FORGOTTEN;
        let back = remembers
            .then(|| step.transition.try_inverse())
            .flatten()
            .unwrap_or_default();
        let inverse = mass_matrix(&plant.coefficients, Angle::of(step.x.alpha)).inverse();
        let impulse = [
            Vector4::new(0.0, 0.0, inverse.arm, inverse.coupling) * h,
            Vector4::new(0.0, 0.0, inverse.coupling, inverse.pendulum) * h,
        ];
        let left: [f64; 2] = std::array::from_fn(|c| step.left[c] * step.weight[c]);
        let row = |c: usize, i: usize| step.y[c].d[i] * step.weight[c];
        let slopes: [Vector4<f64>; 2] = std::array::from_fn(|c| Vector4::from_fn(|i, _| row(c, i)));
        let base: [Base; 2] = std::array::from_fn(|c| {
            Base::from_fn(|i, _| {
                if i == TIMING && timing_is_fixed {
                    0.0
                } else {
                    row(c, 4 + i)
                }
            })
        });
        let mut block = Block {
            t: step.t + 0.5 * h,
            x: step.x,
            volts: step.volts,
            impulse: impulse.map(|i| back * i),
            share: 1.0,
            square: Matrix4::zeros(),
            product: Vector4::zeros(),
            base: SMatrix::zeros(),
        };
        for c in 0..2 {
            block.square += slopes[c] * slopes[c].transpose();
            block.product += slopes[c] * left[c];
            block.base += slopes[c] * base[c].transpose();
            out.base_normal += base[c] * base[c].transpose();
            out.base_gradient += base[c] * left[c];
        }
        normal += block.square;
        out.gradient += block.product;
        out.absorbed += block.base;
        out.steps.push(block);
        out.slopes.push(slopes);
        out.left.push(left);
        out.base.push(base);
        out.y.push(step.y.map(|y| y.v));
        out.weight.push(step.weight);
    }
    if !normal.iter().all(|v: &f64| v.is_finite()) {
        return None;
    }
    for i in 0..4 {
        normal[(i, i)] += 1e-9 + 1e-9 * normal[(i, i)];
    }
    out.normal = normal.cholesky()?;
    let cross = out.absorbed;
    out.absorbed = out.normal.solve(&cross);
    out.base_normal -= cross.tr_mul(&out.absorbed);
    out.base_gradient -= out.absorbed.tr_mul(&out.gradient);
    let together = ((BLOCK / h).round() as usize).max(1);
    out.blocks = out.steps.chunks(together).filter_map(Block::sum).collect();
    Some(out)
}

impl Block {
    /// Steps one after the other as one.
    fn sum(steps: &[Self]) -> Option<Self> {
        let (first, last) = (steps.first()?, steps.last()?);
        let n = steps.len() as f64;
        let mut sum = Self {
            t: 0.5 * (first.t + last.t),
            x: steps[steps.len() / 2].x,
            volts: steps[steps.len() / 2].volts,
            impulse: [Vector4::zeros(); 2],
            share: 0.5 * (n + 1.0) / n,
            square: Matrix4::zeros(),
            product: Vector4::zeros(),
            base: SMatrix::zeros(),
        };
        for step in steps {
            for axis in 0..2 {
                sum.impulse[axis] += step.impulse[axis];
            }
            sum.square += step.square;
            sum.product += step.product;
            sum.base += step.base;
        }
        Some(sum)
    }
}
