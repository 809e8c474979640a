//! A rig's robust regulator: one gain for every rig whose parameters are within a range of this one's.

use furuta_ctrl::design::{DesignError, Weights, lqr};
use furuta_model::linear_plant::{Amplitudes, Hold, Remark, rigid, rigid_remarks};
use furuta_model::{Params, Rig};
use nalgebra::{Matrix4, RowVector4};

use crate::polytope::{Polytope, PolytopeError, Slopes, SlopesError, Uncertain, polytope_with};
use crate::rig_loop::{Law, RigLoop};
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
    /// The rig itself, with its effects.
    rig: Rig,
}

/// Why a rig has no robust regulator.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RobustRigError {
    /// No polytope.
    #[error("{0}")]
    Polytope(#[from] PolytopeError),
    /// The effects have no linear model upright.
    #[error("{0}")]
    Slopes(#[from] SlopesError),
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
/// all states. Springs, cables and tilt are as the rig file has them; delay, lag and a flexible drive are in no vertex
/// but in [`RobustRig::slowest`] and [`RobustRig::largest_sampled`].
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
    let plant = rig.try_plant().map_err(SlopesError::from)?;
    let up = rigid(&plant, Hold::Arm(0.0)).map_err(SlopesError::from)?;
    let nominal = lqr(&up.a, &up.b, weights)?.gain;
    let slopes = Slopes::of(rig)?;
    let within = enclosed(&rig.params, &slopes, keys, spread);
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
            rig: rig.clone(),
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
            largest: largest(rig, &slopes, keys, spread, weights),
        }),
        Err(other) => Err(other),
    }
}

/// The largest spread below `high` with a common Lyapunov function, by bisection: of nested ranges, the wider is the
/// harder.
fn largest(
    rig: &Rig,
    slopes: &Slopes,
    keys: &[&'static str],
    high: f64,
    weights: &Weights<f64, 4, 1>,
) -> f64 {
    let possible = |spread: f64| {
        let Ok(within) = enclosed(&rig.params, slopes, keys, spread) else {
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
    slopes: &Slopes,
    keys: &[&'static str],
    share: f64,
) -> Result<Polytope, PolytopeError> {
    let off: Vec<_> = keys.iter().map(|&key| Uncertain { key, share }).collect();
    polytope_with(params, slopes, &off)
}

fn vertices(within: &Polytope) -> Vec<Vertex<4, 1>> {
    within.control_points.iter().map(|m| (m.a, m.b)).collect()
}

impl RobustRig {
    /// The rig's effects that the guarantee knows nothing of, or in a small range only, and why: no vertex has a delay,
    /// a lag or a flexible drive, nor friction.
    ///
    /// ```
    /// use furuta_ctrl::design::balance_weights;
    /// use furuta_design::polytope::LENGTHS_AND_MASS;
    /// use furuta_design::robust_rig::robust_rig;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("ramos-velasco").ok_or("no such rig")?;
    /// rig.effects.push(Effect::new("motor.delay", &[0.025])?);
    /// let found = robust_rig(&rig, &LENGTHS_AND_MASS, 0.1, &balance_weights(&rig.params))?;
    /// assert!(found.remarks()[0].to_string().starts_with("motor.delay: left out"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn remarks(&self) -> Vec<Remark> {
        // The polytope is that of this plant: it is possible.
        self.rig
            .try_plant()
            .map_or_else(|_| Vec::new(), |plant| rigid_remarks(&plant).to_vec())
    }

    /// The slowest pole's real part under a gain, over the rigs at the corners of the range with their effects, 1/s:
    /// positive where one falls. See [`crate::rig_loop`] for what the loop holds.
    #[must_use]
    pub fn slowest(&self, gain: &RowVector4<f64>) -> f64 {
        self.over_corners(gain, None)
    }

    /// The largest pole's size at this sample period (s) under a gain, over the rigs at the corners with their effects:
    /// above 1 where one falls.
    #[must_use]
    pub fn largest_sampled(&self, gain: &RowVector4<f64>, period: f64) -> f64 {
        (self.over_corners(gain, Some(period)) * period).exp()
    }

    fn over_corners(&self, gain: &RowVector4<f64>, period: Option<f64>) -> f64 {
        let law = Law::of_states(std::array::from_fn(|i| gain[i]));
        let growth = |(params, _): &(Params<f64>, _)| {
            let rig = Rig {
                params: *params,
                ..self.rig.clone()
            };
            let closed = RigLoop::new(&rig, law, period, &Amplitudes::NONE);
            // No poles: no statement, which must not pass for a good one.
            closed
                .map(|closed| closed.growth())
                .ok()
                .filter(|growth| !growth.is_nan())
                .unwrap_or(f64::INFINITY)
        };
        self.polytope
            .corners
            .iter()
            .map(growth)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}
