//! End stops of the arm: `-stiffness d - damping d_dot`, `d` the depth beyond `angle` from `middle`.

use super::{Acts, AtRest, Footprint, EndStop, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// End stops of the arm: `-stiffness d - damping d_dot`, `d` the depth beyond `angle` from `middle`; they push and
    /// never pull.
    ArmStop {
        /// Torque per radian of indentation, N m/rad.
        stiffness,
        /// How far from the middle the arm meets them, rad.
        angle,
        /// Torque per rad/s of indentation, N m s/rad.
        damping,
        /// The arm's angle halfway between them, rad.
        middle,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.stop",
    name: "End stops of the arm",
    law: "-stiffness d - damping d_dot, d the depth beyond angle from middle; they push and never pull",
    sentence: "The arm meets a rubber on either side: a spring and a damper (Kelvin-Voigt) that push it back and \
        let go when they would have to pull.",
    shows: "The arm turns back at the same two angles whatever the motor does, and pushes the pendulum as it does; \
        between them nothing is wrong.",
    experiment: "slow pushes of the arm against either end, with the voltage that holds it there",
    look_alikes: &["arm.cable", "arm.spring", "disturbance.arm_kick"],
    parameters: &[
        ParameterSpec {
            name: "stiffness",
            unit: "N m/rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e6,
            off: 0.0,
            typical: Typical::Of(|p| 10.0 * super::stall_torque(p)),
            starts: &[0.5, 2.0],
        },
        ParameterSpec {
            name: "angle",
            unit: "rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.3),
            starts: &[1.0, 2.0, 4.0],
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
        ParameterSpec {
            name: "middle",
            unit: "rad",
            kind: Kind::Rest,
            default: Some(0.0),
            min: -100.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.3),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Nothing("small motions do not reach the stops"),
    acts: Acts::CONTACT.and(Acts::ANGLE),
    at_rest: AtRest::LeftOut("the arm is taken to rest between its stops"),
    own: None,
    offered: Offered::OnRequest("it acts only where the arm reached its stops, which whoever recorded has seen"),
};

impl<S: Scalar> Law<S> for ArmStop<S> {
    #[inline(always)]
    fn end_stop(&self) -> EndStop<S> {
        EndStop {
            stiffness: self.stiffness,
            angle: self.angle,
            damping: self.damping,
            middle: self.middle,
        }
    }
}
