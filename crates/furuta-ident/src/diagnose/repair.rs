//! From fitted coefficients back to the parameters of a rig file.

use std::collections::BTreeMap;

use furuta_model::effects::MAX_PARAMETERS;
use furuta_model::params::RANGES;
use furuta_model::{Actuation, Effect, Params, Rig};

use super::Fit;
use super::hypothesis::{
    ARM_DAMPING, ARM_INERTIA, BASE, DRIVE, FIRST_EFFECT, INERTIA, LENGTH, PENDULUM_DAMPING,
};
use super::result::{AtBound, Estimate, ParameterEstimate, si};

/// The rig with the fitted parameters and effects.
///
/// Data show only combinations; where one stands for several parameters, the change goes to the one that is known
/// least: inertias to `arm.inertia` and `pendulum.inertia`, the coupling of both axes to `arm.length`, gain to
/// `motor.torque_constant`, damping to `arm.viscous`. Where the command is a torque or an acceleration, the gain is
/// `motor.amplifier_gain`.
pub(super) fn repaired(rig: &Rig, fit: &Fit) -> Rig {
    let mut rig = rig.clone();
    let sheet = &fit.model.sheet;
    let v = fit.model.physical(&fit.z);
    let p = &mut rig.params;
    let moment = p.pendulum.mass * p.pendulum.com;
    let about_com = v[INERTIA] - moment * p.pendulum.com;
    if sheet.held[INERTIA] {
        // As the sheet says.
    } else if about_com >= 0.0 {
        let change = about_com - p.pendulum.inertia;
        p.pendulum.inertia = about_com;
        p.pendulum.inertia_transverse = (p.pendulum.inertia_transverse + change).max(0.0);
    } else {
        // A point mass cannot lose inertia: it moves closer instead, its moment kept.
        p.pendulum.inertia = 0.0;
        p.pendulum.com = v[INERTIA] / moment;
        p.pendulum.mass = moment / p.pendulum.com;
    }
    p.arm.length = v[LENGTH];
    if !sheet.held[ARM_INERTIA] {
        p.arm.inertia = (v[ARM_INERTIA] - carried(p)).max(LEAST_ARM * v[ARM_INERTIA]);
    }
    let gain = v[DRIVE] / sheet.coefficients.drive;
    match p.motor.actuation {
        Actuation::Torque | Actuation::Acceleration => p.motor.amplifier_gain *= gain,
        Actuation::Voltage | Actuation::Current => p.motor.torque_constant *= gain,
    }
    if !sheet.held[ARM_DAMPING] {
        let per_back_emf = per_back_emf(p);
        let electric = per_back_emf * p.motor.back_emf_constant;
        p.arm.viscous = (v[ARM_DAMPING] - electric).max(0.0);
        if v[ARM_DAMPING] < electric {
            p.motor.back_emf_constant = v[ARM_DAMPING] / per_back_emf;
        }
    }
    p.pendulum.viscous = v[PENDULUM_DAMPING].max(0.0);
    let mut i = FIRST_EFFECT;
    for spec in &fit.model.effects {
        let values: arrayvec::ArrayVec<f64, MAX_PARAMETERS> =
            v[i..i + spec.parameters.len()].iter().copied().collect();
        i += spec.parameters.len();
        rig.effects.extend(Effect::of(spec, &values));
    }
    rig
}

/// The least share of what turns with the arm that is the arm's own: a rig file has no arm without inertia.
const LEAST_ARM: f64 = 1e-3;

/// What the arm carries, as inertia about the motor's axis.
fn carried(p: &Params<f64>) -> f64 {
    p.pendulum.mass * p.arm.length * p.arm.length + p.pendulum.inertia_axial
}

/// The arm's damping per back-EMF constant.
fn per_back_emf(p: &Params<f64>) -> f64 {
    let m = &p.motor;
    m.torque_constant * m.gear_ratio * m.gear_ratio * m.efficiency / m.resistance
}

/// The damping of the arm by the sheet's back-EMF constant beside the numbers written.
pub(super) fn electric_damping(sheet: &Params<f64>, written: &Params<f64>) -> f64 {
    per_back_emf(written) * sheet.motor.back_emf_constant
}

/// Whether what the arm carries leaves it no inertia of its own, of this inertia about the motor's axis, while the
/// sheet's arm has one.
pub(super) fn has_no_arm(sheet: &Params<f64>, written: &Params<f64>, whole: f64) -> bool {
    let is_least = |p: &Params<f64>, whole: f64| whole - carried(p) <= LEAST_ARM * whole;
    is_least(written, whole) && !is_least(sheet, sheet.arm.inertia + carried(sheet))
}

/// All parameters of the rig file, those that the data determine with their standard deviations, and whether they stand
/// at a bound.
pub(super) fn parameters(
    rig: &Rig,
    repaired: &Rig,
    fit: &Fit,
    at_bound: &[AtBound],
) -> BTreeMap<String, ParameterEstimate> {
    let sheet = &fit.model.sheet;
    let scale = |i: usize| match sheet.held[i] {
        true => f64::NAN,
        false => fit.std[i] * sheet.scale[i],
    };
    let relative_gain = scale(DRIVE) / sheet.coefficients.drive;
    let motor = &rig.params.motor;
    let (gain, nominal) = match motor.actuation {
        Actuation::Torque | Actuation::Acceleration => {
            ("motor.amplifier_gain", motor.amplifier_gain)
        }
        Actuation::Voltage | Actuation::Current => ("motor.torque_constant", motor.torque_constant),
    };
    let determined: [(&str, f64); BASE] = [
        ("arm.inertia", scale(ARM_INERTIA)),
        ("pendulum.inertia", scale(INERTIA)),
        (gain, relative_gain * nominal),
        ("arm.viscous", scale(ARM_DAMPING)),
        ("pendulum.viscous", scale(PENDULUM_DAMPING)),
        ("arm.length", scale(LENGTH)),
    ];
    RANGES
        .iter()
        .zip(
            rig.params
                .to_array()
                .into_iter()
                .zip(repaired.params.to_array()),
        )
        .filter(|(range, _)| motor.actuation.uses(range.key))
        .map(|(range, (sheet, fitted))| {
            let std = determined
                .iter()
                .find(|(key, _)| *key == range.key)
                .map(|(_, std)| *std);
            let estimate = ParameterEstimate {
                nominal: sheet,
                fitted,
                std: std.unwrap_or(f64::NAN),
                tolerance: rig.tolerance.share(range.key).unwrap_or(f64::NAN),
                unit: si(range.unit_for(motor.actuation)),
                identifiable: std.is_some_and(f64::is_finite),
                at_bound: at_bound.iter().any(|b| b.parameter == range.key),
            };
            (range.key.to_owned(), estimate)
        })
        .collect()
}

/// The number of a key.
pub(super) fn number(params: &Params<f64>, key: &str) -> Option<f64> {
    let i = RANGES.iter().position(|range| range.key == key)?;
    params.to_array().get(i).copied()
}

/// The unit of a key, as the JSON contract has it.
pub(super) fn unit(key: &str, actuation: Actuation) -> String {
    let range = RANGES.iter().find(|range| range.key == key);
    range.map_or_else(String::new, |range| si(range.unit_for(actuation)))
}

/// The fitted parameters of the `index`-th effect.
pub(super) fn effect_parameters(fit: &Fit, index: usize) -> BTreeMap<String, Estimate> {
    let spec = fit.model.effects[index];
    let offset = fit.model.offset(index);
    let values = fit.model.physical(&fit.z);
    let scales = fit.model.scales();
    let actuation = fit.model.sheet.params.motor.actuation;
    spec.parameters
        .iter()
        .enumerate()
        .map(|(k, p)| {
            let i = offset + k;
            let std = fit.std[i] * scales[i];
            // A deviation wider than the range says that the recordings do not show the number.
            let shows = p.kind.is_continuous() && std < p.max - p.min;
            let estimate = Estimate {
                value: values[i],
                std: if shows { std } else { f64::NAN },
                unit: si(actuation.unit_of(p.unit)),
                word: p.word(values[i]).map(str::to_owned),
            };
            (p.name.to_owned(), estimate)
        })
        .collect()
}
