//! What is attached beside the bodies: end stops, a cable that relaxes, a winding.

use super::Plant;
use super::crossing::Cubic;
use super::drive::{Bodies, Moment, TwoBody};
use super::events::Event;
use super::friction::Balance;
use super::regime::{How, Regime};
use super::state::{Contact, PlantState, STATES};
use super::trial::Stages;
use crate::effects::Acts;
use crate::integrate::{Fixed, Stage};
use crate::scalar::Scalar;
use crate::state::State;

/// An end stop is touched or left where the arm is this deep in or out of it, rad: less is rounding about an event.
const ROUNDING: f64 = 1e-9;

impl<S: Scalar> Plant<S> {
    /// The voltage (V) that would give the motor's torque at once.
    #[inline(always)]
    pub(super) fn acting(&self, m: &TwoBody<S>, volts: S) -> S {
        if !self.winding.is_late() {
            return volts;
        }
        m.inner[1] + self.back_emf(m.rotor[1])
    }

    /// The bodies and inner states now.
    #[inline(always)]
    pub(super) fn body(&self, s: &PlantState<S>) -> TwoBody<S> {
        TwoBody {
            x: s.x,
            rotor: if self.acts.includes(Acts::DRIVE) {
                s.rotor
            } else {
                [s.x.theta, s.x.theta_dot]
            },
            inner: s.inner,
            own: self.acts.includes(Acts::STATE),
        }
    }

    /// The motor's back-EMF as a voltage, V.
    #[inline(always)]
    fn back_emf(&self, speed: S) -> S {
        let c = &self.coefficients;
        self.winding.back_emf * c.arm_damping / c.drive * speed
    }

    /// Torque on the arm of what is attached to it, N m.
    #[inline(always)]
    pub(super) fn attached(&self, m: &TwoBody<S>, at: &Moment<S>) -> S {
        let side = at.pressed.side::<S>();
        self.end_stop.torque(side, m.x.theta, m.x.theta_dot)
            - self.relaxation.stiffness * m.inner[0]
    }

    /// Adds what is attached to these bodies.
    #[inline(always)]
    pub(super) fn attach(
        &self,
        balance: &mut Balance<S>,
        m: &TwoBody<S>,
        at: &Moment<S>,
        of: Bodies,
    ) {
        if !self.acts.touches(Acts::CONTACT.and(Acts::INNER)) {
            return;
        }
        balance.free[0] += self.attached(m, at);
        if self.acts.includes(Acts::STATE) {
            let own = self.own_at_arm(m, at, of);
            balance.free = [balance.free[0] + own[0], balance.free[1] + own[1]];
        }
    }

    /// How fast the inner states change.
    #[inline(always)]
    pub(super) fn inner_rates(&self, m: &TwoBody<S>, at: &Moment<S>) -> [S; STATES] {
        let mut rates = [S::ZERO; STATES];
        rates[0] = self.relaxation.rate(m.inner[0], m.x.theta_dot);
        let settled = at.volts - self.back_emf(m.rotor[1]);
        rates[1] = self.winding.rate(m.inner[1], settled);
        if self.acts.includes(Acts::STATE) {
            self.own_rates(&mut rates, m, at);
        }
        rates
    }

    /// The inner states as after a long rest under the voltage at the motor; and the end stop that the arm presses on.
    pub(super) fn relax(&self, s: &mut PlantState<S>) {
        if self.acts.includes(Acts::INNER) {
            s.inner = [S::ZERO; STATES];
            s.inner[1] = s.voltage - self.back_emf(s.rotor[1]);
            self.own_starts(&mut s.inner);
        }
        s.pressed = Contact::of(self.end_stop.side(s.x.theta, s.x.theta_dot));
    }

    /// The end stop that the arm presses on, where it was not just found out by an event.
    pub(super) fn press(&self, s: &mut PlantState<S>) {
        if !self.end_stop.is_there() {
            return;
        }
        let (stop, limit) = (&self.end_stop, S::Real::from_f64(ROUNDING));
        let side = s.pressed.side::<S>();
        let now = stop.side(s.x.theta, s.x.theta_dot);
        let push = stop.push(side, s.x.theta, s.x.theta_dot);
        let is_off = push.real() < -(stop.stiffness.real() * limit);
        let is_on = stop.depth(now, s.x.theta).real() > limit;
        if s.pressed == Contact::Free && is_on || s.pressed != Contact::Free && is_off {
            s.pressed = Contact::of(now);
        }
    }

    /// With which torque (N m) an end stop pushes the arm, and how fast that changes, N m/s.
    pub(super) fn pressing(&self, on: Contact, m: &TwoBody<S>, acceleration: S) -> (S, S) {
        let (side, stop) = (on.side::<S>(), &self.end_stop);
        let rate = stop.stiffness * m.x.theta_dot + stop.damping * acceleration;
        (stop.push(side, m.x.theta, m.x.theta_dot), side * rate)
    }

    /// When in a trial step the arm meets an end stop or leaves it.
    pub(super) fn at_the_stops(
        &self,
        s: &PlantState<S>,
        regime: &Regime<S>,
        stages: &Stages<S>,
        end: &TwoBody<S>,
        length: S::Real,
    ) -> Option<(Event, S::Real)> {
        let (zero, stop) = (S::Real::ZERO, &self.end_stop);
        if !stop.is_there() {
            return None;
        }
        let of = |side: S, x: &State<S>| {
            let push = stop.push(side, x.theta, x.theta_dot);
            (stop.depth(side, x.theta).real(), push.real())
        };
        // How the push of the stop `on` passes through zero, `sign` times which falls.
        let crosses = |on: Contact, sign: S| {
            let at = stages.moment(2, self.memory_at(s, end), s.pressed);
            let last = self.forces(end, s.contact, at, How::Kept(regime.dry));
            let before = self.pressing(on, &self.body(s), regime.acceleration[0]);
            let after = self.pressing(on, end, last.acceleration[0]);
            let cubic = Cubic {
                from: (sign * before.0).real(),
                to: (sign * after.0).real(),
                slope_from: (sign * before.1).real() * length,
                slope_to: (sign * after.1).real() * length,
            };
            cubic.falls_to_zero() * length
        };
        if s.pressed != Contact::Free {
            let (_, then) = of(s.pressed.side(), &end.x);
            let leaves = then < zero;
            return leaves.then(|| (Event::Release, crosses(s.pressed, S::ONE)));
        }
        for contact in [Contact::Negative, Contact::Positive] {
            let side = contact.side::<S>();
            let ((depth, push), (then, push_then)) = (of(side, &s.x), of(side, &end.x));
            if then <= zero || push_then <= zero {
                continue;
            }
            let speed = |x: &State<S>| -((side * x.theta_dot).real() * length);
            if depth <= zero {
                let cubic = Cubic {
                    from: -depth,
                    to: -then,
                    slope_from: speed(&s.x),
                    slope_to: speed(&end.x),
                };
                return Some((Event::Press(contact), cubic.falls_to_zero() * length));
            }
            // It had come off a stop that it pressed in: a kink, and no jump. Yet a line would end too far from it for
            // Newton's one step to have the event's derivative.
            return (push <= zero).then(|| (Event::Again(contact), crosses(contact, -S::ONE)));
        }
        None
    }

    /// What the inner states have become over the times of `h` seconds before now, the oldest first: in each the rig
    /// was in one of these states under one of these commands (V), which a lag or a resonance of the motor follows
    /// late; they are as they come after a delay. Plants without such states do not listen.
    ///
    /// ```
    /// use furuta_model::{Effect, Plant, Rig, State};
    /// let rig = Rig::builtin("qube-servo-2").ok_or("built in")?;
    /// let cable = Effect::new("arm.relaxation", &[0.01, 0.5])?;
    /// let plant: Plant<f64> = Plant::new(&rig.params, &[cable])?;
    /// let hanging = State::new(1.0, core::f64::consts::PI, 0.0, 0.0);
    /// let (mut rested, mut turned) = (plant.rest(hanging), plant.rest(hanging));
    /// let turning = State::new(0.95, core::f64::consts::PI, 50.0, 0.0);
    /// plant.remember(&mut turned, [(turning, 0.0)], 0.002);
    /// plant.step(&mut rested, 0.0, 0.002);
    /// plant.step(&mut turned, 0.0, 0.002);
    /// assert!(turned.x.theta_dot < rested.x.theta_dot); // the cable is still stretched by nearly 0.1 rad
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn remember<P>(&self, s: &mut PlantState<S>, past: P, h: S::Real)
    where
        P: IntoIterator<Item = (State<S>, S::Real), IntoIter: ExactSizeIterator>,
    {
        if !self.acts.includes(Acts::INNER) {
            return;
        }
        let past = past.into_iter();
        let (length, count) = (S::from_real(h), past.len());
        // The motor goes through the commands again, and is put back where it was.
        let now = (s.t, s.voltage, s.ringing);
        for (k, (x, command)) in past.enumerate() {
            #[allow(clippy::cast_precision_loss)]
            let ago =
                |part: f64| now.0 - length.scale(S::Real::from_f64((count - k) as f64 - part));
            s.t = ago(0.0);
            let u = S::from_real(command);
            if k == 0 {
                s.voltage = self.mapped(s.t, u);
                s.ringing = self.settled(s.voltage);
            }
            let driven = self.driven(s, u, Fixed(h));
            (s.voltage, s.ringing) = (driven.voltage, driven.ringing);
            let (t, volts) = (ago(0.5), driven.volts[Stage::Middle as usize]);
            let settled = volts - self.back_emf(x.theta_dot);
            if k == 0 {
                s.inner[0] = S::ZERO;
                s.inner[1] = settled;
                self.own_starts(&mut s.inner);
            }
            s.inner[0] = self.relaxation.after(s.inner[0], x.theta_dot, length);
            s.inner[1] = self.winding.after(s.inner[1], settled, length);
            self.own_after(&mut s.inner, &x, t, volts, h);
        }
        (s.t, s.voltage, s.ringing) = now;
    }

    /// How fast the inner states forget where they were, at time `t` (s) in this state under this command (V): the
    /// slowest of them, 1/s; 0 where one never does. `None`: there are none.
    ///
    /// ```
    /// use furuta_model::{Effect, Plant, Rig, State};
    /// let rig = Rig::builtin("qube-servo-2").ok_or("built in")?;
    /// let cable = Effect::new("arm.relaxation", &[0.01, 0.5])?;
    /// let plant: Plant<f64> = Plant::new(&rig.params, &[cable])?;
    /// assert_eq!(plant.forgetting(0.0, &State::hanging(), 0.0), Some(2.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn forgetting(&self, t: S::Real, x: &State<S>, command: S::Real) -> Option<f64> {
        if !self.acts.includes(Acts::INNER) {
            return None;
        }
        let mut slowest = f64::INFINITY;
        for time in [self.relaxation.time_constant, self.winding.time_constant] {
            if time.value() > 0.0 {
                slowest = slowest.min(1.0 / time.value());
            }
        }
        // What follows the voltage remembers what the voltage does.
        if self.winding.is_late() || self.acts.includes(Acts::STATE) {
            if self.acts.includes(Acts::LAG) {
                slowest = slowest.min(1.0 / self.lag.value());
            }
            if self.acts.includes(Acts::RESONANCE) {
                slowest = slowest.min(0.5 * self.resonance.decay().value());
            }
        }
        if self.acts.includes(Acts::STATE) {
            let t = S::from_real(t);
            let volts = self.mapped(t, S::from_real(command));
            slowest = slowest.min(self.own_fading(x, t, volts));
        }
        Some(if slowest > 0.0 { slowest } else { 0.0 })
    }
}
