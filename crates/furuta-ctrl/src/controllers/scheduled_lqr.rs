//! State feedback whose gain follows the arm's speed.

use super::{Controller, Design, LinearLaw, StateFeedback, weights};
use crate::error::ConfigError;
use crate::design::{balance_weights, dlqr};
use crate::real::{Real, c, command};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Plant, State, linearize};

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "scheduled_lqr",
    sentence: "State feedback with a gain for every speed of the arm: a rotating pendulum is thrown outwards, and falls \
        faster",
    parameters: &[
        weights::q(4, "diagonal of the state's weight Q, at all speeds; that of `lqr` if left out"),
        weights::r("weight R of the command"),
        ParameterSpec::number(
            "fastest",
            "rad/s",
            1e-3,
            1e4,
            "speed of the arm up to which there are gains; beyond it the last one acts; that of the motor at its largest \
             command if left out",
        ),
    ],
};

/// Gains that are kept: at rest, at `fastest`, and between them at equal steps of the speed's square.
pub const SPEEDS: usize = 9;

/// `u = -K(theta') (x - x_ref) + drag theta'_ref`, limited: a linear-quadratic regulator for each speed of the arm.
///
/// With the pendulum upright an arm may turn at any steady speed `w`. Linearised there, only the pendulum's fall is
/// another one than at rest: its weight's moment is `weight + swing w²` in place of `weight`, as the centrifugal force
/// pulls outwards. So the gain is a function of `w²`. It is designed at [`SPEEDS`] places of it and linear in between;
/// it has no jump, so neither has the command. At rest it is the gain of `lqr`. `drag` is the voltage that a steady
/// speed needs.
///
/// ```
/// use furuta_ctrl::Site;
/// use furuta_ctrl::controllers::{Controller, Design, ScheduledLqr, settings};
/// use furuta_model::State;
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let given = settings("scheduled_lqr").ok_or("no such controller")?;
/// let control = ScheduledLqr::<f64>::design(&given, &Site::of(&rig, 0.002))?;
/// // At 20 rad/s the pendulum falls more than four times as hard as at rest.
/// assert!(control.gain_at(20.0)[1] > 1.5 * control.gain_at(0.0)[1]);
/// // The arm of a steady turn is not braked.
/// let turning = State::new(0.0, 0.0, 5.0, 0.0);
/// assert!(control.update(&mut (), &turning, &turning, 0.002) > 1.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ScheduledLqr<T> {
    /// The rows `K` in the order of [`State`]: V/rad, V/rad, V s/rad, V s/rad. The one at `k` is for the speed
    /// `fastest sqrt(k/(SPEEDS - 1))`.
    pub gains: [[T; 4]; SPEEDS],
    /// Speed of the last gain, rad/s.
    pub fastest: T,
    /// Voltage over the speed of an arm that turns steadily, V s/rad.
    pub drag: T,
    /// Largest command either way, V.
    pub command_limit: T,
}

impl<T: Real> ScheduledLqr<T> {
    /// The gain at this speed of the arm, rad/s.
    pub fn gain_at(&self, speed: T) -> [T; 4] {
        let last = SPEEDS - 1;
        let share = speed / self.fastest;
        #[allow(clippy::cast_precision_loss)]
        let place = (share * share).clamp(T::ZERO, T::ONE) * c(last as f64);
        // A speed that is not a number has the first gain; the command is then none either.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let below = (place.value() as usize).min(last - 1);
        #[allow(clippy::cast_precision_loss)]
        let part = place - c(below as f64);
        let (from, to) = (&self.gains[below], &self.gains[below + 1]);
        core::array::from_fn(|i| from[i] + part * (to[i] - from[i]))
    }

    fn at(&self, gain: [T; 4]) -> StateFeedback<T> {
        StateFeedback {
            gain,
            command_limit: self.command_limit,
        }
    }
}

impl<T: Real> Design for ScheduledLqr<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let weights = weights::given(settings, || balance_weights(site.params))?;
        let k = site.params.coefficients();
        let drag = k.arm_damping / k.drive;
        let fastest = settings
            .number(const { SPEC.parameter("fastest").optional() })
            .unwrap_or(site.command_limit / drag);
        if !fastest.is_finite() {
            return Err(ConfigError::Unsuitable {
                section: SPEC.id,
                problem: "nothing slows its arm down, so its motor has no largest speed; give `fastest`",
            });
        }
        let rest = site.linear()?;
        let bare = Plant::without_effects(k);
        let turning = |w: f64| linearize(&bare, State::new(0.0, 0.0, w, 0.0), drag * w).a;
        let mut gains = [[T::ZERO; 4]; SPEEDS];
        for (i, gain) in gains.iter_mut().enumerate() {
            #[allow(clippy::cast_precision_loss)]
            let share = i as f64 / (SPEEDS - 1) as f64;
            let a = rest.a + (turning(fastest * libm::sqrt(share)) - turning(0.0));
            let (a, b) = zero_order_hold(&a, &rest.b, site.period);
            let designed = dlqr(&a, &b, &weights)?.gain;
            *gain = core::array::from_fn(|i| c(designed[i]));
        }
        Ok(Self {
            gains,
            fastest: c(fastest),
            drag: c(drag),
            command_limit: c(site.command_limit),
        })
    }
}

impl<T: Real> Controller<T> for ScheduledLqr<T> {
    type State = ();

    fn start(&self) {}

    fn update(&self, _: &mut (), x: &State<T>, reference: &State<T>, _: T) -> T {
        let feedback = self.at(self.gain_at(x.theta_dot));
        let u = feedback.unlimited(x, reference) + self.drag * reference.theta_dot;
        command(u, self.command_limit)
    }

    /// That of a resting arm.
    fn linear_law(&self) -> Option<LinearLaw<T>> {
        Some(LinearLaw::of_states(self.gains[0]))
    }

    fn surrogate(&self) -> Option<StateFeedback<T>> {
        Some(self.at(self.gains[0]))
    }
}
