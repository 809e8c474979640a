//! Which effects a linear model holds, and what is said of the others.

use super::describing::{Amplitudes, Described};
use super::hold::Equilibrium;
use crate::effects::{Acts, AtRest, Effect};
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

/// Whether its slope at rest tells what it does nearby.
pub(super) fn has_slope(effect: &Effect<f64>) -> bool {
    matches!(effect.spec().at_rest, AtRest::Slope | AtRest::Local(_))
}

/// Which effects of `plant` arm and pendulum alone do not hold, as [`super::rigid`] and [`super::Load`] have them, or
/// in a small range only, and why: what a design for four states is not made for.
///
/// ```
/// use furuta_model::linear_plant::rigid_remarks;
/// use furuta_model::{Effect, Plant, Rig};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let effects = [Effect::new("arm.spring", &[0.02, 0.3])?, Effect::new("motor.lag", &[0.01])?];
/// let remarks = rigid_remarks(&Plant::new(&rig.params, &effects)?);
/// assert_eq!(remarks.iter().map(|r| r.effect).collect::<Vec<_>>(), ["motor.lag"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn rigid_remarks(plant: &Plant<f64>) -> ArrayVec<Remark, MAX_EFFECTS> {
    let more = Acts::DELAY
        .and(Acts::LAG)
        .and(Acts::RESONANCE)
        .and(Acts::DRIVE)
        .and(Acts::SENSOR_DELAY);
    let of = |effect: &Effect<f64>| {
        let spec = effect.spec();
        let treatment = match spec.at_rest {
            AtRest::Slope if spec.acts.touches(more) => {
                Treatment::LeftOut("it is none of the four states of arm and pendulum")
            }
            AtRest::Slope => return None,
            AtRest::Local(why) => Treatment::Local(why),
            AtRest::Friction(why) | AtRest::Kinked(why) | AtRest::LeftOut(why) => {
                Treatment::LeftOut(why)
            }
        };
        Some(Remark {
            effect: spec.id,
            treatment,
        })
    };
    plant.effects().iter().filter_map(of).collect()
}

/// Of every effect that the matrices do not hold exactly.
pub(super) fn remarks(
    plant: &Plant<f64>,
    at: &Equilibrium,
    amplitudes: &Amplitudes,
    described: &Described,
) -> ArrayVec<Remark, MAX_EFFECTS> {
    let of = |effect: &Effect<f64>| {
        let spec = effect.spec();
        let treatment = match spec.at_rest {
            AtRest::Slope => return None,
            AtRest::Local(why) => Treatment::Local(why),
            AtRest::Friction(why) => described.damping_by(plant, effect, at, amplitudes).map_or(
                Treatment::LeftOut(why),
                |value| Treatment::Described {
                    value,
                    unit: "N m s/rad",
                },
            ),
            AtRest::Kinked(_) if amplitudes.command > 0.0 => Treatment::Described {
                value: described.gain,
                unit: "V/V",
            },
            AtRest::Kinked(why) | AtRest::LeftOut(why) => Treatment::LeftOut(why),
        };
        Some(Remark {
            effect: spec.id,
            treatment,
        })
    };
    plant.effects().iter().filter_map(of).collect()
}
