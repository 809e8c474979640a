//! Where an effect acts.

use crate::actuation::Actuation;

/// Where an effect acts, so that a plant calls only the hooks that do something.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Default)]
pub struct Acts(u32);

/// Marks of an effect, each a bit of its own.
macro_rules! marks {
    ($($(#[$doc:meta])* $name:ident,)+) => {
        /// The number of each mark's bit.
        #[expect(non_camel_case_types, clippy::upper_case_acronyms)]
        enum Bit { $($name,)+ }

        impl Acts {
            $($(#[$doc])* pub const $name: Self = Self(1 << Bit::$name as u32);)+
        }
    };
}

marks! {
    /// Between command and motor voltage, without memory ([`Law::voltage`](super::Law::voltage)).
    VOLTAGE,
    /// Delays the command ([`Law::delay`](super::Law::delay)).
    DELAY,
    /// Low-pass between command and motor ([`Law::lag`](super::Law::lag)).
    LAG,
    /// A torque that depends on time and state ([`Law::torque`](super::Law::torque)).
    TORQUE,
    /// Dry friction, able to hold an axis still ([`Law::dry_friction`](super::Law::dry_friction)).
    DRY_FRICTION,
    /// Between true and measured angles ([`Law::reading`](super::Law::reading)).
    READING,
    /// On the coefficients of the equations of motion ([`Law::shape`](super::Law::shape)).
    SHAPE,
    /// A torque that depends on where the arm has been ([`Law::travelled`](super::Law::travelled)).
    MEMORY,
    /// Jumps at known times ([`Law::jump_after`](super::Law::jump_after)).
    JUMPS,
    /// Between rotor and arm ([`Law::drive`](super::Law::drive)).
    DRIVE,
    /// Delays the encoders ([`Law::sensor_delay`](super::Law::sensor_delay)).
    SENSOR_DELAY,
    /// It depends on the arm's absolute angle: where the arm's encoder was zeroed matters.
    ANGLE,
    /// On the motor's side of a drive: where rotor and arm are two bodies it acts on the rotor, at the rotor's angle
    /// and speed, as the arm's damping does.
    SHAFT,
    /// Bodies meet in blows: what is wrong before a blow is many times as wrong after it.
    BLOWS,
    /// On what the encoders' discs show of the true angles ([`Law::disc`](super::Law::disc)).
    DISC,
    /// Something that the arm touches and leaves ([`Law::end_stop`](super::Law::end_stop)).
    CONTACT,
    /// It has a state that follows a differential equation ([`Law::relaxation`](super::Law::relaxation),
    /// [`Law::winding`](super::Law::winding), or that of a user's own law).
    INNER,
    /// Its strength counts backwards: the larger the number, the less it does (a limit, the stiffness of a coupling).
    BACKWARDS,
    /// Its strength is a limit: where it is not reached nothing happens. What it does is in proportion to no number.
    LIMIT,
    /// Keeps the arm's speed within bounds ([`Law::speed_limit`](super::Law::speed_limit)).
    SPEED_LIMIT,
    /// The arm rings about the commanded acceleration ([`Law::resonance`](super::Law::resonance)).
    RESONANCE,
    /// Of a motor that goes by steps.
    STEPS,
    /// A torque on the arm alone that is not of the motor's side: an arm that follows an acceleration does not feel it.
    ARM,
    /// Its law is of a voltage and the current that it drives against the back-EMF.
    CURRENT,
    /// A user's own law with a state ([`super::own::InternalState`]).
    STATE,
    /// The encoders' counts step at a moment ([`Law::lost`](super::Law::lost)).
    COUNTS,
    /// The readings are not of the moment that their stamps say ([`Law::untimely`](super::Law::untimely)).
    UNTIMELY,
    /// On the pendulum alone, or on its encoder.
    PENDULUM,
    /// Shifts an encoder's zero, as each recording's own zero does.
    ZERO,
    /// Its law depends on the time since the run began, all the while: what begins and ends at moments has
    /// [`Self::JUMPS`].
    CLOCK,
}

impl Acts {
    /// Nowhere.
    pub const NOWHERE: Self = Self(0);

    /// Everything that moves the arm by a torque, or lies between motor and arm.
    const ON_ARM: Self = Self::ARM
        .and(Self::SHAFT)
        .and(Self::MEMORY)
        .and(Self::DRIVE)
        .and(Self::CONTACT);

    /// Everything that a motor alone has whose command is an acceleration.
    const STEPPER: Self = Self::SPEED_LIMIT.and(Self::RESONANCE).and(Self::STEPS);

    /// Everything on the arm's side, where it is not on the pendulum's encoder: between command and arm, and the arm's
    /// encoder.
    const OF_ARM: Self = Self::ON_ARM
        .and(Self::VOLTAGE)
        .and(Self::DELAY)
        .and(Self::LAG)
        .and(Self::CURRENT)
        .and(Self::STEPPER)
        .and(Self::READING)
        .and(Self::DISC)
        .and(Self::COUNTS);

    /// Whether recordings can show what acts here where each of the angles `[theta, alpha]` is looked at, or not.
    ///
    /// ```
    /// use furuta_model::effects;
    /// let acts = |id| effects::spec(id).expect("in the catalogue").acts;
    /// assert!(!acts("pendulum.spring").shows_in([true, false]));
    /// assert!(!acts("sensor.theta.scale").shows_in([false, true]));
    /// assert!(acts("arm.tilt").shows_in([false, true]));
    /// ```
    #[must_use]
    pub const fn shows_in(self, looks_at: [bool; 2]) -> bool {
        if self.includes(Self::PENDULUM) {
            looks_at[1]
        } else {
            looks_at[0] || !self.touches(Self::OF_ARM)
        }
    }

    /// Why an effect that acts here cannot act on a rig whose command is of this kind; `None` where it can.
    ///
    /// ```
    /// use furuta_model::{Actuation, effects};
    /// let not_on = |id, kind| effects::spec(id).expect("in the catalogue").acts.not_on(kind);
    /// assert!(not_on("motor.delay", Actuation::Acceleration).is_none());
    /// assert!(not_on("arm.coulomb", Actuation::Acceleration).is_some());
    /// assert!(not_on("motor.inductance", Actuation::Torque).is_some());
    /// assert!(not_on("motor.speed_limit", Actuation::Voltage).is_some());
    /// ```
    #[must_use]
    pub const fn not_on(self, actuation: Actuation) -> Option<&'static str> {
        match actuation {
            Actuation::Acceleration if self.touches(Self::ON_ARM) => {
                Some("the arm follows the commanded acceleration whatever torque acts on it")
            }
            Actuation::Current | Actuation::Torque if self.touches(Self::CURRENT) => Some(
                "its law is of a motor that a voltage drives; the current of this one is commanded",
            ),
            Actuation::Acceleration if self.touches(Self::CURRENT) => {
                Some("its law is of a motor that a voltage drives")
            }
            Actuation::Voltage | Actuation::Current | Actuation::Torque
                if self.touches(Self::STEPPER) =>
            {
                Some(
                    "only a motor whose command is an acceleration goes by steps and keeps to a speed",
                )
            }
            _ => None,
        }
    }

    /// Each `motor.kind` of rigs on which such an effect can act.
    ///
    /// ```
    /// use furuta_model::effects;
    /// let kinds = |id| effects::spec(id).expect("in the catalogue").acts.kinds();
    /// assert!(kinds("motor.delay").eq(["voltage", "torque", "acceleration"]));
    /// assert!(kinds("motor.resonance").eq(["acceleration"]));
    /// ```
    pub fn kinds(self) -> impl Iterator<Item = &'static str> {
        [
            Actuation::Voltage,
            Actuation::Torque,
            Actuation::Acceleration,
        ]
        .into_iter()
        .filter(move |actuation| self.not_on(*actuation).is_none())
        .map(Actuation::kind)
    }

    /// Both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of `other` is included.
    #[inline(always)]
    #[must_use]
    pub const fn includes(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether any of `other` is included.
    #[inline(always)]
    #[must_use]
    pub const fn touches(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}
