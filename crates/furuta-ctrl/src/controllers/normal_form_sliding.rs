//! Sliding mode in the normal form: the pendulum's acceleration is the input, the arm its internal dynamics.

use super::output_regulator::{LAMBDA, ORDER, Wanted, product, resting, steady_motion};
use super::{Controller, Design};
use crate::error::ConfigError;
use crate::design::{DesignError, SteadyMotion, Weights, balance_weights, lqr};
use crate::numbers::{Number, listed};
use crate::real::{Real, c, command, is_finite};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::dynamics::acceleration;
use furuta_model::params::Coefficients;
use furuta_model::State;
use furuta_model::linear_plant::Load;
use nalgebra::{SMatrix, SVector};

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "normal_form_sliding",
    sentence: "Sliding mode with the pendulum's acceleration as the input: the model inverted, a saturated \
        switching term on the pendulum's speed",
    parameters: &[
        LAMBDA,
        ORDER,
        ParameterSpec::number(
            "gamma",
            "rad/s2",
            0.0,
            1e6,
            "size of the switching term; if left out, the acceleration of a pendulum that leans by 0.15 rad",
        ),
        ParameterSpec::number(
            "eps",
            "rad/s",
            1e-6,
            1e6,
            "half of its layer's width; if left out, such that it damps 5.5 times as fast as the pendulum \
             hanging swings",
        ),
        ParameterSpec::number(
            "filter",
            "s",
            0.0,
            1e3,
            "time constant of the low pass behind it",
        )
        .or(0.0),
        ParameterSpec::numbers(
            "gain",
            4,
            "1/s2, 1/s",
            -1e9,
            1e9,
            "K on the errors of [theta, alpha, theta_dot, alpha_dot]; if left out, an LQR of the normal \
             form with the weights of `lqr`",
        ),
    ],
};

/// Lean whose fall the switching term stands against, rad.
const LEAN: f64 = 0.15;
/// Damping of the layer, of the pendulum's own frequency.
const LAYER: f64 = 5.5;

/// `u = -(1/g41) (f41 - alpha_ref'' + K (x - pi(w)) + gamma sat(H / eps))`, `H = alpha' - alpha_ref'`.
///
/// (Ramos-Velasco, Ruiz-Leon, Celikovsky, eq. (53), (54), with the reference's acceleration that their (46) leaves
/// out.) The model's inverse makes `alpha'' = alpha_ref'' - K (x - pi(w)) - gamma sat(H / eps)`; what the model does
/// not know acts like an acceleration of the pendulum, and up to `gamma` the switching term stands against it. The
/// filter is the one that the paper asks for in real time: a first-order low pass of the switching term alone.
///
/// The switching function holds the pendulum's *speed*; inside the layer it is a damping `gamma / eps` (1/s), for which
/// `K` must be made: [`NormalFormSliding::gain`].
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
    /// `K` for a model: the LQR of the normal form upright, `alpha'' = v - (gamma / eps) alpha'`, `theta''` by the zero
    /// dynamics.
    ///
    /// See [`NormalFormSliding::gain_under`] for a rig whose effects pull.
    ///
    /// # Errors
    /// Those of [`crate::design::riccati::continuous`].
    pub fn gain(
        model: &Coefficients<f64>,
        switching: &Switching<f64>,
        weights: &Weights<f64, 4, 1>,
    ) -> Result<[f64; 4], DesignError> {
        Self::gain_under(model, &Load::NONE, switching, weights)
    }

    /// The same for a rig whose effects pull with this `load`. What pulls the arm alone does not change it: the
    /// inverted model takes it off.
    ///
    /// Its layer's damping is part of what is stabilised. (The paper's own gain is that of a misprinted normal form.)
    ///
    /// ```
    /// use furuta_ctrl::controllers::{NormalFormSliding, Switching};
    /// use furuta_ctrl::design::Weights;
    /// use furuta_model::linear_plant::Load;
    /// let model = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?.params.coefficients();
    /// let switching = Switching { gamma: 20.0, eps: 0.5, filter: 0.0 };
    /// let weights = Weights::diagonal([1.0; 4], [1.0]);
    /// let gain = |slope| NormalFormSliding::gain_under(&model, &Load { slope }, &switching, &weights);
    /// let (none, arm) = ([0.0; 4], [-0.02, 0.0, 0.0, 0.0]);
    /// assert_eq!(gain([arm, none])?, gain([none, none])?);
    /// assert_ne!(gain([none, [0.0, -0.004, 0.0, 0.0]])?, gain([none, none])?);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`crate::design::riccati::continuous`].
    pub fn gain_under(
        model: &Coefficients<f64>,
        load: &Load<f64>,
        switching: &Switching<f64>,
        weights: &Weights<f64, 4, 1>,
    ) -> Result<[f64; 4], DesignError> {
        let mut a = SMatrix::<f64, 4, 4>::zeros();
        a[(0, 2)] = 1.0;
        a[(1, 3)] = 1.0;
        // theta'' = (M22 v + b_p alpha' - weight alpha - load) / (m L_r c) to first order, under the acceleration v -
        // layer alpha'.
        let layer = switching.gamma / switching.eps;
        a[(2, 1)] = -model.weight / model.coupling;
        a[(2, 3)] = (model.pendulum_damping - model.pendulum * layer) / model.coupling;
        for (i, slope) in load.slope[1].into_iter().enumerate() {
            a[(2, i)] -= slope / model.coupling;
        }
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

impl<T: Real> Design for NormalFormSliding<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let model = site.coefficients()?;
        let frequency = site.frequency();
        let gamma = settings
            .number(const { SPEC.parameter("gamma").optional() })
            .unwrap_or(LEAN * frequency * frequency);
        let switching = Switching {
            gamma,
            eps: settings
                .number(const { SPEC.parameter("eps").optional() })
                .unwrap_or((gamma / (LAYER * frequency)).max(1e-6)),
            filter: settings.value(const { SPEC.parameter("filter").settled() }),
        };
        let steady = steady_motion(settings, site)?;
        let gain = match settings.vector(const { SPEC.parameter("gain").several::<4>() }) {
            Some(gain) => gain,
            None => {
                // What full command does to the pendulum costs what full command costs.
                let [_, full] = acceleration(&model, &State::upright(), site.command_limit);
                let mut weights = balance_weights(site.params);
                weights.r[0] = 1.0 / (full * full);
                NormalFormSliding::gain_under(&model, &steady.load, &switching, &weights)?
            }
        };
        Ok(NormalFormSliding {
            model,
            steady,
            gain,
            switching,
            command_limit: site.command_limit,
        }
        .cast())
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
        let u = self
            .steady
            .inverse(&self.model, x, wanted.middle, alpha_ddot);
        command(u, self.command_limit)
    }

    fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        put("GAIN", Number::Real(&self.gain));
        put("CONTROLLER_LIMIT", Number::Real(&[self.command_limit]));
        put("CONTROLLER_MODEL", Number::Real(&listed(&self.model)));
        put(
            "CONTROLLER_LOAD",
            Number::Real(self.steady.load.slope.as_flattened()),
        );
        put("SWITCHING_GAMMA", Number::Real(&[self.switching.gamma]));
        put("SWITCHING_EPS", Number::Real(&[self.switching.eps]));
        put("SWITCHING_FILTER", Number::Real(&[self.switching.filter]));
        resting(&self.model, &self.steady, put);
        true
    }
}
