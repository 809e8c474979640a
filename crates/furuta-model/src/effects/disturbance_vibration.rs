//! Vibration: `amplitude sin(2π frequency t + phase)` on the arm.

use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Vibration: `amplitude sin(2π frequency t + phase)` on the arm.
    DisturbanceVibration {
        /// Largest torque, N m.
        amplitude,
        /// Of the vibration, Hz.
        frequency,
        /// At the run's start, rad.
        phase,
    }
}

pub(super) const SPEC: Spec = Spec {
    id: "disturbance.vibration",
    name: "Vibration",
    law: "amplitude sin(2π frequency t + phase) on the arm",
    sentence: "Something beside the rig hums or shakes: the arm feels a sinusoidal torque that goes on \
        whatever the rig does.",
    shows: "An error of one frequency that repeats with time, not with any angle, also while the rig is at rest.",
    experiment: "a recording at rest without any command",
    look_alikes: &["arm.cogging"],
    parameters: &[
        ParameterSpec {
            name: "amplitude",
            unit: "N m",
            kind: Kind::Real,
            default: None,
            min: 0.0,
            max: 1e3,
            off: 0.0,
            typical: Typical::Of(|p| 0.1 * super::stall_torque(p)),
            starts: &[0.2],
        },
        ParameterSpec {
            name: "frequency",
            unit: "Hz",
            kind: Kind::Frequency,
            default: None,
            min: 0.5,
            max: 1e4,
            off: 0.0,
            typical: Typical::Of(|_| 1.0),
            starts: &[0.0],
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
    footprint: Footprint::UNCOMMANDED,
    acts: Acts::TORQUE.and(Acts::ARM).and(Acts::CLOCK),
    at_rest: AtRest::UNCOMMANDED,
    own: None,
    offered: Offered::Always,
};

impl<S: Scalar> Law<S> for DisturbanceVibration<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let turn = S::from_f64(core::f64::consts::TAU);
        let (sin, _) = (turn * self.frequency * at.clock.t + self.phase).sin_cos();
        [self.amplitude * sin, S::ZERO]
    }
}
