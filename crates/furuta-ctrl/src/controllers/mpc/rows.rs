//! One limited number at the times that the prediction looks at.

use crate::design::Predicted;
use crate::real::{Real, c};

/// One limited number at `M` times, each scaled to a row of about unit length.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Rows<T, const M: usize> {
    /// From the error now, a row for each of its four numbers.
    pub free: [[T; M]; 4],
    /// From the moves, a row for each time; lower triangular, for a move changes nothing before it.
    pub forced: [[T; M]; M],
    /// The same, a row for each move: the solver reads both ways.
    pub by_move: [[T; M]; M],
    /// What the number itself is multiplied by in each row.
    pub scale: [T; M],
    /// Largest value either way, V or rad; infinite where there is no limit. Of the command's changes: in one sample.
    pub limit: T,
    /// The same in each row: `limit * scale`; of changes, times the samples in which they take place.
    pub reach: [T; M],
    /// Largest multiplier: the price of a unit beyond the limit in the row's units; infinite for a limit that is kept
    /// at all cost.
    pub price: [T; M],
}

impl<const M: usize> Rows<f64, M> {
    pub(super) fn new(predicted: &Predicted<4, M>, limit: f64, price: f64) -> Self {
        Self::each(predicted, limit, [1.0; M], price)
    }

    /// Of the changes of `command` from each time to the next, which follow after `samples`; the first from the
    /// last command that was given. By at most `step` in a sample, at all cost.
    pub(super) fn changes(
        command: &Predicted<4, M>,
        step: f64,
        samples: impl Fn(usize) -> usize,
    ) -> Self {
        let mut changes = *command;
        for i in (1..M).rev() {
            for (x, before) in changes.free[i].iter_mut().zip(&command.free[i - 1]) {
                *x -= before;
            }
            for (x, before) in changes.forced[i].iter_mut().zip(&command.forced[i - 1]) {
                *x -= before;
            }
        }
        #[allow(clippy::cast_precision_loss)] // some hundred samples
        let counts =
            core::array::from_fn(|i| if i == 0 { 1.0 } else { samples(i - 1) as f64 });
        Self::each(&changes, step, counts, f64::INFINITY)
    }

    /// `times` as large a limit in each row.
    fn each(predicted: &Predicted<4, M>, limit: f64, times: [f64; M], price: f64) -> Self {
        if !limit.is_finite() {
            return Self {
                free: [[0.0; M]; 4],
                forced: [[0.0; M]; M],
                by_move: [[0.0; M]; M],
                scale: [1.0; M],
                limit,
                reach: [limit; M],
                price: [0.0; M],
            };
        }
        let lengths = predicted
            .forced
            .map(|row| libm::sqrt(row.iter().map(|x| x * x).sum()));
        let longest = lengths.iter().fold(0.0, |a: f64, b| a.max(*b));
        // What the moves hardly reach, an angle a few samples from now, stays a short row: nothing is gained by
        // insisting.
        let scale = lengths.map(|length| 1.0 / length.max(0.1 * longest));
        let forced: [[f64; M]; M] =
            core::array::from_fn(|i| predicted.forced[i].map(|x| x * scale[i]));
        Self {
            free: core::array::from_fn(|j| {
                core::array::from_fn(|i| predicted.free[i][j] * scale[i])
            }),
            by_move: core::array::from_fn(|j| forced.map(|row| row[j])),
            forced,
            scale,
            limit,
            reach: core::array::from_fn(|i| limit * times[i] * scale[i]),
            price: scale.map(|s| price / s),
        }
    }

    pub(super) fn cast<T: Real>(&self) -> Rows<T, M> {
        Rows {
            free: self.free.map(|row| row.map(c)),
            forced: self.forced.map(|row| row.map(c)),
            by_move: self.by_move.map(|row| row.map(c)),
            scale: self.scale.map(c),
            limit: c(self.limit),
            reach: self.reach.map(c),
            price: self.price.map(c),
        }
    }
}

impl<T: Real, const M: usize> Rows<T, M> {
    /// Whether there is a limit at all.
    pub fn is_limited(&self) -> bool {
        self.limit.value() < f64::INFINITY
    }

    /// The rows' values without moves, less what they are where the number itself is zero: it is at `zero`. Within
    /// `reach` either way if the limit is kept; 0 where there is none.
    pub fn asked(&self, e: &[T; 4], zero: T) -> [T; M] {
        let mut out = [T::ZERO; M];
        if self.is_limited() {
            let [a, b, c, d] = &self.free;
            for i in 0..M {
                out[i] = (a[i] * e[0] + b[i] * e[1])
                    + (c[i] * e[2] + d[i] * e[3])
                    + zero * self.scale[i];
            }
        }
        out
    }
}
