//! A rig in the words of the wire.

use furuta_ctrl::Limits;
use furuta_model::Actuation;
use furuta_wire::{Hello, PROTOCOL_VERSION, RigLimits, RigName};

/// What a rig says of itself: 500 Hz or what `period_us` says, the motor off after 20 ms without a command.
#[must_use]
#[allow(clippy::cast_possible_truncation)] // volts and radians have few digits
pub fn hello(
    name: &str,
    period_us: u32,
    counts_per_rev: [f64; 2],
    command_limit: f64,
    limits: &Limits,
    actuation: Actuation,
) -> Hello {
    let mut rig = RigName::new();
    for c in name.chars() {
        if rig.try_push(c).is_err() {
            break;
        }
    }
    let narrow = |limit: Option<f64>| limit.map(|limit| limit as f32);
    Hello {
        version: PROTOCOL_VERSION,
        rig,
        period_us,
        arm_counts_per_rev: counts_per_rev[0],
        pendulum_counts_per_rev: counts_per_rev[1],
        command_limit: command_limit as f32,
        limits: RigLimits {
            arm_angle: narrow(limits.arm_angle),
            arm_speed: narrow(limits.arm_speed),
            pendulum_speed: narrow(limits.pendulum_speed),
        },
        watchdog_periods: (20_000 / period_us.max(1)).max(2) as u16,
        actuation: actuation.code(),
    }
}
