//! LuGre friction on the arm at a constant level: `-stiffness z - damping dz/dt`,
//! `dz/dt = theta_dot (1 - stiffness z sign(theta_dot)/torque)`.

use super::arm_presliding::{STIFFNESS, TORQUE, bend_after};
use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// LuGre friction on the arm at a constant level: `-stiffness z - damping dz/dt`,
    /// `dz/dt = theta_dot (1 - stiffness z sign(theta_dot)/torque)`.
    ArmLugre {
        /// Friction of a sliding arm, N m.
        torque,
        /// Torque per radian before it slides, N m/rad.
        stiffness,
        /// Of the bristles while they bend, N m s/rad.
        damping,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.lugre",
    name: "Presliding friction with damped bristles (LuGre) on the arm",
    law: "-stiffness z - damping dz/dt, dz/dt = theta_dot (1 - stiffness z sign(theta_dot)/torque)",
    sentence: "Before the arm slides, its bearings and brushes bend like bristles with a damper each: a spring and \
        viscous friction at first, Coulomb friction after a short way (C. Canudas de Wit et al., IEEE TAC 40, 1995, \
        419, at one level of friction; sigma0 is stiffness, sigma1 damping, sigma2 the arm's viscous friction).",
    shows: "As presliding friction; while it sticks, the arm's small motions die out faster than bristles alone \
        would let them, and after a reversal the friction is there at once, in proportion to the speed.",
    experiment: "sweeps of several small amplitudes and rates across the same angle: the loop of torque over angle \
        widens with the rate before the arm slides",
    look_alikes: &["arm.presliding", "arm.coulomb", "arm.stribeck"],
    parameters: &[
        TORQUE,
        // A cable that gives way over a quarter of a radian has no dampers.
        ParameterSpec { starts: &[0.5, 4.0], ..STIFFNESS },
        ParameterSpec {
            name: "damping",
            unit: "N m s/rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            // Half of what is critical on bristles of typical stiffness.
            typical: Typical::Of(|p| libm::sqrt(2.0 * super::stall_torque(p) * p.coefficients().hub)),
            starts: &[0.5],
        },
    ],
    strengths: 1,
    footprint: Footprint::Like("arm.spring", "before it slides, friction is a spring; when it slides, a damping"),
    acts: Acts::TORQUE.and(Acts::MEMORY).and(Acts::SHAFT),
    at_rest: AtRest::Friction("a spring with a damper before it slides, dry friction when it does"),
    own: None,
    offered: Offered::OnRequest("it has one number more than presliding friction, which data show only where the arm \
        often turns before it slides"),
};

impl<S: Scalar> Law<S> for ArmLugre<S> {
    /// The bristles' bend, as that of Dahl's: their damper does not change it.
    #[inline(always)]
    fn travelled(&self, bend: S, travel: S) -> S {
        bend_after(self.torque / self.stiffness, bend, travel)
    }

    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let (bend, speed) = (at.memory, at.x.theta_dot);
        let share = self.stiffness * bend / self.torque;
        let rate = speed - speed.abs() * share;
        [-(self.stiffness * bend + self.damping * rate), S::ZERO]
    }
}
