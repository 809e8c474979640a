//! Compensation: what is done to a controller's command about effects that the rig file names.
//!
//! | Effects | What is done | Setting |
//! |---|---|---|
//! | springs, cables, cogging, a tilted base | the voltage that holds the arm at its reference is added | `hold` |
//! | dry friction of the arm | its voltage is added in the direction in which the arm is about to move | `friction` |
//! | dead zone, offset and asymmetry of the motor | the command is chosen for which the motor's voltage is the one wanted | `motor` |
//! | what an [estimator](crate::estimators) finds beside the command | is taken off it | `disturbance` |
//! | delay of the command | estimators with a model look ahead | their `predict` |

mod friction;
mod hold;
mod motor;

use crate::error::ConfigError;
use crate::numbers::Number;
use crate::real::{Real, is_finite};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use friction::Friction;
use furuta_model::effects::Acts;
use furuta_model::plant::MAX_EFFECTS;
use furuta_model::{Effect, Plant, State};
pub use hold::voltage as holding_voltage;

/// What a controller file may say of it.
pub static SPEC: Spec = Spec {
    id: "compensate",
    sentence: "What is done to the command about effects that the rig file names",
    parameters: &[
        ParameterSpec::switch(
            "hold",
            true,
            "the voltage that holds the arm at its reference against springs and whatever else pulls it",
        ),
        ParameterSpec::number(
            "friction",
            "",
            0.0,
            1.0,
            "share of the arm's dry friction that is made up for",
        )
        .or(1.0),
        ParameterSpec::switch(
            "motor",
            true,
            "the command for which the motor's voltage, behind dead zone and the like, is the one wanted",
        ),
        ParameterSpec::switch(
            "disturbance",
            true,
            "against the voltage that the estimator finds beside the command",
        ),
    ],
};

/// Speed at which the level of dry friction is taken, over the pendulum's frequency: Stribeck friction is still near
/// its static torque.
const SLOW: f64 = 0.01;

/// Feed-forward from the rig's model.
#[derive(Clone, Debug)]
pub struct Compensation<T: Real> {
    plant: Plant<T>,
    /// The same without dry friction.
    smooth: Plant<T>,
    hold: bool,
    friction: Option<Friction<T>>,
    motor: bool,
    disturbance: bool,
    limit: T,
}

/// What is known when a command is compensated.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Situation<T> {
    /// The state when the command begins to act.
    pub x: State<T>,
    /// Where the arm is asked to be, rad.
    pub reference: T,
    /// [`crate::estimators::Estimate::disturbance`], V.
    pub disturbance: T,
}

impl<T: Real> Compensation<T> {
    /// With these settings at this site.
    ///
    /// # Errors
    /// Where the rig's model is not possible.
    pub fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let plant: Plant<f64> = Plant::new(site.params, site.effects)?;
        let is_dry = |e: &Effect<f64>| e.spec().acts.touches(Acts::DRY_FRICTION);
        let smooth: arrayvec::ArrayVec<Effect<f64>, MAX_EFFECTS> = plant
            .effects()
            .iter()
            .filter(|e| !is_dry(e))
            .copied()
            .collect();
        let smooth = Plant::new(site.params, &smooth)?;
        let share = settings.value(const { SPEC.parameter("friction").settled() });
        let touches = |acts| plant.effects().iter().any(|e| e.spec().acts.touches(acts));
        Ok(Self {
            hold: settings.is_on(const { SPEC.parameter("hold").settled() })
                && touches(Acts::TORQUE),
            friction: Friction::new(&plant, &smooth, SLOW * site.frequency(), site.period, share),
            motor: settings.is_on(const { SPEC.parameter("motor").settled() })
                && touches(Acts::VOLTAGE),
            disturbance: settings.is_on(const { SPEC.parameter("disturbance").settled() }),
            limit: T::from_f64(site.command_limit),
            plant: plant.cast(),
            smooth: smooth.cast(),
        })
    }

    /// Whether the voltage is added that holds the arm at its reference against what pulls it.
    pub fn holds(&self) -> bool {
        self.hold
    }

    /// Every number that it depends on, by name; its plants are the rig's with all effects, and without dry friction.
    pub fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) {
        let [level, ahead, full] = self
            .friction
            .as_ref()
            .map_or([T::ZERO; 3], Friction::numbers);
        put("COMPENSATE_HOLD", Number::Whole(u32::from(self.hold)));
        put(
            "COMPENSATE_FRICTION",
            Number::Whole(u32::from(self.friction.is_some())),
        );
        put("COMPENSATE_MOTOR", Number::Whole(u32::from(self.motor)));
        put(
            "COMPENSATE_DISTURBANCE",
            Number::Whole(u32::from(self.disturbance)),
        );
        put("FRICTION_LEVEL", Number::Real(&[level]));
        put("FRICTION_AHEAD", Number::Real(&[ahead]));
        put("FRICTION_FULL", Number::Real(&[full]));
        put("MOTOR_HALVINGS", Number::Whole(motor::HALVINGS));
        put(
            "MOTOR_SMALL",
            Number::Real(&[crate::real::c::<T>(motor::STRAIGHT) * self.limit]),
        );
        put("MOTOR_LIMIT", Number::Real(&[self.limit]));
    }

    /// The command (V) in place of a balancing controller's `u`. Finite where `u` is; where a model has no finite
    /// answer, `u` stays.
    pub fn command(&self, u: T, at: &Situation<T>) -> T {
        let or_zero = |volts: T| if is_finite(volts) { volts } else { T::ZERO };
        let mut volts = u;
        if self.hold {
            volts += or_zero(hold::voltage(&self.smooth, at.reference));
        }
        if let Some(friction) = &self.friction {
            volts += or_zero(friction.voltage(&self.smooth, &at.x, volts));
        }
        if self.disturbance {
            volts -= or_zero(at.disturbance);
        }
        if self.motor && is_finite(volts) {
            volts = motor::command(&self.plant, volts, self.limit);
        }
        volts
    }
}
