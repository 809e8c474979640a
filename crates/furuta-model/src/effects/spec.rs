//! What an effect is: where it acts, its parameters, and what to tell a student about it.

use crate::dynamics::Angle;
use crate::params::{Coefficients, Params};
use crate::scalar::Scalar;
use crate::state::State;

/// Where an effect acts, so that a plant calls only the hooks that do something.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Default)]
pub struct Acts(u8);

impl Acts {
    /// Nowhere.
    pub const NOWHERE: Self = Self(0);
    /// Between command and motor voltage, without memory ([`Law::voltage`]).
    pub const VOLTAGE: Self = Self(1);
    /// Delays the command ([`Law::delay`]).
    pub const DELAY: Self = Self(2);
    /// Low-pass between command and motor ([`Law::lag`]).
    pub const LAG: Self = Self(4);
    /// A torque that depends on time and state ([`Law::torque`]).
    pub const TORQUE: Self = Self(8);
    /// Dry friction, able to hold an axis still ([`Law::dry_friction`]).
    pub const DRY_FRICTION: Self = Self(16);
    /// Between true and measured angles ([`Law::reading`]).
    pub const READING: Self = Self(32);

    /// On the coefficients of the equations of motion ([`Law::shape`]).
    pub const SHAPE: Self = Self(64);

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
}

/// One parameter of an effect.
#[derive(Copy, Clone, Debug)]
pub struct ParameterSpec {
    /// As in rig files and JSON.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Lower end of the allowed range.
    pub min: f64,
    /// Upper end of the allowed range.
    pub max: f64,
    /// The value at which the effect does nothing (a strength: 0, a gain: 1), or from which this parameter is counted.
    pub off: f64,
    /// A distance from `off` that would be noticed on this rig: the unit in which a search takes its steps.
    pub typical: fn(&Params<f64>) -> f64,
    /// Where a search starts, as multiples of `typical` from `off`.
    pub starts: &'static [f64],
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
    /// How many of them, from the first, are strengths: the effect does nothing where all of these are zero, or at their [`ParameterSpec::off`].
    pub strengths: usize,
    /// Which hooks it implements.
    pub acts: Acts,
}

/// What an effect may depend on at one moment.
#[derive(Copy, Clone, Debug)]
pub struct Instant<'a, S> {
    /// Time since the run began, s.
    pub t: S,
    /// The true state.
    pub x: &'a State<S>,
    /// Sine and cosine of the pendulum's angle.
    pub angle: Angle<S>,
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

    /// Measured `[theta, alpha]` for true ones, rad.
    #[inline(always)]
    fn reading(&self, angles: [S; 2]) -> [S; 2] {
        angles
    }
}

/// What is wrong with an effect asked for.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum EffectError {
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
}

impl core::fmt::Display for EffectError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::UnknownEffect => write!(f, "no such effect in the catalogue"),
            Self::WrongCount {
                effect,
                given,
                expected,
            } => write!(
                f,
                "{effect} has {expected} parameters, {given} values were given"
            ),
            Self::OutOfRange {
                effect,
                parameter,
                value,
                min,
                max,
                unit,
            } => write!(
                f,
                "{effect}: {parameter} = {value} is outside the allowed range [{min}, {max}] {unit}"
            ),
        }
    }
}

impl core::error::Error for EffectError {}
