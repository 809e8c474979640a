//! How the motor is taken off when a limit is hit at speed: braked first, for a bounded time.

use crate::numbers::Number;
use crate::real::{Real, c, is_finite};
use furuta_model::{Params, State};

/// Longest braking, s.
const TIME: f64 = 0.25;
/// From nothing to the whole voltage takes so long at least, s: gears and amplifiers do not like a step.
const RISE: f64 = 0.01;
/// An arm that is faster than when the braking began, by this much of it, is not being braked: its encoder or its motor
/// is the wrong way round.
const FASTER: f64 = 1.2;
/// The voltage follows the speed with this time constant of the braked arm, in periods: slow against what delay and
/// estimate take.
const PERIODS: f64 = 8.0;

/// Brakes an arm that has hit a limit: a voltage against its speed, under an envelope that falls to zero.
///
/// A motor at 0 V brakes too, its terminals shorted, but no harder than its back electromotive force drives a current;
/// and the pendulum pushes on. So, from the sample at which a limit is found passed,
///
/// `u = -min(g*|theta_dot|, limit*(1 - t/T)) * sign(theta_dot)`,
///
/// where `g` brakes the arm with a time constant of eight periods. The voltage so far ends at once; what brakes rises
/// within 10 ms; all ends for good after `T` = 0.25 s, at the arm's reversal, and at once where the arm becomes faster
/// instead of slower (an encoder or a motor is the wrong way round) or a number is not finite. Then the motor is off.
///
/// ```
/// use furuta_ctrl::supervisor::Brake;
/// use furuta_model::State;
/// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let brake = Brake::<f64>::new(&rig.params, 5.0, 0.002);
/// let mut braking = brake.begin(6.0);
/// let u = brake.update(&mut braking, &State::new(1.1, 3.1, 6.0, 0.0), 1);
/// assert!(u < 0.0 && u >= -1.0); // a fifth of the limit after one period
/// assert_eq!(brake.update(&mut braking, &State::new(1.1, 3.1, -0.1, 0.0), 1), 0.0); // a reversal
/// assert!(braking.is_over());
/// # Ok::<(), &str>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Brake<T> {
    /// V s/rad.
    gain: T,
    /// V.
    limit: T,
    /// By how much the voltage rises in a period, V.
    rise: T,
    /// Length of the envelope, periods.
    periods: u32,
}

/// A braking under way.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Braking<T> {
    left: u32,
    /// The arm's speed at the beginning, rad/s.
    from: T,
    /// The last voltage's size, V.
    u: T,
}

impl<T: Real> Brake<T> {
    /// For a rig with these parameters, a largest voltage (V) and a sample period (s).
    #[must_use]
    pub fn new(params: &Params<f64>, command_limit: f64, period: f64) -> Self {
        let k = params.coefficients();
        // Without motor or mass there is nothing to brake with: no number, no braking.
        let gain = k.arm / (k.drive * PERIODS * period);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        // at most TIME over the shortest period; a cast saturates
        let periods = libm::ceil(TIME / period) as u32;
        Self {
            gain: T::from_f64(gain),
            limit: T::from_f64(command_limit),
            rise: T::from_f64(command_limit * period / RISE),
            periods,
        }
    }

    /// A brake that never brakes: the motor is off at once.
    #[must_use]
    pub fn none() -> Self {
        Self {
            gain: T::ZERO,
            limit: T::ZERO,
            rise: T::ZERO,
            periods: 0,
        }
    }

    /// Every number that its voltage depends on, by name.
    pub fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) {
        put("BRAKE_GAIN", Number::Real(&[self.gain]));
        put("BRAKE_LIMIT", Number::Real(&[self.limit]));
        put("BRAKE_RISE", Number::Real(&[self.rise]));
        put("BRAKE_FASTER", Number::Real(&[c(FASTER)]));
        put("BRAKE_PERIODS", Number::Whole(self.periods));
    }

    /// Longest braking, periods.
    #[must_use]
    pub fn periods(&self) -> u32 {
        self.periods
    }

    /// Begins, at this speed of the arm (rad/s).
    #[must_use]
    pub fn begin(&self, theta_dot: T) -> Braking<T> {
        Braking {
            left: self.periods,
            from: theta_dot,
            u: T::ZERO,
        }
    }

    /// The voltage (V) for one sample, `periods` after the one before. Once 0, and over, it stays 0.
    pub fn update(&self, state: &mut Braking<T>, x: &State<T>, periods: u32) -> T {
        state.left = state.left.saturating_sub(periods.max(1));
        let speed = x.theta_dot * sign(state.from);
        let slower = speed > T::ZERO && speed <= state.from.abs() * c(FASTER);
        if !(slower && is_finite(speed)) {
            state.left = 0;
        }
        if state.left == 0 {
            state.u = T::ZERO;
            return T::ZERO;
        }
        let envelope = self.limit * T::from_f64(f64::from(state.left) / f64::from(self.periods));
        let risen = state.u + self.rise * T::from_f64(f64::from(periods.max(1)));
        let u = least(least(self.gain * speed, envelope), risen);
        if !is_finite(u) {
            state.left = 0;
            state.u = T::ZERO;
            return T::ZERO;
        }
        state.u = u;
        -u * sign(state.from)
    }
}

impl<T: Real> Braking<T> {
    /// True from when on the motor is off.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.left == 0
    }
}

fn least<T: Real>(a: T, b: T) -> T {
    a.if_less(b, a, b)
}

fn sign<T: Real>(x: T) -> T {
    if x < T::ZERO { -T::ONE } else { T::ONE }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use furuta_model::Rig;

    fn brake() -> Brake<f64> {
        let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
        Brake::new(&rig.params, 5.0, 0.002)
    }

    #[test]
    fn an_arm_that_becomes_faster_is_let_go() {
        let brake = brake();
        let mut braking = brake.begin(5.0);
        let at = |speed| State::new(1.0, 3.0, speed, 0.0);
        assert!(brake.update(&mut braking, &at(5.0), 1) < 0.0);
        assert_eq!(brake.update(&mut braking, &at(6.1), 1), 0.0);
        // For good.
        assert_eq!(brake.update(&mut braking, &at(5.0), 1), 0.0);
    }

    #[test]
    fn none_brakes_nothing() {
        let none = Brake::<f64>::none();
        let mut braking = none.begin(5.0);
        assert!(braking.is_over());
        assert_eq!(
            none.update(&mut braking, &State::new(1.0, 3.0, 5.0, 0.0), 1),
            0.0
        );
    }

    proptest! {
        /// Whatever is measured: within the limit and the envelope, against the speed at which it began, never rising
        /// faster than it may, and 0 for good after its time or once it has been 0.
        #[test]
        fn it_ends_whatever_happens(
            from in prop::num::f64::ANY,
            speeds in prop::collection::vec((prop_oneof![prop::num::f64::ANY, -20.0..20.0f64], 0u32..5), 130..300),
        ) {
            let brake = brake();
            let mut braking = brake.begin(from);
            let (mut elapsed, mut before, mut over) = (0u32, 0.0f64, false);
            for (speed, periods) in speeds {
                let u = brake.update(&mut braking, &State::new(1.0, 0.0, speed, 0.0), periods);
                elapsed += periods.max(1);
                prop_assert!(u.is_finite() && u.abs() <= 5.0 * (1.0 - f64::from(elapsed.min(125)) / 125.0) + 1e-12);
                prop_assert!(u == 0.0 || u.signum() != speed.signum() && u.signum() != from.signum());
                prop_assert!(u.abs() <= before + f64::from(periods.max(1)) + 1e-12); // 5 V in five periods
                prop_assert!(!over || u == 0.0);
                over |= braking.is_over();
                prop_assert!(elapsed < 125 || over);
                before = u.abs();
            }
        }
    }
}
