//! Impulse responses: what each window says about any small torque in it, without a further simulation.
//!
//! A small torque along a window moves the predicted angles by what the window's sensitivities to its state pass on: an
//! impulse at sample `k` is a change of speed there, which is the same as some change of the initial state.

use furuta_model::dynamics::{Angle, mass_matrix};
use furuta_model::params::Coefficients;
use furuta_model::{Plant, State};
use nalgebra::{Cholesky, Const, Matrix4, SMatrix, SVector, Vector4};
use rayon::prelude::*;

use super::fit::{Fit, Problem};
use super::linear::Course;
use super::model::Model;
use super::passes::Passes;
use super::window::Windows;

/// A torque that does not jump is taken as constant over blocks of this length, s.
const BLOCK: f64 = 0.008;
/// A state of which less is left is lost in rounding.
const FORGOTTEN: f64 = 1e-13;

/// What a window says about any small torque in it, while the first `B` parameters of the fit follow.
pub(crate) struct ImpulseResponse<const B: usize> {
    pub(crate) window: usize,
    pub(crate) recording: usize,
    /// Weighted slopes of the two angles after each step with respect to the initial state, and what is left of the
    /// measurement.
    pub(crate) slopes: Vec<[Vector4<f64>; 2]>,
    pub(crate) left: Vec<[f64; 2]>,
    pub(crate) normal: Cholesky<f64, Const<4>>,
    pub(crate) gradient: Vector4<f64>,
    /// When the angles are read after each step, s, and what they are.
    pub(crate) read: Vec<f64>,
    pub(crate) y: Vec<[f64; 2]>,
    /// Their weights.
    pub(crate) weight: Vec<[f64; 2]>,
    /// Weighted slopes with respect to the base parameters, and what the initial state absorbs of them.
    pub(crate) base: Vec<[SVector<f64, B>; 2]>,
    pub(crate) absorbed: SMatrix<f64, 4, B>,
    /// Normal equations of the base parameters, the initial state taken out.
    pub(crate) base_normal: SMatrix<f64, B, B>,
    pub(crate) base_gradient: SVector<f64, B>,
    /// The steps one by one, for a torque that jumps, and some taken together, for others.
    pub(crate) steps: Vec<Block<B>>,
    pub(crate) blocks: Vec<Block<B>>,
}

/// One or some steps of a window, so few that a torque is the same in all of them.
#[derive(Clone)]
pub(crate) struct Block<const B: usize> {
    /// Time (s) and state in the middle.
    pub(crate) t: f64,
    /// How long it lasts, s.
    pub(crate) length: f64,
    pub(crate) x: State<f64>,
    /// Voltage at the motor then.
    pub(crate) volts: f64,
    /// The initial state's change that a torque of one on arm or pendulum over the block is equal to.
    pub(crate) impulse: [Vector4<f64>; 2],
    /// The share of that which has happened by the ends of its steps, on average.
    pub(crate) share: f64,
    /// Sums over the block's steps and both angles: slopes times slopes, slopes times what is left.
    pub(crate) square: Matrix4<f64>,
    pub(crate) product: Vector4<f64>,
    /// The same, slopes times those with respect to the base parameters.
    pub(crate) base: SMatrix<f64, 4, B>,
}

/// The impulse responses about `fit`, and the coefficients of its plant; windows that say nothing that can be computed
/// with are left out. Parameters that are `held` do not follow.
pub(crate) fn impulse_responses<const B: usize, M: Model>(
    problem: &Problem<'_>,
    fit: &Fit<M>,
    held: [bool; B],
) -> (Coefficients<f64>, Vec<ImpulseResponse<B>>) {
    let windows = Windows::new(&fit.model, &fit.z);
    let passes = Passes::new(&fit.model, &fit.z, B);
    let data = problem.data;
    let plant = &windows.plain().plant;
    let responses = problem
        .windows
        .par_iter()
        .zip(&fit.states)
        .enumerate()
        .filter_map(|(window, (w, x0))| {
            let run = &data.runs[w.run];
            let course = passes.course(data, w, x0);
            let together = ((BLOCK / run.h).round() as usize).max(1);
            response(plant, (window, run.recording), together, &course, held)
        })
        .collect();
    (plant.coefficients, responses)
}

fn response<const B: usize>(
    plant: &Plant<f64>,
    (window, recording): (usize, usize),
    together: usize,
    course: &Course,
    held: [bool; B],
) -> Option<ImpulseResponse<B>> {
    let count = course.steps.len();
    let mut out = ImpulseResponse {
        window,
        recording,
        slopes: Vec::with_capacity(count),
        left: Vec::with_capacity(count),
        normal: Matrix4::identity().cholesky()?,
        gradient: Vector4::zeros(),
        read: Vec::with_capacity(count),
        y: Vec::with_capacity(count),
        weight: Vec::with_capacity(count),
        base: Vec::with_capacity(count),
        absorbed: SMatrix::zeros(),
        base_normal: SMatrix::zeros(),
        base_gradient: SVector::zeros(),
        steps: Vec::with_capacity(count),
        blocks: Vec::new(),
    };
    let mut normal = Matrix4::zeros();
    for (k, step) in course.steps.iter().enumerate() {
        let h = step.h;
        // An axis that sticks forgets its speed: nothing that happens to it later is like a change of the initial
        // state.
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
        let rows = course.slopes.of(k);
        let slopes = rows.map(|row| Vector4::from_fn(|i, _| row[i]));
        let base: [SVector<f64, B>; 2] =
            rows.map(|row| SVector::from_fn(|i, _| if held[i] { 0.0 } else { row[4 + i] }));
        let mut block = Block {
            t: step.t + 0.5 * h,
            length: h,
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
        out.read.push(step.read);
        out.y.push(step.y);
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
    out.blocks = out.steps.chunks(together).filter_map(Block::sum).collect();
    Some(out)
}

impl<const B: usize> Block<B> {
    /// Steps one after the other as one.
    fn sum(steps: &[Self]) -> Option<Self> {
        let (first, last) = (steps.first()?, steps.last()?);
        let n = steps.len() as f64;
        let mut sum = Self {
            t: 0.5 * (first.t + last.t),
            length: 0.0,
            x: steps[steps.len() / 2].x,
            volts: steps[steps.len() / 2].volts,
            impulse: [Vector4::zeros(); 2],
            share: 0.5 * (n + 1.0) / n,
            square: Matrix4::zeros(),
            product: Vector4::zeros(),
            base: SMatrix::zeros(),
        };
        for step in steps {
            sum.length += step.length;
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
