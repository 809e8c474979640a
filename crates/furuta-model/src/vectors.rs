//! Work on dual numbers, compiled for the processor's vectors.

use crate::scalar::Scalar;

/// Work that [`in_vectors`] may have compiled twice: for every processor, and for vectors of four numbers. All that it
/// calls has to be inlined into `call`, or is compiled for every processor alone.
pub trait Vectorised {
    /// What comes of it.
    type Output;
    /// Does it; to be marked `#[inline(always)]`.
    fn call(self) -> Self::Output;
}

/// Does the work in vectors of four numbers where `S` holds several and the processor has such vectors; the arithmetic,
/// and so every bit, is the same in all.
///
/// Builds for development spare the compiler a second version of the whole model, and all builds a third, for vectors
/// of eight, which few dual numbers fill. Without the feature `std` there is one version.
///
/// ```
/// use furuta_model::Jet;
/// use furuta_model::vectors::{Vectorised, in_vectors};
///
/// struct Square<const N: usize>(Jet<f64, N>);
///
/// impl<const N: usize> Vectorised for Square<N> {
///     type Output = Jet<f64, N>;
///     #[inline(always)]
///     fn call(self) -> Jet<f64, N> {
///         self.0 * self.0
///     }
/// }
///
/// let square = in_vectors::<Jet<f64, 4>, _>(Square(Jet::variable(3.0, 1)));
/// assert_eq!((square.v, square.d), (9.0, [0.0, 6.0, 0.0, 0.0]));
/// ```
#[inline(always)]
pub fn in_vectors<S: Scalar, F: Vectorised>(f: F) -> F::Output {
    #[cfg(all(feature = "std", target_arch = "x86_64", not(debug_assertions)))]
    if const { size_of::<S>() > size_of::<S::Real>() && S::LANES == 1 } {
        if let Some(wide) = pulp::x86::V3::try_new() {
            return wide.vectorize(Wide(f));
        }
    }
    f.call()
}

/// The same as pulp calls it.
#[cfg(all(feature = "std", target_arch = "x86_64", not(debug_assertions)))]
struct Wide<F>(F);

#[cfg(all(feature = "std", target_arch = "x86_64", not(debug_assertions)))]
impl<F: Vectorised> pulp::NullaryFnOnce for Wide<F> {
    type Output = F::Output;
    #[inline(always)]
    fn call(self) -> F::Output {
        self.0.call()
    }
}
