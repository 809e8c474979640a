//! What an effect is: where it acts, its parameters, and what to tell a student about it.

use super::at_rest::AtRest;
use super::attached::{EndStop, Relaxation, Winding};
use super::footprint::Footprint;
use super::offered::Offered;
use super::own::OwnLaws;
use crate::actuation::Actuation;
use crate::dynamics::Angle;
use crate::params::{Coefficients, Params};
use crate::scalar::Scalar;
use crate::state::State;

/// Where an effect acts, so that a plant calls only the hooks that do something.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Default)]
pub struct Acts(u32);

impl Acts {
    /// Nowhere.
    pub const NOWHERE: Self = Self(0);
    /// Between command and motor voltage, without memory ([`Law::voltage`]).
    pub const VOLTAGE: Self = Self(1);
    /// Delays the command ([`Law::delay`]).
    pub const DELAY: Self = Self(1 << 1);
    /// Low-pass between command and motor ([`Law::lag`]).
    pub const LAG: Self = Self(1 << 2);
    /// A torque that depends on time and state ([`Law::torque`]).
    pub const TORQUE: Self = Self(1 << 3);
    /// Dry friction, able to hold an axis still ([`Law::dry_friction`]).
    pub const DRY_FRICTION: Self = Self(1 << 4);
    /// Between true and measured angles ([`Law::reading`]).
    pub const READING: Self = Self(1 << 5);
    /// On the coefficients of the equations of motion ([`Law::shape`]).
    pub const SHAPE: Self = Self(1 << 6);
    /// A torque that depends on where the arm has been ([`Law::travelled`]).
    pub const MEMORY: Self = Self(1 << 7);
    /// Jumps at known times ([`Law::jump_after`]).
    pub const JUMPS: Self = Self(1 << 8);
    /// Between rotor and arm ([`Law::drive`]).
    pub const DRIVE: Self = Self(1 << 9);
    /// Delays the encoders ([`Law::sensor_delay`]).
    pub const SENSOR_DELAY: Self = Self(1 << 10);
    /// It depends on the arm's absolute angle: where the arm's encoder was zeroed matters.
    pub const ANGLE: Self = Self(1 << 11);
    /// On the motor's side of a drive: where rotor and arm are two bodies it acts on the rotor, at the rotor's angle
    /// and speed, as the arm's damping does.
    pub const SHAFT: Self = Self(1 << 12);
    /// Bodies meet in blows: what is wrong before a blow is many times as wrong after it.
    pub const BLOWS: Self = Self(1 << 13);
    /// On what the encoders' discs show of the true angles ([`Law::disc`]).
    pub const DISC: Self = Self(1 << 14);
    /// Something that the arm touches and leaves ([`Law::end_stop`]).
    pub const CONTACT: Self = Self(1 << 15);
    /// It has a state that follows a differential equation ([`Law::relaxation`], [`Law::winding`]).
    pub const INNER: Self = Self(1 << 16);
    /// Its strength counts backwards: the larger the number, the less it does (a limit, the stiffness of a coupling).
    pub const BACKWARDS: Self = Self(1 << 17);
    /// Keeps the arm's speed within bounds ([`Law::speed_limit`]).
    pub const SPEED_LIMIT: Self = Self(1 << 18);

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

/// What values a parameter can take.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A real number: a fit varies it.
    Real,
    /// An angle that a sine or the effect's direction begins at, rad: the effect is the sum of a part at 0 and a part
    /// at a quarter turn.
    Phase,
    /// The arm's angle from which the effect is counted, rad: turning the arm and this angle together changes nothing.
    Rest,
    /// A frequency, Hz: a search looks through a grid as fine as the recordings are long.
    Frequency,
    /// A moment of a run, s: a search looks through all of them.
    Time,
    /// The number of a run, from 0.
    Run,
    /// A whole number: a search tries one after the other.
    Whole,
    /// One of these, by name in rig files and by its place in the list elsewhere.
    Choice(&'static [&'static str]),
}

/// How large something is that would be noticed.
#[derive(Copy, Clone, Debug)]
pub enum Typical {
    /// So large on a rig with these parameters.
    Of(fn(&Params<f64>) -> f64),
    /// So large on any rig.
    Is(f64),
}

/// One parameter of an effect.
#[derive(Copy, Clone, Debug)]
pub struct ParameterSpec {
    /// As in rig files and JSON.
    pub name: &'static str,
    /// SI unit (`-`: a pure number).
    pub unit: &'static str,
    /// Which values it can take within the range.
    pub kind: Kind,
    /// The value where a rig file leaves it out; without one it must be given.
    pub default: Option<f64>,
    /// Lower end of the allowed range.
    pub min: f64,
    /// Upper end of the allowed range.
    pub max: f64,
    /// The value at which the effect does nothing (a strength: 0, a gain: 1), or from which this parameter is counted.
    pub off: f64,
    /// A distance from `off` that would be noticed on this rig: the unit in which a search takes its steps.
    pub typical: Typical,
    /// Where a search starts, as multiples of `typical` from `off`.
    pub starts: &'static [f64],
}

impl Kind {
    /// Whether it varies continuously, so that a fit can improve it.
    #[must_use]
    pub const fn is_continuous(self) -> bool {
        matches!(
            self,
            Self::Real | Self::Phase | Self::Rest | Self::Frequency | Self::Time
        )
    }
}

impl ParameterSpec {
    /// A distance from `off` that would be noticed on a rig with these parameters, in the parameter's unit.
    ///
    /// ```
    /// let rig = furuta_model::Rig::builtin("qube-servo-2").expect("built in");
    /// let rest = &furuta_model::effects::spec("arm.spring").expect("in the catalogue").parameters[1];
    /// assert_eq!(rest.typical(&rig.params), 0.3); // rad
    /// ```
    #[must_use]
    pub fn typical(&self, params: &Params<f64>) -> f64 {
        match self.typical {
            Typical::Of(size) => size(params),
            Typical::Is(size) => size,
        }
    }

    /// The value that `word` stands for, where the parameter is a choice.
    #[must_use]
    pub fn choice(&self, word: &str) -> Option<f64> {
        match self.kind {
            Kind::Choice(words) => {
                let place = words.iter().position(|w| *w == word)?;
                #[allow(clippy::cast_precision_loss)]
                Some(place as f64)
            }
            _ => None,
        }
    }

    /// The word for a value, where the parameter is a choice.
    #[must_use]
    pub fn word(&self, value: f64) -> Option<&'static str> {
        match self.kind {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            Kind::Choice(words) => words.get(value as usize).copied(),
            _ => None,
        }
    }
}

/// A catalogue entry.
#[derive(Copy, Clone, Debug)]
pub struct Spec {
    /// Public name: rig files, JSON, Python, reports.
    pub id: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// The physics as a formula.
    pub law: &'static str,
    /// One sentence a student understands.
    pub sentence: &'static str,
    /// How it shows in recorded data.
    pub shows: &'static str,
    /// The experiment that shows it apart from its look-alikes.
    pub experiment: &'static str,
    /// Ids of effects that look alike in data.
    pub look_alikes: &'static [&'static str],
    /// Its parameters.
    pub parameters: &'static [ParameterSpec],
    /// How many of them, from the first, are strengths: the effect does nothing where all of these are zero, or at
    /// their [`ParameterSpec::off`].
    pub strengths: usize,
    /// What it leaves in a transfer function.
    pub footprint: Footprint,
    /// Which hooks it implements.
    pub acts: Acts,
    /// What becomes of it in a linear model about a place of rest.
    pub at_rest: AtRest,
    /// The laws of a user's own hypothesis; none of the catalogue has them.
    pub own: Option<&'static OwnLaws>,
    /// Whether a diagnosis looks for it unasked.
    pub offered: Offered,
}

/// What an effect may depend on at one moment.
#[derive(Copy, Clone, Debug)]
pub struct Instant<'a, S> {
    /// The time.
    pub clock: Clock<S>,
    /// The true state.
    pub x: &'a State<S>,
    /// Sine and cosine of the pendulum's angle.
    pub angle: Angle<S>,
    /// What the whole rig's equations of motion are made of, rotor and motor included.
    pub coefficients: &'a Coefficients<S>,
    /// What [`Law::travelled`] keeps.
    pub memory: S,
    /// Voltage at the motor, V.
    pub volts: S,
}

/// A moment of a run.
#[derive(Copy, Clone, Debug)]
pub struct Clock<S> {
    /// Which run it is, from 0.
    pub run: usize,
    /// Time since the run began, s.
    pub t: S,
    /// A time within the same stretch between jumps ([`Law::jump_after`]): what acts at times only asks this one, since
    /// an integrator looks at the very edges.
    pub within: S,
}

impl<S: Scalar> Clock<S> {
    /// The moment `t` (s) of the first run.
    #[inline(always)]
    #[must_use]
    pub fn at(t: S) -> Self {
        Self {
            run: 0,
            t,
            within: t,
        }
    }
}

/// What lies between the motor's rotor and the arm. All zero: they are one body.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Drive<S> {
    /// Backlash: rotor and arm are free of each other within `gap/2` either way, rad.
    pub gap: S,
    /// Of the coupling, N m/rad; 0: rigid.
    pub stiffness: S,
    /// Of the coupling, N m s/rad.
    pub damping: S,
    /// The rotor's share of [`Coefficients::hub`], 0 to 1.
    pub motor_share: S,
    /// Whether the arm's encoder sits on the rotor.
    pub encoder_on_motor: bool,
}

impl<S: Scalar> Drive<S> {
    /// Rotor and arm are one body.
    pub const RIGID: Self = Self {
        gap: S::ZERO,
        stiffness: S::ZERO,
        damping: S::ZERO,
        motor_share: S::ZERO,
        encoder_on_motor: false,
    };
}

/// The hooks by which an effect changes the plant; each does nothing unless implemented (and listed in [`Spec::acts`]).
pub trait Law<S: Scalar> {
    /// Voltage out for voltage in, at time `t` (s).
    #[inline(always)]
    fn voltage(&self, t: S, volts: S) -> S {
        let _ = t;
        volts
    }

    /// By how much the command is late, s.
    #[inline(always)]
    fn delay(&self) -> S {
        S::ZERO
    }

    /// Largest speed of an arm whose acceleration is commanded, rad/s.
    #[inline(always)]
    fn speed_limit(&self) -> S {
        S::ZERO
    }

    /// Time constant of a first-order lag of the voltage, s.
    #[inline(always)]
    fn lag(&self) -> S {
        S::ZERO
    }

    /// Changes what the equations of motion are made of.
    #[inline(always)]
    fn shape(&self, coefficients: Coefficients<S>) -> Coefficients<S> {
        coefficients
    }

    /// Torque on `[arm, pendulum]`, N m.
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        let _ = at;
        [S::ZERO; 2]
    }

    /// The largest torque with which dry friction can hold or brake `[arm, pendulum]`, N m.
    #[inline(always)]
    fn dry_friction(&self, at: &Instant<'_, S>) -> [S; 2] {
        let _ = at;
        [S::ZERO; 2]
    }

    /// What is remembered of the arm's travel after `travel` more (rad) without a reversal, from what was remembered
    /// before.
    #[inline(always)]
    fn travelled(&self, memory: S, travel: S) -> S {
        let _ = travel;
        memory
    }

    /// The first time after `t` in this run at which the effect jumps, s.
    #[inline(always)]
    fn jump_after(&self, run: usize, t: S) -> Option<S> {
        let _ = (run, t);
        None
    }

    /// What it puts between rotor and arm.
    #[inline(always)]
    fn drive(&self) -> Drive<S> {
        Drive::RIGID
    }

    /// By how much the encoders are late, s.
    #[inline(always)]
    fn sensor_delay(&self) -> S {
        S::ZERO
    }

    /// Measured `[theta, alpha]` for those that the discs show, rad.
    #[inline(always)]
    fn reading(&self, angles: [S; 2]) -> [S; 2] {
        angles
    }

    /// By how much the encoders' discs stand wrong at the true `[theta, alpha]`, rad.
    #[inline(always)]
    fn disc(&self, angles: [S; 2]) -> [S; 2] {
        let _ = angles;
        [S::ZERO; 2]
    }

    /// What the arm meets at the ends of its way.
    #[inline(always)]
    fn end_stop(&self) -> EndStop<S> {
        EndStop::NONE
    }

    /// What pulls at the arm and gives way in time.
    #[inline(always)]
    fn relaxation(&self) -> Relaxation<S> {
        Relaxation::NONE
    }

    /// What delays the motor's current.
    #[inline(always)]
    fn winding(&self) -> Winding<S> {
        Winding::PROMPT
    }
}

/// What is wrong with an effect asked for.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum EffectError {
    /// An effect that makes no sense on a rig with this kind of command.
    OtherActuation {
        /// The effect's id.
        effect: &'static str,
        /// What the rig's command is.
        actuation: Actuation,
        /// Why not.
        why: &'static str,
    },
    /// The id is not in the catalogue.
    UnknownEffect,
    /// The number of values differs from the number of parameters.
    WrongCount {
        /// The effect's id.
        effect: &'static str,
        /// How many were given.
        given: usize,
        /// How many it has.
        expected: usize,
    },
    /// A parameter without a default was left out.
    Missing {
        /// The effect's id.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// Its unit.
        unit: &'static str,
    },
    /// A value outside its range, or not a number.
    OutOfRange {
        /// The effect's id.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// What was given.
        value: f64,
        /// Lower end of the range.
        min: f64,
        /// Upper end of the range.
        max: f64,
        /// Unit.
        unit: &'static str,
    },
    /// A fraction where a whole number or a place in a list is wanted.
    NotWhole {
        /// The effect's id.
        effect: &'static str,
        /// The parameter's name.
        parameter: &'static str,
        /// What was given.
        value: f64,
        /// Lower end of the range.
        min: f64,
        /// Upper end of the range.
        max: f64,
    },
}

impl Spec {
    /// Whether it is a function of the present state and of the motor's voltage alone: it remembers nothing, does not
    /// depend on time, and changes neither the command nor the readings. A run with such effects can be cut into
    /// pieces that begin with a state.
    ///
    /// ```
    /// let follows = |id| furuta_model::effects::spec(id).expect("in the catalogue").follows_state();
    /// assert!(follows("arm.coulomb") && follows("motor.ripple"));
    /// assert!(!follows("motor.delay") && !follows("arm.presliding") && !follows("disturbance.vibration"));
    /// ```
    #[must_use]
    pub fn follows_state(&self) -> bool {
        let of_state = Acts::TORQUE
            .and(Acts::DRY_FRICTION)
            .and(Acts::SHAPE)
            .and(Acts::ANGLE)
            .and(Acts::SHAFT);
        let depends_on_time = self.footprint == Footprint::UNCOMMANDED || self.own.is_some();
        of_state.includes(self.acts) && !depends_on_time
    }

    /// Whether both are the same entry: of users' own laws the very same text.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        let same_law = match (self.own, other.own) {
            (None, None) => true,
            (Some(a), Some(b)) => core::ptr::eq(a, b),
            _ => false,
        };
        self.id == other.id && same_law
    }

    /// The values in the order of the parameters: those given, defaults for what is left out.
    ///
    /// # Errors
    /// [`EffectError::Missing`] where a parameter that has no default is left out.
    ///
    /// ```
    /// use furuta_model::effects;
    /// let drive = effects::spec("drive.backlash").expect("in the catalogue");
    /// let given = |name: &str| match name {
    ///     "gap" => Some(0.05),
    ///     "motor_share" => Some(0.4),
    ///     _ => None, // encoder = "arm"
    /// };
    /// assert_eq!(drive.values(given)?[..], [0.05, 0.4, 0.0]);
    /// let error = drive.values(|_| None).expect_err("no gap");
    /// assert_eq!(error.to_string(), "drive.backlash lacks gap (rad): give it a value");
    /// # Ok::<(), furuta_model::EffectError>(())
    /// ```
    pub fn values(
        &self,
        given: impl Fn(&str) -> Option<f64>,
    ) -> Result<arrayvec::ArrayVec<f64, { super::MAX_PARAMETERS }>, EffectError> {
        let value = |p: &ParameterSpec| {
            given(p.name).or(p.default).ok_or(EffectError::Missing {
                effect: self.id,
                parameter: p.name,
                unit: p.unit,
            })
        };
        self.parameters.iter().map(value).collect()
    }
}

impl core::fmt::Display for EffectError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::UnknownEffect => {
                write!(f, "no such effect in the catalogue, nor an empirical term")
            }
            Self::WrongCount {
                effect,
                given,
                expected,
            } => write!(
                f,
                "{effect} has {expected} parameters, {given} values were given"
            ),
            Self::Missing {
                effect,
                parameter,
                unit,
            } => write!(f, "{effect} lacks {parameter} ({unit}): give it a value"),
            Self::OutOfRange {
                effect,
                parameter,
                value,
                min,
                max,
                unit,
            } => write!(
                f,
                "{effect}: {parameter} = {} is outside the allowed range [{min}, {max}] {unit}",
                furuta_input::number(*value)
            ),
            Self::OtherActuation {
                effect,
                actuation,
                why,
            } => write!(
                f,
                "{effect} cannot act on a rig whose motor.kind is \"{actuation}\" ({why}): leave it out"
            ),
            Self::NotWhole {
                effect,
                parameter,
                value,
                min,
                max,
            } => write!(
                f,
                "{effect}: {parameter} = {} must be a whole number in [{min}, {max}]",
                furuta_input::number(*value)
            ),
        }
    }
}

impl core::error::Error for EffectError {}
