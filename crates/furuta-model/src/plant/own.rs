//! Users' own laws that have a state.

use super::Plant;
use super::drive::{Bodies, Moment, TwoBody, steps_for};
use super::state::{FIRST_OWN, STATES};
use crate::effects::{Acts, Clock, Instant, Own};
use crate::scalar::Scalar;
use crate::state::State;

impl<S: Scalar> Plant<S> {
    /// The laws with a state, each with its place among the inner states.
    #[inline(always)]
    pub(super) fn with_states(&self) -> impl Iterator<Item = (usize, &Own<S>)> {
        let own = self.effects.iter().filter_map(|e| e.with_state());
        own.zip(FIRST_OWN..STATES).map(|(own, place)| (place, own))
    }

    /// Torques on `[arm, pendulum]` of those that these bodies feel, N m.
    #[inline(never)]
    pub(super) fn own_torque(
        &self,
        at: &Instant<'_, S>,
        of: Bodies,
        inner: &[S; STATES],
    ) -> [S; 2] {
        let mut torque = [S::ZERO; 2];
        for (place, own) in self.with_states() {
            let felt = match of {
                Bodies::Whole => true,
                Bodies::Load => !own.is_on_motor(),
                Bodies::Rotor => own.is_on_motor(),
            };
            if felt {
                let extra = own.torque_at(at, inner[place]);
                torque = [torque[0] + extra[0], torque[1] + extra[1]];
            }
        }
        torque
    }

    /// The same at arm and pendulum.
    pub(super) fn own_at_arm(&self, m: &TwoBody<S>, at: &Moment<S>, of: Bodies) -> [S; 2] {
        let instant = self.instant(&m.x, at.clock, self.acting(m, at.volts), at.memory);
        self.own_torque(&instant, of, &m.inner)
    }

    /// The same of rotor, arm and pendulum with the states at the start of a run.
    #[inline(never)]
    pub(super) fn own_at_start(&self, x: &State<S>, clock: Clock<S>, volts: S) -> [S; 2] {
        let mut inner = [S::ZERO; STATES];
        self.own_starts(&mut inner);
        let instant = self.instant(x, clock, volts, S::ZERO);
        self.own_torque(&instant, Bodies::Whole, &inner)
    }

    /// The states at the start of a run.
    pub(super) fn own_starts(&self, inner: &mut [S; STATES]) {
        for (place, own) in self.with_states() {
            inner[place] = own.start();
        }
    }

    /// How fast the states change.
    #[inline(never)]
    pub(super) fn own_rates(&self, rates: &mut [S; STATES], m: &TwoBody<S>, at: &Moment<S>) {
        let volts = self.acting(m, at.volts);
        let rotor = State::new(m.rotor[0], m.x.alpha, m.rotor[1], m.x.alpha_dot);
        for (place, own) in self.with_states() {
            let x = if own.is_on_motor() { &rotor } else { &m.x };
            rates[place] = own.rate(&self.instant(x, at.clock, volts, at.memory), m.inner[place]);
        }
    }

    /// How many steps of the integrator the states need for `h` seconds from here.
    pub(super) fn own_steps(&self, m: &TwoBody<S>, at: &Moment<S>, h: S::Real) -> usize {
        let volts = self.acting(m, at.volts);
        let rotor = State::new(m.rotor[0], m.x.alpha, m.rotor[1], m.x.alpha_dot);
        let steps = self.with_states().map(|(place, own)| {
            let x = if own.is_on_motor() { &rotor } else { &m.x };
            let instant = self.instant(x, at.clock, volts, at.memory);
            steps_for(own.fading(&instant, m.inner[place]).abs(), h)
        });
        steps.fold(1, usize::max)
    }

    /// The states after `h` seconds in which rig and voltage stay as they are.
    pub(super) fn own_after(
        &self,
        inner: &mut [S; STATES],
        x: &State<S>,
        t: S,
        volts: S,
        h: S::Real,
    ) {
        if !self.acts.includes(Acts::STATE) {
            return;
        }
        let at = self.instant(x, Clock::at(t), volts, S::ZERO);
        for (place, own) in self.with_states() {
            let steps = steps_for(own.fading(&at, inner[place]).abs(), h);
            #[allow(clippy::cast_precision_loss)]
            let part = h / S::Real::from_f64(steps as f64);
            let half = part * S::Real::from_f64(0.5);
            for _ in 0..steps {
                let z = inner[place];
                let first = own.rate(&at, z);
                let second = own.rate(&at, z + first.scale(half));
                let third = own.rate(&at, z + second.scale(half));
                let fourth = own.rate(&at, z + third.scale(part));
                let sum = first + fourth + (second + third).scale(S::Real::from_f64(2.0));
                inner[place] = z + sum.scale(part / S::Real::from_f64(6.0));
            }
        }
    }

    /// How fast each of the states forgets where it was, at most at their starts, 1/s; infinite without any.
    pub(super) fn own_fading(&self, x: &State<S>, t: S, volts: S) -> f64 {
        let at = self.instant(x, Clock::at(t), volts, S::ZERO);
        let rates = self
            .with_states()
            .map(|(_, own)| own.fading(&at, own.start()).value());
        rates.fold(f64::INFINITY, f64::min)
    }
}
