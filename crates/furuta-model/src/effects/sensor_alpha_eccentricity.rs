//! Eccentric encoder of the pendulum: `measured alpha = alpha + amplitude sin(alpha + phase)`.

use super::sensor_theta_eccentricity::{AMPLITUDE, PHASE};
use super::{Acts, AtRest, Footprint, Law, Offered, Spec};
use crate::transfer::Output;
use crate::scalar::Scalar;

parameters! {
    /// Eccentric encoder of the pendulum: `measured alpha = alpha + amplitude sin(alpha + phase)`.
    SensorAlphaEccentricity {
        /// Largest error, rad.
        amplitude,
        /// Where in the turn, rad.
        phase,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "sensor.alpha.eccentricity",
    name: "Eccentric encoder of the pendulum",
    law: "measured alpha = alpha + amplitude sin(alpha + phase)",
    sentence: "The encoder's disc does not sit on the axis: it counts too fast on one side of the turn and too \
        slowly on the other.",
    shows: "The measured angle is wrong by the same amount whenever the pendulum comes to the same place, once per \
        turn, whatever moves it.",
    experiment: "the pendulum let go through whole turns: the error repeats with the angle, whatever the speed",
    look_alikes: &["sensor.alpha.offset", "sensor.alpha.scale", "pendulum.spring"],
    parameters: &[AMPLITUDE, PHASE],
    strengths: 1,
    footprint: Footprint::Scale(Output::Alpha),
    acts: Acts::DISC.and(Acts::PENDULUM),
    at_rest: AtRest::READING,
    own: None,
    offered: Offered::OnRequest("over a part of a turn it is a scale and an offset of the encoder"),
};

impl<S: Scalar> Law<S> for SensorAlphaEccentricity<S> {
    #[inline(always)]
    fn disc(&self, [_, alpha]: [S; 2]) -> [S; 2] {
        let (sin, _) = (alpha + self.phase).sin_cos();
        [S::ZERO, self.amplitude * sin]
    }
}
