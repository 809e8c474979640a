//! The nonlinear output regulator: feed-forward of a steady motion, linear feedback about it.

use super::{Controller, Design, LinearLaw, StateFeedback};
use crate::error::ConfigError;
use crate::design::SteadyMotion;
use crate::numbers::Number;
use crate::real::{Real, command, wrap};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::params::Coefficients;
use furuta_model::State;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "output_regulator",
    sentence: "u = c(w) - K (x - pi(w)): the pendulum follows a sine, the arm the motion that this takes; \
        without a sine, state feedback",
    parameters: &[
        LAMBDA,
        ORDER,
        ParameterSpec::numbers(
            "gain",
            4,
            "V/rad, V s/rad",
            -1e6,
            1e6,
            "K on the errors of [theta, alpha, theta_dot, alpha_dot]; that of `lqr` if left out",
        ),
    ],
};

/// Which sine.
pub(super) const LAMBDA: ParameterSpec = ParameterSpec::number(
    "lambda",
    "rad/s",
    1e-3,
    1e3,
    "frequency of the sine that the pendulum's reference is",
)
.or(1.0);

/// How well it is known what the arm does meanwhile.
pub(super) const ORDER: ParameterSpec = ParameterSpec::whole(
    "order",
    1.0,
    7.0,
    5.0,
    "order of the power series of the arm's motion in the sine's amplitude",
);

/// The steady motion that [`LAMBDA`] and [`ORDER`] speak of.
pub(super) fn steady_motion(
    settings: &Settings,
    site: &Site<'_>,
) -> Result<SteadyMotion<f64>, ConfigError> {
    let lambda = settings.value(const { LAMBDA.settled() });
    let order = settings.whole(const { ORDER.settled() });
    Ok(SteadyMotion::solve_under(
        &site.coefficients()?,
        &site.load()?,
        lambda,
        order,
    )?)
}

/// `u = c(w) - K (x - pi(w))`: the pendulum follows a sine, the arm the motion that this takes.
///
/// (Ramos-Velasco, Ruiz-Leon, Celikovsky, sec. 4.1, with the sign that their gain asks for.) The oscillator's state `w`
/// is read off the reference's `alpha` and `alpha_dot`, which are to be a sine's of the frequency `steady.lambda`; its
/// `theta` moves the arm's middle. A reference of zeros makes it plain state feedback. `c(w)` is the model's own
/// command on `pi(w)`, so it is as exact as `pi` is.
///
/// ```
/// use furuta_ctrl::controllers::{Controller, OutputRegulator};
/// use furuta_ctrl::design::{SteadyMotion, balance};
/// use furuta_model::{Rig, State};
/// let params = Rig::builtin("qube-servo-2").ok_or("no such rig")?.params;
/// let steady = SteadyMotion::solve(&params.coefficients(), 4.0, 5)?;
/// let regulator = OutputRegulator::<f64>::new(&params, &steady, balance(&params, 0.002)?.gain.into());
/// // On the steady motion the feedback is silent.
/// let w = [0.0, 0.02];
/// let reference = State::new(0.0, w[1], 0.0, 0.0);
/// let u = regulator.update(&mut (), &steady.state(w), &reference, 0.002);
/// assert!((u - steady.command.at(w[0], w[1])).abs() < 1e-5);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct OutputRegulator<T> {
    /// The model behind `c(w)`.
    pub model: Coefficients<T>,
    /// `pi(w)`.
    pub steady: SteadyMotion<T>,
    /// The row `K` in the order of [`State`]: V/rad, V/rad, V s/rad, V s/rad.
    pub gain: [T; 4],
    /// Largest command either way, V.
    pub command_limit: T,
}

impl<T: Real> OutputRegulator<T> {
    /// For a rig with these parameters, in the target's own precision.
    pub fn new(
        params: &furuta_model::Params<f64>,
        steady: &SteadyMotion<f64>,
        gain: [f64; 4],
    ) -> Self {
        Self {
            model: params.coefficients().cast(),
            steady: steady.cast(),
            gain: gain.map(T::from_f64),
            command_limit: T::from_f64(params.motor.command_limit),
        }
    }
}

impl<T: Real> Design for OutputRegulator<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let gain = match settings.vector(const { SPEC.parameter("gain").several::<4>() }) {
            Some(gain) => gain,
            None => {
                let lqr = Settings::new(&super::state_feedback::SPEC);
                StateFeedback::<f64>::design(&lqr, site)?.gain
            }
        };
        Ok(Self {
            model: site.coefficients()?.cast(),
            command_limit: T::from_f64(site.command_limit),
            ..Self::new(site.params, &steady_motion(settings, site)?, gain)
        })
    }
}

impl<T: Real> Controller<T> for OutputRegulator<T> {
    type State = ();

    fn start(&self) {}

    fn update(&self, _: &mut (), x: &State<T>, reference: &State<T>, _: T) -> T {
        let wanted = Wanted::at(&self.steady, reference);
        let forward = wanted.command(&self.steady, &self.model);
        let u = forward - product(&self.gain, &wanted.error(x));
        command(u, self.command_limit)
    }

    fn linear_law(&self) -> Option<LinearLaw<T>> {
        Some(LinearLaw::of_states(self.gain))
    }

    fn surrogate(&self) -> Option<StateFeedback<T>> {
        Some(StateFeedback {
            gain: self.gain,
            command_limit: self.command_limit,
        })
    }

    fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        put("GAIN", Number::Real(&self.gain));
        put("CONTROLLER_LIMIT", Number::Real(&[self.command_limit]));
        resting(&self.model, &self.steady, put);
        true
    }
}

/// Where a reference wants the state, and with which acceleration of the pendulum.
pub(super) struct Wanted<T> {
    /// `pi(w)`, moved by the reference's `theta`.
    pub(super) state: State<T>,
    /// Where its arm's middle is, rad.
    pub(super) middle: T,
    /// rad/s².
    pub(super) alpha_ddot: T,
}

impl<T: Real> Wanted<T> {
    pub(super) fn at(steady: &SteadyMotion<T>, reference: &State<T>) -> Self {
        let w = steady.oscillator(reference);
        let mut state = steady.state(w);
        state.theta += reference.theta;
        Self {
            state,
            middle: reference.theta,
            alpha_ddot: -(steady.lambda * steady.lambda * w[1]),
        }
    }

    /// `c(w)`, V: the model's own command on the wanted motion.
    pub(super) fn command(&self, steady: &SteadyMotion<T>, model: &Coefficients<T>) -> T {
        steady.inverse(model, &self.state, self.middle, self.alpha_ddot)
    }

    /// `x - pi(w)`, the pendulum's angle the short way round.
    pub(super) fn error(&self, x: &State<T>) -> [T; 4] {
        let e = *x - self.state;
        [e.theta, wrap(e.alpha), e.theta_dot, e.alpha_dot]
    }
}

/// The motion wanted while the reference rests upright with the arm at 0, by name: its state, the pendulum's
/// acceleration and the command. The arm's reference is added to the state's first number; the command does not depend
/// on it.
pub(super) fn resting<T: Real>(
    model: &Coefficients<T>,
    steady: &SteadyMotion<T>,
    put: &mut impl FnMut(&'static str, Number<'_, T>),
) {
    let wanted = Wanted::at(steady, &State::upright());
    put("WANTED", Number::Real(&wanted.state.to_array()));
    put("WANTED_ACCELERATION", Number::Real(&[wanted.alpha_ddot]));
    put("FORWARD", Number::Real(&[wanted.command(steady, model)]));
}

pub(super) fn product<T: Real>(row: &[T; 4], x: &[T; 4]) -> T {
    row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3] * x[3]
}
