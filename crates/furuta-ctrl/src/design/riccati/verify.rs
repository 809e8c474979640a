//! What is made of the matrix that an iteration ended at: refined, checked, accepted or not.

use super::Solution;
use super::equation::RiccatiEquation;
use crate::design::elimination::Lu;
use crate::design::lyapunov::{self, SQUARINGS, cayley, squared, symmetric};
use crate::design::stability::{cayley_radius, spectral_radius};
use crate::design::{DesignError, Float, as_f64};
use nalgebra::SMatrix;

/// Newton steps at most; each squares the error until rounding stops it, one is usual.
const REFINEMENTS: u32 = 12;

/// Which of the two equations.
#[derive(Copy, Clone, PartialEq, Eq)]
pub(super) enum Time {
    Discrete,
    Continuous,
}

/// A matrix that may be the solution, in scaled coordinates.
struct Candidate<T: Float, const N: usize, const M: usize> {
    x: SMatrix<T, N, N>,
    gain: SMatrix<T, M, N>,
    closed: SMatrix<T, N, N>,
    left: SMatrix<T, N, N>,
    /// Relative residual: the larger of that in scaled coordinates and that in the units that were given.
    residual: T,
    /// Relative residual in the units that were given.
    as_given: T,
    /// Sum of the norms of the equation's terms, in scaled coordinates.
    terms: T,
}

/// The largest relative residual that is accepted: 1e-10 in f64, 4e-5 in f32.
fn allowed<T: Float>() -> T {
    T::default_epsilon().powf(nalgebra::convert(0.64))
}

impl<T: Float, const N: usize, const M: usize> RiccatiEquation<T, N, M> {
    fn candidate(&self, time: Time, x: SMatrix<T, N, N>) -> Option<Candidate<T, N, M>> {
        let (a, b, q, n) = (&self.a, &self.b, &self.q, &self.n);
        let bt = b.transpose();
        let (gain, left, sizes) = match time {
            Time::Discrete => {
                let xb = x * b;
                let axa = symmetric(a.transpose() * (x * a));
                let across = a.transpose() * xb + n;
                let weight = SMatrix::identity() + bt * xb;
                let gain = Lu::new(weight)?.solve(across.transpose());
                let spent = symmetric(across * gain);
                (gain, axa - x - spent + q, [axa, x, spent, *q])
            }
            Time::Continuous => {
                let gain = (x * b + n).transpose();
                let xa = x * a;
                let xa = xa + xa.transpose();
                let spent = gain.transpose() * gain;
                (gain, xa - spent + q, [xa, x * T::zero(), spent, *q])
            }
        };
        let share = |left: T, terms: T| {
            if terms > T::zero() {
                left / terms
            } else {
                left
            }
        };
        let terms = sizes.iter().fold(T::zero(), |sum, m| sum + m.norm());
        let scaled = share(left.norm(), terms);
        let as_given = if self.is_scaled() {
            let given = sizes
                .iter()
                .fold(T::zero(), |sum, m| sum + self.norm_as_given(m));
            share(self.norm_as_given(&left), given)
        } else {
            scaled
        };
        let residual = scaled.max(as_given);
        residual.is_finite().then_some(Candidate {
            x,
            gain,
            closed: a - b * gain,
            left,
            residual,
            as_given,
            terms,
        })
    }

    /// The change of `X` that makes up for `rhs` on the equation's left side, to first order.
    fn newton(
        &self,
        time: Time,
        closed: &SMatrix<T, N, N>,
        rhs: &SMatrix<T, N, N>,
    ) -> Option<SMatrix<T, N, N>> {
        match time {
            Time::Discrete => lyapunov::discrete(closed, rhs),
            Time::Continuous => lyapunov::continuous(closed, rhs),
        }
    }

    /// Newton's method (Kleinman 1968, Hewer 1971) from a stabilising `X` near the solution, for as long as the
    /// residual falls.
    pub(super) fn verify(
        &self,
        time: Time,
        x: SMatrix<T, N, N>,
        shift: T,
        iterations: u32,
    ) -> Result<Solution<T, N, M>, DesignError> {
        let broken = DesignError::NoStabilisingSolution { measure: f64::NAN };
        let mut best = self.candidate(time, symmetric(x)).ok_or(broken)?;
        let rounding = T::default_epsilon() * nalgebra::convert::<f64, T>(32.0 * N as f64);
        for _ in 0..REFINEMENTS {
            if best.residual <= rounding {
                break;
            }
            let next = self
                .newton(time, &best.closed, &best.left)
                .and_then(|change| self.candidate(time, best.x + change));
            match next {
                Some(next) if next.residual < best.residual * nalgebra::convert(0.7) => best = next,
                _ => break,
            }
        }
        if !self.stands(time, &best, shift) {
            let measure = match time {
                Time::Discrete => spectral_radius(&best.closed),
                Time::Continuous => cayley_radius(&best.closed),
            };
            return Err(DesignError::NoStabilisingSolution {
                measure: as_f64(measure),
            });
        }
        if !(best.residual <= allowed()) {
            return Err(DesignError::NotConverged {
                residual: as_f64(best.residual),
                allowed: as_f64(allowed::<T>()),
            });
        }
        let (x, gain) = (self.cost_as_given(&best.x), self.gain_as_given(&best.gain));
        if !x.iter().chain(gain.iter()).all(|v| v.is_finite()) {
            return Err(broken);
        }
        Ok(Solution {
            x,
            gain,
            residual: best.as_given,
            iterations,
        })
    }

    /// Whether the closed loop is stable, and stays so if the last digits of the problem change.
    ///
    /// A mode that only rounding connects to the input can be 'stabilised' by an enormous gain, a mode on the boundary
    /// pushed inside by rounding of its weight. In both, another rounding gives another answer: that is tried where a
    /// gain is large or a mode slow.
    fn stands(&self, time: Time, t: &Candidate<T, N, M>, shift: T) -> bool {
        let epsilon = T::default_epsilon();
        let mut power = match time {
            Time::Discrete => t.closed,
            Time::Continuous => match cayley(&t.closed) {
                Some((power, _)) => power,
                None => return false,
            },
        };
        let mut steps = T::one();
        for _ in 0..SQUARINGS {
            if power.norm_squared() < epsilon {
                // Rounding moves a mode on the boundary inside by the root of epsilon, and adds epsilon times the gain
                // to the closed loop.
                let [slow, strong] = [1e-2, 1e-10].map(nalgebra::convert::<f64, T>);
                let pull = t.gain.norm() * self.b.norm() * epsilon;
                let clear = steps * epsilon.sqrt() < slow
                    && pull < strong * (T::one() + self.a.norm())
                    && shift == T::zero();
                return clear || self.stands_shaken(time, t, shift);
            }
            power = squared(&power);
            steps += steps;
        }
        false
    }

    /// How much, to first order, solution and closed loop change with the last digits.
    fn stands_shaken(&self, time: Time, t: &Candidate<T, N, M>, shift: T) -> bool {
        let epsilon = T::default_epsilon();
        let [limit, half] = [1e-3, 0.5].map(nalgebra::convert::<f64, T>);
        // A fixed pattern of signs that has no symmetry (xorshift).
        let mut bits: u32 = 0x9e37_79b9;
        let mut sign = || {
            bits ^= bits << 13;
            bits ^= bits >> 17;
            bits ^= bits << 5;
            if bits & 8 == 0 { epsilon } else { -epsilon }
        };
        let (a, b) = (self.a.map(|v| v * sign()), self.b.map(|v| v * sign()));
        let shaken = a - b * t.gain;
        let both = |m: SMatrix<T, N, N>| m + m.transpose();
        let by = |x: &SMatrix<T, N, N>, change: &SMatrix<T, N, N>| match time {
            Time::Discrete => both(t.closed.transpose() * (x * change)),
            Time::Continuous => both(x * change),
        };
        // How slowly the closed loop forgets; at the same time what a rounding of 1 in the equation becomes in X, in
        // any direction.
        let Some(memory) = self.newton(time, &t.closed, &SMatrix::identity()) else {
            return false;
        };
        let Some(change) = self.newton(time, &t.closed, &by(&t.x, &shaken)) else {
            return false;
        };
        // The terms of the equation cancel but for their rounding; a start that is taken off again leaves that of its
        // own size.
        let change = change + memory * ((t.terms + shift) * epsilon);
        let pull = self.b.transpose() * change;
        let gain = match time {
            Time::Discrete => {
                let weight = SMatrix::identity() + self.b.transpose() * (t.x * self.b);
                match Lu::new(weight) {
                    Some(lu) => lu.solve(pull * t.closed),
                    None => return false,
                }
            }
            Time::Continuous => pull,
        };
        let moved = self.newton(time, &t.closed, &by(&memory, &(shaken - self.b * gain)));
        change.norm() <= t.x.norm() * limit
            && moved.is_some_and(|moved| moved.norm() <= memory.norm() * half)
    }
}
