//! The hanging rig as a linear system with effects: `(M s² + D s + K) q = drive u`, solved line by line.

use furuta_model::dynamics::Angle;
use furuta_model::effects::{Clock, Drive, Instant, Law, Resonance};
use furuta_model::params::Coefficients;
use furuta_model::{Effect, Jet, State};
use nalgebra::Complex;
use std::f64::consts::PI;

use super::super::first_principles::Output;

/// The rig about the pendulum hanging and the arm at 0: coefficients, stiffness, and what delays the command.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    c: Coefficients<f64>,
    /// Torque that pulls back, by angle (columns) and axis (rows).
    stiffness: [[f64; 2]; 2],
    lags: Vec<f64>,
    rings: Vec<Resonance<f64>>,
    delay: f64,
    drive: Drive<f64>,
}

impl Linear {
    /// A rig with these effects, by their own laws.
    pub(super) fn new(c: Coefficients<f64>, effects: &[Effect<f64>]) -> Self {
        let mut linear = Self {
            c: effects.iter().fold(c, |c, e| e.shape(c)),
            stiffness: [[0.0; 2], [0.0, c.weight]],
            lags: effects.iter().map(Law::lag).filter(|l| *l > 0.0).collect(),
            rings: (effects.iter().map(Law::resonance))
                .filter(|r| r.period > 0.0)
                .collect(),
            delay: effects.iter().map(|e| e.delay() + e.sensor_delay()).sum(),
            drive: Drive::RIGID,
        };
        for effect in effects {
            let drive = effect.drive();
            if drive.stiffness > 0.0 {
                linear.drive = drive;
            }
            for (row, pull) in linear.stiffness.iter_mut().zip(pull(&c, effect)) {
                for (k, p) in row.iter_mut().zip(pull) {
                    *k += p;
                }
            }
        }
        linear
    }

    /// Angle over voltage at `s` (rad/s).
    pub(super) fn response(&self, output: Output, s: Complex<f64>) -> Complex<f64> {
        let (c, k) = (&self.c, &self.stiffness);
        let square = s * s;
        // Hanging, cos(alpha) = -1: M12 = +m L_r c.
        let upper = square * c.coupling + k[0][1];
        let lower = square * c.coupling + k[1][0];
        let pendulum = square * c.pendulum + s * c.pendulum_damping + k[1][1];
        let late: Complex<f64> = self.lags.iter().map(|lag| s * lag + 1.0).product();
        let ringing = |r: &Resonance<f64>| {
            let follows = s * r.decay() + r.rate() * r.rate();
            follows / (square + follows)
        };
        let rings: Complex<f64> = self.rings.iter().map(ringing).product();
        let torque = rings * c.drive * (-s * self.delay).exp() / late;
        // What the arm's own axis asks for, and what of the motor's torque reaches it.
        let (arm, torque) = if self.drive.stiffness > 0.0 {
            let rotor = self.drive.motor_share * c.hub;
            let shaft = s * self.drive.damping + self.drive.stiffness;
            let inner = square * rotor + s * c.arm_damping + shaft;
            let load = square * (c.arm - rotor) + k[0][0] + shaft;
            (load - shaft * shaft / inner, torque * shaft / inner)
        } else {
            (square * c.arm + s * c.arm_damping + k[0][0], torque)
        };
        let determinant = arm * pendulum - upper * lower;
        match output {
            Output::Theta => torque * pendulum / determinant,
            Output::Alpha => -torque * lower / determinant,
        }
    }
}

/// How strongly an effect pulls back, by axis and angle (N m/rad).
fn pull(c: &Coefficients<f64>, effect: &Effect<f64>) -> [[f64; 2]; 2] {
    type Slope = Jet<f64, 2>;
    let constant = Slope::constant;
    let values: Vec<Slope> = effect.values().iter().map(|v| constant(*v)).collect();
    let Ok(effect) = Effect::<Slope>::new(effect.spec().id, &values) else {
        return [[0.0; 2]; 2];
    };
    let x = State::new(
        Slope::variable(0.0, 0),
        Slope::variable(PI, 1),
        constant(0.0),
        constant(0.0),
    );
    let torque = effect.torque(&Instant {
        clock: Clock::at(constant(0.0)),
        x: &x,
        angle: Angle::of(x.alpha),
        coefficients: &c.cast(),
        memory: constant(0.0),
        volts: constant(0.0),
    });
    torque.map(|t| t.d.map(|slope| -slope))
}
