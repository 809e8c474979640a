//! The voltage against the arm's dry friction.

use super::hold::acceleration;
use crate::real::{Real, c};
use furuta_model::{Plant, State};

/// Periods over which the arm's motion is looked ahead, to see which way friction will act.
const AHEAD: f64 = 4.0;
/// Share of the friction's own voltage by which the arm has to be driven until all of it is made up for.
const SOFT: f64 = 0.25;

/// What makes up for dry friction.
///
/// Friction acts against the motion, and against what would move an arm at rest; so the direction is taken from the
/// speed `w` that the arm would have a few periods later if there were none: `u += level * sat(w / w0)`. By the speed
/// alone an arm at rest would get no help to come loose, by the command alone a moving one would be pushed the wrong
/// way whenever it brakes. `w0`, what a quarter of the friction's voltage does meanwhile, makes the change of direction
/// soft: an arm at rest needs about a fifth of the voltage that it needs by itself.
#[derive(Clone, Debug)]
pub(super) struct Friction<T> {
    /// Voltage of the friction at low speed, V.
    level: T,
    /// s.
    ahead: T,
    /// rad/s.
    full: T,
}

impl<T: Real> Friction<T> {
    /// For `share` of the friction in `plant`, of which `smooth` is the one without; `slow` (rad/s) is a speed at which
    /// it counts. `None` where there is none.
    pub(super) fn new(
        plant: &Plant<f64>,
        smooth: &Plant<f64>,
        slow: f64,
        period: f64,
        share: f64,
    ) -> Option<Self> {
        let x = State::new(0.0, 0.0, slow, 0.0);
        let still = State::upright();
        let per_volt = acceleration(smooth, &still, 1.0) - acceleration(smooth, &still, 0.0);
        // Stopping within a sample of a thousandth of the period would take more than any friction.
        let rubbed = plant.rate(0.0, &x, 0.0, 1e3 / period).theta_dot;
        let level = share * (acceleration(smooth, &x, 0.0) - rubbed) / per_volt;
        let ahead = AHEAD * period;
        let full = SOFT * level * per_volt * ahead;
        (level > 0.0 && full.is_finite() && full > 0.0).then(|| Self {
            level: T::from_f64(level),
            ahead: T::from_f64(ahead),
            full: T::from_f64(full),
        })
    }

    /// Level (V), time looked ahead (s), speed of full help (rad/s).
    pub(super) fn numbers(&self) -> [T; 3] {
        [self.level, self.ahead, self.full]
    }

    /// What to add to the voltage `volts` in the state `x`, V.
    pub(super) fn voltage(&self, smooth: &Plant<T>, x: &State<T>, volts: T) -> T {
        let later = x.theta_dot + acceleration(smooth, x, volts) * self.ahead;
        self.level * (later / self.full).clamp(-T::ONE, c(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furuta_model::{Effect, Rig};

    #[test]
    fn the_level_is_that_of_the_friction_and_the_direction_that_of_the_motion() {
        let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
        let torque = 0.02;
        let effect = Effect::new("arm.coulomb", &[torque]).expect("an effect");
        let plant = Plant::new(&rig.params, &[effect]).expect("possible");
        let smooth = Plant::new(&rig.params, &[]).expect("possible");
        let friction =
            Friction::<f64>::new(&plant, &smooth, 0.1, 0.002, 1.0).expect("there is some");
        let level = torque / rig.params.coefficients().drive;
        assert!((friction.level - level).abs() < 1e-9 * level);
        let at = |speed: f64, volts: f64| {
            friction.voltage(&smooth, &State::new(0.0, 0.0, speed, 0.0), volts)
        };
        assert_eq!(at(0.0, 0.0), 0.0);
        // Moving: with the motion, also while it brakes.
        assert!((at(1.0, 0.0) - level).abs() < 1e-9 && (at(-1.0, 1.0) + level).abs() < 1e-9);
        // At rest: with the command, all of it from a quarter of the friction's voltage on.
        assert!((at(0.0, 0.26 * level) - level).abs() < 1e-9);
        assert!((at(0.0, -0.1 * level) + 0.4 * level).abs() < 1e-3 * level);
        assert!(Friction::<f64>::new(&smooth, &smooth, 0.1, 0.002, 1.0).is_none());
        assert!(Friction::<f64>::new(&plant, &smooth, 0.1, 0.002, 0.0).is_none());
    }
}
