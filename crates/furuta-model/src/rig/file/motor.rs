//! The table `[motor]`: which keys a rig file has for each kind of command.

use super::{FileText, RigError};
use crate::actuation::Actuation;
use crate::params::Motor;

/// Reads `motor.kind` (a voltage where it is left out) and what belongs to it.
pub(super) fn parse(file: &FileText) -> Result<Motor<f64>, RigError> {
    let (m, arm) = (&file.motor, &file.arm);
    let kind = m.kind.as_deref().unwrap_or("voltage");
    let actuation =
        Actuation::of(kind, m.unit.as_deref()).ok_or_else(|| RigError::UnknownActuation {
            kind: kind.to_owned(),
            unit: m.unit.clone().unwrap_or_default(),
        })?;
    // What need not be said: a gear, an efficiency and an amplifier of 1 where the command is no voltage.
    let default = (actuation != Actuation::Voltage).then_some(1.0);
    let value = |key: &'static str, given: Option<f64>, default: Option<f64>, neutral: f64| match (
        actuation.uses(key),
        given,
    ) {
        (true, Some(value)) => Ok(value),
        (true, None) => default.ok_or(RigError::Missing { key, actuation }),
        (false, None) => Ok(neutral),
        (false, Some(_)) => Err(RigError::DoesNotEnter { key, actuation }),
    };
    value("arm.inertia", arm.inertia, None, 1.0)?;
    value("arm.viscous", arm.viscous, None, 0.0)?;
    Ok(Motor {
        actuation,
        resistance: value("motor.resistance", m.resistance, None, 1.0)?,
        torque_constant: value("motor.torque_constant", m.torque_constant, None, 1.0)?,
        back_emf_constant: value("motor.back_emf_constant", m.back_emf_constant, None, 0.0)?,
        gear_ratio: value("motor.gear_ratio", m.gear_ratio, default, 1.0)?,
        efficiency: value("motor.efficiency", m.efficiency, default, 1.0)?,
        amplifier_gain: value("motor.amplifier_gain", m.amplifier_gain, default, 1.0)?,
        command_limit: m.command_limit,
    })
}

/// What a file says of it: nothing of a voltage, as files did before there were others.
pub(super) fn written(actuation: Actuation) -> String {
    match actuation {
        Actuation::Voltage => String::new(),
        other => format!("kind = \"{}\"\nunit = \"{}\"\n", other.kind(), other.unit()),
    }
}
