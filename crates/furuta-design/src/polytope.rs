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

use furuta_model::linear_plant::{Hold, NoEquilibrium, equilibrium, smooth};
use furuta_model::{Linear, Params, Plant, PlantError, Rig, State, linearize};
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

/// What the effects of a rig add to the torques on arm and pendulum, per radian and rad/s of theta, alpha, theta_dot,
/// alpha_dot, and per volt; N m.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Slopes(SMatrix<f64, 2, 5>);

/// Why a rig's effects have no slopes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SlopesError {
    /// The rig cannot be.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// Nothing rests upright.
    #[error("{0}")]
    Equilibrium(#[from] NoEquilibrium),
}

impl Slopes {
    /// No effects.
    pub const NONE: Self = Self(SMatrix::<f64, 2, 5>::from_array_storage(
        nalgebra::ArrayStorage([[0.0; 2]; 5]),
    ));

    /// Of a rig's effects that have a slope at rest, the pendulum at 0 and the arm at its middle under the voltage that
    /// holds it there. How far springs and tilt let the pendulum lean at rest is not in them.
    ///
    /// # Errors
    /// [`SlopesError`].
    ///
    /// ```
    /// use furuta_design::polytope::Slopes;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// assert_eq!(Slopes::of(&rig)?, Slopes::NONE);
    /// rig.effects.push(Effect::new("arm.spring", &[0.01, 0.0])?);
    /// assert!((Slopes::of(&rig)?.torque(0, 0) + 0.01).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(rig: &Rig) -> Result<Self, SlopesError> {
        let smooth = smooth(&rig.try_plant()?);
        let at = equilibrium(&smooth, Hold::Arm(0.0))?;
        let with = linearize(&smooth, State::upright(), at.command);
        let bare = Plant::without_effects(smooth.coefficients);
        let without = linearize(&bare, State::upright(), at.volts);
        let c = smooth.coefficients;
        let mass = SMatrix::<f64, 2, 2>::new(c.arm, -c.coupling, -c.coupling, c.pendulum);
        let mut added = SMatrix::<f64, 2, 5>::zeros();
        for i in 0..2 {
            for j in 0..4 {
                added[(i, j)] = with.a[(2 + i, j)] - without.a[(2 + i, j)];
            }
            added[(i, 4)] = with.b[2 + i] - without.b[2 + i];
        }
        Ok(Self(mass * added))
    }

    /// The torque on `axis` (0: arm, 1: pendulum) per unit of `of` (0 to 3: the states; 4: the command).
    #[must_use]
    pub fn torque(&self, axis: usize, of: usize) -> f64 {
        self.0[(axis, of)]
    }
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
mod tests {
    use super::*;
    use furuta_model::{Rig, State, linearize};

    fn rig() -> Rig {
        Rig::builtin("fong2014-emecs").expect("built in")
    }

    #[test]
    fn corners_are_the_models_of_those_rigs() {
        let mut rig = rig();
        let off = LENGTHS_AND_MASS.map(|key| Uncertain { key, share: 0.2 });
        let found = polytope(&rig.params, &off).expect("not too wide");
        assert_eq!((found.control_points.len(), found.corners.len()), (27, 8));
        for (params, model) in &found.corners {
            rig.params = *params;
            let expected = linearize(&rig.nominal_plant(), State::upright(), 0.0);
            assert!((model.a - expected.a).norm() < 1e-11 * expected.a.norm());
            assert!((model.b - expected.b).norm() < 1e-11 * expected.b.norm());
            assert!(found.control_points.contains(model));
        }
    }

    /// A rig inside the box is the convex combination that the theory says, for every parameter that can be given.
    #[test]
    fn rigs_inside_are_convex_combinations() {
        for (seed, keys) in keys().collect::<Vec<_>>().chunks(4).enumerate() {
            let off: Vec<_> = keys
                .iter()
                .map(|key| Uncertain { key, share: 0.3 })
                .collect();
            let mut rig = rig();
            let found = polytope(&rig.params, &off).expect("not too wide");
            // Where in the box, 0 to 1 on each axis; of R, by its reciprocal.
            let at: Vec<f64> = (0..keys.len())
                .map(|i| 0.15 + 0.19 * ((i + seed) % 4) as f64)
                .collect();
            let mut p = rig.params.to_array();
            for (u, t) in off.iter().zip(&at) {
                let index = furuta_model::params::RANGES
                    .iter()
                    .position(|r| r.key == u.key)
                    .expect("known");
                let (low, high) = (1.0 - u.share, 1.0 + u.share);
                p[index] *= if u.key == "motor.resistance" {
                    1.0 / (1.0 / low + t * (1.0 / high - 1.0 / low))
                } else {
                    low + t * (high - low)
                };
            }
            rig.params = Params::from_array(rig.params.motor.actuation, p);
            let expected = linearize(&rig.nominal_plant(), State::upright(), 0.0);
            // Bernstein weights times the control points' determinants, which polytope() does not give out: solve for
            // the combination with the known weights by taking them from the quotient's two equal forms.
            let bernstein = |degree: usize, k: usize, t: f64| match (degree, k) {
                (1, 0) => 1.0 - t,
                (1, _) => t,
                (_, 0) => (1.0 - t) * (1.0 - t),
                (_, 1) => 2.0 * t * (1.0 - t),
                _ => t * t,
            };
            let degrees: Vec<usize> = keys
                .iter()
                .map(|key| KEYS.iter().find(|k| k.0 == *key).expect("known").1)
                .collect();
            let determinants = determinants(
                &Rig::builtin("fong2014-emecs").expect("built in").params,
                &off,
                &degrees,
            );
            let (mut a, mut b, mut total) = (
                SMatrix::<f64, 4, 4>::zeros(),
                SVector::<f64, 4>::zeros(),
                0.0,
            );
            for (i, point) in found.control_points.iter().enumerate() {
                let (mut rest, mut weight) = (i, determinants[i]);
                for (degree, t) in degrees.iter().zip(&at) {
                    weight *= bernstein(*degree, rest % (degree + 1), *t);
                    rest /= degree + 1;
                }
                assert!(weight >= 0.0);
                a += point.a * weight;
                b += point.b * weight;
                total += weight;
            }
            assert!(
                (a / total - expected.a).norm() < 1e-10 * expected.a.norm(),
                "{keys:?}"
            );
            assert!(
                (b / total - expected.b).norm() < 1e-10 * expected.b.norm(),
                "{keys:?}"
            );
        }
    }

    /// Bernstein coefficients of the determinant, by another way than the code under test: blossoming at the ends.
    fn determinants(params: &Params<f64>, off: &[Uncertain], degrees: &[usize]) -> Vec<f64> {
        let count: usize = degrees.iter().map(|d| d + 1).product();
        let value = |share: &[f64]| {
            let mut p = params.to_array();
            for (u, s) in off.iter().zip(share) {
                let index = furuta_model::params::RANGES
                    .iter()
                    .position(|r| r.key == u.key)
                    .expect("known");
                p[index] *= 1.0 + u.share * s;
            }
            Fraction::of(
                &Params::from_array(params.motor.actuation, p),
                &Slopes::NONE,
            )
            .determinant
        };
        (0..count)
            .map(|i| {
                let mut rest = i;
                let index: Vec<usize> = degrees
                    .iter()
                    .map(|d| {
                        let k = rest % (d + 1);
                        rest /= d + 1;
                        k
                    })
                    .collect();
                // f's polar form at (-1, 1) is 2 f(0) - (f(-1) + f(1)) / 2; take all combinations.
                let mut terms = vec![(1.0, Vec::new())];
                for (d, k) in degrees.iter().zip(&index) {
                    let choices: &[(f64, f64)] = match (d, k) {
                        (_, 0) => &[(1.0, -1.0)],
                        (2, 1) => &[(2.0, 0.0), (-0.5, -1.0), (-0.5, 1.0)],
                        _ => &[(1.0, 1.0)],
                    };
                    terms = terms
                        .iter()
                        .flat_map(|(w, at): &(f64, Vec<f64>)| {
                            choices.iter().map(move |(cw, c)| {
                                (w * cw, at.iter().copied().chain([*c]).collect())
                            })
                        })
                        .collect();
                }
                terms.iter().map(|(w, at)| w * value(at)).sum()
            })
            .collect()
    }

    #[test]
    fn errors_name_the_cause() {
        let p = rig().params;
        let one = |key, share| polytope(&p, &[Uncertain { key, share }]);
        assert!(matches!(
            one("pendulum.mass", 1.0),
            Err(PolytopeError::Share { .. })
        ));
        assert!(matches!(
            one("pendulum.mass", f64::NAN),
            Err(PolytopeError::Share { .. })
        ));
        assert!(matches!(
            one("environment.gravity", 0.1),
            Err(PolytopeError::UnknownKey { .. })
        ));
        assert!(
            key("pendulum.lenght")
                .expect_err("misspelt")
                .to_string()
                .contains("pendulum.com")
        );
        let twice = [Uncertain {
            key: "arm.length",
            share: 0.1,
        }; 2];
        assert_eq!(
            polytope(&p, &twice),
            Err(PolytopeError::Twice { key: "arm.length" })
        );
        let all: Vec<_> = keys().map(|key| Uncertain { key, share: 0.1 }).collect();
        assert_eq!(
            polytope(&p, &all),
            Err(PolytopeError::TooMany { count: 81 * 512 })
        );
    }
}
