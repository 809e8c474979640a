//! Eccentric encoder of the arm: `measured theta = theta + amplitude sin(theta + phase)`.

use super::{Acts, AtRest, Footprint, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::transfer::Output;
use crate::scalar::Scalar;

parameters! {
    /// Eccentric encoder of the arm: `measured theta = theta + amplitude sin(theta + phase)`.
    SensorThetaEccentricity {
        /// Largest error, rad.
        amplitude,
        /// Where in the turn, rad.
        phase,
    }
}

/// Of every eccentric encoder: its largest error.
pub(super) const AMPLITUDE: ParameterSpec = ParameterSpec {
    name: "amplitude",
    unit: "rad",
    kind: Kind::Real,
    default: None,
    min: 0.0,
    max: 1.0,
    off: 0.0,
    typical: Typical::Of(|_| 0.05),
    starts: &[0.5],
};
/// Of everything that repeats with a turn and is found at few places of it: where in the turn.
pub(super) const PHASE: ParameterSpec = ParameterSpec {
    name: "phase",
    unit: "rad",
    kind: Kind::Phase,
    default: Some(0.0),
    min: -100.0,
    max: 100.0,
    off: 0.0,
    typical: Typical::Of(|_| 1.0),
    starts: &[0.0, 1.6, 3.1, -1.6],
};

pub(super) const SPEC: Spec = Spec {
    id: "sensor.theta.eccentricity",
    name: "Eccentric encoder of the arm",
    law: "measured theta = theta + amplitude sin(theta + phase)",
    sentence: "The encoder's disc does not sit on the axis: it counts too fast on one side of the turn and too \
        slowly on the other.",
    shows: "The measured angle is wrong by the same amount whenever the arm comes to the same place, once per turn, \
        whatever moves it.",
    experiment: "the arm turned by hand over a whole turn against marks, or slow turns both ways",
    look_alikes: &["sensor.theta.scale", "arm.cogging", "arm.tilt"],
    parameters: &[AMPLITUDE, PHASE],
    strengths: 1,
    footprint: Footprint::Scale(Output::Theta),
    acts: Acts::DISC.and(Acts::ANGLE),
    at_rest: AtRest::READING,
    own: None,
    offered: Offered::OnRequest("over a part of a turn it is a scale and an offset of the encoder"),
};

impl<S: Scalar> Law<S> for SensorThetaEccentricity<S> {
    #[inline(always)]
    fn disc(&self, [theta, _]: [S; 2]) -> [S; 2] {
        let (sin, _) = (theta + self.phase).sin_cos();
        [self.amplitude * sin, S::ZERO]
    }
}
