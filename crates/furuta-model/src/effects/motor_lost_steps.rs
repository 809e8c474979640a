//! Lost steps of a stepper motor: the arm falls back behind the commanded course at a moment of one run.

use super::pulse::{RUN, TIME, same};
use super::{Acts, AtRest, Footprint, Instant, Kind, Law, Offered, ParameterSpec, Spec, Typical};
use crate::scalar::Scalar;

parameters! {
    /// Lost steps of a stepper motor: the arm falls back behind the commanded course at a moment of one run.
    MotorLostSteps {
        /// How far the arm gets beyond the commanded course, rad; negative: it falls back.
        size,
        /// When it begins, s.
        time,
        /// In which run, from 0.
        run,
        /// Whether the readings are of the steps commanded (1), not of an encoder on the arm (0).
        reads,
    }
}

/// How long a slip lasts, s: the rotor passes one period of the field (four full steps) at about the speed of its free
/// swing, which is 50 to 150 Hz.
const SLIP: f64 = 0.02;

pub(super) const SPEC: Spec = Spec {
    id: "motor.lost_steps",
    name: "Lost steps of the stepper motor",
    law: "theta'' = u + 4 size/slip^2 for the first half of the slip, - 4 size/slip^2 for the second; slip = 0.02 s \
        from time on, in run `run` alone",
    sentence: "The load was more than the field holds, and the rotor slipped to its next place: four full steps, or \
        several times that.",
    shows: "One run, one moment: the pendulum jumps as after a blow. Where theta counts commanded steps nothing is \
        seen of it there; an encoder on the arm shows a step.",
    experiment: "the arm brought back to a mark after the run: it does not stand where the count says",
    look_alikes: &["disturbance.kick", "sensor.theta.lost_counts"],
    parameters: &[
        ParameterSpec {
            name: "size",
            unit: "rad",
            kind: Kind::Real,
            default: None,
            min: -100.0,
            max: 100.0,
            off: 0.0,
            // Four full steps of a motor with 200.
            typical: Typical::Is(0.125_663_706),
            starts: &[1.0, -1.0],
        },
        TIME,
        RUN,
        ParameterSpec {
            name: "reads",
            unit: "-",
            kind: Kind::Choice(&["arm", "steps"]),
            default: Some(0.0),
            min: 0.0,
            max: 1.0,
            off: 0.0,
            typical: Typical::Is(1.0),
            starts: &[0.0, 1.0],
        },
    ],
    strengths: 1,
    footprint: Footprint::UNCOMMANDED,
    acts: Acts::TORQUE.and(Acts::JUMPS).and(Acts::COUNTS).and(Acts::STEPS),
    at_rest: AtRest::UNCOMMANDED,
    own: None,
    offered: Offered::OnRequest("few stepper motors lose steps in a recording that is kept, and none but they can"),
};

impl<S: Scalar> MotorLostSteps<S> {
    /// The moments at which the acceleration jumps, s.
    #[inline(always)]
    fn edges(&self) -> [S; 3] {
        [0.0, 0.5, 1.0].map(|part| self.time + S::from_f64(part * SLIP))
    }

    /// How far the arm is beyond the commanded course, rad.
    #[inline(always)]
    fn beyond(&self, t: S) -> S {
        let part = (t - self.time) / S::from_f64(SLIP);
        let square = |x: S| S::from_f64(2.0) * x * x;
        if part.real() <= S::Real::ZERO {
            S::ZERO
        } else if part.real() < S::Real::from_f64(0.5) {
            self.size * square(part)
        } else if part.real() < S::Real::ONE {
            self.size * (S::ONE - square(S::ONE - part))
        } else {
            self.size
        }
    }
}

impl<S: Scalar> Law<S> for MotorLostSteps<S> {
    #[inline(always)]
    fn jump_after(&self, run: usize, t: S) -> Option<S> {
        let now = t.real();
        self.edges().into_iter().find(|edge| same(self.run, run) && edge.real() > now)
    }

    /// On an arm that follows a commanded acceleration, one that is moved by as much more.
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let [begin, middle, end] = self.edges().map(S::real);
        let now = at.clock.within.real();
        if !same(self.run, at.clock.run) || now < begin || now >= end {
            return [S::ZERO; 2];
        }
        let size = self.size * at.coefficients.arm * S::from_f64(4.0 / (SLIP * SLIP));
        [if now < middle { size } else { -size }, S::ZERO]
    }

    #[inline(always)]
    fn lost(&self, run: usize, t: S) -> [S; 2] {
        if !same(self.run, run) || self.reads.real() == S::Real::ZERO {
            return [S::ZERO; 2];
        }
        [-self.beyond(t), S::ZERO]
    }
}
