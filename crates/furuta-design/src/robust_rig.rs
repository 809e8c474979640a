//! A rig's robust regulator: one gain for every rig whose parameters are within a range of this one's.

use furuta_ctrl::design::{DesignError, Weights, lqr, poles};
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Linear, Params, Rig, State, linearize};
use nalgebra::{Matrix4, RowVector4};

use crate::polytope::{Polytope, PolytopeError, Uncertain, polytope};
use crate::robust::{Robust, RobustError, Time, Vertex, robust_lqr, stabilisable};

/// To what the largest spread is found.
const RESOLUTION: f64 = 0.005;

/// A robust regulator beside the usual one.
#[derive(Clone, Debug)]
pub struct RobustRig {
    /// The gain with its guarantee.
    pub regulator: Robust<4, 1>,
    /// The LQR's gain for the rig itself.
    pub nominal: RowVector4<f64>,
    /// Where the parameters may be.
    pub polytope: Polytope,
}

/// Why a rig has no robust regulator.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RobustRigError {
    /// No polytope.
    #[error("{0}")]
    Polytope(#[from] PolytopeError),
    /// The rig itself has no regulator.
    #[error("{0}")]
    Design(#[from] DesignError),
    /// No design.
    #[error("{0}")]
    Robust(RobustError),
    /// The range is too wide.
    #[error(
        "no common Lyapunov function: no gain is guaranteed to stabilise every rig within {spread} of each \
         value; the largest spread with one is {largest:.3}"
    )]
    NoCommonLyapunovFunction {
        /// What was asked for, as a share of each value.
        spread: f64,
        /// What can be had, found by bisection to half a hundredth.
        largest: f64,
    },
}

/// The robust regulator (continuous time) of a rig each of whose parameters `keys` is off by up to `spread` of its
/// value, all of them at once and changing however fast; the mean guaranteed cost is over starts of equal variance in
/// all states.
///
/// # Errors
/// [`RobustRigError`]; for a range that is too wide it says how wide it may be.
///
/// ```
/// use furuta_ctrl::design::balance_weights;
/// use furuta_design::polytope::LENGTHS_AND_MASS;
/// use furuta_design::robust_rig::{RobustRigError, robust_rig};
/// let rig = furuta_model::Rig::builtin("ramos-velasco").ok_or("no such rig")?;
/// let weights = balance_weights(&rig.params);
/// let found = robust_rig(&rig, &LENGTHS_AND_MASS, 0.2, &weights)?;
/// // The LQR lets a rig within the range fall, the robust gain none.
/// assert!(found.slowest(&found.nominal) > 0.0 && found.slowest(&found.regulator.gain) < 0.0);
/// let wide = robust_rig(&rig, &LENGTHS_AND_MASS, 0.5, &weights);
/// assert!(matches!(wide, Err(RobustRigError::NoCommonLyapunovFunction { largest, .. }) if largest > 0.2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn robust_rig(
    rig: &Rig,
    keys: &[&'static str],
    spread: f64,
    weights: &Weights<f64, 4, 1>,
) -> Result<RobustRig, RobustRigError> {
    let up = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let nominal = lqr(&up.a, &up.b, weights)?.gain;
    let within = enclosed(&rig.params, keys, spread);
    let designed = match &within {
        Ok(within) => robust_lqr(
            Time::Continuous,
            &vertices(within),
            weights,
            &Matrix4::identity(),
        )
        .map_err(RobustRigError::Robust),
        Err(e) => Err(RobustRigError::Polytope(e.clone())),
    };
    match designed {
        Ok(regulator) => Ok(RobustRig {
            regulator,
            nominal,
            polytope: within?,
        }),
        Err(
            RobustRigError::Polytope(PolytopeError::TooWide)
            | RobustRigError::Robust(
                RobustError::NotQuadraticallyStabilisable { .. }
                | RobustError::NotCertified { .. }
                | RobustError::Nominal(_)
                | RobustError::Broken,
            ),
        ) => Err(RobustRigError::NoCommonLyapunovFunction {
            spread,
            largest: largest(rig, keys, spread, weights),
        }),
        Err(other) => Err(other),
    }
}

/// The largest spread below `high` with a common Lyapunov function, by bisection: of nested ranges, the wider is the
/// harder.
fn largest(rig: &Rig, keys: &[&'static str], high: f64, weights: &Weights<f64, 4, 1>) -> f64 {
    let possible = |spread: f64| {
        let Ok(within) = enclosed(&rig.params, keys, spread) else {
            return false;
        };
        let all = vertices(&within);
        // Near the end of what is possible a Lyapunov function may be found and its guarantee lost to rounding: that
        // does not count.
        let exists = stabilisable(Time::Continuous, &all, weights);
        exists == Ok(true)
            && robust_lqr(Time::Continuous, &all, weights, &Matrix4::identity()).is_ok()
    };
    let (mut low, mut high) = (0.0, high);
    while high - low > RESOLUTION {
        let middle = 0.5 * (low + high);
        if possible(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

fn enclosed(
    params: &Params<f64>,
    keys: &[&'static str],
    share: f64,
) -> Result<Polytope, PolytopeError> {
    let off: Vec<_> = keys.iter().map(|&key| Uncertain { key, share }).collect();
    polytope(params, &off)
}

fn vertices(within: &Polytope) -> Vec<Vertex<4, 1>> {
    within.control_points.iter().map(|m| (m.a, m.b)).collect()
}

impl RobustRig {
    /// The slowest pole's real part under a gain, over the rigs at the corners of the range, 1/s: positive where one
    /// falls.
    #[must_use]
    pub fn slowest(&self, gain: &RowVector4<f64>) -> f64 {
        self.over_corners(gain, |m| (m.a, m.b), |p| p.re)
    }

    /// The largest pole's size at this sample period (s) under a gain, over the rigs at the corners: above 1 where one
    /// falls.
    #[must_use]
    pub fn largest_sampled(&self, gain: &RowVector4<f64>, period: f64) -> f64 {
        self.over_corners(gain, |m| zero_order_hold(&m.a, &m.b, period), |p| p.norm())
    }

    fn over_corners(
        &self,
        gain: &RowVector4<f64>,
        system: impl Fn(&Linear) -> Vertex<4, 1>,
        measure: impl Fn(&nalgebra::Complex<f64>) -> f64,
    ) -> f64 {
        let worst = |(_, model): &(Params<f64>, Linear)| {
            let (a, b) = system(model);
            // No poles: no statement, which must not pass for a good one.
            poles(&(a - b * gain)).map_or(f64::INFINITY, |all| {
                all.iter().map(&measure).fold(f64::NEG_INFINITY, f64::max)
            })
        };
        self.polytope
            .corners
            .iter()
            .map(worst)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}
