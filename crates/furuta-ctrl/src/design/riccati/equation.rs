//! A Riccati problem as it is solved: checked, its input weight made 1, its states scaled.

use crate::design::elimination::{backward, cholesky, forward};
use crate::design::error::finite;
use crate::design::lyapunov::symmetric;
use crate::design::scaling::{SWEEPS, Sizes};
use crate::design::{DesignError, Entry, Float, Weights, as_f64};
use nalgebra::{SMatrix, SVector};

/// The problem in scaled states `z = D^-1 x` and inputs `v = L'u` with `R = L L'`, so that the weight of `v` is 1.
#[derive(Copy, Clone)]
pub(super) struct RiccatiEquation<T: Float, const N: usize, const M: usize> {
    pub(super) a: SMatrix<T, N, N>,
    pub(super) b: SMatrix<T, N, M>,
    pub(super) q: SMatrix<T, N, N>,
    pub(super) n: SMatrix<T, N, M>,
    /// `A - B N'`: the system when the cross term is taken out.
    pub(super) free: SMatrix<T, N, N>,
    /// `B B'`.
    pub(super) g: SMatrix<T, N, N>,
    /// `Q - N N'`.
    pub(super) h: SMatrix<T, N, N>,
    scale: SVector<T, N>,
    scaled: bool,
    root: SMatrix<T, M, M>,
}

impl<T: Float, const N: usize, const M: usize> RiccatiEquation<T, N, M> {
    pub(super) fn new(
        a: &SMatrix<T, N, N>,
        b: &SMatrix<T, N, M>,
        weights: &Weights<T, N, M>,
    ) -> Result<Self, DesignError> {
        finite(a, Entry::A)?;
        finite(b, Entry::B)?;
        finite(&weights.n, Entry::N)?;
        check_symmetric(&weights.q, Entry::Q)?;
        check_symmetric(&weights.r, Entry::R)?;
        let root =
            cholesky(&weights.r).map_err(|(index, pivot)| DesignError::NotPositiveDefinite {
                matrix: Entry::R,
                index,
                pivot: as_f64(pivot),
            })?;
        let b = forward(&root, b.transpose()).transpose();
        let n = forward(&root, weights.n.transpose()).transpose();
        let mut problem = Self {
            a: *a,
            b,
            q: symmetric(weights.q),
            n,
            free: a - b * n.transpose(),
            g: symmetric(b * b.transpose()),
            h: symmetric(weights.q - n * n.transpose()),
            scale: SVector::repeat(T::one()),
            scaled: false,
            root,
        };
        problem.balance();
        Ok(problem)
    }

    /// Chooses `D`, a diagonal of powers of two, so that rows and columns of the Hamiltonian matrix `[A, -G; -H, -A']`
    /// become alike (Osborne 1960, kept symplectic as by Benner 2001). Powers of two leave every digit as it is.
    fn balance(&mut self) {
        let nothing = T::zero();
        // Without weight or without input one side of the balance is empty.
        if self.g.amax() == nothing || self.h.amax() == nothing {
            return;
        }
        let (mut a, mut g, mut h) = (self.free.abs(), self.g.abs(), self.h.abs());
        let mut d = SVector::<T, N>::repeat(T::one());
        for _ in 0..SWEEPS {
            let mut settled = true;
            for i in 0..N {
                let mut sizes = Sizes::zero();
                for j in 0..N {
                    if j != i {
                        sizes.falls += a[(i, j)] + g[(i, j)];
                        sizes.grows += a[(j, i)] + h[(i, j)];
                    }
                }
                (sizes.falls_twice, sizes.grows_twice) = (g[(i, i)], h[(i, i)]);
                let f = sizes.best_factor();
                if f != T::one() {
                    settled = false;
                    d[i] *= f;
                    for j in 0..N {
                        a[(i, j)] /= f;
                        a[(j, i)] *= f;
                        g[(i, j)] /= f;
                        g[(j, i)] /= f;
                        h[(i, j)] *= f;
                        h[(j, i)] *= f;
                    }
                }
            }
            if settled {
                break;
            }
        }
        if d.iter().any(|s| *s != T::one()) {
            self.rescale(&d);
        }
    }

    fn rescale(&mut self, d: &SVector<T, N>) {
        for i in 0..N {
            for j in 0..N {
                let (across, inner) = (d[j] / d[i], d[i] * d[j]);
                self.a[(i, j)] *= across;
                self.free[(i, j)] *= across;
                self.g[(i, j)] /= inner;
                self.h[(i, j)] *= inner;
                self.q[(i, j)] *= inner;
            }
            for j in 0..M {
                self.b[(i, j)] /= d[i];
                self.n[(i, j)] *= d[i];
            }
        }
        self.scale = *d;
        self.scaled = true;
    }

    /// The system with the weight 1 on every input and every scaled state: it can be stabilised exactly where the input
    /// reaches all unstable modes, whatever weights were given.
    pub(super) fn with_unit_weights(
        a: &SMatrix<T, N, N>,
        b: &SMatrix<T, N, M>,
    ) -> Result<Self, DesignError> {
        let unit = Weights::new(SMatrix::identity(), SMatrix::identity());
        let scaled = Self::new(a, b, &unit)?;
        Ok(Self {
            q: SMatrix::identity(),
            h: SMatrix::identity(),
            ..scaled
        })
    }

    /// A matrix that weighs scaled states, in the units that were given.
    pub(super) fn cost_as_given(&self, x: &SMatrix<T, N, N>) -> SMatrix<T, N, N> {
        SMatrix::from_fn(|i, j| x[(i, j)] / (self.scale[i] * self.scale[j]))
    }

    /// Whether the scaled states are not the given ones.
    pub(super) fn is_scaled(&self) -> bool {
        self.scaled
    }

    /// The norm of [`Self::cost_as_given`].
    pub(super) fn norm_as_given(&self, x: &SMatrix<T, N, N>) -> T {
        let mut sum = T::zero();
        for j in 0..N {
            for i in 0..N {
                let entry = x[(i, j)] / (self.scale[i] * self.scale[j]);
                sum += entry * entry;
            }
        }
        sum.sqrt()
    }

    /// A gain of scaled states and inputs, in the units that were given.
    pub(super) fn gain_as_given(&self, k: &SMatrix<T, M, N>) -> SMatrix<T, M, N> {
        let k = backward(&self.root, *k);
        SMatrix::from_fn(|i, j| k[(i, j)] / self.scale[j])
    }

    /// Size of the matrix to start from where 0 does not lead to the stabilising solution.
    pub(super) fn shift(&self) -> T {
        let control = self.g.norm();
        if control > T::zero() {
            (T::one() + self.free.norm()) / control
        } else {
            T::one()
        }
    }
}

fn check_symmetric<T: Float, const N: usize>(
    m: &SMatrix<T, N, N>,
    matrix: Entry,
) -> Result<(), DesignError> {
    finite(m, matrix)?;
    for row in 0..N {
        for col in 0..row {
            // Rounding while a weight is put together, C'C for instance, leaves differences of a few units in the last
            // place of the products, whose size the diagonal shows.
            let size = (m[(row, row)] * m[(col, col)]).abs().sqrt();
            let size = size.max(m[(row, col)].abs());
            let difference = m[(row, col)] - m[(col, row)];
            if difference.abs() > size * T::default_epsilon() * nalgebra::convert(100.0) {
                return Err(DesignError::NotSymmetric {
                    matrix,
                    row,
                    col,
                    difference: as_f64(difference),
                });
            }
        }
    }
    Ok(())
}
