//! The hooks by which an effect changes a plant, and what they are given.

use super::attached::{EndStop, Relaxation, Winding};
use super::resonance::Resonance;
use crate::dynamics::Angle;
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;

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

/// The hooks by which an effect changes the plant; each does nothing unless implemented (and listed in
/// [`super::Spec::acts`]).
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

    /// How an arm whose acceleration is commanded rings about the command.
    #[inline(always)]
    fn resonance(&self) -> Resonance<S> {
        Resonance::NONE
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

    /// The first time after `t` in this run at which the effect begins, ends or jumps, s.
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

    /// How much later than time `t` (s) of this run says its readings are taken, s.
    #[inline(always)]
    fn untimely(&self, run: usize, t: S) -> S {
        let _ = (run, t);
        S::ZERO
    }

    /// By how much the encoders' counts are wrong at time `t` (s) of this run for good, `[theta, alpha]`, rad.
    #[inline(always)]
    fn lost(&self, run: usize, t: S) -> [S; 2] {
        let _ = (run, t);
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

    /// Why values like these are not what the effect's name says, where they are not: friction that grows with the
    /// speed is not Stribeck's. They are simulated all the same, and never named by a diagnosis.
    #[inline(always)]
    fn contradiction(&self) -> Option<&'static str> {
        None
    }
}
