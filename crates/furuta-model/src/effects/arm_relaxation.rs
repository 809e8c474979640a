//! Cable of the arm that relaxes: `-stiffness z, dz/dt = theta_dot - z/time_constant`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Relaxation, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Cable of the arm that relaxes: `-stiffness z, dz/dt = theta_dot - z/time_constant`.
    ArmRelaxation {
        /// Torque per radian of a fast motion, N m/rad.
        stiffness,
        /// In which the torque at a resting arm falls to 1/e, s.
        time_constant,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "arm.relaxation",
    name: "Cable of the arm that relaxes",
    law: "-stiffness z, dz/dt = theta_dot - z/time_constant",
    sentence: "A cable or a hose pulls back at first and then gives way: a spring in series with a dashpot (a \
        Maxwell element; with `arm.spring` beside it, a Zener element).",
    shows: "After a fast turn the arm is pulled back, and less and less while it stays; slow turns meet a drag.",
    experiment: "steps of the arm that are held for several seconds, against sweeps of several speeds",
    look_alikes: &["arm.spring", "arm.cable", "arm.presliding"],
    parameters: &[
        ParameterSpec {
            name: "stiffness",
            unit: "N m/rad",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e6,
            off: 0.0,
            typical: Typical::Of(|p| 0.3 * super::stall_torque(p)),
            starts: &[0.5],
        },
        ParameterSpec {
            name: "time_constant",
            unit: "s",
            kind: Kind::Real,
            default: None,
            min: 0.01,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|_| 0.5),
            starts: &[0.4, 2.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Like("arm.spring", "faster than its time constant it is a spring, slower a damping"),
    acts: Acts::INNER.and(Acts::ARM),
    at_rest: AtRest::LeftOut("at rest it has relaxed; what it adds in motion is not in the matrices"),
    own: None,
    offered: Offered::OnRequest("within its time constant it is a spring, beyond it viscous friction: short \
        recordings do not tell it from both"),
};

impl<S: Scalar> Law<S> for ArmRelaxation<S> {
    #[inline(always)]
    fn relaxation(&self) -> Relaxation<S> {
        Relaxation {
            stiffness: self.stiffness,
            time_constant: self.time_constant,
        }
    }
}
