//! Sliding mode in the normal form: the pendulum's acceleration is the input, the arm its internal dynamics.

use super::Controller;
use super::output_regulator::{Wanted, product};
use crate::design::{DesignError, SteadyMotion, Weights, lqr};
use crate::real::{Real, c, command, is_finite};
use furuta_model::params::Coefficients;
use furuta_model::{State, zero_dynamics};
use nalgebra::{SMatrix, SVector};

/// `u = -(1/g41) (f41 - alpha_ref'' + K (x - pi(w)) + gamma sat(H / eps))`, `H = alpha' - alpha_ref'`.
///
/// (Ramos-Velasco, Ruiz-Leon, Celikovsky, eq. (53), (54), with the reference's acceleration that their (46) leaves out.) The model's inverse
/// makes `alpha'' = alpha_ref'' - K (x - pi(w)) - gamma sat(H / eps)`; what the model does not know acts like an acceleration of the
/// pendulum, and up to `gamma` the switching term stands against it. The filter is the one that the paper asks for in real time: a
/// first-order low pass of the switching term alone.
///
/// The switching function holds the pendulum's *speed*; inside the layer it is a damping `gamma / eps` (1/s), for which `K` must be made:
/// [`NormalFormSliding::gain`].
///
/// ```
/// use furuta_ctrl::controllers::{Controller, NormalFormSliding, Switching};
/// use furuta_ctrl::design::{SteadyMotion, Weights};
/// use furuta_model::{Rig, State};
/// let params = Rig::builtin("ramos-velasco").ok_or("no such rig")?.params;
/// let model = params.coefficients();
/// let switching = Switching { gamma: 2.0, eps: 0.1, filter: 0.0 };
/// let gain = NormalFormSliding::gain(&model, &switching, &Weights::diagonal([1.0; 4], [1.0]))?;
/// let control = NormalFormSliding::<f64> {
///     model, gain, switching, steady: SteadyMotion::solve(&model, 1.0, 3)?, command_limit: 24.0,
/// };
/// // At rest upright with a reference of zeros there is nothing to do.
/// let u = control.update(&mut control.start(), &State::upright(), &State::upright(), 0.001);
/// assert_eq!(u, 0.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct NormalFormSliding<T> {
    /// The model that is inverted.
    pub model: Coefficients<T>,
    /// `pi(w)`.
    pub steady: SteadyMotion<T>,
    /// `K` in the order of [`State`], rad/s² of the pendulum per unit of the error.
    pub gain: [T; 4],
    /// The switching term.
    pub switching: Switching<T>,
    /// Largest command either way, V.
    pub command_limit: T,
}

/// `gamma sat(H / eps)`, filtered.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Switching<T> {
    /// Largest acceleration of the pendulum that it stands against, rad/s².
    pub gamma: T,
    /// Half of the layer's width in the pendulum's speed, rad/s; 0 switches hard.
    pub eps: T,
    /// Time constant of the filter behind it, s; 0 is none.
    pub filter: T,
}

/// Memory of a [`NormalFormSliding`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct NormalFormSlidingState<T> {
    /// The filtered switching term, rad/s².
    switching: T,
}

impl<T: Real> Switching<T> {
    /// The switching term (54) at `h`, rad/s², before the filter.
    pub fn at(&self, h: T) -> T {
        self.gamma * saturation(h, self.eps)
    }
}

/// `x / width` within ±1; the sign of `x` for a width of 0, and 0 at 0.
pub(super) fn saturation<T: Real>(x: T, width: T) -> T {
    if x.abs() < width {
        x / width
    } else if x > T::ZERO {
        T::ONE
    } else if x < T::ZERO {
        -T::ONE
    } else {
        T::ZERO
    }
}

impl NormalFormSliding<f64> {
    /// `K` for a model: the LQR of the normal form upright, `alpha'' = v - (gamma / eps) alpha'`, `theta''` by the zero dynamics.
    ///
    /// Its layer's damping is part of what is stabilised. (The paper's own gain is that of a misprinted normal form.)
    ///
    /// # Errors
    /// Those of [`crate::design::riccati::continuous`].
    pub fn gain(
        model: &Coefficients<f64>,
        switching: &Switching<f64>,
        weights: &Weights<f64, 4, 1>,
    ) -> Result<[f64; 4], DesignError> {
        let mut a = SMatrix::<f64, 4, 4>::zeros();
        a[(0, 2)] = 1.0;
        a[(1, 3)] = 1.0;
        // theta'' = (M22 v + b_p alpha' - weight alpha) / (m L_r c) to first order, under the acceleration v - layer alpha'.
        let layer = switching.gamma / switching.eps;
        a[(2, 1)] = -model.weight / model.coupling;
        a[(2, 3)] = (model.pendulum_damping - model.pendulum * layer) / model.coupling;
        a[(3, 3)] = -layer;
        let b = SVector::<f64, 4>::new(0.0, 0.0, model.pendulum / model.coupling, 1.0);
        lqr(&a, &b, weights).map(|regulator| regulator.gain.into())
    }

    /// The same in the target's own precision.
    pub fn cast<T: Real>(&self) -> NormalFormSliding<T> {
        NormalFormSliding {
            model: self.model.cast(),
            steady: self.steady.cast(),
            gain: self.gain.map(c),
            switching: Switching {
                gamma: c(self.switching.gamma),
                eps: c(self.switching.eps),
                filter: c(self.switching.filter),
            },
            command_limit: c(self.command_limit),
        }
    }
}

impl<T: Real> Controller<T> for NormalFormSliding<T> {
    type State = NormalFormSlidingState<T>;

    fn start(&self) -> NormalFormSlidingState<T> {
        NormalFormSlidingState { switching: T::ZERO }
    }

    fn update(
        &self,
        state: &mut NormalFormSlidingState<T>,
        x: &State<T>,
        reference: &State<T>,
        h: T,
    ) -> T {
        let wanted = Wanted::at(&self.steady, reference);
        let error = wanted.error(x);
        // Backward Euler: stable and without overshoot for any time constant, 0 included.
        let share = h / (self.switching.filter + h);
        let filtered = state.switching + share * (self.switching.at(error[3]) - state.switching);
        if is_finite(filtered) {
            state.switching = filtered;
        }
        let alpha_ddot = wanted.alpha_ddot - product(&self.gain, &error) - state.switching;
        let u = zero_dynamics::command(&self.model, x, alpha_ddot);
        command(u, self.command_limit)
    }
}
