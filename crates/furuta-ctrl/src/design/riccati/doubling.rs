//! The doubling iteration and its starts.

use super::equation::RiccatiEquation;
use crate::design::Float;
use crate::design::elimination::Lu;
use crate::design::lyapunov::{SQUARINGS, symmetric};
use nalgebra::SMatrix;

/// Doubling of `(A, G, H)`: `H` tends to the solution of `X = A'X(I + GX)^-1 A + H`, `A` to 0 where that solution
/// stabilises.
///
/// `None` where it breaks down, and where `A` does not die out: a closed loop on the stability boundary, to which `H`
/// may well converge, only not quadratically.
fn double<T: Float, const N: usize>(
    mut a: SMatrix<T, N, N>,
    mut g: SMatrix<T, N, N>,
    mut h: SMatrix<T, N, N>,
) -> Option<(SMatrix<T, N, N>, u32)> {
    let died = T::default_epsilon().sqrt();
    let mut before = a.norm_squared();
    for k in 1..=SQUARINGS {
        // The inverse once in place of two solutions: quicker, and what it costs in digits the refinement gives back.
        let inverse = Lu::new(SMatrix::identity() + g * h)?.solve(SMatrix::identity());
        let (wa, wg) = (inverse * a, inverse * g);
        let at = a.transpose();
        let step = symmetric(at * (h * wa));
        g += symmetric(a * (wg * at));
        a *= wa;
        h += step;
        let (change, size, left) = (step.norm_squared(), h.norm_squared(), a.norm_squared());
        if !size.is_finite() || !left.is_finite() {
            return None;
        }
        // `A` squares from step to step: at the root of epsilon the next step changes nothing.
        let settled = T::default_epsilon() * T::default_epsilon() * size;
        let squares = left <= before * before.sqrt();
        before = left;
        if left < died && squares && change <= settled.max(left * size * died) {
            return Some((h, k));
        }
    }
    None
}

/// The discrete equation from the start `shift * I`.
pub(super) fn discrete<T: Float, const N: usize, const M: usize>(
    p: &RiccatiEquation<T, N, M>,
    shift: T,
) -> Option<(SMatrix<T, N, N>, u32)> {
    if shift == T::zero() {
        return double(p.free, p.g, p.h);
    }
    let start = SMatrix::identity() * shift;
    let through = Lu::new(SMatrix::identity() + p.g * shift)?;
    let a = through.solve(p.free);
    let g = symmetric(through.solve(p.g));
    let h = symmetric(p.h - start + p.free.transpose() * (a * shift));
    let (difference, iterations) = double(a, g, h)?;
    Some((start + difference, iterations))
}

/// The continuous equation from the start `shift * I`, by a Cayley transform with the given centre.
pub(super) fn continuous<T: Float, const N: usize, const M: usize>(
    p: &RiccatiEquation<T, N, M>,
    centre: T,
    shift: T,
) -> Option<(SMatrix<T, N, N>, u32)> {
    let one = SMatrix::<T, N, N>::identity();
    let (mut a, g, mut h) = (p.free, p.g, p.h);
    if shift != T::zero() {
        a -= g * shift;
        h += symmetric(p.free) * (shift + shift) - g * (shift * shift);
    }
    let ac = a - one * centre;
    let lu = Lu::new(ac)?;
    let ag = lu.solve(g);
    let inverse = lu.solve(one);
    let ha = h * inverse;
    let w = Lu::new(ac.transpose() + h * ag)?.solve(one);
    let twice = centre + centre;
    let (difference, iterations) = double(
        one + w.transpose() * twice,
        symmetric(ag * w * twice),
        symmetric(w * ha * twice),
    )?;
    Some((difference + one * shift, iterations))
}
