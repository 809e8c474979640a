//! A user's own hypothesis: a law in the rig's variables that no effect of the catalogue has, written as text.
//!
//! The text is compiled once, its units checked, into a short tape that runs on any scalar; from then on it is an
//! effect like any other, with a [`Spec`] of its own that is kept for the life of the process. Reading and compiling
//! needs the feature `std`, running does not.

#[cfg(feature = "std")]
mod check;
#[cfg(feature = "std")]
mod define;
#[cfg(feature = "std")]
mod describe;
#[cfg(feature = "std")]
mod error;
#[cfg(feature = "std")]
mod file;
#[cfg(feature = "std")]
mod parse;
#[cfg(feature = "std")]
mod registry;
mod tape;
#[cfg(feature = "std")]
mod units;

#[cfg(feature = "std")]
pub use define::{Constant, Definition, InternalState, MAX_CONSTANTS, Parameter, Side};
#[cfg(feature = "std")]
pub use error::{HypothesisError, Marked, Problem};
#[cfg(feature = "std")]
pub(crate) use file::{HypothesisText, define as define_text};
#[cfg(feature = "std")]
pub use file::{MAX_HYPOTHESES, load, read};
#[cfg(feature = "std")]
pub(super) use registry::known;
/// Without `std` none can be read.
#[cfg(not(feature = "std"))]
pub(super) fn known(_: &str) -> Option<&'static Spec> {
    None
}
pub use tape::MAX_OPERATIONS;
#[cfg(feature = "std")]
pub use units::Unit;

use super::{Instant, Law, MAX_PARAMETERS, Spec};
use crate::jet::Jet;
use crate::scalar::Scalar;
use arrayvec::ArrayVec;
use tape::{Moment, Tape};

/// The compiled laws of a hypothesis ([`Spec::own`]).
#[derive(Debug)]
pub struct OwnLaws {
    /// Torque on the arm, N m.
    arm: Tape,
    /// Torque on the pendulum, N m.
    pendulum: Tape,
    /// What is added to the voltage, V.
    voltage: Tape,
    /// The state that the torques depend on.
    state: Option<OwnState>,
    /// Whether the torque on the arm acts on the motor's side of a drive.
    on_motor: bool,
    /// The lines of its table in a rig file.
    text: &'static str,
}

/// A state of a hypothesis.
#[cfg_attr(not(feature = "std"), allow(dead_code))] // only a parser makes them
#[derive(Debug)]
struct OwnState {
    /// How fast it changes, its unit per second.
    rate: Tape,
    /// Where it begins.
    start: f64,
}

impl OwnLaws {
    /// The lines of its table `[hypothesis."ID"]` in a file.
    #[must_use]
    pub fn text(&self) -> &'static str {
        self.text
    }
}

/// A hypothesis with values for its parameters: torques on the axes and a voltage that is added to the command's.
#[derive(Copy, Clone, Debug)]
pub struct Own<S> {
    spec: &'static Spec,
    laws: &'static OwnLaws,
    values: [S; MAX_PARAMETERS],
}

/// The same hypothesis with the same values. Hypotheses of the same text are kept once.
impl<S: PartialEq> PartialEq for Own<S> {
    fn eq(&self, other: &Self) -> bool {
        core::ptr::eq(self.laws, other.laws) && self.values == other.values
    }
}

impl<S: Scalar> Own<S> {
    /// With values in the order of the hypothesis's parameters; `None` for an effect that is not a user's own.
    pub(super) fn build(spec: &'static Spec, values: &[S]) -> Option<Self> {
        let mut own = Self {
            spec,
            laws: spec.own?,
            values: [S::ZERO; MAX_PARAMETERS],
        };
        for (slot, value) in own.values.iter_mut().zip(values) {
            *slot = *value;
        }
        Some(own)
    }

    pub(super) fn spec(&self) -> &'static Spec {
        self.spec
    }

    /// Behind every other effect.
    pub(super) fn rank(&self) -> usize {
        super::NAMED + super::EMPIRICAL.len()
    }

    /// The values in the order of the hypothesis's parameters.
    pub(super) fn values(&self) -> ArrayVec<S, MAX_PARAMETERS> {
        let count = self.spec.parameters.len();
        self.values.iter().take(count).copied().collect()
    }
}

impl<S: Scalar> Own<S> {
    /// Whether it acts on the motor's side of a drive.
    #[inline(always)]
    pub(crate) fn is_on_motor(&self) -> bool {
        self.laws.on_motor
    }

    /// Whether it has a state: then its torques are [`Own::torque_at`].
    #[inline(always)]
    pub(crate) fn has_state(&self) -> bool {
        self.laws.state.is_some()
    }

    /// Where its state begins.
    pub(crate) fn start(&self) -> S {
        S::from_f64(self.laws.state.as_ref().map_or(0.0, |state| state.start))
    }

    /// Torques on `[arm, pendulum]` with this state, N m.
    pub(crate) fn torque_at(&self, at: &Instant<'_, S>, state: S) -> [S; 2] {
        let at = moment(at, state);
        [&self.laws.arm, &self.laws.pendulum].map(|law| law.value(&self.values, &at))
    }

    /// How fast the state changes, its unit per second.
    pub(crate) fn rate(&self, at: &Instant<'_, S>, state: S) -> S {
        match &self.laws.state {
            Some(own) => own.rate.value(&self.values, &moment(at, state)),
            None => S::ZERO,
        }
    }

    /// By which share of its size a small difference in the state falls in a second, 1/s; negative where it grows.
    pub(crate) fn fading(&self, at: &Instant<'_, S>, state: S) -> S::Real {
        let Some(own) = &self.laws.state else {
            return S::Real::ZERO;
        };
        let constant = |x: S| Jet::<S::Real, 1>::constant(x.real());
        let m = moment(at, state);
        let m = Moment {
            theta: constant(m.theta),
            alpha: constant(m.alpha),
            theta_dot: constant(m.theta_dot),
            alpha_dot: constant(m.alpha_dot),
            u: constant(m.u),
            t: constant(m.t),
            state: Jet::variable(state.real(), 0),
            angle: m.angle.map(constant),
        };
        -own.rate.value(&self.values.map(constant), &m).d[0]
    }
}

/// What laws read at an instant.
#[inline(always)]
fn moment<S: Scalar>(at: &Instant<'_, S>, state: S) -> Moment<S> {
    let x = at.x;
    Moment {
        theta: x.theta,
        alpha: x.alpha,
        theta_dot: x.theta_dot,
        alpha_dot: x.alpha_dot,
        u: at.volts,
        t: at.clock.t,
        state,
        angle: [at.angle.sin, at.angle.cos],
    }
}

impl<S: Scalar> Law<S> for Own<S> {
    #[inline(always)]
    fn voltage(&self, t: S, volts: S) -> S {
        let at = Moment {
            theta: S::ZERO,
            alpha: S::ZERO,
            theta_dot: S::ZERO,
            alpha_dot: S::ZERO,
            u: volts,
            t,
            state: S::ZERO,
            angle: [S::ZERO; 2],
        };
        volts + self.laws.voltage.value(&self.values, &at)
    }

    /// What depends on a state is asked for with it.
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        if self.has_state() {
            return [S::ZERO; 2];
        }
        self.torque_at(at, S::ZERO)
    }
}
