//! Whether the input reaches every state, and whether the output shows every state.
//!
//! Kalman's test: `dx/dt = A x + B u` is controllable where `W = [B, A B, ..., A^(N-1) B]` has rank `N` (the same test
//! holds for `x[k+1] = A x[k] + B u[k]`). The powers of `A` make `W` badly scaled, so the rank is counted on a scaled
//! copy. With `r` the spectral radius of `|A|` (entries by magnitude; 1 where it is 0) and `d` the norms of the rows of
//! `[|B|, |A| |B| / r, ...]`,
//!
//! ```text
//! W_scaled = diag(d)^-1 [B, A B / r, ..., A^(N-1) B / r^(N-1)]
//! ```
//!
//! Units of time and of the states drop out of it, and rounding in `W` stays at rounding there even where terms cancel,
//! because `d` is made of magnitudes: what is noise is not scaled up to look like a signal. Its singular values come
//! from one-sided Jacobi rotations of its rows, which find small ones to full relative accuracy (the eigenvalues of
//! `W W'` would lose half the digits).

use super::error::finite;
use super::{DesignError, Entry, Float, spectral_radius};
use nalgebra::SMatrix;

/// Sweeps of Jacobi rotations at most; they converge quadratically, ten are rare.
const SWEEPS: u32 = 60;

/// How well a system can be controlled (or observed).
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Controllability<T: Float, const N: usize> {
    /// Singular values of the scaled matrix of the module's description, largest first.
    pub singular_values: [T; N],
    /// How many of them are above rounding: the number of states that can be reached.
    pub rank: usize,
}

impl<T: Float, const N: usize> Controllability<T, N> {
    /// Whether the rank is full.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.rank == N
    }

    /// Largest over smallest singular value: 1 where all directions are reached alike, infinite where the rank is not
    /// full.
    ///
    /// Independent of the units of time and states. It says how unequal the directions are, not how costly a control
    /// is.
    #[must_use]
    pub fn condition(&self) -> T {
        match (self.is_full(), self.singular_values.first()) {
            (true, Some(&largest)) => largest / self.singular_values[N - 1],
            _ => T::one() / T::zero(),
        }
    }
}

/// The blocks `B, A B, ..., A^(N-1) B` of the controllability matrix, each `N x M`, unscaled.
///
/// ```
/// use furuta_ctrl::design::controllability_matrix;
/// use nalgebra::{Matrix2, Vector2};
/// let [b, ab] = controllability_matrix(&Matrix2::new(0.0, 1.0, 0.0, 0.0), &Vector2::new(0.0f64, 1.0));
/// assert_eq!((b, ab), (Vector2::new(0.0, 1.0), Vector2::new(1.0, 0.0)));
/// ```
#[must_use]
pub fn controllability_matrix<T: Float, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
) -> [SMatrix<T, N, M>; N] {
    let mut next = *b;
    core::array::from_fn(|_| {
        let block = next;
        next = a * block;
        block
    })
}

/// Rank and singular values of the controllability matrix of `(A, B)`, scaled as the module describes.
///
/// # Errors
/// [`DesignError::NotFinite`]: an entry that is NaN or infinite.
///
/// ```
/// use furuta_ctrl::design::controllability;
/// use furuta_model::{Rig, State, linearize};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let up = linearize(&rig.nominal_plant(), State::upright(), 0.0);
/// assert!(controllability(&up.a, &up.b)?.is_full());
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn controllability<T: Float, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
) -> Result<Controllability<T, N>, DesignError> {
    finite(a, Entry::A)?;
    finite(b, Entry::B)?;
    Ok(rank(a, b))
}

/// Rank and singular values of the observability matrix of `(A, C)`: the controllability of the dual system `(A', C')`.
///
/// # Errors
/// [`DesignError::NotFinite`]: an entry that is NaN or infinite.
///
/// ```
/// use furuta_ctrl::design::observability;
/// use furuta_model::{Rig, State, linearize};
/// use nalgebra::Matrix1x4;
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let up = linearize(&rig.nominal_plant(), State::upright(), 0.0);
/// // The arm's encoder alone shows all four states; the pendulum's alone can never tell where the arm points.
/// assert!(observability(&up.a, &Matrix1x4::new(1.0, 0.0, 0.0, 0.0))?.is_full());
/// assert_eq!(observability(&up.a, &Matrix1x4::new(0.0, 1.0, 0.0, 0.0))?.rank, 3);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn observability<T: Float, const N: usize, const P: usize>(
    a: &SMatrix<T, N, N>,
    c: &SMatrix<T, P, N>,
) -> Result<Controllability<T, N>, DesignError> {
    finite(a, Entry::A)?;
    finite(c, Entry::C)?;
    Ok(rank(&a.transpose(), &c.transpose()))
}

fn rank<T: Float, const N: usize, const M: usize>(
    a: &SMatrix<T, N, N>,
    b: &SMatrix<T, N, M>,
) -> Controllability<T, N> {
    let magnitude = a.abs();
    let rate = match spectral_radius(&magnitude) {
        r if r > T::zero() => r,
        _ => T::one(),
    };
    let mut blocks = controllability_matrix(&(a / rate), b);
    let bounds = controllability_matrix(&(magnitude / rate), &b.abs());
    for i in 0..N {
        let size = norm(&bounds, i);
        if size > T::zero() {
            for block in &mut blocks {
                for j in 0..M {
                    block[(i, j)] /= size;
                }
            }
        }
    }
    let singular_values = singular_values(blocks);
    // Each entry of the scaled matrix carries the rounding of up to N - 1 products of N terms, so the matrix that of N²
    // entries.
    let n = |n: usize| nalgebra::convert::<f64, T>(n as f64);
    let rounding = n(10 * N * N) * T::default_epsilon();
    let largest = singular_values.first().copied().unwrap_or_else(T::zero);
    Controllability {
        singular_values,
        rank: singular_values
            .iter()
            .filter(|&&s| s > largest * rounding)
            .count(),
    }
}

/// Norm of row `i` through all blocks.
fn norm<T: Float, const N: usize, const M: usize>(blocks: &[SMatrix<T, N, M>; N], i: usize) -> T {
    dot(blocks, i, i).sqrt()
}

fn dot<T: Float, const N: usize, const M: usize>(
    blocks: &[SMatrix<T, N, M>; N],
    p: usize,
    q: usize,
) -> T {
    let mut sum = T::zero();
    for block in blocks {
        for j in 0..M {
            sum += block[(p, j)] * block[(q, j)];
        }
    }
    sum
}

/// Singular values of the matrix made of these blocks side by side, largest first: its rows are turned in pairs until
/// they are orthogonal (Hestenes 1958); their norms are the singular values.
fn singular_values<T: Float, const N: usize, const M: usize>(
    mut blocks: [SMatrix<T, N, M>; N],
) -> [T; N] {
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..N {
            for q in p + 1..N {
                let (pp, qq, pq) = (dot(&blocks, p, p), dot(&blocks, q, q), dot(&blocks, p, q));
                if !(pq.abs() > T::default_epsilon() * (pp * qq).sqrt()) {
                    continue;
                }
                turned = true;
                // The smaller of the two angles that make the rows orthogonal.
                let zeta = (qq - pp) / (pq + pq);
                let root = zeta.abs() + (T::one() + zeta * zeta).sqrt();
                let t = if zeta < T::zero() {
                    -(T::one() / root)
                } else {
                    T::one() / root
                };
                let cos = T::one() / (T::one() + t * t).sqrt();
                let sin = cos * t;
                for block in &mut blocks {
                    for j in 0..M {
                        let (x, y) = (block[(p, j)], block[(q, j)]);
                        block[(p, j)] = cos * x - sin * y;
                        block[(q, j)] = sin * x + cos * y;
                    }
                }
            }
        }
        if !turned {
            break;
        }
    }
    let mut values: [T; N] = core::array::from_fn(|i| norm(&blocks, i));
    values.sort_unstable_by(|x, y| y.partial_cmp(x).unwrap_or(core::cmp::Ordering::Equal));
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix1x2, Matrix2, Matrix4, SVector, Vector2, Vector4};

    #[test]
    fn singular_values_of_a_known_matrix() {
        // [[3, 0], [4, 5]]: singular values 3 sqrt(5) and sqrt(5).
        let blocks = [Vector2::new(3.0f64, 4.0), Vector2::new(0.0, 5.0)];
        let [large, small] = singular_values(blocks);
        assert!((large - 3.0 * 5f64.sqrt()).abs() < 1e-14);
        assert!((small - 5f64.sqrt()).abs() < 1e-14);
    }

    /// Two pendulums of one length on one cart, linearised: no force on the cart can move them apart.
    #[rustfmt::skip]
    fn two_pendulums(first: f64, second: f64) -> (Matrix4<f64>, Vector4<f64>) {
        let (g1, g2) = (9.81 / first, 9.81 / second);
        let a = Matrix4::new(
            0.0, 1.0, 0.0, 0.0,
            g1, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, 1.0,
            0.0, 0.0, g2, 0.0,
        );
        (a, Vector4::new(0.0, -1.0 / first, 0.0, -1.0 / second))
    }

    #[test]
    fn pendulums_of_one_length_cannot_be_controlled_apart() {
        let (a, b) = two_pendulums(0.3, 0.3);
        let twins = controllability(&a, &b).expect("finite");
        assert_eq!(twins.rank, 2);
        assert!(!twins.is_full() && twins.condition().is_infinite());
        let (a, b) = two_pendulums(0.3, 0.33);
        let apart = controllability(&a, &b).expect("finite");
        assert!(apart.is_full());
        // The nearer the lengths, the worse the condition: it grows like 1 / difference.
        let (a, b) = two_pendulums(0.3, 0.303);
        let near = controllability(&a, &b).expect("finite");
        let ratio = near.condition() / apart.condition();
        assert!(near.is_full() && (5.0..20.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_hidden_mode_is_found_in_any_coordinates() {
        // (A, B) with one unreachable mode, seen through a full change of coordinates: rank 3 in f64, to rounding.
        #[rustfmt::skip]
        let a = Matrix4::new(
            -1.0, 2.0, 0.5, 0.3,
            0.0, -2.0, 1.0, -0.7,
            0.0, 0.0, 3.0, 0.2,
            0.0, 0.0, 0.0, -4.0,
        );
        let b = Vector4::new(0.3, 0.7, 1.0, 0.0);
        #[rustfmt::skip]
        let t = Matrix4::new(
            1.0, 0.2, -0.4, 0.3,
            0.1, 1.3, 0.5, -0.2,
            -0.7, 0.4, 0.9, 0.6,
            0.2, -0.3, 0.1, 1.1,
        );
        let inverse = t.try_inverse().expect("invertible");
        let found = controllability(&(t * a * inverse), &(t * b)).expect("finite");
        assert_eq!(found.rank, 3, "{:?}", found.singular_values);
    }

    #[test]
    fn units_do_not_matter() {
        // States in mm and kilometres, time in microseconds: the same singular values.
        let (a, b) = two_pendulums(0.3, 0.5);
        let d = SVector::<f64, 4>::new(1e3, 1e-3, 1e6, 7.0);
        let scaled = SMatrix::from_fn(|i, j| 1e-6 * a[(i, j)] * d[i] / d[j]);
        let plain = controllability(&a, &b).expect("finite").singular_values;
        let other = controllability(&scaled, &b.component_mul(&d))
            .expect("finite")
            .singular_values;
        for (x, y) in plain.iter().zip(other) {
            assert!((x - y).abs() < 1e-9 * plain[0], "{plain:?} {other:?}");
        }
    }

    #[test]
    fn observability_is_the_dual() {
        let (a, b) = two_pendulums(0.3, 0.5);
        let seen = observability(&a.transpose(), &b.transpose()).expect("finite");
        assert_eq!(Ok(seen), controllability(&a, &b));
        // A speed sensor never tells where a free mass is.
        let free = Matrix2::new(0.0f64, 1.0, 0.0, 0.0);
        assert_eq!(
            observability(&free, &Matrix1x2::new(0.0, 1.0)).map(|o| o.rank),
            Ok(1)
        );
        assert_eq!(
            observability(&free, &Matrix1x2::new(1.0, 0.0)).map(|o| o.rank),
            Ok(2)
        );
    }

    #[test]
    fn degenerate_systems() {
        let nothing = controllability(&Matrix2::<f64>::identity(), &Vector2::zeros());
        assert_eq!(nothing.map(|c| c.rank), Ok(0));
        // Two identical modes, one input: only their sum moves.
        let alike = controllability(&Matrix2::<f64>::identity(), &Vector2::new(1.0, 1.0));
        assert_eq!(alike.map(|c| c.rank), Ok(1));
        let single = controllability(
            &Matrix2::new(0.0f32, 1.0, 0.0, 0.0),
            &Vector2::new(0.0, 1.0),
        );
        assert_eq!(single.map(|c| (c.rank, c.condition())), Ok((2, 1.0)));
        assert_eq!(
            controllability(
                &Matrix2::new(0.0, f64::NAN, 0.0, 0.0),
                &Vector2::new(0.0, 1.0)
            ),
            Err(DesignError::NotFinite {
                matrix: Entry::A,
                row: 0,
                col: 1
            })
        );
        assert_eq!(
            observability(&Matrix2::identity(), &Matrix1x2::new(1.0, f64::INFINITY)),
            Err(DesignError::NotFinite {
                matrix: Entry::C,
                row: 0,
                col: 1
            })
        );
    }
}
