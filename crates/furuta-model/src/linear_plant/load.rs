//! What effects pull with, to first order about a place of rest.

use super::{Hold, NoEquilibrium, equilibrium, smooth};
use crate::jet::Jet;
use crate::plant::Plant;
use crate::scalar::Scalar;
use crate::state::State;

/// The torques of springs, cables, cogging, a tilted base and empirical terms by their slopes at rest, N m on `[arm,
/// pendulum]` for each unit of the distance from there in the order of [`State`].
///
/// It is what the effects add to the linear model of [`super::rigid`]: rigid bodies that bear this load have that
/// linear model, and are exact far from rest where the effects are straight.
///
/// ```
/// use furuta_model::linear_plant::{Hold, Load};
/// use furuta_model::{Effect, Plant, Rig, State};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let plant = Plant::new(&rig.params, &[Effect::new("arm.spring", &[0.02, 0.3])?])?;
/// let load = Load::of(&plant, Hold::Arm(0.0))?;
/// assert_eq!(load.torque(&State::new(0.1, 0.2, 0.0, 0.0)), [-0.002, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Load<S> {
    /// N m/rad and N m s/rad.
    pub slope: [[S; 4]; 2],
}

impl<S: Scalar> Load<S> {
    /// Nothing pulls.
    pub const NONE: Self = Self {
        slope: [[S::ZERO; 4]; 2],
    };

    /// The torque on `[arm, pendulum]` at this distance from rest, N m.
    #[inline(always)]
    #[must_use]
    pub fn torque(&self, distance: &State<S>) -> [S; 2] {
        let [theta, alpha, theta_dot, alpha_dot] = distance.to_array();
        self.slope
            .map(|k| k[0] * theta + k[1] * alpha + k[2] * theta_dot + k[3] * alpha_dot)
    }

    /// The same values in another scalar, as constants.
    #[must_use]
    pub fn cast<T: Scalar>(&self) -> Load<T> {
        Load {
            slope: self.slope.map(|row| row.map(|k| T::from_f64(k.value()))),
        }
    }
}

impl Load<f64> {
    /// Of the effects of `plant` that have a slope where it rests upright, held as `hold` says.
    ///
    /// # Errors
    /// [`NoEquilibrium`] where nothing rests upright.
    pub fn of(plant: &Plant<f64>, hold: Hold) -> Result<Self, NoEquilibrium> {
        type Number = Jet<f64, 4>;
        let smooth = smooth(plant);
        let at = equilibrium(&smooth, hold)?;
        let x = at.x.to_array();
        let x = State::from(core::array::from_fn(|i| Number::variable(x[i], i)));
        let torque = smooth
            .cast::<Number>()
            .effect_torques(&x, Number::constant(at.volts));
        Ok(Self {
            slope: torque.map(|t| t.d),
        })
    }
}
