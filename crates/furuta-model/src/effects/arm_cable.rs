//! A real cable on the arm: `-(stiffness e + asymmetry e² + cubic e³)`, `e = theta - rest`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// A real cable on the arm: `-(stiffness e + asymmetry e² + cubic e³)`, `e = theta - rest`.
    ArmCable {
        /// Torque per radian near rest, N m/rad.
        stiffness,
        /// How much more it pulls to one side than to the other, N m/rad².
        asymmetry,
        /// How much it stiffens when wound up, N m/rad³.
        cubic,
        /// Angle at which it does not pull, rad.
        rest,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.cable",
    name: "Cable on the arm",
    law: "-(stiffness e + asymmetry e² + cubic e³), e = theta - rest",
    sentence: "The cable to the pendulum's encoder pulls the arm back: hardly at first, ever more as it is \
        wound up, and not alike on both sides.",
    shows: "The arm is pulled towards one angle, more than in proportion far away from it.",
    experiment: "slow arm sweeps over the whole range in both directions: the holding voltage over the \
        angle is the cable's law",
    look_alikes: &["arm.spring", "arm.tilt", "arm.cogging"],
    parameters: &[
        ParameterSpec {
            name: "stiffness",
            unit: "N m/rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.1 * super::stall_torque(p)),
            starts: &[0.5],
        },
        ParameterSpec {
            name: "asymmetry",
            unit: "N m/rad2",
            kind: Kind::Real,
            default: None,
            min: -1e3,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * super::stall_torque(p)),
            starts: &[0.0],
        },
        ParameterSpec {
            name: "cubic",
            unit: "N m/rad3",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.05 * super::stall_torque(p)),
            starts: &[0.5],
        },
        ParameterSpec {
            name: "rest",
            unit: "rad",
            kind: Kind::Rest,
            default: None,
            min: -100.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.3),
            starts: &[0.0],
        },
    ],
    strengths: 3,
    footprint: Footprint::Like("arm.spring", "about its rest a cable is a spring"),
    acts: Acts::TORQUE.and(Acts::ANGLE).and(Acts::ARM),
    at_rest: AtRest::Slope,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for ArmCable<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let e = at.x.theta - self.rest;
        let pull = e * (self.stiffness + e * (self.asymmetry + e * self.cubic));
        [-pull, S::ZERO]
    }
}
