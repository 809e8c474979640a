//! Dahl friction on the arm: `-stiffness z`, `dz/dt = theta_dot (1 - stiffness z sign(theta_dot)/torque)`.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Dahl friction on the arm: `-stiffness z`, `dz/dt = theta_dot (1 - stiffness z sign(theta_dot)/torque)`.
    ArmPresliding {
        /// Friction of a sliding arm, N m.
        torque,
        /// Torque per radian before it slides, N m/rad.
        stiffness,
    }
}

/// Friction of a sliding arm.
pub(super) const TORQUE: ParameterSpec = ParameterSpec {
    name: "torque",
    unit: "N m",
    kind: Kind::Real,
    default: None,
    min: 0.0,
    max: 1e3,
    off: 0.0,
    typical: Typical::Of(|p| 0.1 * super::stall_torque(p)),
    starts: &[0.5, 0.05],
};

/// Of bristles before it slides.
pub(super) const STIFFNESS: ParameterSpec = ParameterSpec {
    name: "stiffness",
    unit: "N m/rad",
    kind: Kind::Real,
    default: None,
    min: 1e-9,
    max: 1e6,
    off: 0.0,
    typical: Typical::Of(|p| 2.0 * super::stall_torque(p)),
    // The last is a cable that rubs and bends: it gives way over a quarter of a radian, not over milliradians
    // as a bearing does.
    starts: &[0.5, 4.0, 0.02],
};

pub(super) const SPEC: Spec = Spec {
    id: "arm.presliding",
    name: "Presliding (Dahl) friction on the arm",
    law: "-stiffness z, dz/dt = theta_dot (1 - stiffness z sign(theta_dot)/torque)",
    sentence: "Before the arm slides, its bearings and brushes bend like bristles: a spring at first, \
        Coulomb friction after a short way.",
    shows: "Small motions feel a spring, large ones friction; after each reversal the friction builds up \
        over a short way.",
    experiment: "sweeps of several small amplitudes across the same angle: the loop of torque over angle \
        grows with the way",
    look_alikes: &["arm.coulomb", "arm.spring", "motor.lag", "arm.lugre"],
    parameters: &[TORQUE, STIFFNESS],
    strengths: 1,
    footprint: Footprint::Like("arm.spring", "before it slides, friction is a spring; when it slides, a damping"),
    acts: Acts::TORQUE.and(Acts::MEMORY).and(Acts::SHAFT),
    at_rest: AtRest::Friction("a spring before it slides, dry friction when it does"),
    own: None,
    offered: Offered::Always,
};

/// Bristles' bend (rad) after the arm has travelled (rad) on, `most` being that of a sliding arm, `torque/stiffness`.
/// Over a way without reversal the law is solved exactly: the bend tends to `±most` as `exp(-travel/most)`, whatever
/// the speed.
#[inline(always)]
pub(super) fn bend_after<S: Scalar>(most: S, bend: S, travel: S) -> S {
    if most.real() <= S::Real::ZERO {
        return most;
    }
    let end = travel.if_less(S::ZERO, -most, most);
    end + (bend - end) * (-(travel.abs() / most)).exp()
}

impl<S: Scalar> Law<S> for ArmPresliding<S> {
    #[inline(always)]
    fn travelled(&self, bend: S, travel: S) -> S {
        bend_after(self.torque / self.stiffness, bend, travel)
    }

    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        [-(self.stiffness * at.memory), S::ZERO]
    }
}
