//! What the equations of motion are made of, over the weight's moment: right whatever the held parameters are.

use furuta_model::params::Coefficients;
use furuta_model::{Actuation, Scalar};
use nalgebra::{DMatrix, DVector};

use super::fit::Fit;
use super::parameters::Space;
use super::result::Combination;
use crate::shooting::{MAX_FREE, Pass};

/// Places among the seven.
const ARM: usize = 0;
const DRIVE: usize = 4;
const ARM_DAMPING: usize = 5;

/// Names, formulas and units of the ratios to the weight's moment.
const COMBINATIONS: [(&str, &str, &str); 7] = [
    (
        "arm inertia",
        "(arm.inertia + mass·length² + inertia_axial) / (mass·g·com)",
        "s2",
    ),
    (
        "swing inertia",
        "(mass·com² + inertia_transverse − inertia_axial) / (mass·g·com)",
        "s2",
    ),
    ("coupling", "arm.length / g", "s2"),
    (
        "pendulum inertia",
        "(pendulum.inertia + mass·com²) / (mass·g·com)",
        "s2",
    ),
    (
        "drive",
        "amplifier_gain·torque_constant·gear_ratio·efficiency / resistance / (mass·g·com)",
        "1/V",
    ),
    (
        "arm damping",
        "(arm.viscous + back-EMF) / (mass·g·com)",
        "s",
    ),
    ("pendulum damping", "pendulum.viscous / (mass·g·com)", "s"),
];

/// The seven that a recording shows, whose ratios to the weight's moment are the combinations: arm, swing, coupling,
/// pendulum, drive, arm damping, pendulum damping.
pub(super) fn base<S: Copy>(c: &Coefficients<S>) -> [S; 7] {
    [
        c.arm,
        c.swing,
        c.coupling,
        c.pendulum,
        c.drive,
        c.arm_damping,
        c.pendulum_damping,
    ]
}

/// The ratios; of an arm that follows a commanded acceleration, `drive` is that of the acceleration to the command.
fn ratios<S: Scalar>(c: &Coefficients<S>, actuation: Actuation) -> [S; 7] {
    let mut ratios = base(c).map(|x| x / c.weight);
    if actuation == Actuation::Acceleration {
        ratios[DRIVE] = c.drive / c.arm;
    }
    ratios
}

/// The combinations that stand in the equations of a rig of this kind; no name: it does not.
fn named(actuation: Actuation) -> [Option<(&'static str, &'static str, &'static str)>; 7] {
    let mut named = COMBINATIONS.map(Some);
    let with_motor = |formula| Some(("drive", formula, actuation.unit_of("1/V")));
    match actuation {
        Actuation::Voltage => {}
        Actuation::Current => {
            let formula = "amplifier_gain·torque_constant·gear_ratio·efficiency / (mass·g·com)";
            named[DRIVE] = with_motor(formula);
        }
        Actuation::Torque => {
            named[DRIVE] = with_motor("amplifier_gain·gear_ratio·efficiency / (mass·g·com)");
        }
        Actuation::Acceleration => {
            named[DRIVE] = Some(("command's gain", "amplifier_gain", "1"));
            named[ARM] = None;
            named[ARM_DAMPING] = None;
        }
    }
    if matches!(actuation, Actuation::Current | Actuation::Torque) {
        named[ARM_DAMPING] = Some(("arm damping", "arm.viscous / (mass·g·com)", "s"));
    }
    named
}

/// Before and after, with deviations.
pub(super) fn combinations(
    space: &Space,
    fitted: &Fit,
    free: &[usize],
    covariance: Option<&DMatrix<f64>>,
) -> Vec<Combination> {
    let actuation = space.rig.params.motor.actuation;
    let sheet = ratios(
        &space.coefficients::<1>(&space.sheet(), &[], Pass::FIRST),
        actuation,
    );
    let found = ratios(
        &space.coefficients::<MAX_FREE>(&fitted.values, free, Pass::NUMBERS),
        actuation,
    );
    named(actuation)
        .iter()
        .zip(sheet.iter().zip(&found))
        .filter_map(|(named, values)| Some(((*named)?, values)))
        .map(|((name, formula, unit), (sheet, found))| {
            let slope = DVector::from_fn(free.len(), |k, _| found.d[k]);
            // What is at a bound is held: its slopes count for nothing.
            let std = covariance.map_or(f64::NAN, |c| {
                let c = c.map(|x| if x.is_finite() { x } else { 0.0 });
                (&c * &slope).dot(&slope).max(0.0).sqrt()
            });
            Combination {
                name: name.to_owned(),
                formula: formula.to_owned(),
                nominal: sheet.v,
                fitted: found.v,
                std: if std > 0.0 { std } else { f64::NAN },
                unit: unit.to_owned(),
            }
        })
        .collect()
}
