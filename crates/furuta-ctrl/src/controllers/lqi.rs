//! State feedback with the integral of the arm's error.

use super::{Controller, Design, LinearLaw, StateFeedback, weights};
use crate::error::ConfigError;
use crate::design::{balance_weights_with_integral, integral_over_sample, sampled_lqi};
use crate::numbers::Number;
use crate::real::{Real, c, command, is_finite};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::State;
use nalgebra::RowVector4;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "lqi",
    sentence: "State feedback with the integral of the arm's error: what pulls at the arm for long leaves no error",
    parameters: &[
        ParameterSpec::numbers(
            "gain",
            4,
            "V/rad, V s/rad",
            -1e6,
            1e6,
            "K on [theta, alpha, theta_dot, alpha_dot]; designed with q and r if left out",
        ),
        ParameterSpec::number(
            "integral_gain",
            "V/(rad s)",
            -1e6,
            1e6,
            "on the integral of theta; together with gain",
        ),
        weights::q(5, "diagonal of the weight Q of the state and the integral; if q and r are left out: \
            those of `lqr`, an arm that is off for ten of the pendulum's time constants as dear as the \
            angle itself"),
        weights::r("weight R of the command"),
    ],
};

/// `u = -K (x - x_ref) - k_i s`, `s` the integral of the arm's error, limited.
///
/// `s` grows from sample to sample by the integral of the cubic through the error and its rate at both
/// ([`integral_over_sample`]): what [`sampled_lqi`] designs for, without a model of the rig, and 0 only where the error
/// is.
///
/// Where the command is at its limit, `s` does not grow in the direction that holds it there, nor ever beyond what the
/// full command needs (anti-windup).
///
/// ```
/// use furuta_ctrl::controllers::{Controller, Lqi};
/// use furuta_model::State;
/// let control = Lqi { gain: [-1.0, 27.7, -2.0, 3.6], integral_gain: -0.5, command_limit: 10.0 };
/// let mut state = control.start();
/// let off = State::new(0.1, 0.0, 0.0, 0.0);
/// for _ in 0..500 {
///     control.update(&mut state, &off, &State::upright(), 0.002);
/// }
/// // A second after the first sample 0.1 rad s have come together.
/// let u: f64 = control.update(&mut state, &off, &State::upright(), 0.002);
/// assert!((u - 0.15).abs() < 1e-12);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Lqi<T> {
    /// The row `K` in the order of [`State`]: V/rad, V/rad, V s/rad, V s/rad.
    pub gain: [T; 4],
    /// `k_i`, V/(rad s).
    pub integral_gain: T,
    /// Largest command either way, V.
    pub command_limit: T,
}

/// Memory of an [`Lqi`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LqiState<T> {
    /// rad s.
    integral: T,
    /// The sample before.
    before: Option<Before<T>>,
}

/// What is kept of a sample.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Before<T> {
    /// Angle (rad) and speed (rad/s) of the arm.
    arm: [T; 2],
    /// What the arm was asked for from there on: rad, rad/s.
    wanted: [T; 2],
}

impl<T: Real> Lqi<T> {
    fn feedback(&self) -> StateFeedback<T> {
        StateFeedback {
            gain: self.gain,
            command_limit: self.command_limit,
        }
    }

    /// The integral within what the full command needs.
    fn bounded(&self, integral: T) -> T {
        let full = self.command_limit / self.integral_gain.abs();
        let integral = if is_finite(full) {
            integral.clamp(-full, full)
        } else {
            T::ZERO
        };
        if is_finite(integral) { integral } else { T::ZERO }
    }
}

impl<T: Real> Design for Lqi<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let contradiction = |problem| ConfigError::Contradiction {
            section: SPEC.id,
            problem,
        };
        let weighted = weights::any::<5>(settings);
        let given = (
            settings.vector(const { SPEC.parameter("gain").several::<4>() }),
            settings.number(const { SPEC.parameter("integral_gain").optional() }),
        );
        let (gain, integral_gain) = match given {
            (Some(_), Some(_)) if weighted => {
                return Err(contradiction("give either the gains, or q and r"));
            }
            (Some(gain), Some(integral_gain)) => (gain, integral_gain),
            (None, None) => {
                let weights =
                    weights::given(settings, || balance_weights_with_integral(site.params))?;
                let up = site.linear()?;
                let arm = RowVector4::new(1.0, 0.0, 0.0, 0.0);
                let k = sampled_lqi::<f64, 4, 5>(&up.a, &up.b, &arm, site.period, &weights)?.gain;
                ([k[0], k[1], k[2], k[3]], k[4])
            }
            _ => {
                return Err(contradiction(
                    "give both gain and integral_gain, or neither",
                ));
            }
        };
        Ok(Self {
            gain: gain.map(c),
            integral_gain: c(integral_gain),
            command_limit: c(site.command_limit),
        })
    }
}

impl<T: Real> Controller<T> for Lqi<T> {
    type State = LqiState<T>;

    fn start(&self) -> LqiState<T> {
        LqiState {
            integral: T::ZERO,
            before: None,
        }
    }

    fn take_over(&self, x: &State<T>, reference: &State<T>, u: T) -> LqiState<T> {
        let rest = self.feedback().unlimited(x, reference) - u;
        LqiState {
            integral: self.bounded(rest / self.integral_gain),
            before: None,
        }
    }

    fn update(&self, state: &mut LqiState<T>, x: &State<T>, reference: &State<T>, h: T) -> T {
        let feedback = self.feedback().unlimited(x, reference);
        let arm = [x.theta, x.theta_dot];
        // The error since the sample before, from what was wanted then.
        let step = state.before.map_or(T::ZERO, |before| {
            let off = |arm: [T; 2]| [arm[0] - before.wanted[0], arm[1] - before.wanted[1]];
            integral_over_sample(h, off(before.arm), off(arm))
        });
        let held = feedback - self.integral_gain * state.integral;
        // The command that the step asks for in addition.
        let more = -(self.integral_gain * step);
        let stuck = held.abs() >= self.command_limit && held * more > T::ZERO;
        if is_finite(held) && is_finite(step) && !stuck {
            state.integral = self.bounded(state.integral + step);
        }
        let sound = arm.iter().all(|v| is_finite(*v));
        state.before = sound.then_some(Before {
            arm,
            wanted: [reference.theta, reference.theta_dot],
        });
        let wanted = feedback - self.integral_gain * state.integral;
        command(wanted, self.command_limit)
    }

    fn linear_law(&self) -> Option<LinearLaw<T>> {
        Some(LinearLaw {
            gain: self.gain,
            integral: self.integral_gain,
        })
    }

    fn surrogate(&self) -> Option<StateFeedback<T>> {
        Some(self.feedback())
    }

    fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        put("GAIN", Number::Real(&self.gain));
        put("INTEGRAL_GAIN", Number::Real(&[self.integral_gain]));
        put("CONTROLLER_LIMIT", Number::Real(&[self.command_limit]));
        true
    }
}
