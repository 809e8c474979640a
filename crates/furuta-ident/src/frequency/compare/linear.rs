//! The hanging rig as a linear system with effects: `(M s² + D s + K) q = drive u`, solved line by line.

use furuta_model::params::Coefficients;
use nalgebra::Complex;

use super::super::first_principles::Output;

/// What linear effects add to the rig.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Effects {
    /// `arm.spring`, N m/rad.
    pub(super) arm_spring: f64,
    /// `arm.tilt`, rad.
    pub(super) tilt: f64,
    /// `pendulum.spring`, N m/rad.
    pub(super) pendulum_spring: f64,
    /// `motor.lag`, s.
    pub(super) lag: f64,
    /// `motor.delay` and `sensor.delay`, s.
    pub(super) delay: f64,
    /// `drive.compliance`: stiffness (N m/rad), damping (N m s/rad), the motor's share of the arm's inertia.
    pub(super) compliance: Option<[f64; 3]>,
}

/// Angle over voltage at `s` (rad/s), about the pendulum hanging; under a tilt the arm rests where it points downhill.
pub(super) fn response(
    c: &Coefficients<f64>,
    effects: &Effects,
    output: Output,
    s: Complex<f64>,
) -> Complex<f64> {
    let (lean, upright) = effects.tilt.sin_cos();
    let square = s * s;
    // Hanging, cos(alpha) = -1: M12 = +m L_r c.
    let coupling = square * c.coupling + c.weight * lean;
    let pendulum = square * c.pendulum
        + s * c.pendulum_damping
        + (c.weight * upright + effects.pendulum_spring);
    let pull = effects.arm_spring + c.lever * lean;
    let torque = Complex::new(c.drive, 0.0) * (-s * effects.delay).exp() / (s * effects.lag + 1.0);
    // What the arm's own axis asks for, and what of the motor's torque reaches it.
    let (arm, torque) = match effects.compliance {
        None => (square * c.arm + s * c.arm_damping + pull, torque),
        Some([stiffness, damping, share]) => {
            let rotor = share * c.hub;
            let shaft = s * damping + stiffness;
            let inner = square * rotor + s * c.arm_damping + shaft;
            let load = square * (c.arm - rotor) + pull + shaft;
            (load - shaft * shaft / inner, torque * shaft / inner)
        }
    };
    let determinant = arm * pendulum - coupling * coupling;
    match output {
        Output::Theta => torque * pendulum / determinant,
        Output::Alpha => -torque * coupling / determinant,
    }
}
