//! Numbers of a fit that stand at a bound of what a rig can have: what the model lacks, or what the rig file has wrong
//! elsewhere, has taken their place. A model with such a number is not written to a rig file.

use furuta_model::effects::{Kind, ParameterSpec};
use furuta_model::{Actuation, Params, Rig};

use super::Fit;
use super::hypothesis::{
    ARM_DAMPING, ARM_INERTIA, DRIVE, Hypothesis, INERTIA, LENGTH, MOST_DEVIATIONS, PENDULUM_DAMPING,
};
use super::repair;
use super::result::{AtBound, Best, si};
use crate::shooting::Model;

/// A step that ends at a bound is at it but for rounding, in units of the vector.
const ROUNDING: f64 = 1e-9;

const QUARTER: &str = "a quarter of the rig file's";
const FAR_ABOVE: &str = "as far above the rig file's as a fit goes, twenty times its size";

/// Where a number of the vector stands against its range.
enum Place {
    Least,
    Within,
    Most,
}

/// The numbers of this fit at a bound where none can be, as they stand in the rig file that it makes.
///
/// An inertia, a gain or a length has gone as far from the rig file as a fit lets it, or a body is left without
/// inertia. A damping of 0 can be: friction too small to be seen. It cannot where the recordings ask for one that
/// drives, by more than three standard deviations.
pub(super) fn at_bounds(rig: &Rig, fit: &Fit, model: Best) -> Vec<AtBound> {
    let repaired = repair::repaired(rig, fit);
    let written = repaired.params;
    let mut out = Vec::new();
    for (key, reason) in of_sheet(&rig.params, &written, rig, fit) {
        let value = repair::number(&written, key).unwrap_or(f64::NAN);
        out.push(AtBound {
            model,
            parameter: key.to_owned(),
            value,
            unit: repair::unit(key, written.motor.actuation),
            reason: reason.to_owned(),
        });
    }
    let values = fit.model.physical(&fit.z);
    for (i, spec) in fit.model.effects.iter().enumerate() {
        let first = fit.model.offset(i);
        for (p, value) in spec.parameters.iter().zip(&values[first..]) {
            if is_at_bound(p, *value, &fit.model) {
                out.push(AtBound {
                    model,
                    parameter: format!("{}.{}", spec.id, p.name),
                    value: *value,
                    unit: si(written.motor.actuation.unit_of(p.unit)),
                    reason: "the end of the effect's range".to_owned(),
                });
            }
        }
    }
    out
}

/// Whether a number of an effect ended at a bound of its range. One that means no effect does not count, nor does all
/// of a share. Nor does an angle of rest: a spring that rests far away is a push, and a search finds an offset by way
/// of it.
pub(super) fn is_at_bound(p: &ParameterSpec, value: f64, model: &Hypothesis) -> bool {
    let scale = p.typical(&model.sheet.params).abs();
    let at = |bound: f64| bound != p.off && (value - bound).abs() <= ROUNDING * scale;
    p.kind == Kind::Real && (at(p.min) || at(p.max))
}

/// The numbers of the sheet that stand at a bound, by key, each with what that means.
fn of_sheet(
    sheet: &Params<f64>,
    written: &Params<f64>,
    rig: &Rig,
    fit: &Fit,
) -> Vec<(&'static str, &'static str)> {
    let bounds = fit.model.bounds(&fit.z);
    let place = |i: usize| match bounds[i] {
        (low, high) if low == high => Place::Within,
        (low, _) if fit.z[i] - low <= ROUNDING => Place::Least,
        (_, high) if high - fit.z[i] <= ROUNDING => Place::Most,
        _ => Place::Within,
    };
    let held = fit.model.sheet.held;
    let scale = fit.model.sheet.scale;
    // How far a damping would go below 0, and by how much that may be chance.
    let beyond = |i: usize| (fit.past[i] * scale[i], fit.std[i] * scale[i]);
    let values = fit.model.physical(&fit.z);
    let mut out = Vec::new();
    if !held[ARM_INERTIA] {
        match place(ARM_INERTIA) {
            Place::Most => out.push(("arm.inertia", "with what it carries, four times the rig file's")),
            Place::Least => out.push((
                "arm.inertia",
                "with what it carries, a quarter of the rig file's",
            )),
            Place::Within if repair::has_no_arm(sheet, written, values[ARM_INERTIA]) => out.push((
                "arm.inertia",
                "an arm without inertia: pendulum.mass, pendulum.com or arm.length may be too large in the rig file",
            )),
            Place::Within => {}
        }
    }
    if !held[INERTIA] {
        if matches!(place(INERTIA), Place::Most) {
            out.push((
                "pendulum.inertia",
                "about its pivot, four times the rig file's",
            ));
        } else if written.pendulum.inertia <= 0.0 && sheet.pendulum.inertia > 0.0 {
            out.push((
                "pendulum.inertia",
                "a body without inertia, that swings as fast as a point at its centre of mass: pendulum.com may be too \
                 long in the rig file",
            ));
        }
    }
    let gain = match sheet.motor.actuation {
        Actuation::Torque | Actuation::Acceleration => "motor.amplifier_gain",
        Actuation::Voltage | Actuation::Current => "motor.torque_constant",
    };
    match place(DRIVE) {
        Place::Least => out.push((gain, QUARTER)),
        Place::Most => out.push((gain, "four times the rig file's")),
        Place::Within => {}
    }
    if !held[ARM_DAMPING] {
        let electric = repair::electric_damping(sheet, written);
        let (past, std) = beyond(ARM_DAMPING);
        let short = electric - values[ARM_DAMPING] + past;
        let known = rig.tolerance.share("motor.back_emf_constant");
        let known = known.map_or(f64::INFINITY, |share| share * electric);
        let known = if electric > 0.0 { known } else { 0.0 };
        if matches!(place(ARM_DAMPING), Place::Most) {
            out.push(("arm.viscous", FAR_ABOVE));
        } else if short > MOST_DEVIATIONS * std.hypot(known) {
            out.push((
                "arm.viscous",
                "less than none: the back-EMF of the rig file alone damps the arm more than the recordings show",
            ));
        }
    }
    if !held[PENDULUM_DAMPING] {
        let (past, std) = beyond(PENDULUM_DAMPING);
        if matches!(place(PENDULUM_DAMPING), Place::Most) {
            out.push(("pendulum.viscous", FAR_ABOVE));
        } else if past > MOST_DEVIATIONS * std {
            out.push((
                "pendulum.viscous",
                "less than none: the recordings ask for a friction that drives the pendulum",
            ));
        }
    }
    if !matches!(place(LENGTH), Place::Within) {
        out.push((
            "arm.length",
            "three of its tolerances from the rig file's: take a ruler, and state the tolerance if it is larger",
        ));
    }
    out
}
