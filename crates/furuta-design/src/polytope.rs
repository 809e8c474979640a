//! The linear models of a rig whose parameters are known only within a range, enclosed in a polytope.
//!
//! Upright, `[A, B] = N(p) / d(p)` with the determinant `d` of the mass matrix, and both are polynomials of degree 1 or
//! 2 in each parameter. On a box such a quotient is a rational Bezier surface: with Bernstein coefficients `N_i`,
//! `d_i > 0`,
//!
//! ```text
//! [A, B](p) = sum_i w_i(p) d_i (N_i / d_i) / sum_i w_i(p) d_i,    w_i(p) >= 0,
//! ```
//!
//! a convex combination of its control points `N_i / d_i`. What holds for all control points (a Lyapunov inequality,
//! which is convex in `[A, B]`) therefore holds for **every** rig within the range, not only for those at its corners.
//! The corners are among the control points; the others belong to no rig.
//!
//! Springs, cables, tilt and what else has a slope at rest add torques per radian, rad/s and volt that are taken as the
//! rig file's own at all points ([`Slopes`]): the degrees stay.

mod slopes;

pub use slopes::{Slopes, SlopesError};

use furuta_model::{Linear, Params};
use nalgebra::{SMatrix, SVector};

/// A parameter that may be off: its key in the rig file, how much at most, as a share of its value.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Uncertain {
    /// For example `pendulum.mass`.
    pub key: &'static str,
    /// 0.2 for 20 % more or less.
    pub share: f64,
}

/// Which parameters can be given, with the degree of `N` and `d` in each.
const KEYS: [(&str, usize); 13] = [
    ("arm.length", 2),
    ("arm.inertia", 1),
    ("arm.viscous", 1),
    ("pendulum.mass", 2),
    ("pendulum.com", 2),
    ("pendulum.inertia", 1),
    ("pendulum.viscous", 1),
    // Of degree 1 in 1/R, over whose range the ends of R's range are the ends too.
    ("motor.resistance", 1),
    ("motor.torque_constant", 1),
    ("motor.back_emf_constant", 1),
    ("motor.gear_ratio", 2),
    ("motor.efficiency", 1),
    ("motor.amplifier_gain", 1),
];

/// The parameters that the source paper of the experiment with wrong parameters takes to be off: arm length, pendulum
/// length and mass.
pub const LENGTHS_AND_MASS: [&str; 3] = ["arm.length", "pendulum.com", "pendulum.mass"];

/// Control points at most: more would make the design slow and is hardly meant.
const LARGEST: usize = 729;

/// Why there is no polytope.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PolytopeError {
    /// A key that is not among those that can be given.
    #[error("{key} cannot be uncertain here; possible are {}", keys().collect::<Vec<_>>().join(", "))]
    UnknownKey {
        /// What was given.
        key: String,
    },
    /// A share outside its range.
    #[error("{key} off by {share} of its value; allowed is more than 0 and less than 1")]
    Share {
        /// The parameter.
        key: &'static str,
        /// Its share.
        share: f64,
    },
    /// A parameter twice.
    #[error("{key} is given twice")]
    Twice {
        /// The parameter.
        key: &'static str,
    },
    /// Too many parameters at once.
    #[error(
        "{count} control points; at most {LARGEST} are handled: take fewer parameters (one of degree 2 \
         triples them, another doubles)"
    )]
    TooMany {
        /// How many it would be.
        count: usize,
    },
    /// The range is so wide that the enclosure contains no determinant above 0, or a parameter leaves its range.
    #[error("the range is too wide: a control point of the mass matrix is not positive definite")]
    TooWide,
}

/// The keys that can be uncertain.
pub fn keys() -> impl Iterator<Item = &'static str> {
    KEYS.iter().map(|(key, _)| *key)
}

/// The key as this module knows it.
///
/// # Errors
/// [`PolytopeError::UnknownKey`].
pub fn key(name: &str) -> Result<&'static str, PolytopeError> {
    keys()
        .find(|key| *key == name)
        .ok_or_else(|| PolytopeError::UnknownKey {
            key: name.to_owned(),
        })
}

/// The polytope and the rigs at the corners of the box.
#[derive(Clone, Debug, PartialEq)]
pub struct Polytope {
    /// Linear models upright whose convex hull holds those of all rigs within the range.
    pub control_points: Vec<Linear>,
    /// Those of the rigs with every parameter at an end of its range, with their parameters; they are among the control
    /// points.
    pub corners: Vec<(Params<f64>, Linear)>,
}

/// What `[A, B]` and the determinant are made of: `N` (rows of the accelerations, over theta.., alpha.. and u) and `d`.
#[derive(Copy, Clone)]
struct Fraction {
    accelerations: SMatrix<f64, 2, 5>,
    determinant: f64,
}

impl Fraction {
    fn of(p: &Params<f64>, effects: &Slopes) -> Self {
        let c = p.coefficients();
        // adj(M) times the forces' derivatives, M = [arm, -coupling; -coupling, pendulum]: columns theta, alpha,
        // theta', alpha', u.
        let adjugate = SMatrix::<f64, 2, 2>::new(c.pendulum, c.coupling, c.coupling, c.arm);
        let forces = SMatrix::<f64, 2, 5>::new(
            0.0,
            0.0,
            -c.arm_damping,
            0.0,
            c.drive,
            0.0,
            c.weight,
            0.0,
            -c.pendulum_damping,
            0.0,
        );
        Self {
            accelerations: adjugate * (forces + effects.0),
            determinant: c.arm * c.pendulum - c.coupling * c.coupling,
        }
    }

    fn combine(points: &[(f64, Self)]) -> Self {
        points.iter().fold(
            Self {
                accelerations: SMatrix::zeros(),
                determinant: 0.0,
            },
            |sum, (weight, point)| Self {
                accelerations: sum.accelerations + point.accelerations * *weight,
                determinant: sum.determinant + point.determinant * weight,
            },
        )
    }

    fn quotient(&self) -> Linear {
        let rows = self.accelerations / self.determinant;
        let mut a = SMatrix::<f64, 4, 4>::zeros();
        (a[(0, 2)], a[(1, 3)]) = (1.0, 1.0);
        for i in 0..2 {
            for j in 0..4 {
                a[(2 + i, j)] = rows[(i, j)];
            }
        }
        Linear {
            a,
            b: SVector::<f64, 4>::new(0.0, 0.0, rows[(0, 4)], rows[(1, 4)]),
        }
    }
}

/// The polytope of the linear models upright of all rigs within the range.
///
/// # Errors
/// [`PolytopeError`].
///
/// ```
/// use furuta_design::polytope::{Uncertain, polytope};
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let off = ["arm.length", "motor.resistance"].map(|key| Uncertain { key, share: 0.2 });
/// let found = polytope(&rig.params, &off)?;
/// assert_eq!((found.control_points.len(), found.corners.len()), (6, 4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn polytope(params: &Params<f64>, uncertain: &[Uncertain]) -> Result<Polytope, PolytopeError> {
    polytope_with(params, &Slopes::NONE, uncertain)
}

/// The same with what effects add.
///
/// # Errors
/// [`PolytopeError`].
pub fn polytope_with(
    params: &Params<f64>,
    effects: &Slopes,
    uncertain: &[Uncertain],
) -> Result<Polytope, PolytopeError> {
    let mut axes = Vec::new();
    for (i, u) in uncertain.iter().enumerate() {
        let Some((_, degree)) = KEYS.iter().find(|(key, _)| *key == u.key) else {
            return Err(PolytopeError::UnknownKey {
                key: u.key.to_owned(),
            });
        };
        if !(u.share > 0.0 && u.share < 1.0) {
            return Err(PolytopeError::Share {
                key: u.key,
                share: u.share,
            });
        }
        if uncertain[..i].iter().any(|other| other.key == u.key) {
            return Err(PolytopeError::Twice { key: u.key });
        }
        let index = furuta_model::params::RANGES
            .iter()
            .position(|range| range.key == u.key);
        let Some(index) = index else {
            return Err(PolytopeError::UnknownKey {
                key: u.key.to_owned(),
            });
        };
        axes.push(Axis {
            index,
            share: u.share,
            degree: *degree,
        });
    }
    let count = axes
        .iter()
        .fold(1usize, |n, axis| n.saturating_mul(axis.degree + 1));
    if count > LARGEST {
        return Err(PolytopeError::TooMany { count });
    }
    // Values on the grid (each parameter at the ends of its range, one of degree 2 in the middle too), the first
    // parameter varying fastest.
    let mut values: Vec<Fraction> = Vec::with_capacity(count);
    let mut corners = Vec::new();
    for i in 0..count {
        let (mut rest, mut corner) = (i, true);
        let mut p = params.to_array();
        for axis in &axes {
            let at = rest % (axis.degree + 1);
            rest /= axis.degree + 1;
            corner &= at == 0 || at == axis.degree;
            p[axis.index] *= 1.0 + axis.share * (2.0 * at as f64 / axis.degree as f64 - 1.0);
        }
        let p = Params::from_array(params.motor.actuation, p);
        let value = Fraction::of(&p, effects);
        if corner {
            corners.push((p, value.quotient()));
        }
        values.push(value);
    }
    // To Bernstein coefficients, one parameter after the other; of degree 1 they are the values.
    let mut stride = 1;
    for axis in &axes {
        if axis.degree == 2 {
            for start in 0..count {
                if start / stride % 3 == 1 {
                    values[start] = Fraction::combine(&[
                        (2.0, values[start]),
                        (-0.5, values[start - stride]),
                        (-0.5, values[start + stride]),
                    ]);
                }
            }
        }
        stride *= axis.degree + 1;
    }
    if !values.iter().all(|v| v.determinant > 0.0) {
        return Err(PolytopeError::TooWide);
    }
    Ok(Polytope {
        control_points: values.iter().map(Fraction::quotient).collect(),
        corners,
    })
}

/// One uncertain parameter.
struct Axis {
    /// In [`Params::to_array`].
    index: usize,
    share: f64,
    degree: usize,
}

#[cfg(test)]
mod tests;
