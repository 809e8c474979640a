//! The catalogue: what a real rig does and the rigid-body equations leave out. One file per effect.
//!
//! Every effect says where it acts by implementing hooks of [`Law`] and listing them in [`Spec::acts`];
//! [`crate::Plant`] calls only those. To add one: write its file, add one line to the `catalogue!` call below. What few
//! rigs have, or recordings seldom tell from others, is an entry on request: each that is looked for costs time, and is
//! one more that a sound rig can be accused of.
//!
//! Parameters that are all "off" (zero strength) leave the plant exactly as it was.

mod acts;
mod at_rest;
mod attached;
mod custom;
mod error;
mod footprint;
mod law;
mod offered;
pub mod own;
mod pulse;
mod resonance;
mod spec;

pub use acts::Acts;
pub use at_rest::AtRest;
pub use attached::{EndStop, Relaxation, Winding};
pub use custom::{Custom, EMPIRICAL, TERMS, Term};
pub use error::EffectError;
pub use footprint::{BaseParameter, Footprint};
pub use law::{Clock, Drive, Instant, Law};
pub use offered::Offered;
pub use own::{Own, OwnLaws};
pub use resonance::Resonance;
pub use spec::{Kind, ParameterSpec, Spec, Typical};

use crate::actuation::Actuation;
use crate::params::{Coefficients, Params};
use crate::scalar::Scalar;
use arrayvec::ArrayVec;

/// The most parameters one effect can have.
pub const MAX_PARAMETERS: usize = 4;

/// Declares an effect's parameters once: the struct, and its conversions from and to plain lists of values.
macro_rules! parameters {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Copy, Clone, Debug, PartialEq)]
        pub struct $name<S> { $($(#[$field_doc])* pub $field: S),+ }

        impl<S: $crate::scalar::Scalar> $name<S> {
            /// From values in the order of the effect's parameter list (missing ones are zero).
            #[must_use]
            pub fn from_values(values: &[S]) -> Self {
                let mut values = values.iter().copied();
                Self { $($field: values.next().unwrap_or(S::ZERO)),+ }
            }

            /// The values in the order of the effect's parameter list.
            #[must_use]
            pub fn values(&self) -> arrayvec::ArrayVec<S, { $crate::effects::MAX_PARAMETERS }> {
                [$(self.$field),+].into_iter().collect()
            }
        }
    };
}

/// The list of all effects, and the enum over them.
macro_rules! catalogue {
    ($($module:ident :: $name:ident),+ $(,)?) => {
        $(mod $module; pub use $module::$name;)+

        /// Every effect, in the order in which they act.
        const ALL: &[Spec] = &[$($module::SPEC),+];

        /// One effect with its parameters' values.
        #[derive(Copy, Clone, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum Effect<S> {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name<S>),)+
            /// See [`Custom`].
            Custom(Custom<S>),
            /// See [`Own`].
            Own(Own<S>),
        }

        impl<S: Scalar> Effect<S> {
            fn build(id: &str, values: &[S]) -> Option<Self> {
                $(if id == $module::SPEC.id { return Some(Self::$name($name::from_values(values))); })+
                if let Some(e) = Custom::build(id, values) { return Some(Self::Custom(e)); }
                spec(id).and_then(|own| Own::build(own, values)).map(Self::Own)
            }

            /// What the catalogue says of it.
            #[must_use]
            pub fn spec(&self) -> &'static Spec {
                match self {
                    $(Self::$name(_) => &$module::SPEC,)+
                    Self::Custom(e) => e.spec(),
                    Self::Own(e) => e.spec(),
                }
            }

            /// Whether it is on the motor's side of a drive ([`Acts::SHAFT`]); empirical terms are on the arm, a user's
            /// own law says where.
            #[inline(always)]
            pub(crate) fn is_on_shaft(&self) -> bool {
                match self {
                    $(Self::$name(_) => const { $module::SPEC.acts.includes(Acts::SHAFT) },)+
                    Self::Custom(_) => false,
                    Self::Own(e) => e.is_on_motor(),
                }
            }

            /// A user's own law that has a state.
            #[inline(always)]
            pub(crate) fn with_state(&self) -> Option<&Own<S>> {
                match self {
                    Self::Own(e) if e.has_state() => Some(e),
                    _ => None,
                }
            }

            /// The order in which effects act: that of the one list, empirical terms behind it.
            #[must_use]
            pub fn rank(&self) -> usize {
                match self {
                    Self::Custom(e) => e.rank(),
                    Self::Own(e) => e.rank(),
                    _ => ALL
                        .iter()
                        .position(|s| s.id == self.spec().id)
                        .unwrap_or(usize::MAX),
                }
            }

            /// Values in the order of [`Spec::parameters`].
            #[must_use]
            pub fn values(&self) -> ArrayVec<S, MAX_PARAMETERS> {
                match self {
                    $(Self::$name(e) => e.values(),)+
                    Self::Custom(e) => e.values(),
                    Self::Own(e) => e.values(),
                }
            }
        }

        impl<S: Scalar> Law<S> for Effect<S> {
            #[inline(always)]
            fn voltage(&self, t: S, volts: S) -> S {
                match self {
                    $(Self::$name(e) => e.voltage(t, volts),)+
                    Self::Custom(e) => e.voltage(t, volts),
                    Self::Own(e) => e.voltage(t, volts),
                }
            }
            #[inline(always)]
            fn travelled(&self, memory: S, travel: S) -> S {
                match self {
                    $(Self::$name(e) => e.travelled(memory, travel),)+
                    Self::Custom(e) => e.travelled(memory, travel),
                    Self::Own(e) => e.travelled(memory, travel),
                }
            }
            #[inline(always)]
            fn jump_after(&self, run: usize, t: S) -> Option<S> {
                match self {
                    $(Self::$name(e) => e.jump_after(run, t),)+
                    Self::Custom(e) => e.jump_after(run, t),
                    Self::Own(e) => e.jump_after(run, t),
                }
            }
            #[inline(always)]
            fn drive(&self) -> Drive<S> {
                match self {
                    $(Self::$name(e) => e.drive(),)+
                    Self::Custom(e) => e.drive(),
                    Self::Own(e) => e.drive(),
                }
            }
            #[inline(always)]
            fn sensor_delay(&self) -> S {
                match self {
                    $(Self::$name(e) => e.sensor_delay(),)+
                    Self::Custom(e) => e.sensor_delay(),
                    Self::Own(e) => e.sensor_delay(),
                }
            }
            #[inline(always)]
            fn delay(&self) -> S {
                match self {
                    $(Self::$name(e) => e.delay(),)+
                    Self::Custom(e) => e.delay(),
                    Self::Own(e) => e.delay(),
                }
            }
            #[inline(always)]
            fn speed_limit(&self) -> S {
                match self {
                    $(Self::$name(e) => e.speed_limit(),)+
                    Self::Custom(e) => e.speed_limit(),
                    Self::Own(e) => e.speed_limit(),
                }
            }
            #[inline(always)]
            fn resonance(&self) -> Resonance<S> {
                match self {
                    $(Self::$name(e) => e.resonance(),)+
                    Self::Custom(e) => e.resonance(),
                    Self::Own(e) => e.resonance(),
                }
            }
            #[inline(always)]
            fn lag(&self) -> S {
                match self {
                    $(Self::$name(e) => e.lag(),)+
                    Self::Custom(e) => e.lag(),
                    Self::Own(e) => e.lag(),
                }
            }
            #[inline(always)]
            fn shape(&self, coefficients: Coefficients<S>) -> Coefficients<S> {
                match self {
                    $(Self::$name(e) => e.shape(coefficients),)+
                    Self::Custom(e) => e.shape(coefficients),
                    Self::Own(e) => e.shape(coefficients),
                }
            }
            #[inline(always)]
            fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
                match self {
                    $(Self::$name(e) => e.torque(at),)+
                    Self::Custom(e) => e.torque(at),
                    Self::Own(e) => e.torque(at),
                }
            }
            #[inline(always)]
            fn dry_friction(&self, at: &Instant<'_, S>) -> [S; 2] {
                match self {
                    $(Self::$name(e) => e.dry_friction(at),)+
                    Self::Custom(e) => e.dry_friction(at),
                    Self::Own(e) => e.dry_friction(at),
                }
            }
            #[inline(always)]
            fn reading(&self, angles: [S; 2]) -> [S; 2] {
                match self {
                    $(Self::$name(e) => e.reading(angles),)+
                    Self::Custom(e) => e.reading(angles),
                    Self::Own(e) => e.reading(angles),
                }
            }
            #[inline(always)]
            fn disc(&self, angles: [S; 2]) -> [S; 2] {
                match self {
                    $(Self::$name(e) => e.disc(angles),)+
                    Self::Custom(e) => e.disc(angles),
                    Self::Own(e) => e.disc(angles),
                }
            }
            #[inline(always)]
            fn untimely(&self, run: usize, t: S) -> S {
                match self {
                    $(Self::$name(e) => e.untimely(run, t),)+
                    Self::Custom(e) => e.untimely(run, t),
                    Self::Own(e) => e.untimely(run, t),
                }
            }
            #[inline(always)]
            fn lost(&self, run: usize, t: S) -> [S; 2] {
                match self {
                    $(Self::$name(e) => e.lost(run, t),)+
                    Self::Custom(e) => e.lost(run, t),
                    Self::Own(e) => e.lost(run, t),
                }
            }
            #[inline(always)]
            fn end_stop(&self) -> EndStop<S> {
                match self {
                    $(Self::$name(e) => e.end_stop(),)+
                    Self::Custom(e) => e.end_stop(),
                    Self::Own(e) => e.end_stop(),
                }
            }
            #[inline(always)]
            fn relaxation(&self) -> Relaxation<S> {
                match self {
                    $(Self::$name(e) => e.relaxation(),)+
                    Self::Custom(e) => e.relaxation(),
                    Self::Own(e) => e.relaxation(),
                }
            }
            #[inline(always)]
            fn winding(&self) -> Winding<S> {
                match self {
                    $(Self::$name(e) => e.winding(),)+
                    Self::Custom(e) => e.winding(),
                    Self::Own(e) => e.winding(),
                }
            }
            #[inline(always)]
            fn contradiction(&self) -> Option<&'static str> {
                match self {
                    $(Self::$name(e) => Law::<S>::contradiction(e),)+
                    Self::Custom(e) => Law::<S>::contradiction(e),
                    Self::Own(e) => Law::<S>::contradiction(e),
                }
            }
        }
    };
}

// In the order in which they act: what a recording seldom shows stands before what it shows.
catalogue! {
    arm_load_friction::ArmLoadFriction,
    arm_angle_friction::ArmAngleFriction,
    arm_fading_friction::ArmFadingFriction,
    arm_lugre::ArmLugre,
    arm_relaxation::ArmRelaxation,
    arm_stop::ArmStop,
    motor_resolution::MotorResolution,
    motor_inductance::MotorInductance,
    motor_current_limit::MotorCurrentLimit,
    sensor_theta_eccentricity::SensorThetaEccentricity,
    sensor_alpha_eccentricity::SensorAlphaEccentricity,
    arm_coulomb::ArmCoulomb,
    arm_stribeck::ArmStribeck,
    arm_quadratic::ArmQuadratic,
    arm_spring::ArmSpring,
    arm_cable::ArmCable,
    arm_presliding::ArmPresliding,
    arm_cogging::ArmCogging,
    arm_tilt::ArmTilt,
    motor_deadzone::MotorDeadzone,
    motor_bias::MotorBias,
    motor_saturation::MotorSaturation,
    motor_lag::MotorLag,
    motor_delay::MotorDelay,
    motor_asymmetry::MotorAsymmetry,
    motor_drift::MotorDrift,
    motor_ripple::MotorRipple,
    drive_backlash::DriveBacklash,
    drive_compliance::DriveCompliance,
    pendulum_coulomb::PendulumCoulomb,
    pendulum_quadratic::PendulumQuadratic,
    pendulum_spring::PendulumSpring,
    pendulum_bias::PendulumBias,
    pendulum_inertia_transverse::PendulumInertiaTransverse,
    sensor_alpha_offset::SensorAlphaOffset,
    sensor_alpha_scale::SensorAlphaScale,
    sensor_theta_scale::SensorThetaScale,
    sensor_delay::SensorDelay,
    sensor_jitter::SensorJitter,
    sensor_theta_lost_counts::SensorThetaLostCounts,
    sensor_alpha_lost_counts::SensorAlphaLostCounts,
    disturbance_vibration::DisturbanceVibration,
    disturbance_kick::DisturbanceKick,
    disturbance_arm_kick::DisturbanceArmKick,
    motor_speed_limit::MotorSpeedLimit,
    motor_resonance::MotorResonance,
    motor_lost_steps::MotorLostSteps,
}

/// One of the three lists that [`ALL`] falls into.
#[derive(Copy, Clone)]
enum List {
    Always,
    Rare,
    OfAcceleration,
}

impl List {
    const fn of(spec: &Spec) -> Self {
        if spec.acts.not_on(Actuation::Voltage).is_some() {
            Self::OfAcceleration
        } else if spec.offered.is_always() {
            Self::Always
        } else {
            Self::Rare
        }
    }

    const fn len(self) -> usize {
        let (mut n, mut i) = (0, 0);
        while i < ALL.len() {
            n += (Self::of(&ALL[i]) as u8 == self as u8) as usize;
            i += 1;
        }
        n
    }

    const fn entries<const N: usize>(self) -> [&'static Spec; N] {
        let mut entries = [&ALL[0]; N];
        let (mut n, mut i) = (0, 0);
        while i < ALL.len() {
            if Self::of(&ALL[i]) as u8 == self as u8 {
                entries[n] = &ALL[i];
                n += 1;
            }
            i += 1;
        }
        entries
    }
}

/// Every effect that a diagnosis looks for from the outset, in the catalogue's order.
pub static CATALOGUE: &[&Spec] = &List::Always.entries::<{ List::Always.len() }>();

/// Effects that few rigs have, or that recordings seldom tell from others ([`Spec::offered`] says why). They are
/// simulated, hidden and written in rig files as all others. A diagnosis looks for those of them that a fit can follow
/// where the others leave something, and from the outset on request ([`on_request`]).
pub static RARE: &[&Spec] = &List::Rare.entries::<{ List::Rare.len() }>();

/// All entries, those of one kind of rig at the end ([`Acts::kinds`]).
///
/// ```
/// use furuta_model::{CATALOGUE, RARE, effects};
/// let of_voltage = |s: &&furuta_model::Spec| s.acts.kinds().any(|kind| kind == "voltage");
/// assert_eq!(effects::all().filter(of_voltage).count(), CATALOGUE.len() + RARE.len());
/// assert!(effects::all().any(|s| s.id == "motor.resonance"));
/// ```
pub fn all() -> impl Iterator<Item = &'static Spec> {
    [CATALOGUE, RARE, OF_ACCELERATION]
        .into_iter()
        .flatten()
        .copied()
}

/// The entries that a diagnosis looks for where others leave something, or where they are asked for, those of one kind
/// of rig included.
///
/// ```
/// use furuta_model::effects;
/// assert!(effects::on_request().any(|s| s.id == "arm.stop"));
/// assert!(effects::on_request().all(|s| s.id != "arm.coulomb"));
/// ```
pub fn on_request() -> impl Iterator<Item = &'static Spec> {
    all().filter(|s| s.offered.is_on_request())
}

/// Effects of rigs alone whose command is an acceleration ([`crate::Actuation::Acceleration`]).
pub static OF_ACCELERATION: &[&Spec] =
    &List::OfAcceleration.entries::<{ List::OfAcceleration.len() }>();

/// The entry with this id, of the catalogue or of [`EMPIRICAL`]; or a user's own hypothesis ([`own`]) that this process
/// has read, of several with one id the last.
///
/// ```
/// let spec = furuta_model::effects::spec("arm.spring").expect("in the catalogue");
/// assert_eq!(spec.parameters[0].unit, "N m/rad");
/// ```
#[must_use]
pub fn spec(id: &str) -> Option<&'static Spec> {
    known().find(|s| s.id == id).or_else(|| own::known(id))
}

/// How many entries the three lists have.
const NAMED: usize = ALL.len();

/// Everything that a rig file can name: the catalogue, the entries on request, the effects of some kinds of rigs, and
/// then the empirical terms.
///
/// ```
/// assert!(furuta_model::effects::known().any(|s| s.id == "custom.1"));
/// assert!(furuta_model::CATALOGUE.iter().all(|s| s.id != "custom.1"));
/// ```
pub fn known() -> impl Iterator<Item = &'static Spec> {
    all().chain(EMPIRICAL.iter().copied())
}

impl<S: Scalar> Effect<S> {
    /// The effect `id` with `values` in the order of its [`Spec::parameters`].
    ///
    /// # Errors
    /// An unknown id, a wrong number of values, or a value outside its range.
    ///
    /// ```
    /// use furuta_model::{Effect, EffectError};
    /// assert!(Effect::new("arm.spring", &[8.6e-4, -0.5]).is_ok());
    /// let wrong = Effect::new("arm.spring", &[-1.0, 0.0]);
    /// assert!(matches!(wrong, Err(EffectError::OutOfRange { parameter: "stiffness", .. })));
    /// ```
    pub fn new(id: &str, values: &[S]) -> Result<Self, EffectError> {
        let spec = spec(id).ok_or(EffectError::UnknownEffect)?;
        Self::checked(spec, values)
    }

    /// The effect of this entry with `values` in the order of its parameters.
    ///
    /// # Errors
    /// An entry of no catalogue, a wrong number of values, or a value outside its range.
    pub fn checked(spec: &'static Spec, values: &[S]) -> Result<Self, EffectError> {
        check(spec, values)?;
        Self::of(spec, values).ok_or(EffectError::UnknownEffect)
    }

    /// The effect of this entry with values in the order of its parameters, without checking ranges: of a user's own
    /// hypothesis this very one, whatever else has its id. `None` for an entry that is of no catalogue.
    #[must_use]
    pub fn of(spec: &'static Spec, values: &[S]) -> Option<Self> {
        match Own::build(spec, values) {
            Some(own) => Some(Self::Own(own)),
            None => Self::build(spec.id, values),
        }
    }

    /// Checks its values against their ranges.
    ///
    /// # Errors
    /// The first value that is not a number, or outside its range.
    pub fn validate(&self) -> Result<(), EffectError> {
        check(self.spec(), &self.values())
    }

    /// The effect without checking ranges: a fit walks along the edges. `None` for an unknown id.
    #[must_use]
    pub fn unchecked(id: &str, values: &[S]) -> Option<Self> {
        Self::build(id, values)
    }

    /// Checks that it can act on a rig whose command is of this kind.
    ///
    /// # Errors
    /// [`EffectError::OtherActuation`], which says why not.
    ///
    /// ```
    /// use furuta_model::{Actuation, Effect};
    /// let friction = Effect::new("arm.coulomb", &[0.01])?;
    /// let error = friction.validate_for(Actuation::Acceleration).expect_err("a stepper's arm");
    /// assert!(error.to_string().starts_with("arm.coulomb cannot act on a rig whose motor.kind is \"acceleration\""));
    /// # Ok::<(), furuta_model::EffectError>(())
    /// ```
    pub fn validate_for(&self, actuation: Actuation) -> Result<(), EffectError> {
        let spec = self.spec();
        match spec.acts.not_on(actuation) {
            None => Ok(()),
            Some(why) => Err(EffectError::OtherActuation {
                effect: spec.id,
                actuation,
                why,
            }),
        }
    }

    /// Whether all its strengths (values and derivatives) are exactly zero, or exactly where they do nothing.
    #[must_use]
    pub fn is_off(&self) -> bool {
        let spec = self.spec();
        let values = self.values();
        let still = |off: fn(&ParameterSpec) -> f64| {
            spec.parameters
                .iter()
                .zip(&values)
                .take(spec.strengths)
                .all(|(p, v)| *v == S::from_f64(off(p)))
        };
        still(|_| 0.0) || still(|p| p.off)
    }

    /// The same effect in another scalar, its parameters constants.
    #[must_use]
    pub fn cast<T: Scalar>(&self) -> Effect<T> {
        let values: ArrayVec<T, MAX_PARAMETERS> = self
            .values()
            .iter()
            .map(|v| T::from_f64(v.value()))
            .collect();
        match Effect::of(self.spec(), &values) {
            Some(e) => e,
            // `spec()` only returns ids that `build` knows.
            None => unreachable!("an effect of the catalogue is in the catalogue"),
        }
    }
}

/// Whether `values` may be an effect's: as many as it has parameters, each within its range.
fn check<S: Scalar>(spec: &'static Spec, values: &[S]) -> Result<(), EffectError> {
    if values.len() != spec.parameters.len() {
        return Err(EffectError::WrongCount {
            effect: spec.id,
            given: values.len(),
            expected: spec.parameters.len(),
        });
    }
    // All zero is off, whatever the ranges.
    let on = values.iter().any(|v| v.value() != 0.0);
    for (p, v) in spec.parameters.iter().zip(values).filter(|_| on) {
        let value = v.value();
        if p.kind.is_whole() && value != libm::floor(value) {
            return Err(EffectError::NotWhole {
                effect: spec.id,
                parameter: p.name,
                value,
                min: p.min,
                max: p.max,
            });
        }
        if !(value >= p.min && value <= p.max) {
            return Err(EffectError::OutOfRange {
                effect: spec.id,
                parameter: p.name,
                value,
                min: p.min,
                max: p.max,
                unit: p.unit,
            });
        }
    }
    Ok(())
}

/// The torque of a stalled motor at the command's limit, N m: the yardstick for torques on the arm.
fn stall_torque(p: &Params<f64>) -> f64 {
    p.coefficients().drive * p.motor.command_limit
}
