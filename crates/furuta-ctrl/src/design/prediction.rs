//! What a regulated system does within a horizon, and what moves on top of the regulator change.

use super::Regulator;
use nalgebra::{RowSVector, SMatrix, SVector};

/// A system under `u = -K e + v`, predicted at the ends of `MOVES` stretches of time; `v` is constant within a stretch.
///
/// From the error `e` now and scaled moves `w`, an output of [`Prediction::output`] is `free e + forced w` at each of
/// those times. With `w_i = sqrt(n_i) v_i`, `n_i` samples long, what the moves add to an LQR's cost is `(R + B'PB) w'w`
/// whatever `e` is: about its optimal regulator a linear-quadratic problem is a distance. (J. A. Rossiter, B.
/// Kouvaritakis, M. J. Rice, *A numerically robust state-space approach to stable-predictive control strategies*,
/// Automatica 34, 1998.)
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Prediction<const N: usize, const MOVES: usize> {
    /// Samples from now to each stretch's end, rising.
    pub ends: [usize; MOVES],
    /// `(A - B K)^k` at the start of each stretch.
    at_start: [SMatrix<f64, N, N>; MOVES],
    /// The same at its end.
    at_end: [SMatrix<f64, N, N>; MOVES],
    /// The state at the end of stretch `i` after `w_j = 1`: `[i][j]`.
    moved: [[SVector<f64, N>; MOVES]; MOVES],
    gain: RowSVector<f64, N>,
}

/// One number of the prediction at each time: `free[i] e + forced[i] w`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Predicted<const N: usize, const MOVES: usize> {
    /// From the error now.
    pub free: [[f64; N]; MOVES],
    /// From the scaled moves.
    pub forced: [[f64; MOVES]; MOVES],
}

impl<const N: usize, const MOVES: usize> Prediction<N, MOVES> {
    /// Of `x[k+1] = A x[k] + B u[k]` under a regulator of it, over `samples` (at least `MOVES`). Stretches grow with
    /// time as a square does: what comes soon is decided finely.
    #[must_use]
    pub fn new(b: &SVector<f64, N>, regulator: &Regulator<f64, N, 1>, samples: usize) -> Self {
        let spare = samples.saturating_sub(MOVES);
        let ends = core::array::from_fn(|i| {
            let part = (i + 1) * (i + 1) * spare;
            i + 1 + (part + MOVES * MOVES / 2) / (MOVES * MOVES)
        });
        let a = regulator.closed_loop;
        let mut out = Self {
            ends,
            at_start: [SMatrix::identity(); MOVES],
            at_end: [SMatrix::identity(); MOVES],
            moved: [[SVector::zeros(); MOVES]; MOVES],
            gain: regulator.gain,
        };
        let mut power = SMatrix::<f64, N, N>::identity();
        let mut states = [SVector::<f64, N>::zeros(); MOVES];
        for i in 0..MOVES {
            out.at_start[i] = power;
            let length = out.length(i);
            #[allow(clippy::cast_precision_loss)] // some hundred samples
            let push = b / libm::sqrt(length as f64);
            for _ in 0..length {
                power = a * power;
                for state in &mut states {
                    *state = a * *state;
                }
                states[i] += push;
            }
            out.at_end[i] = power;
            out.moved[i] = states;
        }
        out
    }

    /// Samples of stretch `i`.
    #[must_use]
    pub fn length(&self, i: usize) -> usize {
        self.ends[i] - if i == 0 { 0 } else { self.ends[i - 1] }
    }

    /// `c x` at each stretch's end.
    #[must_use]
    pub fn output(&self, c: &RowSVector<f64, N>) -> Predicted<N, MOVES> {
        Predicted {
            free: self.at_end.map(|power| entries(&(c * power))),
            forced: self.moved.map(|row| row.map(|x| (c * x)[0])),
        }
    }

    /// The command at each stretch's start.
    #[must_use]
    pub fn command(&self) -> Predicted<N, MOVES> {
        let k = -self.gain;
        let forced = core::array::from_fn(|i| {
            core::array::from_fn(|j| {
                #[allow(clippy::cast_precision_loss)]
                let own = if i == j {
                    1.0 / libm::sqrt(self.length(i) as f64)
                } else {
                    0.0
                };
                let before = if i == 0 {
                    0.0
                } else {
                    (k * self.moved[i - 1][j])[0]
                };
                own + before
            })
        });
        Predicted {
            free: self.at_start.map(|power| entries(&(k * power))),
            forced,
        }
    }
}

fn entries<const N: usize>(row: &RowSVector<f64, N>) -> [f64; N] {
    core::array::from_fn(|i| row[i])
}
