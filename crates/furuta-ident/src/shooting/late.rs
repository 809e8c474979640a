//! By how much what was recorded is late: commands that act later, readings that are older than their stamps.

use furuta_model::effects::Acts;
use furuta_model::{Effect, Scalar, Spec};

/// Delays of a rig, s. They are not simulated but read off the time axis ([`super::predict`]).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Late<S> {
    /// By how much commands act later.
    command: S,
    /// By how much readings are older.
    readings: S,
}

/// Whether an effect is a delay, of the command or of the encoders: the same on recorded input and output.
pub(crate) fn is_late(spec: &Spec) -> bool {
    spec.acts.touches(Acts::DELAY.and(Acts::SENSOR_DELAY))
}

impl<S: Scalar<Real = f64>> Late<S> {
    /// Commands that act later, by nothing or by what is not known to be an effect's.
    pub(crate) fn by(command: S) -> Self {
        Self {
            command,
            readings: S::ZERO,
        }
    }

    /// Adds the delay that an effect is; `false` if it is none.
    pub(crate) fn add(&mut self, effect: &Effect<S>) -> bool {
        let spec = effect.spec();
        if !is_late(spec) {
            return false;
        }
        let delay = effect.values()[0];
        if spec.acts.includes(Acts::DELAY) {
            self.command += delay;
        } else {
            self.readings += delay;
        }
        true
    }

    /// By how much readings follow the command later, s.
    #[inline(always)]
    pub(crate) fn total(&self) -> S {
        self.command + self.readings
    }

    /// By how much the rig's clock is before a simulation's in which commands act `moved` seconds (whole samples) later
    /// and readings are taken at the rest of the delay: what happens at a moment of the rig happens as much earlier in
    /// that simulation.
    #[inline(always)]
    pub(crate) fn clock(&self, moved: f64) -> S {
        self.command - S::from_f64(moved)
    }

    /// The same in another scalar, all a constant.
    pub(crate) fn cast<T: Scalar<Real = f64>>(&self) -> Late<T> {
        Late {
            command: T::from_f64(self.command.value()),
            readings: T::from_f64(self.readings.value()),
        }
    }
}
