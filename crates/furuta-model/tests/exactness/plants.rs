//! Plants that these tests look at.

use furuta_model::effects::{ParameterSpec, Spec};
use furuta_model::{Effect, EffectError, Params, Plant, Rig, State};
use proptest::prelude::*;

pub(crate) fn rigs() -> impl Iterator<Item = Rig> {
    Rig::VOLTAGE
        .iter()
        .map(|n| Rig::builtin(n).expect("built in"))
}

/// Without motor and friction. The motor's constants stay, so that effects keep their typical sizes.
pub(crate) fn frictionless(rig: &Rig, effects: &[Effect<f64>]) -> Plant<f64> {
    let mut plant = Plant::new(&rig.params, effects).expect("valid");
    plant.coefficients.arm_damping = 0.0;
    plant.coefficients.pendulum_damping = 0.0;
    plant
}

/// The values of an effect that is `size` times as strong as would just be noticed on a rig; shapes are as typical.
/// Kicks belong to run 0.
pub(crate) fn typical(spec: &Spec, params: &Params<f64>, size: f64) -> Vec<f64> {
    let value = |(i, p): (usize, &ParameterSpec)| {
        let size = if i < spec.strengths { size } else { 1.0 };
        let value = (p.off + size * p.typical(params)).clamp(p.min, p.max);
        if p.name == "run" { 0.0 } else { value }
    };
    let mut values: Vec<f64> = spec.parameters.iter().enumerate().map(value).collect();
    while let Err(EffectError::NotWhole { parameter, .. }) = Effect::new(spec.id, &values) {
        let i = spec.parameters.iter().position(|p| p.name == parameter);
        let value = &mut values[i.expect("its own parameter")];
        *value = value.floor();
    }
    values
}

pub(crate) fn effect(spec: &Spec, params: &Params<f64>, size: f64) -> Effect<f64> {
    Effect::new(spec.id, &typical(spec, params, size)).expect("typical values are valid")
}

pub(crate) fn any_state() -> impl Strategy<Value = State<f64>> {
    (-3.0..3.0, -4.0..4.0, -10.0..10.0, -15.0..15.0).prop_map(|(a, b, c, d)| State::new(a, b, c, d))
}

/// A table's row of errors, one per step length.
pub(crate) fn row(name: &str, errors: &[f64], remark: &str) {
    let errors: Vec<_> = errors.iter().map(|e| format!("{e:8.1e}")).collect();
    println!("{name:52} {} {remark}", errors.join(" "));
}
