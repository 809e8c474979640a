//! Which effects a linear model holds, and what is said of the others.

use super::describing::{Amplitudes, Described};
use crate::effects::{Acts, BaseParameter, Effect, Footprint};
use crate::plant::{MAX_EFFECTS, Plant};
use arrayvec::ArrayVec;

/// What became of an effect that has no exact place in the matrices.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Treatment {
    /// Its describing function stands for it; all of the kind together come to this.
    Described {
        /// Damping or gain.
        value: f64,
        /// N m s/rad for friction, V/V for a voltage map.
        unit: &'static str,
    },
    /// Its slope at the equilibrium stands for it, which holds in a small range only, and why.
    Local(&'static str),
    /// The matrices know nothing of it, and why.
    LeftOut(&'static str),
}

/// An effect and what became of it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Remark {
    /// The effect's id.
    pub effect: &'static str,
    /// What became of it.
    pub treatment: Treatment,
}

impl core::fmt::Display for Remark {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.treatment {
            Treatment::Described { value, unit } => write!(
                f,
                "{}: by its describing function, {value:.3e} {unit}",
                self.effect
            ),
            Treatment::Local(why) => write!(f, "{}: its slope at rest, {why}", self.effect),
            Treatment::LeftOut(why) => write!(f, "{}: left out, {why}", self.effect),
        }
    }
}

/// Whether it is dry, presliding or quadratic friction.
pub(super) fn is_friction(effect: &Effect<f64>) -> bool {
    matches!(
        effect.spec().footprint,
        Footprint::Refitted(
            BaseParameter::ArmDamping | BaseParameter::PendulumDamping,
            _
        )
    ) || effect.spec().acts.includes(Acts::MEMORY)
}

/// Whether it is a voltage map with a kink: its gain depends on the command's size or sign.
pub(super) fn is_kinked_map(effect: &Effect<f64>) -> bool {
    matches!(
        effect,
        Effect::MotorDeadzone(_) | Effect::MotorSaturation(_) | Effect::MotorAsymmetry(_)
    )
}

/// Whether it comes from elsewhere: it follows neither the state nor the command.
fn is_uncommanded(effect: &Effect<f64>) -> bool {
    effect.spec().footprint == Footprint::UNCOMMANDED
}

fn is_backlash(effect: &Effect<f64>) -> bool {
    effect.spec().acts.includes(Acts::BLOWS)
}

/// Whether its slope at rest tells what it does nearby.
pub(super) fn has_slope(effect: &Effect<f64>) -> bool {
    !(is_friction(effect) || is_kinked_map(effect) || is_uncommanded(effect) || is_backlash(effect))
}

/// Of every effect that the matrices do not hold exactly.
pub(super) fn remarks(
    plant: &Plant<f64>,
    amplitudes: &Amplitudes,
    described: &Described,
) -> ArrayVec<Remark, MAX_EFFECTS> {
    let of = |effect: &Effect<f64>| {
        let treatment = treatment(effect, amplitudes, described)?;
        Some(Remark {
            effect: effect.spec().id,
            treatment,
        })
    };
    plant.effects().iter().filter_map(of).collect()
}

fn treatment(
    effect: &Effect<f64>,
    amplitudes: &Amplitudes,
    described: &Described,
) -> Option<Treatment> {
    let acts = effect.spec().acts;
    if is_friction(effect) {
        let hinge = matches!(
            effect.spec().footprint,
            Footprint::Refitted(BaseParameter::PendulumDamping, _)
        );
        let (amplitude, value) = if hinge {
            (amplitudes.pendulum_speed, described.pendulum_damping)
        } else {
            (amplitudes.arm_speed, described.arm_damping)
        };
        return Some(if amplitude > 0.0 {
            let unit = "N m s/rad";
            Treatment::Described { value, unit }
        } else if acts.includes(Acts::DRY_FRICTION) {
            Treatment::LeftOut("dry friction has no slope at rest")
        } else if acts.includes(Acts::MEMORY) {
            Treatment::LeftOut("a spring before it slides, dry friction when it does")
        } else {
            Treatment::LeftOut("at rest its slope is 0")
        });
    }
    if is_kinked_map(effect) {
        return Some(if amplitudes.command > 0.0 {
            Treatment::Described {
                value: described.gain,
                unit: "V/V",
            }
        } else {
            Treatment::LeftOut("its gain depends on the command's size or sign")
        });
    }
    if is_backlash(effect) {
        return Some(Treatment::LeftOut(
            "rotor and arm are taken to touch: its gain depends on the motion's size",
        ));
    }
    if is_uncommanded(effect) {
        return Some(Treatment::LeftOut(
            "it follows neither the state nor the command",
        ));
    }
    match effect {
        Effect::ArmCogging(_) | Effect::MotorRipple(_) => Some(Treatment::Local(
            "as far as the arm stays within a small part of 1/order rad",
        )),
        Effect::MotorDrift(_) => Some(Treatment::Local("at the run's start")),
        _ if acts.includes(Acts::READING) => Some(Treatment::LeftOut(
            "the estimator knows of it and takes it off the readings",
        )),
        _ => None,
    }
}
