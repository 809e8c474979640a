//! One sample: from a measurement to a command.

use super::mode::Mode;
use super::system::{Supervisor, SupervisorState};
use crate::compensation::Situation;
use crate::controllers::Controller;
use crate::estimators::{Estimate, Estimator, Measurement};
use crate::real::{Real, command, is_finite};
use crate::reference::{Approach, arm_at};
use furuta_model::State;

/// One sample's answer.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Output<T> {
    /// Command for the motor, V.
    pub u: T,
    /// Mode that gave it.
    pub mode: Mode,
    /// Estimated state at the sample.
    pub x: State<T>,
    /// Where the arm is asked to be just now, rad.
    pub reference: T,
}

impl<T: Real> Supervisor<T> {
    /// The command for one sample; the arm is to go to `target` (rad) once the pendulum is up.
    ///
    /// Always a finite number within the command limit; 0 in the modes idle, stopping and fault; against the arm's
    /// speed in braking.
    pub fn update(
        &self,
        state: &mut SupervisorState<T>,
        measurement: &Measurement<T>,
        target: T,
    ) -> Output<T> {
        let Estimate {
            now,
            ahead,
            disturbance,
        } = self.estimator.update(&mut state.estimator, measurement);
        if let Some(fault) = self.thresholds.violation(&now) {
            self.find(state, fault, &now);
        }
        let periods = T::from_f64(f64::from(measurement.periods));
        let target = if is_finite(target) { target } else { T::ZERO };
        let mode = self.next_mode(state, &now, &ahead, periods);
        if mode != state.mode {
            self.enter(state, mode, &ahead);
        }
        let u = match mode {
            Mode::SwingUp => {
                let elapsed = self.h * periods;
                let follower = self.follower.as_ref();
                match follower.and_then(|f| f.update(&mut state.following, &ahead, elapsed)) {
                    Some(u) => u,
                    None if self.gives_up(state) => T::ZERO,
                    None => {
                        self.swing_up
                            .update(&mut state.swing_up, &ahead, &arm_at(T::ZERO), self.h)
                    }
                }
            }
            Mode::Balance => {
                let step = self.thresholds.reference_speed * self.h * periods;
                state.arm_reference += (target - state.arm_reference).clamp(-step, step);
                let reference = Approach {
                    from: state.arm_reference,
                    to: target,
                    step: self.thresholds.reference_speed * self.h,
                };
                let u = self
                    .balance
                    .update_ahead(&mut state.balance, &ahead, &reference, self.h);
                // What the last command was above this one dies out, instead of vanishing at once.
                let bump = self.thresholds.blend * state.bump.unwrap_or(state.u - u);
                state.bump = Some(bump);
                let u = u + bump;
                let situation = Situation {
                    x: ahead,
                    reference: state.arm_reference,
                    disturbance,
                };
                self.compensation.command(u, &situation)
            }
            Mode::Braking => {
                let u = self
                    .brake
                    .update(&mut state.braking, &now, measurement.periods);
                if state.braking.is_over() {
                    state.mode = Mode::Fault;
                }
                u
            }
            Mode::Idle | Mode::Stopping | Mode::Fault => T::ZERO,
        };
        let mode = state.mode;
        state.u = command(u, self.thresholds.command_limit);
        Output {
            u: state.u,
            mode,
            x: now,
            reference: match mode {
                Mode::Balance => state.arm_reference,
                _ => T::ZERO,
            },
        }
    }
}
