//! What the motor gets of a pilot's decision: all of it, or nothing where something is wrong. The loop asks at every sample; a replay asks the same.

use furuta_model::Limits;
use furuta_wire::Status;

use crate::control_loop::RunError;
use crate::pilot::{Decision, Measurement};

/// The voltage to answer with (V), and the fault that ends the run here if it is 0 for one.
pub(crate) fn verdict(
    limits: &Limits,
    status: Status,
    m: &Measurement,
    d: &Decision,
) -> (f64, Option<RunError>) {
    match fault(limits, status, m, d) {
        Some(fault) => (0.0, Some(fault)),
        None => (d.volts, None),
    }
}

fn fault(limits: &Limits, status: Status, m: &Measurement, d: &Decision) -> Option<RunError> {
    let t = m.t;
    let numbers = [
        ("arm speed", d.theta_dot),
        ("pendulum speed", d.alpha_dot),
        ("command", d.volts),
    ];
    for (quantity, value) in numbers {
        if !value.is_finite() {
            return Some(RunError::NotFinite { quantity, t });
        }
    }
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
