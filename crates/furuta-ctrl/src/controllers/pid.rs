//! A pair of PID controllers, the arm's around the pendulum's.

use super::{Controller, Design, LinearLaw, StateFeedback};
use crate::error::ConfigError;
use crate::design::{balance_weights_with_integral, sampled_lqi};
use crate::real::{Real, c, command, is_finite, wrap};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::State;
use nalgebra::RowVector4;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "pid",
    sentence: "Two PID controllers: the arm's asks for an angle of the pendulum, the pendulum's turns it into a command",
    parameters: &[
        ParameterSpec::numbers(
            "pendulum",
            3,
            "V/rad, V/(rad s), V s/rad",
            -1e6,
            1e6,
            "kp, ki, kd of the pendulum's angle; those of `lqi` if pendulum and arm are left out",
        ),
        ParameterSpec::numbers(
            "arm",
            3,
            "1, 1/s, s",
            -1e6,
            1e6,
            "kp, ki, kd from the arm's error to the pendulum's angle; below 0, for an arm that is to go one way first \
             lets the pendulum lean that way",
        ),
        ParameterSpec::number(
            "filter",
            "rad/s",
            1e-2,
            1e6,
            "corner of the derivatives' low pass; 0.3 over the sample period or 15 times the pendulum's frequency, the \
             larger, if left out",
        ),
        ParameterSpec::number(
            "tracking",
            "s",
            1e-3,
            1e4,
            "time in which the integrals follow a command that is at its limit; twice the pendulum's time constant if \
             left out",
        ),
    ],
};

/// Two PID controllers in cascade.
///
/// The arm's gives the angle that the pendulum is to have, `a = kp e + ki (integral of e) - kd theta'` with `e =
/// theta_ref - theta`; the pendulum's the command, `u = kp (a - alpha) + ki (integral of a - alpha) - kd alpha'`.
/// Derivatives act on what is measured, not on the error, and are difference quotients through a low pass of first
/// order. Where the command is at its limit, what the limit takes off is led back to both integrals with the time
/// constant `tracking` (back-calculation: K. J. Åström, T. Hägglund, *PID Controllers*, 2nd ed. 1995, 3.5).
///
/// ```
/// use furuta_ctrl::controllers::{Controller, Pid};
/// use furuta_model::State;
/// let control = Pid {
///     pendulum: [28.0, 0.0, 3.6], arm: [-0.05, -0.01, -0.07], filter: 150.0, tracking: 0.2, command_limit: 10.0,
/// };
/// let mut state = control.start();
/// // 0.1 rad beyond its reference, the arm asks the pendulum to lean by 0.005 rad.
/// let u: f64 = control.update(&mut state, &State::new(0.1, 0.0, 0.0, 0.0), &State::upright(), 0.002);
/// assert!((u - 28.0 * 0.005).abs() < 1e-12);
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Pid<T> {
    /// `[kp, ki, kd]` of the pendulum's angle: V/rad, V/(rad s), V s/rad.
    pub pendulum: [T; 3],
    /// `[kp, ki, kd]` from the arm's error to the pendulum's angle: rad/rad, 1/s, s.
    pub arm: [T; 3],
    /// Corner of the derivatives' low pass, rad/s.
    pub filter: T,
    /// Time constant of the back-calculation, s.
    pub tracking: T,
    /// Largest command either way, V.
    pub command_limit: T,
}

/// Memory of a [`Pid`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PidState<T> {
    /// Of the arm's error, times its gain: rad of the pendulum.
    arm: T,
    /// Of the pendulum's error, times its gain: V.
    pendulum: T,
    before: Option<Before<T>>,
}

/// The angles `[theta, alpha]` (rad) of the sample before, and their filtered rates (rad/s).
#[derive(Copy, Clone, Debug, PartialEq)]
struct Before<T> {
    angles: [T; 2],
    rates: [T; 2],
}

impl<T: Real> Pid<T> {
    /// The pair whose gains near upright are those of `u = -K x - integral_gain s`, `s` the integral of the arm's
    /// angle: the arm's gains and the pendulum's, `[kp, ki, kd]` each. Not finite where `K` does not act on the
    /// pendulum's angle.
    ///
    /// ```
    /// use furuta_ctrl::controllers::Pid;
    /// let (arm, pendulum) = Pid::gains([-1.0, 25.0, -2.0, 3.6], -0.5);
    /// assert_eq!((arm, pendulum), ([-0.04, -0.02, -0.08], [25.0, 0.0, 3.6]));
    /// ```
    pub fn gains(gain: [T; 4], integral_gain: T) -> ([T; 3], [T; 3]) {
        let [theta, alpha, theta_dot, alpha_dot] = gain;
        (
            [theta / alpha, integral_gain / alpha, theta_dot / alpha],
            [alpha, T::ZERO, alpha_dot],
        )
    }

    /// `v` within what the full command needs through `gain`; 0 where that is no number.
    fn bounded(&self, v: T, gain: T) -> T {
        let full = self.command_limit / gain.abs();
        if is_finite(v) && is_finite(full) {
            v.clamp(-full, full)
        } else {
            T::ZERO
        }
    }

    /// The filtered rates at the angles of `x`; at the first sample the state's own.
    fn rates(&self, before: Option<Before<T>>, x: &State<T>, h: T) -> [T; 2] {
        let Some(before) = before else {
            return [x.theta_dot, x.alpha_dot];
        };
        let share = T::ONE - (-(self.filter * h)).exp();
        let moved = [
            x.theta - before.angles[0],
            wrap(x.alpha - before.angles[1]),
        ];
        core::array::from_fn(|i| {
            before.rates[i] + share * (moved[i] / h - before.rates[i])
        })
    }

    /// The command without limit, and the errors of the arm and of the pendulum that are integrated.
    fn unlimited(
        &self,
        state: &PidState<T>,
        rates: [T; 2],
        x: &State<T>,
        reference: &State<T>,
    ) -> (T, [T; 2]) {
        let off = reference.theta - x.theta;
        let lean = self.arm[0] * off + state.arm + self.arm[2] * (reference.theta_dot - rates[0]);
        let error = lean + wrap(reference.alpha - x.alpha);
        let rate = reference.alpha_dot - rates[1];
        let u = self.pendulum[0] * error + state.pendulum + self.pendulum[2] * rate;
        (u, [off, error])
    }
}

impl<T: Real> Design for Pid<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let given = (
            settings.vector(const { SPEC.parameter("arm").several::<3>() }),
            settings.vector(const { SPEC.parameter("pendulum").several::<3>() }),
        );
        let (arm, pendulum) = match given {
            (Some(arm), Some(pendulum)) => (arm, pendulum),
            (None, None) => {
                let up = site.linear()?;
                let weights = balance_weights_with_integral(site.params);
                let theta = RowVector4::new(1.0, 0.0, 0.0, 0.0);
                let k = sampled_lqi::<f64, 4, 5>(&up.a, &up.b, &theta, site.period, &weights)?.gain;
                Pid::gains([k[0], k[1], k[2], k[3]], k[4])
            }
            _ => {
                return Err(ConfigError::Contradiction {
                    section: SPEC.id,
                    problem: "give both pendulum and arm, or neither",
                });
            }
        };
        let filter = settings.number(const { SPEC.parameter("filter").optional() });
        let tracking = settings.number(const { SPEC.parameter("tracking").optional() });
        let standard = (0.3 / site.period).max(15.0 * site.frequency());
        Ok(Self {
            pendulum: pendulum.map(c),
            arm: arm.map(c),
            filter: c(filter.unwrap_or(standard)),
            tracking: c(tracking.unwrap_or(2.0 / site.frequency())),
            command_limit: c(site.command_limit),
        })
    }
}

impl<T: Real> Controller<T> for Pid<T> {
    type State = PidState<T>;

    fn start(&self) -> PidState<T> {
        PidState {
            arm: T::ZERO,
            pendulum: T::ZERO,
            before: None,
        }
    }

    /// The arm's integral takes up the difference, or the pendulum's where the arm has none.
    fn take_over(&self, x: &State<T>, reference: &State<T>, u: T) -> PidState<T> {
        let mut state = self.start();
        let rates = self.rates(None, x, T::ONE);
        let missing = u - self.unlimited(&state, rates, x, reference).0;
        if self.arm[1] != T::ZERO {
            state.arm = self.bounded(missing / self.pendulum[0], self.pendulum[0]);
        } else if self.pendulum[1] != T::ZERO {
            state.pendulum = self.bounded(missing, T::ONE);
        }
        state
    }

    fn update(&self, state: &mut PidState<T>, x: &State<T>, reference: &State<T>, h: T) -> T {
        let rates = self.rates(state.before, x, h);
        let (wanted, [off, error]) = self.unlimited(state, rates, x, reference);
        let u = command(wanted, self.command_limit);
        if is_finite(wanted) {
            // What the limit takes off, led back.
            let back = (u - wanted) * (h / self.tracking).clamp(T::ZERO, T::ONE);
            if self.arm[1] != T::ZERO {
                let next = state.arm + self.arm[1] * off * h + back / self.pendulum[0];
                state.arm = self.bounded(next, self.pendulum[0]);
            }
            if self.pendulum[1] != T::ZERO {
                let next = state.pendulum + self.pendulum[1] * error * h + back;
                state.pendulum = self.bounded(next, T::ONE);
            }
            let angles = [x.theta, x.alpha];
            let sound = angles.iter().chain(&rates).all(|v| is_finite(*v));
            state.before = sound.then_some(Before { angles, rates });
        } else {
            state.before = None;
        }
        u
    }

    /// Without the low pass of the derivatives. An integral of the pendulum's error is a memory of its own.
    fn linear_law(&self) -> Option<LinearLaw<T>> {
        let ([kp, ki, kd], [arm_kp, arm_ki, arm_kd]) = (self.pendulum, self.arm);
        (ki == T::ZERO).then_some(LinearLaw {
            gain: [kp * arm_kp, kp, kp * arm_kd, kd],
            integral: kp * arm_ki,
        })
    }

    fn surrogate(&self) -> Option<StateFeedback<T>> {
        let [kp, _, kd] = self.pendulum;
        Some(StateFeedback {
            gain: [kp * self.arm[0], kp, kp * self.arm[2], kd],
            command_limit: self.command_limit,
        })
    }
}
