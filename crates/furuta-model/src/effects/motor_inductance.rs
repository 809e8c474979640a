//! Inductance of the motor: `time_constant di/dt = u - e theta_dot - i`, the motor's torque `drive i`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical, Winding};
use crate::scalar::Scalar;

parameters! {
    /// Inductance of the motor: `time_constant di/dt = u - e theta_dot - i`, the motor's torque `drive i`, with
    /// `e = back_emf arm_damping/drive`; `i` (V) is the current times the resistance.
    MotorInductance {
        /// Inductance over resistance, s.
        time_constant,
        /// The part of the arm's damping that is back-EMF, 0 to 1.
        back_emf,
    }
}

/// The part of the arm's damping that is back-EMF.
pub(super) const BACK_EMF: ParameterSpec = ParameterSpec {
    name: "back_emf",
    unit: "-",
    kind: Kind::Share,
    default: Some(1.0),
    min: 0.0,
    max: 1.0,
    off: 0.0,
    typical: Typical::Of(|_| 1.0),
    starts: &[1.0],
};

pub(super) const SPEC: Spec = Spec {
    id: "motor.inductance",
    name: "Inductance of the motor",
    law: "motor torque drive i, time_constant di/dt = u - e theta_dot - i, e = back_emf arm_damping/drive",
    sentence: "The current follows the voltage less the back-EMF only after the winding's time constant (inductance \
        over resistance).",
    shows: "Fast commands act late, and the motor's own braking comes late as well: fast motions are damped less \
        than slow ones.",
    experiment: "commands that alternate every few samples, with the arm fast and with the arm at rest",
    look_alikes: &["motor.lag", "motor.delay", "drive.compliance"],
    parameters: &[
        ParameterSpec {
            name: "time_constant",
            unit: "s",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 10.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.01),
            starts: &[0.3, 2.0],
        },
        BACK_EMF,
    ],
    strengths: 1,
    footprint: Footprint::Like(
        "motor.lag",
        "where back-EMF takes little of the voltage, a late current is a late voltage",
    ),
    acts: Acts::INNER.and(Acts::CURRENT),
    at_rest: AtRest::LeftOut("the current is taken to follow at once"),
    own: None,
    offered: Offered::OnRequest("small motors have a millisecond, and beyond that a lag of the voltage explains \
        nearly the same"),
};

impl<S: Scalar> Law<S> for MotorInductance<S> {
    #[inline(always)]
    fn winding(&self) -> Winding<S> {
        Winding {
            time_constant: self.time_constant,
            back_emf: self.back_emf,
        }
    }
}
