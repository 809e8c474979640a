//! A flexible coupling between rotor and arm: `stiffness (rotor - arm) + damping (rotor_dot - arm_dot)`.

use super::drive_backlash::{ENCODER, MOTOR_SHARE};
use super::{Acts, AtRest, Drive, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// A flexible coupling between rotor and arm: `stiffness (rotor - arm) + damping (rotor_dot - arm_dot)`.
    DriveCompliance {
        /// Torque per radian of twist, N m/rad; 0 stands for a rigid coupling.
        stiffness,
        /// Torque per rad/s of twist, N m s/rad.
        damping,
        /// Share of `arm.inertia` on the motor's side, 0 to 1.
        motor_share,
        /// Where the arm's encoder sits: 0 on the arm, 1 on the motor.
        encoder,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "drive.compliance",
    name: "Flexible coupling in the drive",
    law: "stiffness (rotor - arm) + damping (rotor_dot - arm_dot) between rotor and arm",
    sentence: "Shaft, belt or coupling between motor and arm twist like a spring: the arm follows late and rings.",
    shows: "Fast commands make the arm ring at one frequency; slow ones show nothing.",
    experiment: "short pulses of the command, or a chirp through the ringing's frequency, recorded at the highest rate",
    look_alikes: &["motor.lag", "drive.backlash"],
    parameters: &[
        ParameterSpec {
            name: "stiffness",
            unit: "N m/rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e6,
            off: 0.0,
            typical: Typical::Of(|p| 20.0 * super::stall_torque(p)),
            starts: &[0.3, 1.0, 3.0],
        },
        ParameterSpec {
            name: "damping",
            unit: "N m s/rad",
            kind: Kind::Real,
            default: Some(0.0),
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.02 * super::stall_torque(p)),
            starts: &[0.5],
        },
        MOTOR_SHARE,
        ENCODER,
    ],
    strengths: 1,
    footprint: Footprint::Own(&["stiffness", "damping", "motor_share"]),
    acts: Acts::DRIVE.and(Acts::BACKWARDS),
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for DriveCompliance<S> {
    #[inline(always)]
    fn drive(&self) -> Drive<S> {
        Drive {
            stiffness: self.stiffness,
            damping: self.damping,
            motor_share: self.motor_share,
            encoder_on_motor: self.encoder.value() > 0.5,
            ..Drive::RIGID
        }
    }
}
