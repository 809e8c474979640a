//! The safety monitor: what the motor gets of a pilot's decision. That is all of it, nothing where something is wrong,
//! or what brakes the arm where a limit is hit. The loop asks at every sample; a replay asks the same.

use furuta_ctrl::supervisor::{Brake, Braking, Fault};
use furuta_log::Mode;
use furuta_model::{Limits, Rig, State};
use furuta_wire::Status;

use crate::pilot::{Decision, Measurement};
use crate::run_error::RunError;

/// What the motor gets at a sample.
pub(crate) struct SafeCommand {
    /// The voltage to answer with (V).
    pub(crate) volts: f64,
    /// What is being done: the pilot's doing, or braking.
    pub(crate) mode: Mode,
    /// What ends the run here; the voltage is then 0.
    pub(crate) end: Option<RunError>,
}

/// How a rig's arm is stopped where a limit is hit, at this sample period (s): the same in the loop and in its replay.
pub(crate) fn brake(rig: &Rig, period: f64) -> Brake<f64> {
    Brake::new(&rig.params, rig.params.motor.command_limit, period)
}

/// Watches a run, sample by sample.
pub(crate) struct SafetyMonitor {
    limits: Limits,
    brake: Brake<f64>,
    /// The limit that was hit, while the arm is braked.
    stopping: Option<(RunError, Braking<f64>)>,
}

impl SafetyMonitor {
    pub(crate) fn new(limits: Limits, brake: Brake<f64>) -> Self {
        Self {
            limits,
            brake,
            stopping: None,
        }
    }

    /// Whether the arm is being braked: the run then ends with that and with nothing else, within a quarter of a
    /// second.
    pub(crate) fn is_stopping(&self) -> bool {
        self.stopping.is_some()
    }

    /// What the motor gets at this sample.
    pub(crate) fn check(&mut self, status: Status, m: &Measurement, d: &Decision) -> SafeCommand {
        let off = |mode, error| SafeCommand {
            volts: 0.0,
            mode,
            end: Some(error),
        };
        let unknown = not_finite(m, d);
        let (error, mut braking) = match (self.stopping.take(), unknown) {
            (Some((error, _)), Some(_)) => return off(Mode::Brake, error),
            (Some(stopping), None) => stopping,
            (None, Some(error)) => return off(d.mode, error),
            (None, None) => match fault(&self.limits, status, m, d) {
                None => {
                    return SafeCommand {
                        volts: d.volts,
                        mode: d.mode,
                        end: None,
                    };
                }
                Some(
                    error @ RunError::Fault {
                        fault: Fault::NotANumber,
                        ..
                    },
                ) => return off(d.mode, error),
                Some(error) => (error, self.brake.begin(d.theta_dot)),
            },
        };
        let x = State::new(m.theta, m.alpha, d.theta_dot, d.alpha_dot);
        let volts = self.brake.update(&mut braking, &x, m.periods);
        if braking.is_over() {
            return off(Mode::Brake, error);
        }
        self.stopping = Some((error, braking));
        SafeCommand {
            volts,
            mode: Mode::Brake,
            end: None,
        }
    }
}

fn not_finite(m: &Measurement, d: &Decision) -> Option<RunError> {
    let numbers = [
        ("arm speed", d.theta_dot),
        ("pendulum speed", d.alpha_dot),
        ("command", d.volts),
    ];
    let bad = numbers.into_iter().find(|(_, value)| !value.is_finite());
    bad.map(|(quantity, _)| RunError::NotFinite { quantity, t: m.t })
}

fn fault(limits: &Limits, status: Status, m: &Measurement, d: &Decision) -> Option<RunError> {
    let t = m.t;
    let Limits {
        arm_angle,
        arm_speed,
        pendulum_speed,
    } = *limits;
    let limited = [
        ("arm angle", m.theta, arm_angle, "rad"),
        ("arm speed", d.theta_dot, arm_speed, "rad/s"),
        ("pendulum speed", d.alpha_dot, pendulum_speed, "rad/s"),
    ];
    for (quantity, value, limit, unit) in limited {
        if let Some(limit) = limit.filter(|limit| value.abs() > *limit) {
            return Some(RunError::Limit {
                quantity,
                value,
                limit,
                unit,
                t,
            });
        }
    }
    if let Some(fault) = d.fault {
        return Some(RunError::Fault { fault, t });
    }
    status
        .contains(Status::LIMIT)
        .then_some(RunError::RigLimit { t })
}
