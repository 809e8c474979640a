//! All windows linearised at once, their initial states eliminated: what is left is a quadratic in the parameters.

use nalgebra::{Cholesky, Const, DMatrix, DVector, SMatrix, Vector4};
use rayon::prelude::*;

use super::data::{Data, Run, Window};
use super::linear::Linear;
use super::model::{Layout, Model};
use super::passes::Passes;
use super::slopes::{Along, Slopes};
use super::start::Start;

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
    /// The reduced Gauss-Newton matrix of the numbers that the window depends on.
    matrix: DMatrix<f64>,
    /// Where the window says something: the Gauss-Newton matrix of its initial state, and how that and the parameters
    /// go together.
    own_matrix: Option<Cholesky<f64, Const<4>>>,
    cross: SMatrix<f64, 4, MAX_FREE>,
    /// How each sample follows, where that is kept.
    slopes: Option<Slopes>,
}

/// What is kept of the windows beside the sums.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Keep {
    Sums,
    /// Scores in blocks of this many seconds.
    Blocks(f64),
    /// The slopes, for [`About::again`].
    Slopes,
}

impl Response {
    /// What is needed to follow the window by its slopes.
    pub(super) fn linear(&self) -> Option<(&Slopes, &Cholesky<f64, Const<4>>)> {
        self.slopes.as_ref().zip(self.own_matrix.as_ref())
    }

    /// Takes up another gradient: how the initial state goes on, and what is left of the parameters' gradient.
    fn turn(&mut self, gradient: &[f64], places: impl Iterator<Item = (usize, usize)>) {
        let Some(own) = &self.own_matrix else { return };
        self.own = own.solve(&Vector4::from_fn(|a, _| gradient[a]));
        for (i, at) in places {
            self.score[at] = gradient[4 + i] - self.cross.column(i).dot(&self.own);
        }
    }

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

/// Where the numbers that a window of this recording depends on stand.
fn places(layout: &Layout, recording: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..layout.local()).map(move |i| (i, layout.place(recording, i)))
}

/// Windows to be linearised about their starts and the numbers `z` of a model.
pub(crate) struct About<'a, M> {
    pub(crate) model: &'a M,
    pub(crate) z: &'a [f64],
    pub(crate) data: &'a Data,
    pub(crate) windows: &'a [Window],
    pub(crate) states: &'a [Start],
    /// How much what is known beforehand counts.
    pub(crate) prior_weight: f64,
}

impl<M: Model> About<'_, M> {
    /// Linearises all windows.
    pub(crate) fn reduced(&self, keep: Keep) -> Reduced {
        let all: Vec<usize> = (0..self.windows.len()).collect();
        self.added_up(self.linearised(&all, keep))
    }

    /// The same by slopes that were found `before`; the windows that were not followed by them are linearised anew.
    pub(super) fn again(&self, mut before: Reduced, along: &[Option<Along>]) -> Reduced {
        let layout = self.model.layout();
        let mut anew = Vec::new();
        for (i, along) in along.iter().enumerate() {
            let Some(along) = along else {
                anew.push(i);
                continue;
            };
            let recording = self.data.runs[self.windows[i].run].recording;
            before.windows[i].turn(&along.gradient, places(&layout, recording));
        }
        for (i, response) in anew.iter().zip(self.linearised(&anew, Keep::Slopes)) {
            before.windows[*i] = response;
        }
        self.added_up(before.windows)
    }

    /// Windows linearised, their initial states eliminated.
    fn linearised(&self, which: &[usize], keep: Keep) -> Vec<Response> {
        if which.is_empty() {
            return Vec::new();
        }
        let layout = self.model.layout();
        let passes = Passes::new(self.model, self.z, layout.local());
        which
            .par_iter()
            .map_init(
                || passes.states(),
                |s, &i| {
                    let w = &self.windows[i];
                    let linear = passes.linear(s, self.data, w, &self.states[i]);
                    eliminated(linear, &layout, &self.data.runs[w.run], keep)
                },
            )
            .collect()
    }

    /// The sum over all windows, in order: the same digits whatever the number of threads; with what is known
    /// beforehand.
    fn added_up(&self, windows: Vec<Response>) -> Reduced {
        let layout = self.model.layout();
        let p = layout.len();
        let (mut gradient, mut matrix) = (DVector::zeros(p), DMatrix::zeros(p, p));
        for (response, w) in windows.iter().zip(self.windows) {
            let recording = self.data.runs[w.run].recording;
            for (i, at) in places(&layout, recording) {
                gradient[at] += response.score[at];
                for (j, beside) in places(&layout, recording) {
                    matrix[(at, beside)] += response.matrix[(i, j)];
                }
            }
        }
        for (i, prior) in self.model.priors().into_iter().enumerate() {
            if let Some(prior) = prior {
                let weight = self.prior_weight * prior.std.powi(-2);
                gradient[i] += weight * (self.z[i] - prior.mean);
                matrix[(i, i)] += weight;
            }
        }
        Reduced {
            gradient,
            matrix,
            windows,
        }
    }
}

/// What a window says once its initial state follows.
fn eliminated(linear: Linear, layout: &Layout, run: &Run, keep: Keep) -> Response {
    let places: Vec<(usize, usize)> = places(layout, run.recording).collect();
    let all = linear.matrix();
    let (gradient, blocks) = match keep {
        Keep::Blocks(seconds) => {
            let blocks = linear.gradients(run.samples_in(seconds));
            (added(&blocks), blocks)
        }
        Keep::Sums | Keep::Slopes => (linear.gradient(), Vec::new()),
    };
    let mut response = Response {
        by_parameters: SMatrix::zeros(),
        own: Vector4::zeros(),
        score: DVector::zeros(layout.len()),
        blocks: Vec::new(),
        information: DVector::zeros(layout.len()),
        own_matrix: None,
        cross: SMatrix::zeros(),
        slopes: None,
        matrix: DMatrix::zeros(layout.local(), layout.local()),
    };
    let mut own = all.fixed_view::<4, 4>(0, 0).into_owned();
    for i in 0..4 {
        own[(i, i)] += 1e-9 + 1e-9 * own[(i, i)];
    }
    let Some(own) = own.cholesky().filter(|_| linear.cost.is_finite()) else {
        return response;
    };
    let mut cross = SMatrix::<f64, 4, MAX_FREE>::zeros();
    for &(i, _) in &places {
        for a in 0..4 {
            cross[(a, i)] = all[(a, 4 + i)];
        }
    }
    response.by_parameters = own.solve(&cross);
    (response.own_matrix, response.cross) = (Some(own), cross);
    response.turn(&gradient, places.iter().copied());
    response.blocks = (blocks.iter())
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
        for &(j, _) in &places {
            let follows = cross.column(i).dot(&response.by_parameters.column(j));
            response.matrix[(i, j)] = all[(4 + i, 4 + j)] - follows;
        }
        response.information[at] = response.matrix[(i, i)];
    }
    if matches!(keep, Keep::Slopes) {
        response.slopes = Some(linear.slopes);
    }
    response
}

/// The sum of the parts of a gradient.
fn added(parts: &[Vec<f64>]) -> Vec<f64> {
    let mut sum = vec![0.0; parts.first().map_or(0, Vec::len)];
    for part in parts {
        for (sum, part) in sum.iter_mut().zip(part) {
            *sum += part;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use furuta_model::Rig;

    use super::*;
    use crate::shooting::falls::{SECONDS, as_given, falls};
    use crate::shooting::model::Pass;
    use crate::shooting::{Effort, Problem};

    /// Followed to where they were found, slopes say what linearising anew says; windows that were not followed are
    /// linearised anew.
    #[test]
    fn slopes_where_they_were_found_say_what_linearising_says() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let data = Data::new(&falls(&rig), &rig);
        let problem = Problem::new(&data, data.windows(SECONDS, |_| true));
        let model = as_given(&rig);
        let z = vec![0.01; model.layout().len()];
        let solved = problem.solve_states(&model, &z, None);
        let fit = problem.fit(&model, z, &solved.states, Effort::QUICK.within(0));
        let about = problem.about(&fit);
        let fresh = about.reduced(Keep::Slopes);
        let seen = model.observed::<4>(&fit.z, Pass::FIRST).plain();
        let along: Vec<Option<Along>> = (fresh.windows.iter().enumerate())
            .map(|(i, response)| {
                let (slopes, _) = response.linear().expect("the window says something");
                let (w, start) = (&problem.windows[i], &fit.states[i]);
                (i % 2 == 0).then(|| Along::new(&seen, &data, w, start, slopes))
            })
            .collect();
        // Gradients that are not those.
        let mut astray = about.reduced(Keep::Slopes);
        for response in &mut astray.windows {
            response.score.fill(1e6);
        }
        let again = about.again(astray, &along);
        // The same sums of the same numbers; a simulation without derivatives differs in rounding alone.
        let size = fresh.gradient.amax();
        assert!(size > 1.0, "{size}");
        for (a, b) in again.gradient.iter().zip(fresh.gradient.iter()) {
            assert!((a - b).abs() < 1e-9 * size, "{a} {b}");
        }
        assert_eq!(again.matrix, fresh.matrix);
    }
}
