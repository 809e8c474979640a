//! From continuous to sampled time under a command held between samples.

use nalgebra::{RealField, SMatrix, SVector};

/// `A_d = e^{A h}` and `B_d = (integral of e^{A s} ds from 0 to h) B`, by the exponential of `[[A, B], [0, 0]] h`.
///
/// Scaling and squaring with a Taylor series of order 12 on `‖A h‖ ≤ ¼`: the truncation is below the rounding of `f64`.
///
/// ```
/// use furuta_model::discretize::zero_order_hold;
/// use nalgebra::{matrix, vector};
/// // A double integrator: x1 += h x2 + h²/2 u.
/// let (a, b) = zero_order_hold(&matrix![0.0, 1.0; 0.0, 0.0], &vector![0.0, 1.0], 0.1_f64);
/// assert!((a - matrix![1.0, 0.1; 0.0, 1.0]).norm() < 1e-15 && (b - vector![0.005, 0.1]).norm() < 1e-15);
/// ```
#[must_use]
pub fn zero_order_hold<T: RealField + Copy, const N: usize>(
    a: &SMatrix<T, N, N>,
    b: &SVector<T, N>,
    h: T,
) -> (SMatrix<T, N, N>, SVector<T, N>) {
    let real = |x: f64| nalgebra::convert::<f64, T>(x);
    let (mut ah, mut bh) = (a * h, b * h);
    let mut norm = ah.abs().row_sum().max();
    let mut doublings = 0;
    while norm > real(0.25) && doublings < 60 {
        norm *= real(0.5);
        doublings += 1;
    }
    let shrink = real(0.5).powi(doublings);
    ah *= shrink;
    bh *= shrink;
    // phi = I + A/2! + A²/3! + ...; e^A = I + A phi; integral of e^{A s} B = phi B (A, B already times the small step)
    let identity = SMatrix::<T, N, N>::identity();
    let mut phi = identity;
    for k in (2..=13).rev() {
        phi = identity + ah * phi / real(f64::from(k));
    }
    let mut ad = identity + ah * phi;
    let mut bd = phi * bh;
    for _ in 0..doublings {
        bd = ad * bd + bd;
        ad = ad * ad;
    }
    (ad, bd)
}
