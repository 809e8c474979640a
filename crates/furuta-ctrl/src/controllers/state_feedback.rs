//! Linear state feedback.

use super::{Controller, Design, LinearLaw, weights};
use crate::error::ConfigError;
use crate::design::{Regulator, balance_weights, dlqr};
use crate::numbers::Number;
use crate::real::{Real, command, wrap};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::State;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "lqr",
    sentence: "State feedback u = -K (x - reference), limited; K given, or a linear-quadratic regulator of the rig",
    parameters: &[
        ParameterSpec::numbers(
            "gain",
            4,
            "V/rad, V s/rad",
            -1e6,
            1e6,
            "K on [theta, alpha, theta_dot, alpha_dot]; designed with q and r if left out",
        ),
        weights::q(4, "diagonal of the state's weight Q; if q and r are left out: full command, half a \
            radian of the pendulum and the arm's usual travel cost alike"),
        weights::r("weight R of the command"),
    ],
};

/// `u = -K (x - x_ref)`, limited; the pendulum's error is taken the short way round.
///
/// ```
/// use furuta_ctrl::controllers::{Controller, StateFeedback};
/// use furuta_model::State;
/// let balance = StateFeedback { gain: [-1.0, 27.7, -2.0, 3.6], command_limit: 10.0 };
/// let tipped = State::new(0.0, 0.1, 0.0, 0.0);
/// assert_eq!(balance.update(&mut (), &tipped, &State::upright(), 0.002), -2.77);
/// let broken = State::new(f64::NAN, 0.1, 0.0, 0.0);
/// assert_eq!(balance.update(&mut (), &broken, &State::upright(), 0.002), 0.0);
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct StateFeedback<T> {
    /// The row `K` in the order of [`State`]: V/rad, V/rad, V s/rad, V s/rad.
    pub gain: [T; 4],
    /// Largest command either way, V.
    pub command_limit: T,
}

impl<T: Real> StateFeedback<T> {
    /// The feedback of a designed regulator, in the target's own precision.
    pub fn new(regulator: &Regulator<f64, 4, 1>, command_limit: f64) -> Self {
        Self {
            gain: core::array::from_fn(|i| T::from_f64(regulator.gain[i])),
            command_limit: T::from_f64(command_limit),
        }
    }

    /// The command before the limit.
    pub fn unlimited(&self, x: &State<T>, reference: &State<T>) -> T {
        let e = *x - *reference;
        let [k_theta, k_alpha, k_theta_dot, k_alpha_dot] = self.gain;
        -(k_theta * e.theta
            + k_alpha * wrap(e.alpha)
            + k_theta_dot * e.theta_dot
            + k_alpha_dot * e.alpha_dot)
    }
}

impl<T: Real> Design for StateFeedback<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let weighted = weights::any::<4>(settings);
        if let Some(gain) = settings.vector(const { SPEC.parameter("gain").several::<4>() }) {
            if weighted {
                return Err(ConfigError::Contradiction {
                    section: SPEC.id,
                    problem: "give either gain, or q and r",
                });
            }
            return Ok(Self {
                gain: gain.map(T::from_f64),
                command_limit: T::from_f64(site.command_limit),
            });
        }
        let weights = weights::given(settings, || balance_weights(site.params))?;
        let (a, b) = site.upright()?;
        Ok(Self::new(&dlqr(&a, &b, &weights)?, site.command_limit))
    }
}

impl<T: Real> Controller<T> for StateFeedback<T> {
    type State = ();

    fn start(&self) {}

    fn update(&self, _: &mut (), x: &State<T>, reference: &State<T>, _: T) -> T {
        command(self.unlimited(x, reference), self.command_limit)
    }

    fn linear_law(&self) -> Option<LinearLaw<T>> {
        Some(LinearLaw::of_states(self.gain))
    }

    fn surrogate(&self) -> Option<Self> {
        Some(*self)
    }

    fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        put("GAIN", Number::Real(&self.gain));
        put("CONTROLLER_LIMIT", Number::Real(&[self.command_limit]));
        true
    }
}
