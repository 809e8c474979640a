//! Sliding mode on the surface of an LQR.

use super::normal_form_sliding::saturation;
use super::output_regulator::{LAMBDA, ORDER, Wanted, product, resting, steady_motion};
use super::{Controller, Design, StateFeedback, weights};
use crate::error::ConfigError;
use crate::design::{DesignError, SteadyMotion, Weights, balance_weights, lqr};
use crate::numbers::Number;
use crate::real::{Real, c, command, is_finite};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::params::Coefficients;
use furuta_model::{Linear, State};

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "lqr_sliding",
    sentence: "Sliding mode on the surface B'P (x - pi(w)) = 0 of a linear-quadratic regulator, which \
        remains where the switching saturates",
    parameters: &[
        LAMBDA,
        ORDER,
        weights::q(4, "diagonal of the state's weight Q; that of `lqr` if left out"),
        weights::r("weight R of the command; that of `lqr` if left out"),
        ParameterSpec::word(
            "reaching",
            &["layer", "super_twisting"],
            "a saturated switching term, or one that is continuous and learns",
        ),
        ParameterSpec::number(
            "strength",
            "V",
            0.0,
            1e3,
            "largest disturbance that it stands against; a twelfth of the largest command if left out",
        ),
        ParameterSpec::number(
            "rate",
            "1/s",
            1e-3,
            1e4,
            "layer: how fast a small error is reached; super_twisting: how fast the disturbance changes, \
             of its strength",
        ),
    ],
};

/// How fast the surface is reached in a layer, 1/s: a loop of its own beside the LQR, a tenth of what 500 samples a
/// second carry.
const LAYER_RATE: f64 = 40.0;
/// How fast a disturbance changes for the super-twisting, 1/s.
const TWISTING_RATE: f64 = 1.0;

/// `u = c(w) - K (x - pi(w)) - reach(sigma)` with `sigma = B'P (x - pi(w)) / B'P B`.
///
/// `P` solves the Riccati equation of an LQR, whose gain is `K = B'P / R`: the surface is where that gain says "nothing
/// to do". Its motion is stable, being what remains of the LQR under an infinite gain, and it has relative degree one,
/// so a switching term reaches it: scaled by `B'P B` the surface is in volts times seconds, and a volt moves it by one
/// a second, the motor's as well as those of a disturbance that acts like a voltage. Along the cost `e'P e` any such
/// term only lowers the cost further, and where it saturates the LQR remains: with the equivalent control
/// `-B'P A e / B'P B` in the place of `-K e`, the textbook's choice, wrong parameters let a large error grow as soon as
/// the switching term is exhausted.
///
/// (V. Utkin, *Sliding Modes in Control and Optimization*, 1992; super-twisting: A. Levant, *Sliding order and sliding
/// accuracy in sliding mode control*, Int. J. Control 58, 1993.)
///
/// ```
/// use furuta_ctrl::controllers::{Controller, LqrSliding, Reaching};
/// use furuta_ctrl::design::{SteadyMotion, Weights};
/// use furuta_model::{Rig, State, linearize};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let steady = SteadyMotion::solve(&rig.params.coefficients(), 4.0, 5)?;
/// let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
/// let reaching = Reaching::BoundaryLayer { gain: 2.0, width: 0.02 };
/// let control = LqrSliding::on_surface(
///     &rig.params.coefficients(), &linear, &steady, &Weights::diagonal([1.0; 4], [1.0]), reaching, 10.0,
/// )?;
/// let u = control.update(&mut control.start(), &State::new(0.0, 0.05, 0.0, 0.0), &State::upright(), 0.002);
/// assert!(u < -1.0 && u >= -10.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LqrSliding<T> {
    /// The model behind `c(w)`.
    pub model: Coefficients<T>,
    /// `pi(w)`.
    pub steady: SteadyMotion<T>,
    /// `B'P / B'P B`, V s per unit of the error.
    pub surface: [T; 4],
    /// `K`, V per unit of the error.
    pub gain: [T; 4],
    /// How the surface is reached.
    pub reaching: Reaching<T>,
    /// Largest command either way, V.
    pub command_limit: T,
}

/// How the surface is reached and held.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Reaching<T> {
    /// `gain sat(sigma / width)`: holds the surface to `width d / gain` against a disturbance of `d` volts below
    /// `gain`.
    BoundaryLayer {
        /// V.
        gain: T,
        /// Half of the layer's width, V s; 0 switches hard.
        width: T,
    },
    /// `root |sigma|^(1/2) sign(sigma) + v`, `v' = integral sign(sigma)`: a continuous command that learns a
    /// disturbance which changes by less than `integral` volts a second; holds the surface exactly in continuous time,
    /// to about `integral h²` at the sample period `h`.
    SuperTwisting {
        /// `V / (V s)^(1/2)`; Levant: 1.5 times the root of the disturbance's rate.
        root: T,
        /// V/s; Levant: 1.1 times the disturbance's rate.
        integral: T,
        /// Largest `v`, V: what has been learnt must not outlast a saturated motor.
        limit: T,
    },
}

impl<T: Real> Reaching<T> {
    /// Levant's gains of the super-twisting against disturbances that change by less than `rate` (V/s).
    pub fn super_twisting(rate: T, limit: T) -> Self {
        Self::SuperTwisting {
            root: c::<T>(1.5) * rate.sqrt(),
            integral: c::<T>(1.1) * rate,
            limit,
        }
    }
}

/// Memory of a [`LqrSliding`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LqrSlidingState<T> {
    /// What the super-twisting has learnt, V.
    learnt: T,
}

impl LqrSliding<f64> {
    /// The surface of the LQR with these weights for the upright linearisation.
    ///
    /// # Errors
    /// Those of [`crate::design::riccati::continuous`].
    pub fn on_surface(
        model: &Coefficients<f64>,
        upright: &Linear,
        steady: &SteadyMotion<f64>,
        weights: &Weights<f64, 4, 1>,
        reaching: Reaching<f64>,
        command_limit: f64,
    ) -> Result<Self, DesignError> {
        let regulator = lqr(&upright.a, &upright.b, weights)?;
        let row = upright.b.transpose() * regulator.cost;
        let surface = row / (row * upright.b)[0];
        Ok(Self {
            model: *model,
            steady: *steady,
            surface: surface.into(),
            gain: regulator.gain.into(),
            reaching,
            command_limit,
        })
    }

    /// The same in the target's own precision.
    pub fn cast<T: Real>(&self) -> LqrSliding<T> {
        LqrSliding {
            model: self.model.cast(),
            steady: self.steady.cast(),
            surface: self.surface.map(c),
            gain: self.gain.map(c),
            reaching: match self.reaching {
                Reaching::BoundaryLayer { gain, width } => Reaching::BoundaryLayer {
                    gain: c(gain),
                    width: c(width),
                },
                Reaching::SuperTwisting {
                    root,
                    integral,
                    limit,
                } => Reaching::SuperTwisting {
                    root: c(root),
                    integral: c(integral),
                    limit: c(limit),
                },
            },
            command_limit: c(self.command_limit),
        }
    }
}

impl<T: Real> LqrSliding<T> {
    /// `c(w) - K e` (V) and `sigma` (V s).
    fn feedback(&self, x: &State<T>, reference: &State<T>) -> (T, T) {
        let wanted = Wanted::at(&self.steady, reference);
        let error = wanted.error(x);
        let forward = wanted.command(&self.steady, &self.model);
        let feedback = forward - product(&self.gain, &error);
        (feedback, product(&self.surface, &error))
    }

    /// The reaching term, V.
    fn reach(&self, state: &mut LqrSlidingState<T>, sigma: T, h: T) -> T {
        match self.reaching {
            Reaching::BoundaryLayer { gain, width } => gain * saturation(sigma, width),
            Reaching::SuperTwisting {
                root,
                integral,
                limit,
            } => {
                let sign = saturation(sigma, T::ZERO);
                let learnt = state.learnt + integral * sign * h;
                if is_finite(learnt) {
                    state.learnt = learnt.clamp(-limit, limit);
                }
                root * sigma.abs().sqrt() * sign + state.learnt
            }
        }
    }
}

impl<T: Real> Design for LqrSliding<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let weights = weights::given(settings, || balance_weights(site.params))?;
        let strength = settings
            .number(const { SPEC.parameter("strength").optional() })
            .unwrap_or(site.command_limit / 12.0);
        let rate = settings.number(const { SPEC.parameter("rate").optional() });
        let reaching = match settings.word(const { SPEC.parameter("reaching").chosen() }) {
            "super_twisting" => {
                Reaching::super_twisting(rate.unwrap_or(TWISTING_RATE) * strength, strength)
            }
            _ => Reaching::BoundaryLayer {
                gain: strength,
                width: strength / rate.unwrap_or(LAYER_RATE),
            },
        };
        let linear = site.linear()?;
        let designed = LqrSliding::on_surface(
            &site.coefficients()?,
            &linear,
            &steady_motion(settings, site)?,
            &weights,
            reaching,
            site.command_limit,
        )?;
        Ok(designed.cast())
    }
}

impl<T: Real> Controller<T> for LqrSliding<T> {
    type State = LqrSlidingState<T>;

    fn start(&self) -> LqrSlidingState<T> {
        LqrSlidingState { learnt: T::ZERO }
    }

    fn take_over(&self, x: &State<T>, reference: &State<T>, u: T) -> LqrSlidingState<T> {
        let (feedback, sigma) = self.feedback(x, reference);
        let mut state = self.start();
        if let Reaching::SuperTwisting { limit, .. } = self.reaching {
            let learnt = feedback - self.reach(&mut state, sigma, T::ZERO) - u;
            if is_finite(learnt) {
                state.learnt = learnt.clamp(-limit, limit);
            }
        }
        state
    }

    fn surrogate(&self) -> Option<StateFeedback<T>> {
        Some(StateFeedback {
            gain: self.gain,
            command_limit: self.command_limit,
        })
    }

    fn update(
        &self,
        state: &mut LqrSlidingState<T>,
        x: &State<T>,
        reference: &State<T>,
        h: T,
    ) -> T {
        let (feedback, sigma) = self.feedback(x, reference);
        let u = feedback - self.reach(state, sigma, h);
        command(u, self.command_limit)
    }

    fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        put("GAIN", Number::Real(&self.gain));
        put("CONTROLLER_LIMIT", Number::Real(&[self.command_limit]));
        put("SURFACE", Number::Real(&self.surface));
        let (twisting, reaching) = match self.reaching {
            Reaching::BoundaryLayer { gain, width } => (0, [gain, width, T::ZERO]),
            Reaching::SuperTwisting {
                root,
                integral,
                limit,
            } => (1, [root, integral, limit]),
        };
        put("TWISTING", Number::Whole(twisting));
        put("REACHING", Number::Real(&reaching));
        resting(&self.model, &self.steady, put);
        true
    }
}
