//! Standard deviations of what was fitted.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::data::Window;
use super::eliminate::Reduced;
use super::fit::{Fit, Problem, WHITE};

/// Of fewer blocks a variance says little.
const BLOCKS: usize = 8;

impl Problem<'_> {
    /// Standard deviations, and by how much correlated errors widened them: `H⁻¹ (sum of score scoreᵀ) H⁻¹` over
    /// blocks, and not below what white noise would give.
    ///
    /// A block is a window. Where more than the noise is left, the model is wrong in the same way for long, and blocks
    /// of twice, four times and so on as many windows, up to whole recordings, are tried as long as there are
    /// [`BLOCKS`] of them: the widest deviation counts.
    pub(super) fn deviations<M>(
        &self,
        here: &Fit<M>,
        r: &Reduced,
        bounds: &[(f64, f64)],
    ) -> (Vec<f64>, f64) {
        let p = bounds.len();
        let mut m = r.matrix.clone();
        for i in 0..p {
            m[(i, i)] += 1e-9;
        }
        let held = |i: usize| bounds[i].0 == bounds[i].1;
        for i in (0..p).filter(|i| held(*i)) {
            m.row_mut(i).fill(0.0);
            m.column_mut(i).fill(0.0);
            m[(i, i)] = 1e12;
        }
        let Some(inverse) = m.cholesky().map(|c| c.inverse()) else {
            return (vec![f64::NAN; p], 1.0);
        };
        // By run: how many samples a window has, and how many windows lie between the first and the last.
        let mut whole: BTreeMap<usize, usize> = BTreeMap::new();
        for w in &self.windows {
            let len = whole.entry(w.run).or_insert(1);
            *len = w.len.max(*len);
        }
        let place = |w: &Window| w.start / whole[&w.run];
        let most = self.windows.iter().map(place).max().unwrap_or(0) + 1;
        let variances = |windows: usize| {
            let mut scores: BTreeMap<(usize, usize), DVector<f64>> = BTreeMap::new();
            for (w, response) in self.windows.iter().zip(&r.windows) {
                let block = (w.run, place(w) / windows);
                *scores.entry(block).or_insert_with(|| DVector::zeros(p)) += &response.score;
            }
            let mut meat = DMatrix::zeros(p, p);
            for score in scores.values() {
                meat += score * score.transpose();
            }
            ((&inverse * meat * &inverse).diagonal(), scores.len())
        };
        let mut variance: Vec<f64> = variances(1).0.iter().copied().collect();
        let left = here.cost / self.floor();
        // The longest are as long as the longest run.
        let longer = std::iter::successors(Some(2), |windows| Some(2 * windows));
        for windows in longer.take_while(|windows| left > WHITE && *windows < 2 * most) {
            let (wider, blocks) = variances(windows);
            if blocks < BLOCKS {
                break;
            }
            for (v, w) in variance.iter_mut().zip(wider.iter()) {
                *v = v.max(*w);
            }
        }
        let white = |i: usize| inverse[(i, i)] * left.max(1.0);
        let free: Vec<f64> = (0..p)
            .filter(|i| !held(*i) && white(*i) > 0.0)
            .map(|i| variance[i] / white(i))
            .collect();
        let mean = free.iter().sum::<f64>() / free.len().max(1) as f64;
        let std = (0..p)
            .map(|i| variance[i].max(inverse[(i, i)]).sqrt())
            .collect();
        (std, mean.sqrt().max(1.0))
    }
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
