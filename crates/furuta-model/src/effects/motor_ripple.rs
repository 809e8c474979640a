//! Ripple of the motor's torque constant: `motor torque -> (1 + amplitude sin(order theta + phase)) * motor torque`.

use super::{Acts, AtRest, BaseParameter, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Ripple of the motor's torque constant: a torque of `amplitude sin(order theta + phase)` of what the voltage
    /// gives.
    ///
    /// What the speed takes of the current ripples as well, through both constants of the motor. It is left out: a rig
    /// is fitted with one damping of the arm, in which back-EMF and viscous friction are not told apart. Where the
    /// back-EMF takes a tenth of the voltage, the ripple is a fifth smaller than this.
    MotorRipple {
        /// Largest change, a share of the constant, -.
        amplitude,
        /// How often per turn of the arm, a whole number.
        order,
        /// Where in the turn, rad.
        phase,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "motor.ripple",
    name: "Torque ripple of the motor",
    law: "drive * u * amplitude sin(order theta + phase) added to the motor's torque",
    sentence: "The current changes from one winding to the next as the motor turns: the same voltage turns \
        the arm a little harder at some angles than at others.",
    shows: "The error repeats with the arm's angle and changes sign with the voltage; without a voltage there is none.",
    experiment: "slow turns from stop to stop under two loads: a ripple grows with the voltage, cogging does not",
    look_alikes: &["arm.cogging", "motor.asymmetry", "arm.cable"],
    parameters: &[
        ParameterSpec {
            name: "amplitude",
            unit: "-",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1.0,
            off: 0.0,
            typical: Typical::Of(|_| 0.1),
            starts: &[0.3],
        },
        // Brushes that pass n segments commutate 2n times a turn where n is odd, n times where it is even: an even
        // number either way, from three segments to twenty.
        ParameterSpec {
            name: "order",
            unit: "-",
            kind: Kind::Whole,
            default: None,
            min: 0.0,
            max: 1000.0,
            off: 0.0,
            typical: Typical::Of(|_| 2.0),
            // A pulley or a magnet off its axis gives the low ones, the windings the even ones above.
            starts: &[
                0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0,
                15.0, 16.0, 17.0, 18.0, 19.0, 20.0,
            ],
        },
        ParameterSpec {
            name: "phase",
            unit: "rad",
            kind: Kind::Phase,
            default: Some(0.0),
            min: -100.0,
            max: 100.0,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[0.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::Refitted(
        BaseParameter::MotorGain,
        "about one angle of the arm the gain is another: measure about two",
    ),
    acts: Acts::TORQUE.and(Acts::ANGLE).and(Acts::SHAFT),
    at_rest: AtRest::WITHIN_A_TOOTH,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for MotorRipple<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let (sin, _) = (self.order * at.x.theta + self.phase).sin_cos();
        [self.amplitude * sin * at.coefficients.drive * at.volts, S::ZERO]
    }
}
