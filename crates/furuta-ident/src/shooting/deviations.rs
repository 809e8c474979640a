//! Standard deviations of what was fitted.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::data::Window;
use super::eliminate::Reduced;
use super::fit::{Fit, Problem, WHITE};
use super::model::Model;

/// Of fewer blocks a variance says little.
const BLOCKS: usize = 8;

/// How far the numbers of a fit may be from the true ones.
pub(super) struct Deviations {
    /// Standard deviations, in the units of the fit.
    pub(super) std: Vec<f64>,
    /// The same of each number if those that tell how it acts ([`Model::shape`]) are known.
    pub(super) std_by_itself: Vec<f64>,
    /// By how much errors that are correlated widen `std`: root mean square over the free numbers, at least 1.
    pub(super) widened: f64,
}

impl Problem<'_> {
    /// Standard deviations: `H⁻¹ (sum of score scoreᵀ) H⁻¹` over blocks, and not below what white noise would give.
    ///
    /// A block is a window. Where more than the noise is left, the model is wrong in the same way for long, and blocks
    /// of twice, four times and so on as many windows, up to whole recordings, are tried as long as there are
    /// [`BLOCKS`] of them: the widest deviation counts.
    pub(super) fn deviations<M: Model>(
        &self,
        here: &Fit<M>,
        r: &Reduced,
        bounds: &[(f64, f64)],
    ) -> Deviations {
        let p = bounds.len();
        let held = |i: usize| bounds[i].0 == bounds[i].1;
        let Some(inverse) = inverse(r, held) else {
            return Deviations {
                std: vec![f64::NAN; p],
                std_by_itself: vec![f64::NAN; p],
                widened: 1.0,
            };
        };
        let left = here.cost / self.floor();
        let scatter = self.scatter(r, p, left > WHITE);
        let variances = widest(&inverse, &scatter);
        let white = |i: usize| inverse[(i, i)] * left.max(1.0);
        let free: Vec<f64> = (0..p)
            .filter(|i| !held(*i) && white(*i) > 0.0)
            .map(|i| variances[i] / white(i))
            .collect();
        let mean = free.iter().sum::<f64>() / free.len().max(1) as f64;
        let std = |i: usize| variances[i].max(inverse[(i, i)]).sqrt();
        let by_itself = |i: usize| {
            let shape = here.model.shape(i);
            if shape.is_empty() {
                return std(i);
            }
            let known = self::inverse(r, |k| held(k) || shape.contains(&k));
            known.map_or(f64::NAN, |known| {
                widest(&known, &scatter)[i].max(known[(i, i)]).sqrt()
            })
        };
        Deviations {
            std: (0..p).map(std).collect(),
            std_by_itself: (0..p).map(by_itself).collect(),
            widened: mean.sqrt().max(1.0),
        }
    }

    /// The sums of squares of the scores of blocks: of single windows, then, where something `is_left`, of longer
    /// blocks.
    fn scatter(&self, r: &Reduced, p: usize, is_left: bool) -> Vec<DMatrix<f64>> {
        // By run: how many samples a window has, and how many windows lie between the first and the last.
        let mut whole: BTreeMap<usize, usize> = BTreeMap::new();
        for w in &self.windows {
            let len = whole.entry(w.run).or_insert(1);
            *len = w.len.max(*len);
        }
        let place = |w: &Window| w.start / whole[&w.run];
        let most = self.windows.iter().map(place).max().unwrap_or(0) + 1;
        let of_blocks = |windows: usize| {
            let mut scores: BTreeMap<(usize, usize), DVector<f64>> = BTreeMap::new();
            for (w, response) in self.windows.iter().zip(&r.windows) {
                let block = (w.run, place(w) / windows);
                *scores.entry(block).or_insert_with(|| DVector::zeros(p)) += &response.score;
            }
            let squares = scores.values().map(|score| score * score.transpose());
            (
                squares.fold(DMatrix::zeros(p, p), |sum, s| sum + s),
                scores.len(),
            )
        };
        // The longest are as long as the longest run.
        let longer = std::iter::successors(Some(2), |windows| Some(2 * windows))
            .take_while(|windows| is_left && *windows < 2 * most)
            .map(of_blocks)
            .take_while(|(_, blocks)| *blocks >= BLOCKS);
        std::iter::once(of_blocks(1))
            .chain(longer)
            .map(|(squares, _)| squares)
            .collect()
    }
}

/// The inverse of the Gauss-Newton matrix, the numbers that are `held` known.
fn inverse(r: &Reduced, held: impl Fn(usize) -> bool) -> Option<DMatrix<f64>> {
    let mut m = r.matrix.clone();
    for i in 0..m.nrows() {
        m[(i, i)] += 1e-9;
        if held(i) {
            m.row_mut(i).fill(0.0);
            m.column_mut(i).fill(0.0);
            m[(i, i)] = 1e12;
        }
    }
    m.cholesky().map(|c| c.inverse())
}

/// The widest variance of each number over sums of squares of scores.
fn widest(inverse: &DMatrix<f64>, scatter: &[DMatrix<f64>]) -> DVector<f64> {
    let of = |squares: &DMatrix<f64>| (inverse * squares * inverse).diagonal();
    scatter
        .iter()
        .map(of)
        .reduce(|a, b| a.sup(&b))
        .unwrap_or_else(|| DVector::zeros(inverse.nrows()))
}

#[cfg(test)]
mod tests {
    use furuta_model::Rig;

    use crate::shooting::falls::{SECONDS, as_given, falls};
    use crate::shooting::{Data, Effort, Model, Problem};

    /// Of more recordings than there must be blocks, each may be one.
    #[test]
    fn deviations_of_many_short_recordings_that_the_model_does_not_explain_are_numbers() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let recordings = falls(&rig);
        let mut other = rig.clone();
        other.params.pendulum.inertia *= 1.2;
        other.effects =
            vec![furuta_model::Effect::new("arm.spring", &[1e-3, 0.1]).expect("an effect")];
        let data = Data::new(&recordings, &other);
        let problem = Problem::new(&data, data.windows(SECONDS, |_| true));
        let model = as_given(&other);
        let start = problem.solve_states(&model, &vec![0.0; model.layout().len()], None);
        let fit = problem.fit(&model, start.z, &start.states, Effort::FULL);
        assert!(problem.chi(&fit) > 2.0, "{}", problem.chi(&fit));
        assert!(fit.std.iter().all(|std| std.is_finite()), "{:?}", fit.std);
    }
}
