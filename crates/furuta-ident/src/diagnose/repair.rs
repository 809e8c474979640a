//! From fitted coefficients back to the parameters of a rig file.

use std::collections::BTreeMap;

use furuta_model::effects::MAX_PARAMETERS;
use furuta_model::params::RANGES;
use furuta_model::{Actuation, Effect, Rig};

use super::Fit;
use super::hypothesis::{
    ARM_DAMPING, ARM_INERTIA, BASE, DRIVE, FIRST_EFFECT, INERTIA, LENGTH, PENDULUM_DAMPING,
};
use super::result::{Estimate, ParameterEstimate};

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
        let carried = p.pendulum.mass * p.arm.length * p.arm.length + p.pendulum.inertia_axial;
        p.arm.inertia = (v[ARM_INERTIA] - carried).max(1e-3 * v[ARM_INERTIA]);
    }
    let gain = v[DRIVE] / sheet.coefficients.drive;
    match p.motor.actuation {
        Actuation::Torque | Actuation::Acceleration => p.motor.amplifier_gain *= gain,
        Actuation::Voltage | Actuation::Current => p.motor.torque_constant *= gain,
    }
    if !sheet.held[ARM_DAMPING] {
        let m = &p.motor;
        let per_back_emf =
            m.torque_constant * m.gear_ratio * m.gear_ratio * m.efficiency / m.resistance;
        let electric = per_back_emf * m.back_emf_constant;
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

/// All parameters of the rig file, those that the data determine with their standard deviations.
pub(super) fn parameters(
    rig: &Rig,
    repaired: &Rig,
    fit: &Fit,
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
            };
            (range.key.to_owned(), estimate)
        })
        .collect()
}

/// A unit as the JSON contract has it: 1 for a pure number.
fn si(unit: &str) -> String {
    if unit == "-" { "1" } else { unit }.to_owned()
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
