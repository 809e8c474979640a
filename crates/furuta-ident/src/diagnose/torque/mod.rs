//! The torque that a model lacks on either axis: against each state, and over time.
//!
//! Both are least squares on the residuals of half-second windows, through the same impulse responses that `screen`
//! uses, so nothing is differentiated twice: noise stays noise, and the standard deviations are those of the encoders
//! (or of what is left, where that is more).

mod by_state;
mod in_time;

use furuta_model::Actuation;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix4xX};

pub(super) use by_state::by_state;
pub(super) use in_time::in_time;

use super::Fit;
use super::predict::Predictor;
use super::screen::{FOLLOW, Response, responses};
use crate::shooting::{self, Problem};

type Block = shooting::Block<FOLLOW>;

/// The impulse responses about a model, and how far off it is.
pub(super) struct Responses {
    by_window: Vec<Response>,
    /// Squared residuals in units of the noise, for each sample.
    chi2: f64,
    samples: f64,
    /// What the rig's command is.
    actuation: Actuation,
    /// Whether a torque moves each axis.
    moved: [bool; 2],
}

impl Responses {
    /// About `model`, each window from its best initial state.
    pub(super) fn new(problem: &Problem<'_>, model: &Predictor) -> Self {
        let fit: Fit = problem.solve_states(&model.hypothesis, &model.z, None);
        let (_, responses) = responses(problem, &fit);
        let samples = problem.samples();
        Self {
            by_window: responses,
            chi2: fit.cost / samples,
            samples,
            actuation: model.hypothesis.sheet.params.motor.actuation,
            moved: model.hypothesis.sheet.moved(),
        }
    }

    /// What is left above the noise, in units of it, summed.
    fn gap(&self) -> f64 {
        (self.chi2 - 1.0).max(1e-9) * self.samples
    }
}

/// Normal equations for torques that are sums of some functions, the initial state eliminated: the arm's coefficients
/// first, then the pendulum's, then the base parameters.
#[derive(Clone)]
struct TorqueNormal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl TorqueNormal {
    fn zero(functions: usize) -> Self {
        let size = 2 * functions + FOLLOW;
        Self {
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
        }
    }

    fn is_finite(&self) -> bool {
        let mut all = self.matrix.iter().chain(&self.gradient);
        all.all(|v| v.is_finite())
    }

    /// One window's; `values` gives the two of the functions that are not zero in a block, and what they are there.
    fn of(
        response: &Response,
        functions: usize,
        values: impl Fn(usize, &Block) -> [(usize, f64); 2],
    ) -> Self {
        let torques = 2 * functions;
        let mut moved = Matrix4xX::<f64>::zeros(torques);
        let mut cross = Matrix4xX::<f64>::zeros(torques);
        let mut matrix = DMatrix::zeros(torques, torques);
        let mut with_base = DMatrix::zeros(torques, FOLLOW);
        let mut gradient = DVector::zeros(torques);
        for (k, block) in response.blocks.iter().enumerate() {
            let mut here = moved.clone();
            for (function, value) in values(k, block) {
                for (axis, impulse) in block.impulse.iter().enumerate() {
                    let place = axis * functions + function;
                    let mut column = here.column_mut(place);
                    column += impulse * (block.share * value);
                    let mut column = moved.column_mut(place);
                    column += impulse * value;
                }
            }
            let follows = block.square * &here;
            matrix.gemm_tr(1.0, &here, &follows, 1.0);
            with_base.gemm_tr(1.0, &here, &block.base, 1.0);
            gradient.gemv_tr(1.0, &here, &block.product, 1.0);
            cross += follows;
        }
        let absorbed = response.normal.solve(&cross);
        matrix.gemm_tr(-1.0, &cross, &absorbed, 1.0);
        with_base.gemm_tr(-1.0, &cross, &response.absorbed, 1.0);
        gradient.gemv_tr(-1.0, &absorbed, &response.gradient, 1.0);
        let mut out = Self::zero(functions);
        let (all, base) = ((torques, torques), (torques, FOLLOW));
        out.matrix.view_mut((0, 0), all).copy_from(&matrix);
        out.matrix
            .view_mut((0, torques), base)
            .copy_from(&with_base);
        let mut below = out.matrix.view_mut((torques, 0), (FOLLOW, torques));
        below.copy_from(&with_base.transpose());
        let mut corner = out
            .matrix
            .fixed_view_mut::<FOLLOW, FOLLOW>(torques, torques);
        corner.copy_from(&response.base_normal);
        out.gradient.rows_mut(0, torques).copy_from(&gradient);
        let mut last = out.gradient.rows_mut(torques, FOLLOW);
        last.copy_from(&response.base_gradient);
        out
    }

    /// Without the variables at these places, which stay what they are.
    fn holding(self, places: &[usize]) -> Self {
        Self {
            matrix: self.matrix.remove_rows_at(places).remove_columns_at(places),
            gradient: self.gradient.remove_rows_at(places),
        }
    }
}

/// A little is added for what the data say nothing about: torques on an axis that sticks.
fn solver(mut matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let least = 1e-12 * matrix.diagonal().amax();
    for i in 0..matrix.nrows() {
        matrix[(i, i)] += 1e-9 * matrix[(i, i)].max(least);
    }
    matrix.cholesky()
}
