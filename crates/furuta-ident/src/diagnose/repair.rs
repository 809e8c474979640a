//! From fitted coefficients back to the parameters of a rig file.

use std::collections::BTreeMap;

use furuta_model::effects::MAX_PARAMETERS;
use furuta_model::params::RANGES;
use furuta_model::{Actuation, Effect, Rig};

use super::Fit;
use super::hypothesis::{BASE, FIRST_EFFECT, LENGTH};
use super::result::{Estimate, ParameterEstimate};

/// The rig with the fitted parameters and effects.
///
/// Data show only combinations; where one stands for several parameters, the change goes to the one that is known
/// least: inertias to `arm.inertia` and `pendulum.inertia`, the coupling of both axes to `arm.length`, gain to
/// `motor.torque_constant`, damping to `arm.viscous`. Where the command is a torque, the gain is
/// `motor.amplifier_gain`.
pub(super) fn repaired(rig: &Rig, fit: &Fit) -> Rig {
    let mut rig = rig.clone();
    let sheet = &fit.model.sheet;
    let v = fit.model.physical(&fit.z);
    let p = &mut rig.params;
    let moment = p.pendulum.mass * p.pendulum.com;
    let about_com = v[1] - moment * p.pendulum.com;
    if sheet.held[1] {
        // As the sheet says.
    } else if about_com >= 0.0 {
        let change = about_com - p.pendulum.inertia;
        p.pendulum.inertia = about_com;
        p.pendulum.inertia_transverse = (p.pendulum.inertia_transverse + change).max(0.0);
    } else {
        // A point mass cannot lose inertia: it moves closer instead, its moment kept.
        p.pendulum.inertia = 0.0;
        p.pendulum.com = v[1] / moment;
        p.pendulum.mass = moment / p.pendulum.com;
    }
    p.arm.length = v[LENGTH];
    if !sheet.held[0] {
        let carried = p.pendulum.mass * p.arm.length * p.arm.length + p.pendulum.inertia_axial;
        p.arm.inertia = (v[0] - carried).max(1e-3 * v[0]);
    }
    let gain = v[2] / sheet.coefficients.drive;
    if p.motor.actuation == Actuation::Torque {
        p.motor.amplifier_gain *= gain;
    } else {
        p.motor.torque_constant *= gain;
    }
    let m = &p.motor;
    let per_back_emf =
        m.torque_constant * m.gear_ratio * m.gear_ratio * m.efficiency / m.resistance;
    let electric = per_back_emf * m.back_emf_constant;
    if v[3] >= electric {
        p.arm.viscous = v[3] - electric;
    } else {
        p.arm.viscous = 0.0;
        p.motor.back_emf_constant = v[3] / per_back_emf;
    }
    p.pendulum.viscous = v[4].max(0.0);
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
    let relative_gain = scale(2) / sheet.coefficients.drive;
    let motor = &rig.params.motor;
    let (gain, nominal) = match motor.actuation {
        Actuation::Torque => ("motor.amplifier_gain", motor.amplifier_gain),
        _ => ("motor.torque_constant", motor.torque_constant),
    };
    let determined: [(&str, f64); BASE] = [
        ("arm.inertia", scale(0)),
        ("pendulum.inertia", scale(1)),
        (gain, relative_gain * nominal),
        ("arm.viscous", scale(3)),
        ("pendulum.viscous", scale(4)),
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
            let estimate = Estimate {
                value: values[i],
                std: if p.kind.is_continuous() {
                    fit.std[i] * scales[i]
                } else {
                    f64::NAN
                },
                unit: si(actuation.unit_of(p.unit)),
                word: p.word(values[i]).map(str::to_owned),
            };
            (p.name.to_owned(), estimate)
        })
        .collect()
}
