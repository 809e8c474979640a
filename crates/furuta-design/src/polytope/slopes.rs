//! What a rig's effects add to the linear models of a polytope.

use furuta_model::linear_plant::{Hold, NoEquilibrium, equilibrium, smooth};
use furuta_model::{Plant, PlantError, Rig, State, linearize};
use nalgebra::SMatrix;

/// What the effects of a rig add to the torques on arm and pendulum, per radian and rad/s of theta, alpha, theta_dot,
/// alpha_dot, and per volt; N m.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Slopes(pub(super) SMatrix<f64, 2, 5>);

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
