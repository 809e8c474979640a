//! Describing functions: what friction and voltage maps without a slope are to a sine of a given amplitude.
//!
//! For a speed `A sin(phi)` a friction torque `F` against it is, in its first harmonic, the damping
//! `2/(pi A) integral_0^pi F(A sin phi) sin(phi) dphi`: `4 F/(pi A)` for dry friction, `8 c A/(3 pi)` for quadratic
//! drag. For a command `u + A sin(phi)` a voltage map `f` is the gain `1/(pi A) integral_0^2pi f(u + A sin phi)
//! sin(phi) dphi`.

use super::hold::Equilibrium;
use crate::dynamics::Angle;
use crate::effects::{AtRest, Clock, Effect, Instant, Law};
use crate::plant::Plant;

/// For which sines friction and voltage maps are described; 0: not at all.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Amplitudes {
    /// Of the arm's speed, rad/s.
    pub arm_speed: f64,
    /// Of the pendulum's speed, rad/s.
    pub pendulum_speed: f64,
    /// Of the command, V.
    pub command: f64,
}

impl Amplitudes {
    /// Nothing is described.
    pub const NONE: Self = Self {
        arm_speed: 0.0,
        pendulum_speed: 0.0,
        command: 0.0,
    };
}

/// What all effects together are by their describing functions.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Described {
    /// N m s/rad.
    pub(super) arm_damping: f64,
    /// N m s/rad.
    pub(super) pendulum_damping: f64,
    /// Volts at the motor per volt of command, of the maps without a slope.
    pub(super) gain: f64,
}

impl Described {
    /// What an effect's friction comes to, with all others on its axis; `None` where no speed of that axis is given.
    pub(super) fn damping_by(
        &self,
        plant: &Plant<f64>,
        effect: &Effect<f64>,
        at: &Equilibrium,
        amplitudes: &Amplitudes,
    ) -> Option<f64> {
        let axes = [
            (amplitudes.arm_speed, self.arm_damping),
            (amplitudes.pendulum_speed, self.pendulum_damping),
        ];
        axes.into_iter()
            .enumerate()
            .find(|(axis, (amplitude, _))| friction(plant, effect, at, *axis, *amplitude) != 0.0)
            .map(|(_, (_, value))| value)
    }
}

/// Of all effects of a plant about `at`.
pub(super) fn described(
    plant: &Plant<f64>,
    at: &Equilibrium,
    amplitudes: &Amplitudes,
) -> Described {
    let damping = |axis, amplitude| {
        let effects = plant.effects().iter();
        effects
            .map(|e| friction(plant, e, at, axis, amplitude))
            .sum()
    };
    let kinked = plant.retaining(|e| matches!(e.spec().at_rest, AtRest::Kinked(_)));
    Described {
        arm_damping: damping(0, amplitudes.arm_speed),
        pendulum_damping: damping(1, amplitudes.pendulum_speed),
        gain: gain(&kinked, at.command, amplitudes.command),
    }
}

/// The damping (N m s/rad) that an effect is to this axis (0: arm, 1: pendulum) at an amplitude (rad/s) of its speed; 0
/// where it is no friction or none is asked for.
pub(super) fn friction(
    plant: &Plant<f64>,
    effect: &Effect<f64>,
    at: &Equilibrium,
    axis: usize,
    amplitude: f64,
) -> f64 {
    if !(matches!(effect.spec().at_rest, AtRest::Friction(_)) && amplitude > 0.0) {
        return 0.0;
    }
    // A way after which any bristle slides.
    const FAR: f64 = 1e6;
    let torque = |speed: f64| {
        let mut x = at.x;
        if axis == 0 {
            x.theta_dot = speed;
        } else {
            x.alpha_dot = speed;
        }
        let at = Instant {
            clock: Clock::at(0.0),
            x: &x,
            angle: Angle::of(x.alpha),
            coefficients: &plant.coefficients,
            memory: effect.travelled(0.0, FAR),
            volts: at.volts,
        };
        effect.dry_friction(&at)[axis] - effect.torque(&at)[axis]
    };
    // With c = cos(phi): 2/(pi A) times the integral of F(A sqrt(1 - c^2)) over c from -1 to 1; even in c.
    let speed = |c: f64| amplitude * libm::sqrt(1.0 - c * c);
    4.0 / (core::f64::consts::PI * amplitude) * gauss(|c| torque(speed(c)))
}

/// The gain of the voltage maps about `command` for an amplitude (V) of it; 1 where none is asked for.
fn gain(kinked: &Plant<f64>, command: f64, amplitude: f64) -> f64 {
    if amplitude <= 0.0 || kinked.effects().is_empty() {
        return 1.0;
    }
    const POINTS: u32 = 4096;
    let step = core::f64::consts::TAU / f64::from(POINTS);
    let sum: f64 = (0..POINTS)
        .map(|i| {
            let sine = libm::sin((f64::from(i) + 0.5) * step);
            kinked.volts(command + amplitude * sine) * sine
        })
        .sum();
    sum * step / (core::f64::consts::PI * amplitude)
}

/// The integral over 0 to 1 by Gauss's rule of two points on many panels.
fn gauss(f: impl Fn(f64) -> f64) -> f64 {
    const PANELS: u32 = 512;
    let width = 1.0 / f64::from(PANELS);
    let off = 0.5 / libm::sqrt(3.0);
    let sum: f64 = (0..PANELS)
        .map(|i| {
            let middle = f64::from(i) + 0.5;
            f((middle - off) * width) + f((middle + off) * width)
        })
        .sum();
    0.5 * sum * width
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;
    use crate::state::State;
    use core::f64::consts::PI;

    fn damping(id: &str, values: &[f64], axis: usize, amplitude: f64) -> f64 {
        let params = Rig::builtin("qube-servo-2").expect("built in").params;
        let effect = Effect::new(id, values).expect("sound");
        let plant = Plant::new(&params, &[effect]).expect("sound");
        let rest = Equilibrium {
            x: State::upright(),
            volts: 0.0,
            command: 0.0,
            rotor: 0.0,
        };
        friction(&plant, &effect, &rest, axis, amplitude)
    }

    #[test]
    fn friction_as_in_textbooks() {
        let close = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
        };
        close(
            damping("arm.coulomb", &[0.02], 0, 0.5),
            4.0 * 0.02 / (PI * 0.5),
        );
        close(
            damping("arm.presliding", &[0.02, 5.0], 0, 0.5),
            4.0 * 0.02 / (PI * 0.5),
        );
        close(
            damping("arm.quadratic", &[1e-3], 0, 3.0),
            8.0 * 1e-3 * 3.0 / (3.0 * PI),
        );
        close(
            damping("pendulum.quadratic", &[1e-4], 1, 3.0),
            8.0 * 1e-4 * 3.0 / (3.0 * PI),
        );
        // Far below its speed, Stribeck friction is its static torque; far above, the other.
        close(
            damping("arm.stribeck", &[0.01, 0.02, 1e2], 0, 1e-2),
            4.0 * 0.02 / (PI * 1e-2),
        );
        assert_eq!(damping("arm.coulomb", &[0.02], 1, 0.5), 0.0);
        assert_eq!(damping("arm.coulomb", &[0.02], 0, 0.0), 0.0);
    }

    #[test]
    fn a_dead_zone_as_in_textbooks() {
        let params = Rig::builtin("qube-servo-2").expect("built in").params;
        let zone = Effect::new("motor.deadzone", &[0.4]).expect("sound");
        let plant = Plant::new(&params, &[zone]).expect("sound");
        // K. Astrom, B. Wittenmark: 1 - 2/pi (asin r + r sqrt(1 - r^2)), r = zone/amplitude.
        let r: f64 = 0.4 / 1.5;
        let expected = 1.0 - 2.0 / PI * (r.asin() + r * (1.0 - r * r).sqrt());
        let found = gain(&plant, 0.0, 1.5);
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        assert_eq!(gain(&plant, 0.0, 0.0), 1.0);
    }
}
