//! Pole placement for one input.

use super::error::finite;
use super::scaling::{SWEEPS, Sizes};
use super::{DesignError, Entry, Float, as_f64};
use nalgebra::{Complex, RowSVector, SMatrix, SVector};

/// The gain `K` (`u = -K x`) that gives `A - B K` these poles: Ackermann's formula in orthogonal coordinates.
///
/// Householder reflections turn `B` to `[beta, 0, ..., 0]'` and `A` to a Hessenberg matrix `H`; there the
/// controllability matrix is triangular and Ackermann's formula reads `K = e_n' p(H) / (beta h21 h32 ...)`, with the
/// polynomial `p` taken factor by factor: nothing is inverted. For one input the gain is the only one. The same for
/// sampled and for continuous systems; for an estimator, place the poles of `(A', C')`.
///
/// # Errors
/// [`DesignError::NotFinite`]; [`DesignError::PoleWithoutConjugate`]: complex poles come in pairs;
/// [`DesignError::NotControllable`]: the input does not reach every state, or only by rounding.
///
/// ```
/// use furuta_ctrl::design::place;
/// use nalgebra::{Complex, Matrix2, Vector2};
/// // Double integrator to -1 +- i: s^2 + 2 s + 2.
/// let poles = [Complex::new(-1.0f64, 1.0), Complex::new(-1.0, -1.0)];
/// let k = place(&Matrix2::new(0.0, 1.0, 0.0, 0.0), &Vector2::new(0.0, 1.0), &poles)?;
/// assert!((k[0] - 2.0).abs() < 1e-15 && (k[1] - 2.0).abs() < 1e-15);
/// # Ok::<(), furuta_ctrl::design::DesignError>(())
/// ```
pub fn place<T: Float, const N: usize>(
    a: &SMatrix<T, N, N>,
    b: &SVector<T, N>,
    poles: &[Complex<T>; N],
) -> Result<RowSVector<T, N>, DesignError> {
    finite(a, Entry::A)?;
    finite(b, Entry::B)?;
    let factors = factors(poles)?;
    // x = D z with powers of two: states of unlike units do not hide each other.
    let scale = scale(a, b);
    let mut h = SMatrix::<T, N, N>::from_fn(|i, j| a[(i, j)] * (scale[j] / scale[i]));
    let mut b = b.component_div(&scale);
    let mut turn = SMatrix::<T, N, N>::identity();
    let size = h.norm();
    let rounding = T::default_epsilon() * nalgebra::convert::<f64, T>(10.0 * N as f64);
    // Step k makes column k - 1 (for k = 0 the input) zero below row k; what stays at row k is how strongly state k is
    // reached.
    let mut reach = T::one();
    for k in 0..N {
        let mut v = if k == 0 {
            b
        } else {
            h.column(k - 1).into_owned()
        };
        let whole = if k == 0 { b.norm() } else { size };
        for i in 0..k {
            v[i] = T::zero();
        }
        let length = v.norm();
        if !(length > whole * rounding) {
            return Err(DesignError::NotControllable { rank: k });
        }
        // Away from the sign of v[k], so that nothing cancels.
        let image = if v[k] > T::zero() { -length } else { length };
        reach *= image;
        v[k] -= image;
        let norm2 = v.norm_squared();
        if norm2 > T::zero() {
            let factor = nalgebra::convert::<f64, T>(2.0) / norm2;
            let reflect_rows = v * factor;
            h -= reflect_rows * (v.transpose() * h);
            h -= (h * v) * reflect_rows.transpose();
            turn -= (turn * v) * reflect_rows.transpose();
            b -= reflect_rows * v.dot(&b);
        }
    }
    let mut row = RowSVector::<T, N>::zeros();
    row[N - 1] = T::one() / reach;
    for factor in factors.into_iter().flatten() {
        row = match factor {
            Factor::Real(p) => row * h - row * p,
            Factor::Pair { twice_re, square } => {
                let once = row * h;
                once * h - once * twice_re + row * square
            }
        };
    }
    let k = row * turn.transpose();
    let k = RowSVector::<T, N>::from_fn(|_, j| k[j] / scale[j]);
    if k.iter().all(|v| v.is_finite()) {
        Ok(k)
    } else {
        Err(DesignError::NotControllable { rank: N - 1 })
    }
}

/// Scales that make alike how strongly a state is driven and how strongly it drives.
fn scale<T: Float, const N: usize>(a: &SMatrix<T, N, N>, b: &SVector<T, N>) -> SVector<T, N> {
    let mut d = SVector::<T, N>::repeat(T::one());
    for _ in 0..SWEEPS {
        let mut settled = true;
        for i in 0..N {
            let mut sizes = Sizes::zero();
            sizes.falls = b[i].abs() / d[i];
            for j in 0..N {
                if j != i {
                    sizes.falls += a[(i, j)].abs() * d[j] / d[i];
                    sizes.grows += a[(j, i)].abs() * d[i] / d[j];
                }
            }
            let f = sizes.best_factor();
            if f != T::one() {
                settled = false;
                d[i] *= f;
            }
        }
        if settled {
            break;
        }
    }
    d
}

/// A real factor of the characteristic polynomial.
#[derive(Copy, Clone)]
enum Factor<T> {
    /// `s - p`
    Real(T),
    /// `s^2 - 2 re(p) s + |p|^2`
    Pair { twice_re: T, square: T },
}

fn factors<T: Float, const N: usize>(
    poles: &[Complex<T>; N],
) -> Result<[Option<Factor<T>>; N], DesignError> {
    let mut found = [None; N];
    let mut used = [false; N];
    for i in 0..N {
        let p = poles[i];
        if !p.re.is_finite() || !p.im.is_finite() {
            return Err(DesignError::NotFinite {
                matrix: Entry::Poles,
                row: i,
                col: 0,
            });
        }
        if used[i] {
            continue;
        }
        used[i] = true;
        let size = p.re.abs().max(p.im.abs());
        let same = size * T::default_epsilon() * nalgebra::convert(1000.0);
        if p.im == T::zero() {
            found[i] = Some(Factor::Real(p.re));
            continue;
        }
        let twin = (i + 1..N).find(|&j| {
            let q = poles[j];
            !used[j] && (q.re - p.re).abs() <= same && (q.im + p.im).abs() <= same
        });
        match twin {
            Some(j) => used[j] = true,
            None => {
                return Err(DesignError::PoleWithoutConjugate {
                    index: i,
                    re: as_f64(p.re),
                    im: as_f64(p.im),
                });
            }
        }
        found[i] = Some(Factor::Pair {
            twice_re: p.re + p.re,
            square: p.re * p.re + p.im * p.im,
        });
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

    fn real<const N: usize>(poles: [f64; N]) -> [Complex<f64>; N] {
        poles.map(|p| Complex::new(p, 0.0))
    }

    #[test]
    fn a_chain_of_integrators_shows_the_polynomial() {
        // (s + 1)(s + 2)(s^2 + 2 s + 5) = s^4 + 5 s^3 + 13 s^2 + 19 s + 10.
        let a = Matrix4::from_fn(|i, j| if j == i + 1 { 1.0 } else { 0.0 });
        let b = Vector4::new(0.0, 0.0, 0.0, 1.0);
        let mut poles = real([-1.0, 0.0, -2.0, 0.0]);
        poles[1] = Complex::new(-1.0, -2.0);
        poles[3] = Complex::new(-1.0, 2.0);
        let k = place(&a, &b, &poles).expect("controllable");
        for (found, expected) in k.iter().zip([10.0, 19.0, 13.0, 5.0]) {
            assert!((found - expected).abs() < 1e-13, "{k}");
        }
    }

    #[test]
    fn units_of_the_states_do_not_matter() {
        let a = Matrix2::new(0.0, 1.0, 30.0, -2.0);
        let b = Vector2::new(0.0, 5.0);
        let poles = real([-3.0, -4.0]);
        let k = place(&a, &b, &poles).expect("controllable");
        // 5 k2 + 2 = 7 and 5 k1 - 30 = 12.
        assert!(
            (k[0] - 8.4).abs() < 1e-13 && (k[1] - 1.0).abs() < 1e-13,
            "{k}"
        );
        let d = Vector2::new(1e9, 1e-7);
        let other = SMatrix::from_fn(|i, j| a[(i, j)] * d[j] / d[i]);
        let scaled = place(&other, &b.component_div(&d), &poles).expect("controllable");
        for j in 0..2 {
            assert!((scaled[j] / (k[j] * d[j]) - 1.0).abs() < 1e-12, "{scaled}");
        }
    }

    #[test]
    fn errors_name_the_cause() {
        let a = Matrix2::new(1.0, 0.0, 0.0, 1.0);
        let b = Vector2::new(1.0, 1.0);
        assert_eq!(
            place(&a, &b, &real([-1.0, -2.0])),
            Err(DesignError::NotControllable { rank: 1 })
        );
        assert_eq!(
            place(&a, &Vector2::zeros(), &real([-1.0, -2.0])),
            Err(DesignError::NotControllable { rank: 0 })
        );
        let alone = [Complex::new(-1.0, 2.0), Complex::new(-1.0, 0.0)];
        assert_eq!(
            place(&a, &b, &alone),
            Err(DesignError::PoleWithoutConjugate {
                index: 0,
                re: -1.0,
                im: 2.0
            })
        );
        let nan = [Complex::new(f64::NAN, 0.0), Complex::new(-1.0, 0.0)];
        assert_eq!(
            place(&a, &b, &nan),
            Err(DesignError::NotFinite {
                matrix: Entry::Poles,
                row: 0,
                col: 0
            })
        );
    }
}
