//! All windows linearised at once, their initial states eliminated: what is left is a quadratic in the parameters.

use nalgebra::{DMatrix, DVector, Matrix4, SMatrix, Vector4};
use rayon::prelude::*;

use super::data::{Data, Window};
use super::model::{Layout, Model};
use super::predict::some;
use super::start::Start;
use super::window::{WindowNormal, normal};

/// The most numbers that one window can depend on.
pub(crate) const MAX_FREE: usize = 24;

/// Gradient and Gauss-Newton matrix over all windows with the initial states eliminated, what is known beforehand
/// added.
pub(crate) struct Reduced {
    pub(crate) gradient: DVector<f64>,
    pub(crate) matrix: DMatrix<f64>,
    /// Per window: how its initial state follows.
    pub(crate) windows: Vec<Response>,
}

/// How the initial state of a window follows a step of the parameters.
pub(crate) struct Response {
    /// `x -= own - by_parameters * step`, the step in the numbers that the window depends on.
    pub(crate) by_parameters: SMatrix<f64, 4, MAX_FREE>,
    pub(crate) own: Vector4<f64>,
    /// The reduced gradient, for statistics that do not trust the noise to be white.
    pub(crate) score: DVector<f64>,
    /// The same of each block, where they were asked for.
    pub(crate) blocks: Vec<DVector<f64>>,
    /// The diagonal of the reduced Gauss-Newton matrix.
    pub(crate) information: DVector<f64>,
}

impl Response {
    /// The initial state after a step of the parameters.
    pub(crate) fn follow(
        &self,
        start: &Start,
        layout: &Layout,
        recording: usize,
        step: &DVector<f64>,
    ) -> Start {
        let mut by = self.own;
        for i in 0..layout.local() {
            by -= self.by_parameters.column(i) * step[layout.place(recording, i)];
        }
        start.less(&by)
    }
}

/// Linearises all windows in the parameters of `model`; what is known beforehand counts `prior_weight` times. Scores
/// are kept in blocks of `block` seconds as well, if that is given.
pub(crate) fn reduced<M: Model>(
    model: &M,
    z: &[f64],
    data: &Data,
    windows: &[Window],
    states: &[Start],
    prior_weight: f64,
    block: Option<f64>,
) -> Reduced {
    match model.layout().local() {
        0..=8 => reduced_n::<12, M>(model, z, data, windows, states, prior_weight, block),
        9..=12 => reduced_n::<16, M>(model, z, data, windows, states, prior_weight, block),
        13..=16 => reduced_n::<20, M>(model, z, data, windows, states, prior_weight, block),
        _ => reduced_n::<{ 4 + MAX_FREE }, M>(model, z, data, windows, states, prior_weight, block),
    }
}

fn reduced_n<const N: usize, M: Model>(
    model: &M,
    z: &[f64],
    data: &Data,
    windows: &[Window],
    states: &[Start],
    prior_weight: f64,
    block: Option<f64>,
) -> Reduced {
    let seen = model.observed::<N>(z);
    let layout = model.layout();
    let p = layout.len();
    let mut out = Reduced {
        gradient: DVector::zeros(p),
        matrix: DMatrix::zeros(p, p),
        windows: Vec::with_capacity(windows.len()),
    };
    // In parallel, and added up in order: the same digits whatever the number of threads.
    let normals: Vec<WindowNormal<N>> = windows
        .par_iter()
        .zip(states)
        .map_init(
            || some(&seen.plant),
            |s, (w, start)| {
                let block = block.map(|seconds| data.runs[w.run].samples_in(seconds));
                normal(&seen, s, data, w, start, block)
            },
        )
        .collect();
    for (n, w) in normals.iter().zip(windows) {
        let recording = data.runs[w.run].recording;
        out.windows.push(eliminated(
            n,
            &layout,
            recording,
            &mut out.gradient,
            &mut out.matrix,
        ));
    }
    for (i, prior) in model.priors().into_iter().enumerate() {
        if let Some(prior) = prior {
            let weight = prior_weight * prior.std.powi(-2);
            out.gradient[i] += weight * (z[i] - prior.mean);
            out.matrix[(i, i)] += weight;
        }
    }
    out
}

/// Adds what a window says once its initial state follows.
fn eliminated<const N: usize>(
    n: &WindowNormal<N>,
    layout: &Layout,
    recording: usize,
    gradient: &mut DVector<f64>,
    matrix: &mut DMatrix<f64>,
) -> Response {
    let places: Vec<(usize, usize)> = (0..layout.local())
        .map(|i| (i, layout.place(recording, i)))
        .collect();
    let mut response = Response {
        by_parameters: SMatrix::zeros(),
        own: Vector4::zeros(),
        score: DVector::zeros(layout.len()),
        blocks: Vec::new(),
        information: DVector::zeros(layout.len()),
    };
    let mut own = Matrix4::from_fn(|a, b| n.matrix[a][b]);
    for i in 0..4 {
        own[(i, i)] += 1e-9 + 1e-9 * own[(i, i)];
    }
    let Some(own) = own.cholesky().filter(|_| n.cost.is_finite()) else {
        return response;
    };
    let mut cross = SMatrix::<f64, 4, MAX_FREE>::zeros();
    for &(i, _) in &places {
        for a in 0..4 {
            cross[(a, i)] = n.matrix[a][4 + i];
        }
    }
    response.by_parameters = own.solve(&cross);
    response.own = own.solve(&Vector4::from_fn(|a, _| n.gradient[a]));
    response.blocks = (n.blocks.iter())
        .map(|gradient| {
            let of_state = Vector4::from_fn(|a, _| gradient[a]);
            let mut score = DVector::zeros(layout.len());
            for &(i, at) in &places {
                score[at] = gradient[4 + i] - response.by_parameters.column(i).dot(&of_state);
            }
            score
        })
        .collect();
    for &(i, at) in &places {
        let score = n.gradient[4 + i] - cross.column(i).dot(&response.own);
        response.score[at] = score;
        gradient[at] += score;
        response.information[at] =
            n.matrix[4 + i][4 + i] - cross.column(i).dot(&response.by_parameters.column(i));
        for &(j, beside) in &places {
            let follows = cross.column(i).dot(&response.by_parameters.column(j));
            matrix[(at, beside)] += n.matrix[4 + i][4 + j] - follows;
        }
    }
    response
}
