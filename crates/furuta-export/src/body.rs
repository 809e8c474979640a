//! Rigid bodies with the motion of a rig file's numbers.

use furuta_model::{Actuation, Effect, Params};

/// Least moment of inertia of a body, kg m²: simulators take no points. It is 3e-8 of the smallest built-in pendulum's
/// about its hinge, and is taken off the arm where it counts.
const LEAST: f64 = 1e-12;

/// The effect that bodies carry, and why they cannot where they cannot.
pub(crate) const TRANSVERSE: &str = "pendulum.inertia_transverse";
pub(crate) const NO_BODY: &str =
    "no rigid body has a moment of inertia beyond the sum of the two others";

/// A rig of which no rigid bodies have the moments of inertia.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// A body's moments of inertia must each be at most the sum of the two others.
    #[error(
        "no rigid body has the pendulum's moments of inertia {hinge:e} (hinge), {transverse:e} (transverse) and \
         {axial:e} kg m2 (axial): each must be at most the sum of the two others; correct [pendulum] of the rig file"
    )]
    Pendulum {
        /// `I`, kg m².
        hinge: f64,
        /// `I_t`, kg m².
        transverse: f64,
        /// `I_a`, kg m².
        axial: f64,
    },
    /// An arm that follows a commanded acceleration: the rig file does not know its inertia.
    #[error(
        "a rig whose motor.kind is \"acceleration\" has no arm.inertia, which MJCF and URDF need: write a rig file with \
         motor.kind = \"torque\" and the arm's inertia, and command the torque that the acceleration takes"
    )]
    CommandedAcceleration,
    /// Nothing is left of the arm once the rotor's share is taken off.
    #[error(
        "arm.inertia = {inertia:e} kg m2 is too small to be a body of its own beside the rotor's share of \
         {share}: it must exceed 1e-12; correct arm.inertia or motor_share"
    )]
    Arm {
        /// kg m².
        inertia: f64,
        /// Of the rotor.
        share: f64,
    },
}

/// Arm, pendulum and rotor as bodies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bodies {
    /// About the motor's axis, without the rotor where that is a body, kg m².
    pub(crate) arm: f64,
    /// About the motor's axis, kg m²; 0: part of the arm.
    pub(crate) rotor: f64,
    /// About the pendulum's centre of mass: hinge's direction, transverse, along the rod, kg m².
    pub(crate) pendulum: [f64; 3],
    /// Inertia of the hinge's axis that no body has, kg m².
    pub(crate) armature: f64,
    /// Whether the effect `pendulum.inertia_transverse` is left out, for no rigid body has it.
    pub(crate) without_effect: bool,
}

impl Bodies {
    /// Bodies that move as the rig does.
    ///
    /// A constant on both axes across the hinge is one on the arm's axis (sin² + cos² = 1), where it is taken away;
    /// what the hinge has beyond the sum of the others is armature, which counts on the hinge's axis alone.
    pub(crate) fn of(params: &Params<f64>, effects: &[Effect<f64>]) -> Result<Self, BodyError> {
        if params.motor.actuation == Actuation::Acceleration {
            return Err(BodyError::CommandedAcceleration);
        }
        let extra: f64 = effects
            .iter()
            .filter(|e| e.spec().id == TRANSVERSE)
            .map(|e| e.values()[0])
            .sum();
        Self::with(params, effects, extra).or_else(|error| match error {
            BodyError::Pendulum { .. } if extra != 0.0 => Ok(Self {
                without_effect: true,
                ..Self::with(params, effects, 0.0)?
            }),
            error => Err(error),
        })
    }

    /// With so much more transverse inertia, kg m².
    fn with(params: &Params<f64>, effects: &[Effect<f64>], extra: f64) -> Result<Self, BodyError> {
        let p = &params.pendulum;
        let transverse = p.inertia_transverse + extra;
        let lift = (LEAST - transverse.min(p.inertia_axial)).max(0.0);
        let (lifted, axial) = (transverse + lift, p.inertia_axial + lift);
        let hinge = p.inertia.min(lifted + axial).max(LEAST);
        // Written so that a rounding error passes.
        if (lifted - axial).abs() > hinge * (1.0 + 1e-9) {
            return Err(BodyError::Pendulum {
                hinge: p.inertia,
                transverse,
                axial: p.inertia_axial,
            });
        }
        let share = effects.iter().find_map(motor_share).unwrap_or(0.0);
        let rotor = share * params.arm.inertia;
        let arm = params.arm.inertia - lift - rotor;
        if !(arm > LEAST) || share > 0.0 && !(rotor > LEAST) {
            return Err(BodyError::Arm {
                inertia: params.arm.inertia,
                share,
            });
        }
        Ok(Self {
            arm,
            rotor,
            pendulum: [hinge, lifted, axial],
            armature: (p.inertia - hinge).max(0.0),
            without_effect: false,
        })
    }
}

/// The rotor's share of the arm's inertia, of an effect between rotor and arm.
fn motor_share(effect: &Effect<f64>) -> Option<f64> {
    value(effect, "motor_share").filter(|_| effect.spec().id.starts_with("drive."))
}

/// A parameter's value by its name.
pub(crate) fn value(effect: &Effect<f64>, name: &str) -> Option<f64> {
    let place = effect
        .spec()
        .parameters
        .iter()
        .position(|p| p.name == name)?;
    effect.values().get(place).copied()
}
