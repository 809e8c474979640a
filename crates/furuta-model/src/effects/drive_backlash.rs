//! Backlash between rotor and arm (also called play): free of each other for `|rotor - arm| < gap/2`.

use super::{Acts, AtRest, Drive, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Backlash between rotor and arm: free of each other for `|rotor - arm| < gap/2`.
    DriveBacklash {
        /// Total backlash, rad of the arm.
        gap,
        /// Share of `arm.inertia` on the motor's side, 0 to 1.
        motor_share,
        /// Where the arm's encoder sits: 0 on the arm, 1 on the motor.
        encoder,
    }
}

/// Of every drive in which rotor and arm are two bodies: how the inertia is split.
pub(super) const MOTOR_SHARE: ParameterSpec = ParameterSpec {
    name: "motor_share",
    unit: "-",
    kind: Kind::Real,
    default: None,
    // A rotor that is lighter is a lag (`motor.lag`), and rings faster than samples follow.
    min: 0.02,
    max: 0.999,
    off: 0.0,
    typical: Typical::Of(|_| 0.5),
    starts: &[1.0],
};
/// Of every such drive: on which of the two the arm's encoder sits.
pub(super) const ENCODER: ParameterSpec = ParameterSpec {
    name: "encoder",
    unit: "-",
    kind: Kind::Choice(&["arm", "motor"]),
    default: Some(0.0),
    min: 0.0,
    max: 1.0,
    off: 0.0,
    typical: Typical::Of(|_| 1.0),
    starts: &[0.0, 1.0],
};

pub(super) const SPEC: Spec = Spec {
    id: "drive.backlash",
    name: "Backlash in the drive",
    law: "no torque between rotor and arm while |rotor - arm| < gap/2; beyond, they move as one",
    sentence: "The gear has play: after each reversal the motor turns a little before it takes the arm along.",
    shows: "At every change of the torque's sign the arm loses its drive for a moment; it rattles at balance.",
    experiment: "slow reversals of the arm with an encoder on either side, or the arm wiggled by hand at rest",
    look_alikes: &["motor.deadzone", "motor.lag", "arm.coulomb"],
    parameters: &[
        ParameterSpec {
            name: "gap",
            unit: "rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 3.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.03),
            starts: &[1.0],
        },
        MOTOR_SHARE,
        ENCODER,
    ],
    strengths: 1,
    footprint: Footprint::Like("drive.compliance", "by its describing function, backlash is a coupling that is \
        softer the smaller the motion"),
    acts: Acts::DRIVE.and(Acts::BLOWS),
    at_rest: AtRest::LeftOut("rotor and arm are taken to touch: its gain depends on the motion's size"),
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for DriveBacklash<S> {
    #[inline(always)]
    fn drive(&self) -> Drive<S> {
        Drive {
            gap: self.gap,
            motor_share: self.motor_share,
            encoder_on_motor: self.encoder.value() > 0.5,
            ..Drive::RIGID
        }
    }
}
