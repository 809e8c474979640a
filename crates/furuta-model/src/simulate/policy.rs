//! Where a rollout's commands come from.

use crate::scalar::Scalar;
use crate::state::State;

/// Commands for samples and states, for one rollout or for several in lanes.
pub trait Policy: Sync {
    /// The command (V) of sample `k` in the state `x`.
    fn command<S: Scalar<Real = f64>>(&self, k: usize, x: &State<S>) -> S;
}

/// The same commands (V) for every rollout; zero after the last.
#[derive(Copy, Clone, Debug)]
pub struct OpenLoop<'a>(pub &'a [f64]);

impl Policy for OpenLoop<'_> {
    #[inline(always)]
    fn command<S: Scalar<Real = f64>>(&self, k: usize, _: &State<S>) -> S {
        S::from_real(self.0.get(k).copied().unwrap_or(0.0))
    }
}

/// State feedback from the true state, `u = -gain (x - reference)` within `±limit`. Angles are not wrapped.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Feedback {
    /// For `theta, alpha` (V/rad) and `theta_dot, alpha_dot` (V s/rad).
    pub gain: [f64; 4],
    /// Where the state is wanted.
    pub reference: State<f64>,
    /// Largest command, V.
    pub limit: f64,
}

impl Policy for Feedback {
    #[inline(always)]
    fn command<S: Scalar<Real = f64>>(&self, _: usize, x: &State<S>) -> S {
        let mut u = S::ZERO;
        for ((x, r), k) in x
            .to_array()
            .into_iter()
            .zip(self.reference.to_array())
            .zip(self.gain)
        {
            u -= (x - S::from_real(r)).scale(k);
        }
        u.clamp(S::from_real(-self.limit), S::from_real(self.limit))
    }
}
